"""Float64 reference of the ellipsoid's geometry, by the closed form of a line and a unit sphere."""

import numpy as np

import emit
from rig import from_q, to_q

MEAN_SEMI_MM = (78, 113, 98)
REACH = 8
SEMI_MIN_MM, SEMI_MAX_MM, SLOPE_MAX = 40, 200, 4
NOT_CLOSE = 0.01


def position(centre, semi, point):
    """Points in the ellipsoid's units, one a row."""
    return (np.asarray(point, float) - centre) / semi


def cross(centre, semi, origin, slope):
    """Lines from an origin, one slope a row: at, nearest, radius2, entry, is it in reach."""
    slope = np.atleast_2d(slope)
    ahead = np.column_stack([slope, np.ones(len(slope))])
    at = position(centre, semi, origin + (centre[2] - origin[2]) * ahead)
    along = ahead / semi
    tau = -(at * along).sum(axis=1) / (along**2).sum(axis=1)
    nearest = at + tau[:, None] * along
    radius2 = (nearest**2).sum(axis=1)
    half = np.sqrt(np.maximum(0, 1 - radius2) / (along**2).sum(axis=1))
    near = (np.abs(at[:, :2]) <= REACH).all(axis=1)
    return at[:, :2], nearest, radius2, centre[2] + tau - half, near


def random_ray(random, wild):
    """Integers: centre, semi-axes, origin, slope; the ray passes within the reach on most axes."""
    if wild:
        semi = random.uniform(SEMI_MIN_MM, SEMI_MAX_MM, 3)
        slope = random.uniform(-SLOPE_MAX, SLOPE_MAX, 2)
        origin = random.uniform(-1000, 1000, 3)
        depth = random.uniform(100, 16000)
        e = random.uniform(-REACH, REACH, 2) * random.choice([0.15, 0.4, 1.1])
    else:
        semi = np.array(MEAN_SEMI_MM) * np.exp(random.uniform(-0.35, 0.35, 3))
        slope = random.uniform(-0.5, 0.5, 2)
        origin = random.uniform(-130, 130, 3)
        depth = random.uniform(300, 4000)
        e = random.uniform(-1.5, 1.5, 2)
    centre = np.append(origin[:2] + (depth - origin[2]) * slope - e * semi[:2], depth)
    return to_q(centre, 8), to_q(semi, 8), to_q(origin, 8), to_q(slope, 20)


def write_vectors(directory):
    random = np.random.default_rng(301)
    inc = emit.Inc("Ellipsoids, rays and where they meet, in float64.")
    inc.raw("\nstatic const int32_t vector_mean_mm[] = {%d, %d, %d};\n" % MEAN_SEMI_MM)
    rows = []
    while len(rows) < 240:
        wild = len(rows) >= 120
        ints = random_ray(random, wild)
        centre, semi, origin, slope = [from_q(v, b) for v, b in zip(ints, (8, 8, 8, 20))]
        at, nearest, radius2, entry, near = [v[0] for v in cross(centre, semi, origin, slope)]
        if np.abs(np.abs(at).max() - REACH) < NOT_CLOSE:
            continue
        texts = ["{%s}" % ", ".join(emit.numbers(v)) for v in ints]
        rows.append("%d, %s, %d, {%s}, %s, %s" % (
            wild, ", ".join(texts), near,
            ", ".join(emit.numbers(nearest, 7)), emit.number(radius2, 7), emit.number(entry, 4)))
    inc.struct_array("vector_crossing", "vector_crossings", rows)
    return inc.write(directory, "ellipsoid.inc")
