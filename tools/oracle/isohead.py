"""Dots of a bust before a wall for the test of the whole: a head whose place is known."""

import numpy as np

import emit
import labels
import rig as rigs

HEADS = [((0, -70, 850), 95), ((60, -60, 760), 90), ((-70, -90, 980), 100)]


def write_vectors(directory):
    random = np.random.default_rng(91)
    inc = emit.Inc("Dots of a sphere of a head's size on a body before a wall.")
    rows = []
    for rig_index, rig in enumerate((rigs.paper(), rigs.wide())):
        for head_index, (centre, radius) in enumerate(HEADS):
            body = (centre[0], centre[1] + 320, centre[2] + 80)
            surfaces = [labels.sphere(centre, radius), labels.sphere(body, 230),
                        labels.plane(1700)]
            dots = labels.dots_of(rig, surfaces, random, 0, 0, 0)
            name = "%s_%d" % (rig.name, head_index)
            inc.raw("\nstatic const struct vector_dot vector_%s[] = {\n%s};\n" % (
                name, emit.wrap(["{%d, %d, %d}" % tuple(d) for d in dots])))
            rows.append('"%s", %d, %d, %d, %d, %d, %d, vector_%s' % (
                name, rig_index, *centre, radius, len(dots), name))
    inc.struct_array("vector_bust", "vector_busts", rows)
    return inc.write(directory, "isohead.inc")
