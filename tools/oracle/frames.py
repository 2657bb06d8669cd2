"""Frames that a formula makes, so that no picture is stored.

The unit tests make the same frames with the same integer formula (tests/unit/ih_test_frame.h).
"""

import numpy as np

import emit

FULL_Q4 = 4080
MASK32 = 0xFFFFFFFF


class Frame:
    def __init__(self, name, size, maximum=255, background=0, noise=0, slope=(0, 0), seed=1,
                 spots=(), boxes=(), tile=None, floor_q4=29, gain_q8=1178, loud=None):
        self.name, self.maximum = name, maximum
        self.width, self.height = size
        self.background, self.noise, self.slope, self.seed = background, noise, slope, seed
        self.loud = noise if loud is None else loud  # instead of noise, in every other 128x128
        self.spots = [tuple(int(x) for x in s) for s in spots]  # u, v, radius (Q4), height
        self.boxes = [tuple(int(x) for x in b) for b in boxes]  # u0, v0, u1, v1 (included), height
        self.tile = tile or size  # spots and boxes repeat with this period
        self.floor_q4, self.gain_q8 = floor_q4, gain_q8

    def marks(self):
        u, v = np.meshgrid(np.arange(self.tile[0]), np.arange(self.tile[1]))
        value = np.zeros(u.shape, np.int64)
        for cu, cv, radius, height in self.spots:
            near = np.s_[max(0, (cv - radius) // 16):max(0, (cv + radius) // 16 + 1),
                         max(0, (cu - radius) // 16):max(0, (cu + radius) // 16 + 1)]
            far2 = (16 * u[near] - cu)**2 + (16 * v[near] - cv)**2
            value[near] += np.where(far2 < radius**2,
                                    height * (radius**2 - far2) // radius**2, 0)
        for u0, v0, u1, v1, height in self.boxes:
            value[v0:v1 + 1, u0:u1 + 1] += height
        rows = np.arange(self.height) % self.tile[1]
        return value[rows][:, np.arange(self.width) % self.tile[0]]

    def pixels(self):
        u, v = np.meshgrid(np.arange(self.width, dtype=np.int64),
                           np.arange(self.height, dtype=np.int64))
        value = self.background + ((self.slope[0] * u + self.slope[1] * v) >> 8)
        h = (u * 73856093 ^ v * 19349663 ^ self.seed * 83492791) & MASK32
        h ^= h >> 13
        h = (h * 0x5bd1e995) & MASK32
        h ^= h >> 15
        noise = np.where((u // 128 + v // 128) % 2 == 1, self.loud, self.noise)
        value += h % (2 * noise + 1) - noise
        return np.clip(value + self.marks(), 0, self.maximum)

    def grey_q4(self):
        return np.rint(self.pixels() * (FULL_Q4 / self.maximum))


def spec(inc, frame):
    inc.raw("\nstatic const struct vector_spot vector_%s_spots[] = {\n%s};\n" % (
        frame.name, emit.wrap(["{%d, %d, %d, %d}" % s for s in frame.spots or [(0, 0, 1, 0)]])))
    inc.raw("\nstatic const struct vector_box vector_%s_boxes[] = {\n%s};\n" % (
        frame.name, emit.wrap(["{%d, %d, %d, %d, %d}" % b for b in frame.boxes
                               or [(0, 0, 0, 0, 0)]])))
    numbers = (frame.width, frame.height, frame.maximum, frame.background, frame.noise,
               frame.loud, *frame.slope, frame.seed, *frame.tile, frame.floor_q4, frame.gain_q8)
    return '"%s", %s, %d, vector_%s_spots, %d, vector_%s_boxes' % (
        frame.name, ", ".join(map(str, numbers)), len(frame.spots), frame.name, len(frame.boxes),
        frame.name)


def pairs():
    """A lit frame and an ambient one. Where the noise is the same number in both it is texture that
    the ambient frame takes away; in every other 128x128 it is another one in each."""
    random = np.random.default_rng(47)
    lattice = [(16 * u + int(random.integers(16)), 16 * v + int(random.integers(16)), 44,
                int(random.integers(20, 60))) for v in range(20, 400, 31) for u in range(20, 500, 29)]
    yield (Frame("pair8", (512, 410), 255, 90, 30, (20, 10), 3, lattice, loud=12),
           Frame("pair8_ambient", (512, 410), 255, 90, 30, (20, 10), 3, loud=9))
    yield (Frame("pair_mixed", (520, 400), 1023, 400, 100, (0, 0), 4,
                 [(u, v, r, 4 * h) for u, v, r, h in lattice], loud=20),
           Frame("pair_mixed_ambient", (520, 400), 1023, 380, 100, (0, 0), 4, loud=200))
