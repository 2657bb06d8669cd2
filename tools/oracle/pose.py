"""Float64 reference of where a head looks: what is taken from the points, and what the mean heads of all directions say of it."""

import numpy as np

import emit
import rig as rigs
from rig import SLOTS, from_q, to_q

COLUMNS, HEAD_ROWS, BODY_ROWS = 7, 9, 4
# rows, cell, height of the first row, depths from and to, depths counted from before the centre, their unit: mm
GRIDS = ((HEAD_ROWS, 32.0, -128.0, -176.0, 112.0, 32.0, 64.0), (BODY_ROWS, 64.0, 160.0, -256.0, 256.0, 0.0, 128.0))
CELLS = COLUMNS * (HEAD_ROWS + BODY_ROWS)
OTHER = 5
FEATURES = 2 * CELLS + OTHER
YAWS, PITCHES = 24, 9
MEANS = YAWS // 2 + PITCHES
FEW, COVER_MAX = 0.15, 1.25
DOT_SIGMA_PX, RANGE_SIGMA_MM = 33 / 256, 1.5
FEATURE_MAX = 127 / 32


def spread(row, x, y, z, count, rows, cell, top):
    """Bilinear sums of weights and of weights times depths: (count, rows, COLUMNS) each."""
    at_x, at_y = x / cell + COLUMNS // 2, (y - top) / cell
    first_x, first_y = np.floor(at_x).astype(int), np.floor(at_y).astype(int)
    weight, depth = np.zeros(count * rows * COLUMNS), np.zeros(count * rows * COLUMNS)
    for right in (0, 1):
        for down in (0, 1):
            column, line = first_x + right, first_y + down
            part = (1.0 - abs(at_x - column)) * (1.0 - abs(at_y - line))
            part = np.where((column >= 0) & (column < COLUMNS) & (line >= 0) & (line < rows), part, 0.0)
            cells = np.where(part > 0.0, (row * rows + line) * COLUMNS + column, 0)
            weight += np.bincount(cells, part, weight.size)
            depth += np.bincount(cells, part * z, depth.size)
    return weight.reshape(count, rows, COLUMNS), depth.reshape(count, rows, COLUMNS)


def blur(cells):
    """1-2-1 both ways, of sum 1."""
    for axis in (1, 2):
        wide = np.pad(cells, [(0, 0)] + [(1, 1) if axis == i else (0, 0) for i in (1, 2)])
        count = cells.shape[axis]
        cells = 0.25 * (wide.take(range(count), axis) + wide.take(range(2, count + 2), axis)) + 0.5 * cells
    return cells.reshape(len(cells), -1)


def in_plane(points, centre):
    """Points (n, SLOTS, 3) against centres (n, 3) in the vertical plane from the camera to the centre, and its distance."""
    distance = np.hypot(centre[:, 0], centre[:, 2])
    cosine, sine = (centre[:, 2] / distance)[:, None], (centre[:, 0] / distance)[:, None]
    away = points - centre[:, None]
    return (cosine * away[..., 0] - sine * away[..., 2], away[..., 1],
            sine * away[..., 0] + cosine * away[..., 2]), distance


