"""Float64 reference of the band-pass, by scipy.ndimage."""

import numpy as np
from scipy import ndimage

import emit
import frames

UNIT = 81


def exact(grey_q4):
    """81 units are a grey level of 8 bits."""
    grey = grey_q4.astype(float)
    inner = ndimage.correlate(grey, np.outer([1, 2, 1], [1, 2, 1]).astype(float), mode="nearest")
    outer = ndimage.correlate(grey, np.ones((9, 9)), mode="nearest")
    return (81 * inner - 16 * outer) / 256


def response(grey_q4):
    """As the stages after it get it: in whole units."""
    return np.floor(exact(grey_q4) + 0.5)


def write_vectors(directory):
    inc = emit.Inc("Frames by formula, and the band-pass's response by scipy.ndimage.")
    random = np.random.default_rng(50)
    rows = []
    for frame in (frames.Frame("grey8", (320, 240), 255, 60, 40, (90, -50), 1),
                  frames.Frame("grey10", (331, 243), 1023, 300, 300, (0, 0), 2),
                  frames.Frame("grey16", (320, 240), 65535, 30000, 30000, (0, 0), 3),
                  frames.Frame("grey1", (320, 240), 1, 0, 1, (0, 0), 4),
                  frames.Frame("spike", (320, 240), boxes=[(100, 60, 100, 60, 255)])):
        r = exact(frame.grey_q4())
        height, width = r.shape
        positions = [(u, v) for v in (0, 1, 3, 4, height - 5, height - 1) for u in (0, 2, 4, width - 1)]
        positions += [(99, 60), (100, 60), (101, 61), (104, 64), (105, 60)]
        positions += [(int(random.integers(width)), int(random.integers(height))) for _ in range(60)]
        inc.raw("\nstatic const struct vector_response vector_%s_responses[] = {\n%s};\n" % (
            frame.name + "_band", emit.wrap(["{%d, %d, %s}" % (u, v, emit.number(r[v, u], 4))
                                             for u, v in positions])))
        rows.append("{%s}, %d, vector_%s_band_responses" % (
            frames.spec(inc, frame), len(positions), frame.name))
    inc.struct_array("vector_band", "vector_bands", rows)
    return inc.write(directory, "bandpass.inc")
