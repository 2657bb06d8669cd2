"""Float64 reference of the noise map."""

import numpy as np
from scipy import ndimage

import bandpass
import emit
import frames

BLOCK = 32
STEP = 16
WHOLE = 4096
DIFFERENCE_Q4 = 64
WHITE = 19 / 16


def sampled(height, i):
    """The rows that are looked at in a row of blocks."""
    return [v for v in range(i * BLOCK + 4, (i + 1) * BLOCK, STEP) if v < height] or [height - 1]


def medians(response):
    """Of |R| over each block's part of the rows 4, 20, 36, ...; the upper one of two. A last block
    that has none of them takes the frame's last row."""
    height, width = response.shape
    rows, columns = -(-height // BLOCK), -(-width // BLOCK)
    out = np.zeros((rows, columns))
    for i in range(rows):
        for j in range(columns):
            part = response[sampled(height, i), j * BLOCK:(j + 1) * BLOCK]
            values = np.sort(np.abs(part).ravel())
            out[i, j] = values[len(values) // 2]
    return out


def smoothed(block, whole=False):
    """1-2-1 in both directions. whole: in whole units after each, as the firmware rounds."""
    for axis in (1, 0):
        block = ndimage.correlate1d(block, [0.25, 0.5, 0.25], axis=axis, mode="nearest")
        block = np.floor(block + 0.5) if whole else block
    return block


def spread(block, shape, whole=False):
    """To every pixel: linear between the blocks' centres, constant outside."""
    def lines(values, size, axis):
        position = np.clip((np.arange(size) - (BLOCK - 1) / 2) / BLOCK, 0, values.shape[axis] - 1)
        low = np.floor(position).astype(int)
        high = np.minimum(low + 1, values.shape[axis] - 1)
        a, b = np.take(values, low, axis), np.take(values, high, axis)
        part = (position - low).reshape([-1, 1] if axis == 0 else [1, -1])
        step = (b - a) * part
        return a + (np.floor(step + 0.5) if whole else step)
    return lines(lines(block, shape[0], 0), shape[1], 1)


def difference(grey, ambient, subtract):
    """The lit frame less the ambient one as far as the map of blocks says."""
    fraction = spread(np.where(subtract, WHOLE, 0).astype(float), grey.shape, True)
    return np.maximum(grey - np.floor((ambient - DIFFERENCE_Q4) * fraction / WHOLE + 0.5), 0)


def choose(grey, ambient):
    """Is a block quieter, by an eighth, without the ambient light, and not darker by more than
    2 grey levels in the mean? On half of the difference, which needs no cutting off."""
    half = np.floor((grey + frames.FULL_Q4 - ambient) / 2)
    quieter = 16 * medians(bandpass.response(half)) < 7 * medians(bandpass.response(grey))
    for i, j in np.argwhere(quieter):
        part = half[sampled(len(grey), i), j * BLOCK:(j + 1) * BLOCK] - frames.FULL_Q4 // 2
        quieter[i, j] = part.mean() >= -DIFFERENCE_Q4 / 4
    return quieter


def measure(grey, ambient=None, whole=False):
    """What is left of a frame, its map of noise and what is subtracted."""
    if ambient is None:
        block = medians(bandpass.response(grey))
        return grey, smoothed(block, whole), np.zeros(block.shape, bool)
    subtract = choose(grey, ambient)
    left = difference(grey, ambient, subtract)
    block = medians(bandpass.response(left))
    block = np.where(subtract, np.floor(block * WHITE + 0.5) if whole else block * WHITE, block)
    return left, smoothed(block, whole), subtract


def write_vectors(directory):
    inc = emit.Inc("Frames by formula, and their noise.")
    random = np.random.default_rng(49)
    rows = []
    for frame in (frames.Frame("least", (320, 240), 255, 60, 5, (90, -50), 1),
                  frames.Frame("odd", (339, 258), 1023, 300, 30, (0, 0), 2),
                  frames.Frame("low_last", (352, 259), 255, 100, 7, (0, 0), 3),
                  frames.Frame("loud", (640, 480), 255, 60, 1, (0, 0), 4, loud=40)):
        response = bandpass.response(frame.grey_q4())
        block = smoothed(medians(response))
        noise = spread(block, response.shape)
        height, width = response.shape
        positions = [(u, v) for v in (0, 15, 16, height - 1) for u in (0, 15, 16, 47, 48, width - 1)]
        positions += [(int(random.integers(width)), int(random.integers(height))) for _ in range(40)]
        inc.raw("\nstatic const struct vector_place vector_%s_places[] = {\n%s};\n" % (
            frame.name, emit.wrap(["{%d, %d, %s}" % (u, v, emit.number(noise[v, u], 4))
                                   for u, v in positions])))
        inc.array("double", "vector_%s_blocks" % frame.name, block.ravel(), 4)
        rows.append("{%s}, %d, %d, vector_%s_blocks, %d, vector_%s_places" % (
            frames.spec(inc, frame), block.shape[1], block.shape[0], frame.name, len(positions),
            frame.name))
    inc.struct_array("vector_noise", "vector_noises", rows)
    rows = []
    for lit, ambient in frames.pairs():
        _, block, subtract = measure(lit.grey_q4(), ambient.grey_q4())
        inc.array("double", "vector_%s_blocks" % lit.name, block.ravel(), 4)
        inc.array("uint8_t", "vector_%s_subtract" % lit.name, subtract.ravel().astype(int))
        rows.append("{%s}, {%s}, vector_%s_blocks, vector_%s_subtract" % (
            frames.spec(inc, lit), frames.spec(inc, ambient), lit.name, lit.name))
    inc.struct_array("vector_pair", "vector_pairs", rows)
    return inc.write(directory, "noise.inc")
