"""Float64 reference of the noise map."""

import numpy as np
from scipy import ndimage

import band
import emit
import frames

BLOCK = 32
STEP = 16


def medians(response):
    """Of |R| over each block's part of the rows 4, 20, 36, ...; the upper one of two. A last block
    that has none of them takes the frame's last row."""
    height, width = response.shape
    rows, columns = -(-height // BLOCK), -(-width // BLOCK)
    out = np.zeros((rows, columns))
    for i in range(rows):
        look = [v for v in range(i * BLOCK + 4, (i + 1) * BLOCK, STEP) if v < height] or [height - 1]
        for j in range(columns):
            values = np.sort(np.abs(response[look, j * BLOCK:(j + 1) * BLOCK]).ravel())
            out[i, j] = values[len(values) // 2]
    return out


def smoothed(block, whole=False):
    """1-2-1 both ways. whole: in whole units after each, as the firmware rounds."""
    for axis in (1, 0):
        block = ndimage.correlate1d(block, [0.25, 0.5, 0.25], axis=axis, mode="nearest")
        block = np.floor(block + 0.5) if whole else block
    return block


def spread(block, shape, whole=False):
    """To every pixel: linear between the blocks' centres, constant outside."""
    def lines(values, size, axis):
        place = np.clip((np.arange(size) - (BLOCK - 1) / 2) / BLOCK, 0, values.shape[axis] - 1)
        low = np.floor(place).astype(int)
        high = np.minimum(low + 1, values.shape[axis] - 1)
        a, b = np.take(values, low, axis), np.take(values, high, axis)
        part = (place - low).reshape([-1, 1] if axis == 0 else [1, -1])
        step = (b - a) * part
        return a + (np.floor(step + 0.5) if whole else step)
    return lines(lines(block, shape[0], 0), shape[1], 1)


def write_vectors(directory):
    inc = emit.Inc("Frames by formula, and their noise.")
    random = np.random.default_rng(49)
    rows = []
    for frame in (frames.Frame("least", (320, 240), 255, 60, 5, (90, -50), 1),
                  frames.Frame("odd", (339, 258), 1023, 300, 30, (0, 0), 2),
                  frames.Frame("low_last", (352, 259), 255, 100, 7, (0, 0), 3),
                  frames.Frame("loud", (640, 480), 255, 60, 1, (0, 0), 4, loud=40)):
        response = band.response(frame.grey_q4())
        block = smoothed(medians(response))
        noise = spread(block, response.shape)
        height, width = response.shape
        places = [(u, v) for v in (0, 15, 16, height - 1) for u in (0, 15, 16, 47, 48, width - 1)]
        places += [(int(random.integers(width)), int(random.integers(height))) for _ in range(40)]
        inc.raw("\nstatic const struct vector_place vector_%s_places[] = {\n%s};\n" % (
            frame.name, emit.wrap(["{%d, %d, %s}" % (u, v, emit.number(noise[v, u], 4))
                                   for u, v in places])))
        inc.array("double", "vector_%s_blocks" % frame.name, block.ravel(), 4)
        rows.append("{%s}, %d, %d, vector_%s_blocks, %d, vector_%s_places" % (
            frames.spec(inc, frame), block.shape[1], block.shape[0], frame.name, len(places),
            frame.name))
    inc.struct_array("vector_noise", "vector_noises", rows)
    return inc.write(directory, "noise.inc")
