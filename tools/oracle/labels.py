"""Labelled dots of made-up scenes: where each projected dot really appears, and which it is."""

import numpy as np

import emit
import rig as rigs
from rig import from_q, to_q


def plane(point_z, slope_x=0.0, slope_y=0.0):
    """Depth along rays: the plane Z = point_z + slope_x X + slope_y Y."""
    def hit(origin, ray):
        return ((point_z - origin[2] + slope_x * origin[0] + slope_y * origin[1])
                / (ray[..., 2] - slope_x * ray[..., 0] - slope_y * ray[..., 1]))
    return hit


def sphere(centre, radius):
    def hit(origin, ray):
        away = np.asarray(origin, float) - centre
        b = (ray * away).sum(axis=-1)
        inside = b * b - (away @ away - radius**2)
        return np.where(inside > 0, -b - np.sqrt(np.maximum(inside, 0)), np.inf)
    return hit


def step(left_z, right_z):
    """A wall whose right half stands nearer or farther."""
    def hit(origin, ray):
        left, right = plane(left_z)(origin, ray), plane(right_z)(origin, ray)
        on_left = origin[0] + left * ray[..., 0] < 0
        on_right = origin[0] + right * ray[..., 0] >= 0
        return np.minimum(np.where(on_left, left, np.inf), np.where(on_right, right, np.inf))
    return hit


def first_hit(surfaces, origin, ray):
    return np.min([s(origin, ray) for s in surfaces], axis=0)


def see(rig, surfaces):
    """Positions in the frame (u, v), depth and visibility of all dots."""
    rays, origin = from_q(rig.rays_q30, 30), from_q(rig.origin_q16, 16)
    rays = rays / np.linalg.norm(rays, axis=1)[:, None]
    distance = first_hit(surfaces, origin, rays)
    point = origin + np.where(np.isfinite(distance), distance, 1)[:, None] * rays
    back = np.linalg.norm(point, axis=1)
    seen = first_hit(surfaces, np.zeros(3), point / back[:, None]) > back - 1
    u, v = rig.distort(point[:, 0] / point[:, 2], point[:, 1] / point[:, 2])
    seen &= np.isfinite(distance) & (point[:, 2] > rig.near_mm) & (point[:, 2] < rig.far_mm)
    seen &= (u > 1) & (v > 1) & (u < rig.width - 2) & (v < rig.height - 2)
    return np.column_stack([u, v]), point[:, 2], seen


def dots_of(rig, surfaces, random, jitter_px, missing, spurious):
    """Detected dots in the firmware's order: u and v in Q12, slot or -1."""
    position, _, seen = see(rig, surfaces)
    slot = np.flatnonzero(seen & (random.uniform(size=rigs.SLOTS) >= missing))
    position = position[slot] + random.normal(0, jitter_px, (len(slot), 2))
    wrong = random.uniform(3, np.array([rig.width, rig.height]) - 4, (spurious, 2))
    position_q12 = to_q(np.concatenate([position, wrong]), 12)
    slot = np.concatenate([slot, np.full(spurious, -1)])
    order = np.lexsort((position_q12[:, 0], position_q12[:, 1]))
    return np.column_stack([position_q12[order], slot[order]])


def scenes():
    head = [sphere((20, -40, 850), 110), sphere((0, 330, 950), 260)]
    yield "wall", [plane(1500)]
    yield "tilted", [plane(1100, 0.35, -0.25)]
    yield "head", head + [plane(1450)]
    yield "room", head + [plane(2300, 0.2, 0.1)]
    yield "step", [step(900, 1350)]
    yield "open", head


def write_vectors(directory):
    random = np.random.default_rng(61)
    inc = emit.Inc("Dots of made-up scenes with their true slots (-1: spurious).")
    rows = []
    for index, rig in enumerate((rigs.paper(), rigs.wide())):
        for name, surfaces in scenes():
            for kind, trouble in (("clean", (0, 0, 0)), ("rough", (0.1, 0.12, 60))):
                dots = dots_of(rig, surfaces, random, *trouble)
                name_full = "%s_%s_%s" % (rig.name, name, kind)
                inc.raw("\nstatic const struct vector_dot vector_%s[] = {\n%s};\n" % (
                    name_full, emit.wrap(["{%d, %d, %d}" % tuple(d) for d in dots])))
                rows.append('"%s", %d, %d, %d, vector_%s' % (
                    name_full, index, kind == "clean", len(dots), name_full))
    inc.struct_array("vector_scene", "vector_scenes", rows)
    return inc.write(directory, "labels.inc")
