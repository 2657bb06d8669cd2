"""Float64 reference of dot detection, by scipy.ndimage, on frames that a formula makes."""

import numpy as np
from scipy import ndimage

import bandpass
import emit
import noise
from frames import Frame, pairs, spec

RING = [(4, 0), (4, 2), (3, 3), (2, 4), (0, 4), (-2, 4), (-3, 3), (-4, 2),
        (-4, 0), (-4, -2), (-3, -3), (-2, -4), (0, -4), (2, -4), (3, -3), (4, -2)]
EDGE = 6
TWIN = 3


def maxima(response):
    """(v, u) of the pixels above or equal to their eight neighbours; of equal ones the first in
    reading order."""
    first = np.zeros((3, 3), bool)
    first[0] = first[1, 0] = True
    later = ~first
    later[1, 1] = False
    padded = np.pad(response, 1)
    return np.argwhere((response > ndimage.maximum_filter(padded, footprint=first)[1:-1, 1:-1])
                       & (response >= ndimage.maximum_filter(padded, footprint=later)[1:-1, 1:-1]))


def beside(response, u, v):
    height, width = response.shape
    return (response[v, u - 1 if u > 0 else u + 1] + response[v, u + 1 if u + 1 < width else u - 1]
            + response[v - 1 if v > 0 else v + 1, u] + response[v + 1 if v + 1 < height else v - 1, u])


