"""Float64 reference of points drawn into a depth image: where each is seen."""

import numpy as np

import emit
from rig import Rig, from_q, to_q

CLEAR = 0.02  # px and mm from where the answer changes


def rigs():
    return [Rig("pinhole", (640, 480), (525, 525), (319.5, 239.5), (0,) * 5, (400, 4000)),
            Rig("lens", (320, 200), (260.25, 255.5), (163.1, 97.7),
                (-0.21, 0.07, 0.001, -0.0007, -0.01), (300, 9000))]


def position(rig, point):
    """Column and row of its pixel and its depth; None when it is not seen; "unclear" when that is
    a matter of rounding."""
    x, y, z = point
    if min(abs(z - rig.near_mm + 0.5), abs(z - rig.far_mm - 0.5), abs(z % 1 - 0.5)) < CLEAR:
        return "unclear"
    if not rig.near_mm - 0.5 < z < rig.far_mm + 0.5:
        return None
    if max(abs(x), abs(y)) > 1.2 * z:  # a lens may fold what it never sees back into the frame
        return None if max(abs(x), abs(y)) > 2.1 * z else "unclear"
    u, v = rig.distort(x / z, y / z)
    if min(abs(u % 1 - 0.5), abs(v % 1 - 0.5)) < CLEAR:
        return "unclear"
    column, row = round(u), round(v)
    inside = 0 <= column < rig.width and 0 <= row < rig.height
    return (column, row, round(z)) if inside else None


def write_vectors(directory):
    inc = emit.Inc("Points in space, Q8 mm, and the pixels where they are seen in float64.")
    random = np.random.default_rng(77)
    rows = []
    for index, rig in enumerate(rigs()):
        inc.raw("\nstatic const struct ih_calibration vector_cloud_rig_%d = {\n    %s};\n"
                % (index, rig.initialiser()))
        while len(rows) < 150 * (index + 1):
            z = random.uniform(-0.1, 1.1) * rig.far_mm
            point_q8 = to_q([*random.normal(0, 0.5, 2) * abs(z), z], 8)
            if len(rows) % 15 == 0:
                point_q8[:2] *= 40
            seen = position(rig, from_q(point_q8, 8))
            if seen != "unclear":
                rows.append("%d, {%d, %d, %d}, %d, %d, %d" % (
                    index, *point_q8, *(seen or (-1, -1, 0))))
    inc.struct_array("vector_cloud_point", "vector_cloud_points", rows)
    return inc.write(directory, "cloud.inc")
