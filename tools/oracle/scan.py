"""Float64 reference of the scan: a mean head behind every point, every ray against each.

A template score is mostly counting, and a ray that is nearer to a limit than 16 bits resolve may be counted or
not. So a score is an interval: all such rays counted against the head, or all for it."""

import numpy as np

import ellipsoid
import emit
import scenes
from ellipsoid import MEAN_SEMI_MM

DEEP_MM, SPACING_MM = 98, 80
ON_SURFACE_MM, BEHIND_CENTRE_MM = 32, 60
NEARER, BEHIND, EMPTY = -10 / 64, -1, -38 / 64
RING_INNER, RING_OUTER = 1.3, 1.9
RING_EMPTY, RING_NEAR, RING_FRACTION = 45 / 64, -38 / 64, 0.6
RAYS_MIN = 8
# What 16 bits may be off by, with the depth in mm: see ih_template.h.
ERROR_E, ERROR_RADIUS2, ERROR_DEPTH = (1.58e-6, 0.0009), (8.6e-6, 0.0135), (1.12e-6, 0.0095)


def centres_behind(ray_table):
    """Deep behind each seen point, along its ray."""
    seen = ray_table.state == scenes.SEEN
    ahead = np.column_stack([ray_table.slope[seen], np.ones(seen.sum())])
    return ray_table.point[seen] + DEEP_MM * ahead / np.linalg.norm(ahead, axis=1)[:, None]


def mean_of(total, count):
    return total / max(count, RAYS_MIN)


def extreme_mean(sure, unsure, values, sign):
    """Of rays that surely count and those that may, each worth its value: the mean farthest to one side."""
    total, count = values[sure].sum(), sure.sum()
    means = [mean_of(total, count)]
    for value in sorted(values[unsure & ~sure] * sign, reverse=True):
        total, count = total + sign * value, count + 1
        means.append(mean_of(total, count))
    return max(means, key=lambda mean: sign * mean)


def template_score(ray_table, centre):
    """The smallest and the largest score that 16 bits may give a head there."""
    semi = np.array(MEAN_SEMI_MM, float)
    at, nearest, radius2, _, near = ellipsoid.cross(centre, semi, ray_table.origin, ray_table.slope)
    away = centre[2] - ray_table.origin[2]
    error_e, error2, error_depth = [per_mm * away + fixed for per_mm, fixed in (ERROR_E, ERROR_RADIUS2, ERROR_DEPTH)]
    seen, empty = ray_table.state == scenes.SEEN, ray_table.state == scenes.EMPTY
    depth = ray_table.point[:, 2]
    steep = 1 + ((ray_table.slope * semi[2] / semi[:2])**2).sum(axis=1)
    near = near & (steep < 3)
    behind = [(depth - centre[2]) / semi[2] - nearest[:, 2]
              + np.sqrt(np.maximum(0, 1 - radius2 + off) / steep) for off in (-error2, error2)]
    behind = [semi[2] * (behind[0] - error_depth), semi[2] * (behind[1] + error_depth)]
    aside = np.abs(at[:, 0] * semi[0]) - at[:, 1] * semi[1]  # more down when negative
    off_mm = error_e * (semi[0] + semi[1])
    ends = []
    for sign in (-1, 1):
        # Through the head: what is on the surface is best, what is behind it worst.
        on = np.where(sign > 0, (behind[1] > -ON_SURFACE_MM) & (behind[0] < ON_SURFACE_MM),
                      (behind[0] > -ON_SURFACE_MM) & (behind[1] < ON_SURFACE_MM))
        far = np.where(sign > 0, behind[0] >= ON_SURFACE_MM, behind[1] >= ON_SURFACE_MM)
        value = np.where(on, 1, np.where(far, BEHIND, NEARER))
        value = np.where(seen, value, np.where(empty, EMPTY, NEARER))
        total = extreme_mean(near & (radius2 < 1 - error2), near & (radius2 < 1 + error2), value, sign)

        far = depth > centre[2] + BEHIND_CENTRE_MM - sign * 1.01
        value = np.where(seen, np.where(far, 1, RING_NEAR), np.where(empty, RING_EMPTY, 0))
        sure, unsure = [near & (radius2 > RING_INNER**2 + off) & (radius2 < RING_OUTER**2 - off)
                        & (aside > side) for off, side in ((error2, off_mm), (-error2, -off_mm))]
        ends.append(total + RING_FRACTION * extreme_mean(sure, unsure, value, sign))
    return ends


def write_vectors(directory):
    inc = emit.Inc("Places behind the seen points of the scenes in scenes.inc, and the smallest and the\n"
                   " * largest template score of a mean head there, by float64 and by what 16 bits may be off.")
    inc.raw("\n")
    for name in ("DEEP_MM", "SPACING_MM", "ON_SURFACE_MM", "BEHIND_CENTRE_MM", "NEARER", "BEHIND",
                 "EMPTY", "RING_EMPTY", "RING_NEAR", "RING_FRACTION"):
        inc.raw("#define VECTOR_%s (%s)\n" % (name, globals()[name]))
    rows = []
    for scene, ray_table, _ in scenes.spaces():
        tried = []
        for centre in centres_behind(ray_table):
            tried.append("{{%s}, %s}" % (", ".join(emit.numbers(centre, 3)),
                                         ", ".join(emit.numbers(template_score(ray_table, centre), 4))))
        inc.raw("\nstatic const struct vector_place vector_tried_%s[] = {\n%s};\n"
                % (scene.name, emit.wrap(tried)))
        rows.append("%d, vector_tried_%s" % (len(tried), scene.name))
    inc.struct_array("vector_scan", "vector_scans", rows)
    return inc.write(directory, "scan.inc")
