"""Float64 reference of centres behind every seen point; the scan tries one of each block."""

import numpy as np

import emit
import scenes

DEEP_MM = 98


def centres_behind(ray_table):
    """Deep behind each seen point, along its ray."""
    seen = ray_table.state == scenes.SEEN
    ahead = np.column_stack([ray_table.slope[seen], np.ones(seen.sum())])
    return ray_table.point[seen] + DEEP_MM * ahead / np.linalg.norm(ahead, axis=1)[:, None]


def write_vectors(directory):
    inc = emit.Inc("Places behind the seen points of the scenes in scenes.inc.")
    inc.raw("\n#define VECTOR_DEEP_MM (%d)\n" % DEEP_MM)
    rows = []
    for scene, ray_table, _ in scenes.spaces():
        behind = ["{%s}" % ", ".join(emit.numbers(centre, 3)) for centre in centres_behind(ray_table)]
        inc.raw("\nstatic const double vector_behind_%s[][3] = {\n%s};\n" % (scene.name, emit.wrap(behind)))
        rows.append("%d, vector_behind_%s" % (len(behind), scene.name))
    inc.struct_array("vector_scan", "vector_scans", rows)
    return inc.write(directory, "scan.inc")
