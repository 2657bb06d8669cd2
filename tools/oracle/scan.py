"""Float64 reference of the scan: a mean head behind every point, every ray against each.

Most of a score is counting, and a ray that is as good as on a limit may be counted either way. What
such rays can make of a score is its slack: the test allows it on top of rounding."""

import numpy as np

import ellipsoid
import emit
import scenes
from ellipsoid import MEAN_SEMI_MM

DEEP_MM, SPACING_MM = 98, 80
ON_SURFACE_MM, BEHIND_FULL_MM, BEHIND_CENTRE_MM = 28, 60, 60
NEARER, EMPTY, UNKNOWN = -0.15, -0.6, -0.15
RING_INNER, RING_OUTER = 1.3, 1.9
RING_EMPTY, RING_NEAR, RING_SHARE = 0.7, -0.6, 0.6
RAYS_LEAST = 8
# Closer to a limit than the firmware's error is neither side.
CLOSE_MM, CLOSE_RIM_MM, CLOSE_RADIUS2, CLOSE_SIDE_MM = 0.06, 0.3, 1e-3, 0.05


def centres_behind(space):
    """Deep behind each seen point, along its ray."""
    seen = space.state == scenes.SEEN
    ahead = np.column_stack([space.slope[seen], np.ones(seen.sum())])
    return space.point[seen] + DEEP_MM * ahead / np.linalg.norm(ahead, axis=1)[:, None]


def mean_of(values, weights):
    return values.sum() / max(weights, RAYS_LEAST)


def score(space, centre):
    """Score of a head there, and its slack."""
    semi = np.array(MEAN_SEMI_MM, float)
    _, nearest, radius2, entry, near = ellipsoid.cross(centre, semi, space.origin, space.slope)
    seen, empty = space.state == scenes.SEEN, space.state == scenes.EMPTY
    depth = space.point[:, 2]
    behind = depth - entry
    value = np.where(behind < 0, NEARER, -np.minimum(behind / BEHIND_FULL_MM, 1))
    value = np.where(np.abs(behind) < ON_SURFACE_MM, 1, value)
    value = np.where(seen, value, np.where(empty, EMPTY, UNKNOWN))
    inside = near & (radius2 < 1)
    close = np.where(radius2 > 0.99, CLOSE_RIM_MM, CLOSE_MM)
    unsure_inside = near & (np.abs(radius2 - 1) < CLOSE_RADIUS2) \
        | inside & seen & (np.abs(np.abs(behind) - ON_SURFACE_MM) < close)

    aside = np.abs(nearest[:, 0] * semi[0]) - nearest[:, 1] * semi[1]  # below when negative
    place = np.where(depth > centre[2] + BEHIND_CENTRE_MM, 1, RING_NEAR)
    place = np.where(seen, place, np.where(empty, RING_EMPTY, 0))
    ring = near & (radius2 > RING_INNER**2) & (radius2 < RING_OUTER**2) & (aside >= 0)
    around = near & (radius2 > RING_INNER**2 - 0.01) & (radius2 < RING_OUTER**2 + 0.01) \
        & (aside > -1)
    unsure_ring = around & ((np.abs(radius2 - RING_INNER**2) < CLOSE_RADIUS2)
                            | (np.abs(radius2 - RING_OUTER**2) < CLOSE_RADIUS2)
                            | (np.abs(aside) < CLOSE_SIDE_MM)
                            | seen & (np.abs(depth - centre[2] - BEHIND_CENTRE_MM) < CLOSE_MM))
    total = mean_of(value[inside], inside.sum()) \
        + RING_SHARE * mean_of(place[ring], ring.sum())
    # One ray more, less or of the other value: at most its value and the mean's, 2 each in all.
    slack = 2 * unsure_inside.sum() / max(inside.sum() - 1, RAYS_LEAST) \
        + RING_SHARE * 2 * unsure_ring.sum() / max(ring.sum() - 1, RAYS_LEAST)
    return total, slack


def write_vectors(directory):
    inc = emit.Inc("Places behind the seen points of the scenes in scenes.inc, and the scores of a\n"
                   " * mean head there with their slack, in float64.")
    inc.raw("\n")
    for name in ("DEEP_MM", "SPACING_MM", "ON_SURFACE_MM", "BEHIND_FULL_MM", "BEHIND_CENTRE_MM",
                 "NEARER", "EMPTY", "UNKNOWN", "RING_EMPTY", "RING_NEAR", "RING_SHARE"):
        inc.raw("#define VECTOR_%s (%s)\n" % (name, globals()[name]))
    rows = []
    for scene, space, _ in scenes.spaces():
        tried = []
        for centre in centres_behind(space):
            tried.append("{{%s}, %s}" % (", ".join(emit.numbers(centre, 3)),
                                         ", ".join(emit.numbers(score(space, centre), 4))))
        inc.raw("\nstatic const struct vector_place vector_tried_%s[] = {\n%s};\n"
                % (scene.name, emit.wrap(tried)))
        rows.append("%d, vector_tried_%s" % (len(tried), scene.name))
    inc.struct_array("vector_scan", "vector_scans", rows)
    return inc.write(directory, "scan.inc")
