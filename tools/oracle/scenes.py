"""Made scenes for the stages that reason about bodies: rays of three rigs, and what they meet.

Rays and depths are rounded to the firmware's formats first and both sides count with the rounded
ones, so that a difference is arithmetic. A scene is stored as one depth per slot; the test makes
the points from it by the same integer formula (tests/unit/ih_test_scene.h)."""

import numpy as np

import emit
import rig as rigs
from ellipsoid import MEAN_SEMI_MM
from rig import GRID, SLOTS, from_q, to_q

UNKNOWN, SEEN, EMPTY = 0, 1, 2
PAPER, WIDE, RANGE = 0, 1, 2
RANGE_PITCH_MM, RANGE_DEPTH_MM = 26, 1000


class Rays:
    """Origin (Q8) and slopes (Q20) of a rig's rays."""

    def __init__(self, origin_q8, slope_q20):
        self.origin_q8, self.slope_q20 = origin_q8, slope_q20
        self.origin, self.slope = from_q(origin_q8, 8), from_q(slope_q20, 20)

    @staticmethod
    def of_dots(rig):
        return Rays(to_q(from_q(rig.origin_q16, 16), 8), to_q(rig.tangents()[0], 20))

    @staticmethod
    def of_lattice():
        index = np.arange(SLOTS)
        position = np.stack([index % GRID - GRID // 2, index // GRID - GRID // 2], axis=1)
        return Rays(np.zeros(3, np.int64), to_q(position * RANGE_PITCH_MM / RANGE_DEPTH_MM, 20))


def all_rays():
    """In the order of PAPER, WIDE, RANGE."""
    return [Rays.of_dots(rigs.paper()), Rays.of_dots(rigs.wide()), Rays.of_lattice()]


class RayTable:
    """struct ih_rays in floats: origin, and per slot slope, point and state."""

    def __init__(self, rays, depth_q8, state):
        self.origin, self.slope, self.state = rays.origin, rays.slope, state
        along = (depth_q8 - rays.origin_q8[2])[:, None] * rays.slope_q20
        aside = rays.origin_q8[:2] + ((along + (1 << 19)) >> 20)
        point = np.column_stack([aside, depth_q8])
        self.point = from_q(np.where(state[:, None] == SEEN, point, 0), 8)


def meet_ellipsoid(rays, centre, semi):
    """Depths at which the rays enter; inf where they pass."""
    semi = np.asarray(semi, float)
    start = (rays.origin - centre) / semi
    along = np.column_stack([rays.slope, np.ones(SLOTS)]) / semi
    a, b = (along**2).sum(axis=1), along @ start
    root = b * b - a * (start @ start - 1)
    return np.where(root > 0, rays.origin[2] + (-b - np.sqrt(np.maximum(root, 0))) / a, np.inf)


def meet_board(rays, depth, left, right, top, bottom):
    """An upright rectangle that faces the camera."""
    position = rays.origin[:2] + (depth - rays.origin[2]) * rays.slope
    x, y = position[:, 0], position[:, 1]
    return np.where((x >= left) & (x <= right) & (y >= top) & (y <= bottom), depth, np.inf)


def person(centre, semi=MEAN_SEMI_MM):
    """Head, neck and trunk."""
    centre = np.asarray(centre, float)
    return [("ball", centre, semi),
            ("ball", centre + (0, 130, 15), (58, 90, 58)),
            ("ball", centre + (0, 400, 40), (220, 250, 120))]


def wall(depth):
    return [("board", depth, -1e5, 1e5, -1e5, 1e5)]


class Scene:
    def __init__(self, name, rays, centre, semi, things, noise=0.0, missing=0.0, wild=0.0):
        self.name, self.rays, self.centre, self.semi = name, rays, centre, semi
        self.things, self.noise, self.missing, self.wild = things, noise, missing, wild

    def look(self, rays, random):
        """depth_q8 and state by slot. noise: mm at 1 m, it grows with the depth's square."""
        depth = np.full(SLOTS, np.inf)
        for kind, *what in self.things:
            meet = meet_ellipsoid if kind == "ball" else meet_board
            depth = np.minimum(depth, meet(rays, *what))
        seen = np.isfinite(depth)
        depth = np.where(seen, depth, 1000)
        depth = depth + self.noise * (depth / 1000)**2 * random.normal(0, 1, SLOTS)
        wild = random.uniform(size=SLOTS) < self.wild
        depth = np.where(wild, random.uniform(500, 2500, SLOTS), depth)
        lost = random.uniform(size=SLOTS) < self.missing
        state = np.where(seen, SEEN, EMPTY)
        state = np.where(lost, random.choice([UNKNOWN, EMPTY], SLOTS), state)
        return np.where(state == SEEN, to_q(depth, 8), 0), state


def all_scenes():
    at, large = np.array([20.0, -30, 900]), (86, 121, 106)
    shelf = [("board", 1300, -500, -120, y, y + 30) for y in (-250, -80, 90, 260)]
    shelf += [("board", 1320, x, x + 60, -220, -80) for x in (-480, -330, -180)]
    hand = [("ball", at + (40, 60, -190), (50, 45, 25)),
            ("ball", at + (140, 150, -150), (90, 40, 40))]
    side = [("board", 1250, -1e5, at[0] - 10, -1e5, 1e5)]
    return [
        Scene("ball", PAPER, at, (98, 98, 98), [("ball", at, (98, 98, 98))]),
        Scene("head", WIDE, at, large, [("ball", at, large)]),
        Scene("person", PAPER, at, MEAN_SEMI_MM, person(at) + wall(1700), 3, 0.1),
        Scene("person_wide", WIDE, at, large, person(at, large) + wall(1500), 1, 0.1),
        Scene("person_range", RANGE, at, large, person(at, large) + wall(2500), 2, 0.05),
        Scene("wild", WIDE, at, large, person(at, large) + wall(1500), 1, 0.05, 0.2),
        Scene("hand", PAPER, at, MEAN_SEMI_MM, person(at) + hand + wall(1800), 2, 0.05),
        Scene("side", WIDE, at, MEAN_SEMI_MM, side + [("ball", at, MEAN_SEMI_MM)], 1),
        Scene("shelf", WIDE, at, MEAN_SEMI_MM, person(at) + shelf + wall(1500), 1.5, 0.05),
        Scene("near", PAPER, at / 2, MEAN_SEMI_MM, person(at / 2) + wall(1200), 1),
        Scene("far", RANGE, at * 2.5, MEAN_SEMI_MM, person(at * 2.5), 0.5, 0.1),
        Scene("wall", PAPER, None, None, wall(1400), 3, 0.1),
    ]


def spaces():
    """scene, space, depth_q8 for all scenes, the same every time."""
    random = np.random.default_rng(311)
    rays = all_rays()
    for scene in all_scenes():
        depth_q8, state = scene.look(rays[scene.rays], random)
        yield scene, RayTable(rays[scene.rays], depth_q8, state), depth_q8


def write_vectors(directory):
    inc = emit.Inc("Rays of three rigs, and what they meet in made scenes: a depth in Q8 mm, 0 where\n"
                   " * that is not known, -1 where nothing is.")
    rows = []
    for index, rays in enumerate(all_rays()):
        inc.raw("\nstatic const int32_t vector_slopes_%d[][2] = {\n%s};\n" % (
            index, emit.wrap(["{%d, %d}" % tuple(s) for s in rays.slope_q20])))
        rows.append("{%d, %d, %d}, vector_slopes_%d" % (*rays.origin_q8, index))
    inc.struct_array("vector_rays", "vector_rays", rows)
    rows = []
    for scene, ray_table, depth_q8 in spaces():
        inc.array("int32_t", "vector_depths_" + scene.name,
                  np.where(ray_table.state == EMPTY, -1, depth_q8))
        head = (0, 0, 0, 0, 0, 0) if scene.centre is None else (*scene.centre, *scene.semi)
        rows.append('"%s", &vector_rays[%d], vector_depths_%s, {%s}, {%s}' % (
            scene.name, scene.rays, scene.name, ", ".join(emit.numbers(head[:3], 3)),
            ", ".join(emit.numbers(head[3:], 3))))
    inc.struct_array("vector_scene", "vector_scenes", rows)
    return inc.write(directory, "scenes.inc")
