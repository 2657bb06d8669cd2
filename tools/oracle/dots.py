"""Float64 reference of dot detection, by scipy.ndimage, on frames that a formula makes.

The unit test makes the same frames with the same integer formula, so that no picture is stored.
"""

import numpy as np
from scipy import ndimage

import emit

FULL_Q4 = 4080
RESPONSE_UNIT = 1296
MASK32 = 0xFFFFFFFF


class Frame:
    def __init__(self, name, size, maximum=255, background=0, noise=0, slope=(0, 0), seed=1,
                 spots=(), boxes=(), tile=None, floor_q4=29, gain_q8=1708):
        self.name, self.maximum = name, maximum
        self.width, self.height = size
        self.background, self.noise, self.slope, self.seed = background, noise, slope, seed
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
        value += h % (2 * self.noise + 1) - self.noise
        return np.clip(value + self.marks(), 0, self.maximum)


def response(grey_q4):
    grey = grey_q4.astype(float)
    inner = ndimage.correlate(grey, np.outer([1, 2, 1], [1, 2, 1]).astype(float), mode="nearest")
    outer = ndimage.correlate(grey, np.ones((9, 9)), mode="nearest")
    return 81 * inner - 16 * outer


def find(frame, area=(4, 120), extent=16):
    """threshold, dots (u, v, peak), small and large count, runs of every row."""
    grey_q4 = np.rint(frame.pixels() * (FULL_Q4 / frame.maximum))
    filtered = response(grey_q4)
    sample = np.sort(np.abs(filtered[::8, ::8]).ravel())
    median = sample[len(sample) // 2]
    noise = (median // 81 + 1) * 81  # of the bin that holds the median, the upper end
    threshold = max(frame.floor_q4 * RESPONSE_UNIT, np.floor(noise * frame.gain_q8 / 256 + 0.5))
    above = filtered > threshold
    label, count = ndimage.label(above, np.ones((3, 3)))
    dots, small, large = [], 0, 0
    for index, box in enumerate(ndimage.find_objects(label), 1):
        mine = label[box] == index
        size = max(s.stop - s.start for s in box)
        if mine.sum() < area[0]:
            small += 1
        elif mine.sum() > area[1] or size > extent:
            large += 1
        else:
            weight = np.where(mine, filtered[box], 0)**2
            v, u = np.mgrid[box]
            dots.append(((weight * u).sum() / weight.sum(), (weight * v).sum() / weight.sum(),
                         np.where(mine, filtered[box], 0).max()))
    dots.sort(key=lambda d: (d[1], d[0]))
    starts = above & ~np.pad(above, ((0, 0), (1, 0)))[:, :-1]
    return median, threshold, dots, small, large, starts.sum(axis=1)


def scattered(random, count, size, apart, radius, height):
    """Spots at random sub-pixel places, at least so many pixels apart."""
    places = []
    while len(places) < count:
        place = random.uniform(6, np.array(size) - 7)
        if all(np.hypot(*(place - p)) >= apart for p in places):
            places.append(place)
    places = np.rint(np.array(places) * 16)
    return np.column_stack([places, random.integers(radius[0], radius[1] + 1, count),
                            random.integers(height[0], height[1] + 1, count)])


def border_spots(width, height):
    """Centres on, inside and outside all four borders and corners."""
    spots = []
    for shift in (-16, -8, 0, 8, 24):
        right, bottom = 16 * (width - 1) - shift, 16 * (height - 1) - shift
        along = 16 * 40 + 16 * 3 * shift
        spots += [(shift, along, 48, 150), (right, along, 48, 150),
                  (along, shift, 48, 150), (along, bottom, 48, 150)]
    right, bottom = 16 * (width - 1), 16 * (height - 1)
    return spots + [(0, 0, 48, 150), (right, 0, 56, 90), (0, bottom, 40, 200),
                    (right, bottom, 48, 120)]


def shapes():
    """Boxes: a U that joins late, its mirror image, a W, a diagonal chain, an O, hot pixels, bars
    too long and blobs too large."""
    def u_shape(u, v, arms, depth):
        boxes = [(u + 5 * a, v, u + 5 * a, v + depth, 120) for a in range(arms)]
        return boxes + [(u, v + depth + 1, u + 5 * (arms - 1), v + depth + 1, 120)]
    boxes = u_shape(20, 20, 2, 5) + u_shape(60, 20, 3, 6) + u_shape(100, 20, 2, 1)
    boxes += [(140, 30, 140, 36, 120), (145, 30, 145, 36, 120), (140, 29, 145, 29, 120)]
    boxes += [(180 + 2 * i, 20 + 2 * i, 181 + 2 * i, 21 + 2 * i, 120) for i in range(4)]
    boxes += [(220 - 2 * i, 40 + 2 * i, 221 - 2 * i, 41 + 2 * i, 120) for i in range(4)]
    boxes += [(250, 30, 257, 30, 90), (250, 37, 257, 37, 90), (250, 31, 250, 36, 90),
              (257, 31, 257, 36, 90)]
    boxes += [(30 + 23 * i, 80 + i % 3, 30 + 23 * i, 80 + i % 3, 40 + 15 * i) for i in range(11)]
    boxes += [(20, 110, 60, 111, 150), (100, 100, 101, 140, 150), (150, 110, 170, 130, 150),
              (200, 110, 209, 119, 150), (240, 110, 245, 115, 150), (270, 110, 271, 111, 30)]
    boxes += [(40 + 30 * i, 180, 40 + 30 * i, 180, 200) for i in range(4)]
    boxes += [(41 + 30 * i + i, 181 + i, 41 + 30 * i + i, 181 + i, 200) for i in range(4)]
    return boxes


def frames():
    random = np.random.default_rng(51)
    least = (320, 240)
    yield Frame("grey8", least, 255, 40, 2, (30, -20), 1,
                scattered(random, 70, least, 14, (30, 70), (25, 140)))
    yield Frame("grey10", (331, 243), 1023, 160, 6, (-40, 90), 2,
                scattered(random, 60, (331, 243), 14, (30, 70), (100, 560)))
    yield Frame("grey16", least, 65535, 9000, 600, (900, 900), 3,
                scattered(random, 60, least, 14, (30, 70), (5000, 30000)))
    yield Frame("grey1", least, 1, 0, 0, (0, 0), 4,
                scattered(random, 40, least, 14, (30, 60), (3, 3)))
    yield Frame("border", least, spots=border_spots(*least))
    yield Frame("shapes", least, 255, 10, boxes=shapes())
    yield Frame("saturated", least, 255, 200, 3, (0, 0), 5,
                scattered(random, 40, least, 16, (40, 70), (60, 400)))
    yield Frame("noise", least, 255, 100, 30, (0, 0), 6, gain_q8=800)
    row, column = np.divmod(np.arange(361), 19)
    lattice = np.column_stack([16 * (60 + 33 * column + row) + column * 5 % 16,
                               16 * (40 + 27 * row - column) + row * 7 % 16,
                               np.full(361, 44), 60 + 3 * row])
    yield Frame("pattern", (752, 582), 255, 20, 1, (10, 5), 7, lattice)


def crowds():
    """More dots than are kept, and more runs than are kept: only counters can be compared."""
    yield Frame("dots", (1280, 800), spots=[(128, 128, 48, 100)], tile=(16, 16))
    yield Frame("runs", (1280, 240), boxes=[(1, 0, 1, 0, 200)], tile=(4, 1), gain_q8=0)
    yield Frame("board", (1280, 240), boxes=[(0, 0, 0, 0, 200), (2, 6, 2, 6, 200)], tile=(4, 12),
                gain_q8=0)


def spec(inc, frame):
    inc.raw("\nstatic const struct vector_spot vector_%s_spots[] = {\n%s};\n" % (
        frame.name, emit.wrap(["{%d, %d, %d, %d}" % s for s in frame.spots or [(0, 0, 1, 0)]])))
    inc.raw("\nstatic const struct vector_box vector_%s_boxes[] = {\n%s};\n" % (
        frame.name, emit.wrap(["{%d, %d, %d, %d, %d}" % b for b in frame.boxes
                               or [(0, 0, 0, 0, 0)]])))
    numbers = (frame.width, frame.height, frame.maximum, frame.background, frame.noise,
               *frame.slope, frame.seed, *frame.tile, frame.floor_q4, frame.gain_q8)
    return '"%s", %s, %d, vector_%s_spots, %d, vector_%s_boxes' % (
        frame.name, ", ".join(map(str, numbers)), len(frame.spots), frame.name, len(frame.boxes),
        frame.name)


def write_vectors(directory):
    inc = emit.Inc("Frames by formula, and their dots by scipy.ndimage.")
    rows = []
    for frame in frames():
        median, threshold, dots, small, large, _ = find(frame)
        row = spec(inc, frame)
        found = ["{%s}" % ", ".join(emit.numbers(d[:2], 5) + [emit.number(d[2])]) for d in dots]
        inc.raw("\nstatic const struct vector_dot vector_%s_dots[] = {\n%s};\n" % (
            frame.name, emit.wrap(found or ["{0, 0, 0}"])))
        rows.append("{%s}, %d, %d, %d, %d, %d, vector_%s_dots" % (
            row, median, threshold, small, large, len(dots), frame.name))
    inc.struct_array("vector_frame", "vector_frames", rows)
    rows = []
    for frame in crowds():
        _, _, dots, _, _, runs = find(frame)
        rows.append("{%s}, %d, %d" % (spec(inc, frame), len(dots),
                                      np.maximum(runs - 256, 0).sum()))
    inc.struct_array("vector_crowd", "vector_crowds", rows)
    return inc.write(directory, "dots.inc")
