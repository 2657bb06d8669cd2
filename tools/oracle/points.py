"""Float64 reference of triangulation."""

import numpy as np

import emit
import rig as rigs
from rig import to_q


def write_vectors(directory):
    inc = emit.Inc("Places of dots on their lines, and the points there in float64.")
    rows = []
    for index, rig in enumerate(rigs.dot_rigs()):
        _, _, length = rig.lines()
        for slot in rigs.PROBE_SLOTS:
            for depth_mm in np.geomspace(rig.near_mm, rig.far_mm, 4):
                t_q12 = int(to_q(length[slot] / depth_mm, 12))
                exact_mm = length[slot] * 4096 / t_q12
                x, y = rig.dot_at(slot, exact_mm)
                rows.append("%d, %d, %d, %s" % (index, slot, t_q12, ", ".join(
                    [emit.number(exact_mm, 4)] + emit.numbers((x, y), 10))))
    inc.struct_array("vector_point", "vector_points", rows)
    return inc.write(directory, "points.inc")