def features_in_plane(place, seen, distance, sigma, spacing, other):
    """(n, FEATURES): of each cell its depth, how much of the density it has; the other."""
    x, y, z = place
    out = []
    row = np.broadcast_to(np.arange(len(x))[:, None], x.shape)
    for rows, cell, top, near, far, before, unit in GRIDS:
        use = seen & (z > near) & (z < far) & (abs(x) < (COLUMNS + 1) // 2 * cell)
        weight, depth = spread(row[use], x[use], y[use], z[use], len(x), rows, cell, top)
        weight, depth = blur(weight), blur(depth)
        out.append((depth + before * weight) / (weight + FEW) / unit)
        out.append(np.minimum(weight * (spacing[:, None] / cell) ** 2, COVER_MAX))
    height, semi = other
    out.append(np.stack([3.0 * height / distance, distance / 1024.0 - 1.0, 2.0 * sigma / (sigma + 8.0) - 1.0,
                         (semi[:, 0] - 78.0) / 16.0, (semi[:, 1] - 113.0) / 16.0], axis=1))
    return np.clip(np.concatenate(out, axis=1), -FEATURE_MAX, FEATURE_MAX)


def sigma_of(distance, length_px_mm):
    """Standard deviation of a depth; length: of the middle dot's line, 0 of a range image."""
    length = np.asarray(length_px_mm, float)
    return np.where(length > 0.0, DOT_SIGMA_PX * distance ** 2 / np.maximum(length, 1e-9), RANGE_SIGMA_MM)


def features(points, seen, centre, semi, length_px_mm, unit):
    """points (n, SLOTS, 3) mm, seen (n, SLOTS), centre and semi (n, 3) mm; unit: half a pitch of the dots."""
    place, distance = in_plane(points, centre)
    return features_in_plane(place, seen, distance, sigma_of(distance, length_px_mm), 2.0 * unit * distance,
                             (centre[:, 1], semi))


def mirror():
    """Where each feature of a mirrored head stands."""
    order = np.arange(FEATURES)
    first = 0
    for rows in (HEAD_ROWS, HEAD_ROWS, BODY_ROWS, BODY_ROWS):
        cells = np.arange(rows * COLUMNS)
        order[first:first + cells.size] = first + cells.reshape(rows, COLUMNS)[:, ::-1].ravel()
        first += cells.size
    return order


def ordered(seen, mirrored):
    """What the mean heads say of heads and of their mirror images, (n, MEANS) each, for all yaws and pitches."""
    half = YAWS // 2
    return np.concatenate([seen[:, :half], mirrored[:, half - 1::-1], (seen[:, half:] + mirrored[:, half:]) / 2.0], axis=1)


def outputs(means, given):
    """means: of each a line and a square for each feature, and a bias."""
    def once(values):
        return values @ means[0].T + values ** 2 @ means[1].T + means[2]

    return ordered(once(given), once(given[:, mirror()]))


def test_means():
    """The weights of tests/unit/pose/test_pose.c; those of pitch are their own mirror images."""
    mean, given = np.arange(MEANS)[:, None], np.arange(FEATURES)
    given = np.where(mean < YAWS // 2, given, np.minimum(given, mirror()))
    return [((mean * 37 + given * 101 + mean * given) % 61 - 30) / 2 ** 5, ((mean * 53 + given * 29 + mean * given) % 41 - 20) / 2 ** 5,
            ((mean[:, 0] * 1237) % 8191 - 4095) / 2 ** 10]


def head_points(random, centre, unit, noise):
    """Dots on an ellipsoid with a nose, on a chest and on a wall: x, y in Q28, depth in Q8, seen."""
    slot = np.arange(SLOTS)
    x = centre[0] / centre[2] + (slot % 19 - 9) * 2.0 * unit + random.normal(0.0, 0.001, SLOTS)
    y = centre[1] / centre[2] + (slot // 19 - 7) * 2.0 * unit + random.normal(0.0, 0.001, SLOTS)
    aside, down = x * centre[2] - centre[0], y * centre[2] - centre[1]
    part = 1.0 - (aside / 78.0) ** 2 - (down / 113.0) ** 2
    depth = np.where(part > 0.0, centre[2] - 95.0 * np.sqrt(np.maximum(part, 0.0)),
                     np.where((down > 130.0) & (abs(aside) < 220.0), centre[2] - 20.0, centre[2] + 900.0))
    depth = depth + random.normal(0.0, noise, SLOTS)
    return to_q(x, 28), to_q(y, 28), to_q(depth, 8), random.random(SLOTS) > 0.1


def is_clear(place, seen):
    """No point is at the border of what belongs to a grid, where it would be a matter of rounding."""
    x, _, z = (values[0][seen] for values in place)
    borders = [abs(z - border) for grid in GRIDS for border in grid[3:5]]
    borders += [abs(abs(x) - (COLUMNS + 1) // 2 * grid[1]) for grid in GRIDS]
    return min(border.min() for border in borders) > 0.1


def write_vectors(directory):
    inc, rows = emit.Inc("Points around heads, and what is made of them in float64."), []
    for index, (kind, centre, length, unit, noise, tall) in enumerate(
            [(rigs.RIG_DOTS, (60, -40, 850), 11500.0, 0.0160, 8.0, 118.0), (rigs.RIG_DOTS, (-250, 120, 1300), 115000.0, 0.0160, 2.0, 105.0),
             (rigs.RIG_RANGE, (0, 0, 600), 0.0, 0.0220, 1.0, 113.0), (rigs.RIG_DOTS, (300, 60, 700), 37000.0, 0.0100, 3.0, 140.0)]):
        centre, semi, seed = to_q(centre, 8), to_q((80.0, tall, 95.0), 8), 2300 + 100 * index
        length_q8, unit_q28 = int(to_q(length, 8)), int(to_q(unit, 28))
        while True:
            x, y, depth, seen = head_points(np.random.default_rng(seed), from_q(centre, 8), unit, noise)
            point = np.stack([from_q(x, 28), from_q(y, 28), np.ones(SLOTS)], axis=1) * from_q(depth, 8)[:, None]
            given = point[None], seen[None], from_q(centre, 8)[None], from_q(semi, 8)[None]
            if is_clear(in_plane(given[0], given[2])[0], seen):
                break
            seed += 1
        feature = features(*given, np.array([from_q(length_q8, 8)]), np.array([from_q(unit_q28, 28)]))
        log2 = outputs(test_means(), feature)[0]
        inc.raw("\nstatic const struct ih_point vector_%d_points[] = {\n%s};\n" % (
            index, emit.wrap(["{%d, %d, %d, %d}" % ((*p, 1) if s else (p[0], p[1], 0, 0)) for *p, s in zip(x, y, depth, seen)])))
        inc.array("double", "vector_%d_features" % index, feature[0], 5)
        inc.array("double", "vector_%d_log2" % index, log2, 5)
        rows.append("%d, %d, %d, {{%s}, {%s}}, vector_%d_points, vector_%d_features, vector_%d_log2" % (
            kind, length_q8, unit_q28, ", ".join(map(str, centre)), ", ".join(map(str, semi)), index, index, index))
    inc.struct_array("vector_look", "vector_looks", rows)
    return inc.write(directory, "pose.inc")
