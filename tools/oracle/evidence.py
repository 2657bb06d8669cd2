"""Float64 reference of the evidence, over scenes of simple bodies.

Rays for which a count is a matter of rounding are made unknown ones, which count nowhere.
"""

import numpy as np

import emit
from rig import GRID, SLOTS, from_q, to_q

UNKNOWN, SEEN, EMPTY = 0, 1, 2
MEAN_SEMI = np.array([78.0, 113, 98])
CENTRE = np.array([10.0, -100, 800])
ORIGIN = np.array([60.0, -20, 15])
PITCH = 0.05
KINDS = "on rough bulge tall moved bend_down bend_across".split()


def lattice():
    """Slopes of all rays, Q20: a rotated, slightly wavy lattice."""
    index = np.arange(SLOTS)
    column, row = index % GRID - 9, index // GRID - 9
    x = PITCH * (column + 0.05 * row + 0.2 * np.sin(index)) - 0.07
    y = PITCH * (row - 0.05 * column + 0.2 * np.cos(3 * index)) + 0.02
    return to_q(np.stack([x, y], axis=1), 20)


def ellipsoid_depth(slope, centre, semi):
    """Where a ray enters; nan where it does not."""
    ray = np.column_stack([slope, np.ones(len(slope))]) / semi
    away = (ORIGIN - centre) / semi
    a, b, c = (ray * ray).sum(1), ray @ away, away @ away - 1
    root = b * b - a * c
    return ORIGIN[2] + (-b - np.sqrt(np.where(root > 0, root, np.nan))) / a


def box_depth(slope, z, x_range, y_range):
    """A frontal rectangle."""
    position = ORIGIN[:2] + (z - ORIGIN[2]) * slope
    inside = ((position > [x_range[0], y_range[0]]) & (position < [x_range[1], y_range[1]])).all(1)
    return np.where(inside, z, np.nan)


def bodies(name):
    """Depths along the rays; those of the nearest body are seen."""
    head = ("ellipsoid", CENTRE, MEAN_SEMI)
    neck = ("box", 830, (-40, 60), (-20, 60))
    torso = ("ellipsoid", CENTRE + [0, 300, 40], np.array([240.0, 190, 120]))
    wall = ("box", 2000, (-5000, 5000), (-5000, 5000))
    return {
        "head": [head, neck, torso, wall],
        "board": [("disc", 715), neck, torso, wall],
        "table": [head, ("box", 850, (-5000, 5000), (60, 5000)), wall],
        "hand": [head, neck, torso, wall,
                 ("ellipsoid", CENTRE + [-70, 40, -220], np.full(3, 70.0))],
        "before_nothing": [head, neck, torso],
        "rough": [head, neck, torso, wall],
        "dark": [head, neck, torso, wall],
        "small": [("ellipsoid", CENTRE, MEAN_SEMI * [1, 0.8, 1]), neck, torso, wall],
        "moved": [head, neck, torso, wall],
        "neighbours": [head, neck, torso, wall, ("ellipsoid", CENTRE + [-250, 0, 0], MEAN_SEMI),
                       ("ellipsoid", CENTRE + [260, 0, 20], MEAN_SEMI)],
        "gone": [wall],
        "unknown": [],
    }[name]


SCENES = "head board hand before_nothing rough dark small moved gone unknown".split()


def depth_of(body, slope):
    if body[0] == "ellipsoid":
        return ellipsoid_depth(slope, *body[1:])
    if body[0] == "box":
        return box_depth(slope, *body[1:])
    position = ORIGIN[:2] + (body[1] - ORIGIN[2]) * slope
    inside = (((position - CENTRE[:2]) / MEAN_SEMI[:2])**2).sum(1) < 1
    return np.where(inside, body[1] + 0.3 * (position[:, 0] - CENTRE[0]), np.nan)


def make_scene(name, slope_q20, random):
    """Points in Q8, by integers as in the test, and states."""
    slope = from_q(slope_q20, 20)
    depths = np.array([depth_of(b, slope) for b in bodies(name)] + [np.full(SLOTS, np.inf)])
    depth = np.nanmin(depths, axis=0)
    depth += random.normal(0, 9 if name == "rough" else 1.5, SLOTS)
    state = np.where(np.isfinite(depth), SEEN, EMPTY)
    if name == "unknown":
        state[:] = UNKNOWN
    state[random.uniform(size=SLOTS) < (0.5 if name == "dark" else 0.03)] = UNKNOWN
    return to_q(np.where(state == SEEN, depth, 0), 8), state


def points_of(depth_q8, slope_q20):
    origin_q8 = to_q(ORIGIN, 8)
    aside = ((depth_q8 - origin_q8[2])[:, None] * slope_q20 + (1 << 19)) >> 20
    return np.column_stack([origin_q8[:2] + aside, depth_q8])


