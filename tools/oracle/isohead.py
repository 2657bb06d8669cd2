"""Dots of a bust before a wall for the test of the whole: a head whose position is known."""

import numpy as np

import emit
import labels
import rig as rigs

# Half the width, height and depth of a head, and of the neck and the torso that carry it.
HEAD, NECK, TORSO = (78, 113, 98), (58, 110, 62), (215, 235, 115)
WALL_MM = 1700
# Centres of heads; the last ones are where few dots are left on a head.
CENTRES = [(0, -70, 850), (60, -60, 760), (-70, -90, 700), (25, -40, 800),
           (-70, -90, 980), (0, -70, 1000), (60, -60, 950)]


def ellipsoid(centre, axes):
    """A sphere's, in coordinates in which the ellipsoid is the unit sphere."""
    axes = np.asarray(axes, float)

    def hit(origin, ray):
        away = (np.asarray(origin, float) - centre) / axes
        ray = ray / axes
        a, b = (ray * ray).sum(axis=-1), (ray * away).sum(axis=-1)
        inside = b * b - a * (away @ away - 1)
        return np.where(inside > 0, (-b - np.sqrt(np.maximum(inside, 0))) / a, np.inf)
    return hit


def bust(centre):
    """The chest is a little behind the face, the shoulders are below the chin."""
    x, y, z = centre
    return [ellipsoid(centre, HEAD), ellipsoid((x, y + 120, z + 25), NECK),
            ellipsoid((x, y + 400, z + 45), TORSO), labels.plane(WALL_MM)]


def write_vectors(directory):
    random = np.random.default_rng(91)
    inc = emit.Inc("Dots of a head on a neck and shoulders before a wall.")
    rows = []
    for rig_index, rig in enumerate((rigs.paper(), rigs.wide())):
        for head_index, centre in enumerate(CENTRES):
            dots = labels.dots_of(rig, bust(centre), random, 0, 0, 0)
            name = "%s_%d" % (rig.name, head_index)
            inc.raw("\nstatic const struct vector_dot vector_%s[] = {\n%s};\n" % (
                name, emit.wrap(["{%d, %d, %d}" % tuple(d) for d in dots])))
            rows.append('"%s", %d, %d, %d, %d, %d, vector_%s' % (
                name, rig_index, *centre, len(dots), name))
    inc.struct_array("vector_bust", "vector_busts", rows)
    return inc.write(directory, "isohead.inc")