def centre(padded, u, v, reach):
    """Mean of the pixels around, weighted by (R - a quarter of the peak)^2 where positive."""
    u, v = u + EDGE, v + EDGE
    part = padded[v - reach:v + reach + 1, u - reach:u + reach + 1]
    weight = np.maximum(part - padded[v, u] // 4, 0)**2
    dv, du = np.mgrid[-reach:reach + 1, -reach:reach + 1]
    return (u - EDGE + (weight * du).sum() / weight.sum(),
            v - EDGE + (weight * dv).sum() / weight.sum())


def judge(response, padded, u, v, ring_max, side_min, flat_min):
    """"edge", "hot" or the centre of a maximum."""
    peak, sides = response[v, u], beside(response, u, v)
    if sides < 4 * side_min * peak:
        return "hot"
    flat = sides >= 4 * flat_min * peak
    position = centre(padded, u, v, 4 if flat else 2)
    ring_u, ring_v = u, v
    if flat:  # around the plateau's middle, at most 2 px from the peak
        ring_u = int(np.clip(np.floor(position[0] + 0.5), u - 2, u + 2))
        ring_v = int(np.clip(np.floor(position[1] + 0.5), v - 2, v + 2))
    ring = max(padded[ring_v + EDGE + dv, ring_u + EDGE + du] for du, dv in RING)
    return "edge" if ring > np.floor(peak * ring_max + 0.5) else position


def find(frame, ambient=None, ring_max=128 / 256, side_min=138 / 256, flat_min=225 / 256):
    """dots (u, v, peak), maxima above the threshold that are edges or duplicates, and hot pixels."""
    left, block, _ = noise.measure(frame.grey_q4(), ambient and ambient.grey_q4(), True)
    response = bandpass.response(left)
    level = noise.spread(block, response.shape, True)
    threshold = np.maximum(np.floor(frame.floor_q4 * bandpass.UNIT / 16 + 0.5),
                           np.floor(level * frame.gain_q8 / 256 + 0.5))
    padded = np.pad(response, EDGE)
    dots, refused = [], {"edge": 0, "hot": 0}
    for v, u in maxima(response):
        if response[v, u] <= threshold[v, u]:
            continue
        found = judge(response, padded, u, v, ring_max, side_min, flat_min)
        if not isinstance(found, str) and any(
                abs(found[0] - d[0]) < TWIN and abs(found[1] - d[1]) < TWIN for d in dots):
            found = "edge"
        if isinstance(found, str):
            refused[found] += 1
        else:
            dots.append((*found, response[v, u]))
    dots.sort(key=lambda d: (d[1], d[0]))
    return dots, refused["edge"], refused["hot"]


def scattered(random, count, size, apart, radius, height):
    """Spots at random sub-pixel positions, at least so many pixels apart."""
    positions = []
    while len(positions) < count:
        position = random.uniform(6, np.array(size) - 7)
        if all(np.hypot(*(position - p)) >= apart for p in positions):
            positions.append(position)
    positions = np.rint(np.array(positions) * 16)
    return np.column_stack([positions, random.integers(radius[0], radius[1] + 1, count),
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
    """Boxes: a U, its mirror image, a W, a diagonal chain, an O, hot pixels, long bars and large
    blobs."""
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
    smallest = (320, 240)
    yield Frame("grey8", smallest, 255, 40, 2, (30, -20), 1,
                scattered(random, 70, smallest, 14, (30, 70), (25, 140)))
    yield Frame("grey10", (331, 243), 1023, 160, 6, (-40, 90), 2,
                scattered(random, 60, (331, 243), 14, (30, 70), (100, 560)))
    yield Frame("grey16", smallest, 65535, 9000, 600, (900, 900), 3,
                scattered(random, 60, smallest, 14, (30, 70), (5000, 30000)))
    yield Frame("grey1", smallest, 1, 0, 0, (0, 0), 4,
                scattered(random, 40, smallest, 14, (30, 60), (3, 3)))
    yield Frame("border", smallest, spots=border_spots(*smallest))
    yield Frame("shapes", smallest, 255, 10, boxes=shapes())
    yield Frame("saturated", smallest, 255, 200, 3, (0, 0), 5,
                scattered(random, 40, smallest, 16, (40, 70), (60, 400)))
    yield Frame("burnt", (400, 320), 255, 40, 2, (0, 0), 9,
                scattered(random, 90, (400, 320), 24, (30, 80), (200, 2500)))
    yield Frame("noise", smallest, 255, 100, 30, (0, 0), 6, gain_q8=800)
    yield Frame("loud", (640, 480), 255, 60, 1, (0, 0), 8,
                scattered(random, 120, (640, 480), 20, (30, 70), (12, 80)), loud=15)
    row, column = np.divmod(np.arange(361), 19)
    lattice = np.column_stack([16 * (60 + 33 * column + row) + column * 5 % 16,
                               16 * (40 + 27 * row - column) + row * 7 % 16,
                               np.full(361, 44), 60 + 3 * row])
    yield Frame("pattern", (752, 582), 255, 20, 1, (10, 5), 7, lattice)


def crowds():
    """More dots than are kept: only counters can be compared."""
    yield Frame("dots", (1280, 800), spots=[(128, 128, 48, 100)], tile=(16, 16))
    yield Frame("board", (1280, 240), boxes=[(0, 0, 1, 1, 200), (6, 6, 7, 7, 200)], tile=(12, 12),
                gain_q8=0)


def frame_row(inc, frame, result):
    dots, edge, hot = result
    row = spec(inc, frame)
    found = ["{%s}" % ", ".join(emit.numbers(d[:2], 5) + [emit.number(d[2])]) for d in dots]
    inc.raw("\nstatic const struct vector_dot vector_%s_dots[] = {\n%s};\n" % (
        frame.name, emit.wrap(found or ["{0, 0, 0}"])))
    return "{%s}, %d, %d, %d, vector_%s_dots" % (row, edge, hot, len(dots), frame.name)


def write_vectors(directory):
    inc = emit.Inc("Frames by formula, and their dots by scipy.ndimage.")
    inc.struct_array("vector_frame", "vector_frames",
                     [frame_row(inc, frame, find(frame)) for frame in frames()])
    inc.struct_array("vector_pair", "vector_pairs",
                     ["{%s}, {%s}" % (frame_row(inc, lit, find(lit, ambient)), spec(inc, ambient))
                      for lit, ambient in pairs()])
    rows = ["{%s}, %d" % (spec(inc, frame), len(find(frame)[0])) for frame in crowds()]
    inc.struct_array("vector_crowd", "vector_crowds", rows)
    return inc.write(directory, "dots.inc")