class Scene:
    """What a ray is, against one ellipsoid."""

    def __init__(self, slope_q20, depth_q8, state, centre, semi):
        self.centre, self.semi = centre, semi
        slope = from_q(slope_q20, 20)
        self.point = from_q(points_of(depth_q8, slope_q20), 8)
        self.seen, self.empty = state == SEEN, state == EMPTY
        self.aside = ORIGIN[:2] + (centre[2] - ORIGIN[2]) * slope - centre[:2]
        self.e = self.aside / semi[:2]
        g = slope * semi[2] / semi[:2]
        gg, eg = 1 + (g * g).sum(1), (self.e * g).sum(1)
        self.radius2 = (self.e**2).sum(1) - eg**2 / gg
        inside = np.sqrt(np.maximum(1 - self.radius2, 0) / gg)
        self.entry = centre[2] + semi[2] * (-eg / gg - inside)
        self.dz = np.where(self.seen, self.point[:, 2] - centre[2], np.inf)
        position = (self.point - centre) / semi
        f = np.linalg.norm(position, axis=1)
        self.radius = f
        self.distance = (f - 1) / (np.linalg.norm(position / semi, axis=1) / f)
        self.margin = np.full(SLOTS, np.inf)

    def above(self, value, limit, step):
        """value > limit; notes how clear that is, in steps of rounding."""
        with np.errstate(invalid="ignore"):
            self.margin = np.minimum(self.margin, np.abs(value - limit) / step)
        return value > limit


def bend(height, face, axis):
    """How uneven a surface is along an axis of the pattern, with one more bend of 12 mm."""
    height, face = (np.moveaxis(a.reshape(GRID, GRID), axis, 0) for a in (height, face))
    bends = np.minimum(np.abs(np.diff(height, 2, axis=0)), 20)[face[:-2] & face[1:-1] & face[2:]]
    return (bends.sum() + 12) / (len(bends) + 1)


def look(s, start):
    """All numbers by name, and the three counts for the tracks."""
    ex, ey = s.e.T
    out = {}
    reach = ~s.above(np.abs(ex), 8, 1e-3) & ~s.above(np.abs(ey), 8, 1e-3)
    seen = s.seen & reach
    inside = reach & ~s.above(s.radius2, 0.9, 2e-3)
    behind = s.point[:, 2] - s.entry
    on = inside & seen & ~s.above(np.abs(s.distance), 20, 0.05)
    through = inside & (s.empty | (seen & s.above(behind, 50, 0.2)))
    front = inside & seen & ~s.above(behind, -30, 0.2)
    out["on"] = on.sum()
    out["rough"] = np.sqrt((s.distance[on]**2).mean()) if on.any() else 0
    bulge = 0
    if on.sum() >= 6:
        p = s.point[on] - s.centre
        design = np.column_stack([p[:, :2], np.ones(len(p))])
        residual = p[:, 2] - design @ np.linalg.lstsq(design, p[:, 2], rcond=None)[0]
        bulge = np.sqrt((residual**2).mean())
    out["bulge"] = bulge - out["rough"]
    out["tall"] = 100 * (s.semi[1] - MEAN_SEMI[1]) / MEAN_SEMI[1]
    out["moved"] = np.linalg.norm(s.centre - start)
    face = seen & ~s.above(s.dz, 0, 0.02) & ~s.above(s.radius**2, 1.4**2, 2e-3)
    height = (s.radius**2 - 1) / 2 * s.semi[2]
    out["bend_down"], out["bend_across"] = (bend(height, face, axis) for axis in (0, 1))
    return out, (through.sum(), on.sum(), front.sum())


def write_vectors(directory):
    random = np.random.default_rng(51)
    slope_q20 = lattice()
    inc = emit.Inc("Scenes of simple bodies, and the evidence for a head in them.")
    inc.raw("\nstatic const int32_t vector_origin_mm_q8[] = {%d, %d, %d};\n"
            % tuple(to_q(ORIGIN, 8)))
    inc.raw("\nstatic const int32_t vector_slope_q20[][2] = {\n%s};\n"
            % emit.wrap(["{%d, %d}" % tuple(s) for s in slope_q20]))
    rows = []
    for name in SCENES:
        depth_q8, state = make_scene(name, slope_q20, random)
        semi = MEAN_SEMI * ([1, 0.8, 1] if name == "small" else 1)
        centre_q8, semi_q8 = to_q(CENTRE, 8), to_q(semi, 8)
        start_q8 = centre_q8 + (to_q([30, -40, 0], 8) if name == "moved" else 0)
        first = Scene(slope_q20, depth_q8, state, from_q(centre_q8, 8), from_q(semi_q8, 8))
        look(first, CENTRE)
        state = np.where(first.margin < 1, UNKNOWN, state)
        depth_q8 = np.where(state == SEEN, depth_q8, 0)
        found, counts = look(Scene(slope_q20, depth_q8, state, from_q(centre_q8, 8),
                                   from_q(semi_q8, 8)), from_q(start_q8, 8))
        assert list(sorted(found)) == sorted(KINDS)
        inc.raw("\nstatic const struct vector_ray vector_%s_rays[] = {\n%s};\n" % (
            name, emit.wrap(["{%d, %d}" % r for r in zip(depth_q8, state)])))
        rows.append('"%s", vector_%s_rays, {{%d, %d, %d}, {%d, %d, %d}}, {%d, %d, %d}, '
                    '{%s}, %d, %d, %d' % (
                        name, name, *centre_q8, *semi_q8, *start_q8,
                        ", ".join(emit.numbers([found[k] for k in KINDS], 5)), *counts))
    inc.struct_array("vector_scene", "vector_scenes", rows)
    return inc.write(directory, "evidence.inc")
