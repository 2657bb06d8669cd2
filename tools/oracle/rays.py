"""Float64 reference of rays, points and which missing dots say that nothing is there."""

import numpy as np

import emit
import rig as rigs
import scenes
from rig import GRID, SLOTS, from_q, to_q
from samples import MISSING, SEEN, UNKNOWN

PROBE_MM = 100
PERCENTILE = 8
SLOPE_MAX = 4
BRIGHT_U = 400  # the frame is over-exposed left of this
NOT_CLOSE_PX = 0.05


def near_depth(depth_mm, state):
    ordered = np.sort(depth_mm[state == SEEN])
    return ordered[len(ordered) * PERCENTILE // 100] if len(ordered) else 0.0


def is_empty(rig, slot, probe_mm, bright):
    u, v = rig.distort(*rig.dot_at(slot, probe_mm))
    edges = np.array([u, v, rig.width - 1 - u, rig.height - 1 - v, u - BRIGHT_U])
    if np.abs(edges).min() < NOT_CLOSE_PX:
        raise ValueError("slot %d is too close to an edge to be a clear case" % slot)
    return edges[:4].min() > 0 and not (bright and u < BRIGHT_U)


def make(rig, x, y, depth_mm, state, bright):
    """origin, slopes, points, states."""
    dots = rig.kind == rigs.RIG_DOTS
    origin = from_q(rig.origin_q16, 16) if dots else np.zeros(3)
    slope = rig.tangents()[0] if dots else np.stack([x, y], axis=1)
    slope = np.clip(slope, -SLOPE_MAX, SLOPE_MAX)
    point = np.where(state == SEEN, depth_mm * np.stack([x, y, np.ones(SLOTS)]), 0).T
    probe_mm = near_depth(depth_mm, state) + PROBE_MM
    out = np.where(state == SEEN, scenes.SEEN, scenes.UNKNOWN)
    for slot in np.flatnonzero(state == MISSING):
        if not dots or is_empty(rig, slot, probe_mm, bright):
            out[slot] = scenes.EMPTY
    return origin, slope, point, out


def range_rig():
    return rigs.Rig("range", (640, 480), (570, 570), (320, 240), (0,) * 5, (400, 4000))


def points(random, rig, missing, unknown, spread):
    """x, y, depth, state of a bumpy wall; x and y of a range image may lie beyond the frame."""
    depth = random.uniform(rig.near_mm, rig.near_mm + spread * (rig.far_mm - rig.near_mm), SLOTS)
    free = random.uniform(size=SLOTS)
    state = np.where(free < missing, MISSING, np.where(free > 1 - unknown, UNKNOWN, SEEN))
    if rig.kind == rigs.RIG_DOTS:
        x, y = rig.dot_at(np.arange(SLOTS), np.where(state == SEEN, depth, rig.far_mm)).T
    else:
        index = np.arange(SLOTS)
        x, y = (index % GRID - 9) * 0.03 + 0.001, (index // GRID - 9) * 0.03
        outside = state == UNKNOWN
        x, y = np.where(outside, x * 30, x), np.where(outside, y * 30, y)
    limit = 2**31 - 1
    return (np.clip(to_q(x, 28), -limit, limit), np.clip(to_q(y, 28), -limit, limit),
            np.where(state == SEEN, to_q(depth, 8), 0), state)


def write_vectors(directory):
    size = scenes.write_vectors(directory)
    inc = emit.Inc("Points of a 19x19 table, and their rays and states in float64.")
    inc.raw("\n#define VECTOR_PROBE_MM %d\n#define VECTOR_BRIGHT_U %d\n" % (PROBE_MM, BRIGHT_U))
    dots, rows = rigs.dot_rigs(), []
    inc.struct_array("ih_calibration", "vector_range_rigs", [range_rig().initialiser()])
    for index, (rig, missing, spread, bright) in enumerate(
            [(0, 0.3, 0.2, False), (0, 0.5, 1, True), (1, 0.3, 0.1, True), (2, 0.4, 1, False),
             (4, 0.4, 0.02, False), (0, 1, 1, True), (-1, 0.3, 0.5, False)]):
        seed = 1000 + 100 * index
        while True:  # until no case is a matter of rounding
            random = np.random.default_rng(seed)
            the_rig = range_rig() if rig < 0 else dots[rig]
            x, y, depth, state = points(random, the_rig, missing, 0.1 if rig < 0 else 0, spread)
            try:
                origin, slope, point, states = make(the_rig, from_q(x, 28), from_q(y, 28),
                                                    from_q(depth, 8), state, bright)
                break
            except ValueError:
                seed += 1
        inc.raw("\nstatic const struct ih_point vector_%d_points[] = {\n%s};\n" % (
            index, emit.wrap(["{%d, %d, %d, %d}" % p for p in zip(x, y, depth, state)])))
        rays = ["{%d, %s, {%s}}" % (slot, ", ".join(emit.numbers(slope[slot], 7)),
                                     ", ".join(emit.numbers(point[slot], 4)))
                for slot in rigs.PROBE_SLOTS]
        inc.raw("\nstatic const struct vector_ray vector_%d_rays[] = {\n%s};\n"
                % (index, emit.wrap(rays)))
        inc.array("int8_t", "vector_%d_states" % index, states)
        rows.append("%s, %d, vector_%d_points, {%s}, %d, vector_%d_rays, "
                    "vector_%d_states" % (
            "&vector_range_rigs[0]" if rig < 0 else "&vector_rigs[%d]" % rig, bright, index,
            ", ".join(emit.numbers(origin, 6)), len(rays), index, index))
    inc.struct_array("vector_space", "vector_spaces", rows)
    return size + inc.write(directory, "rays.inc")
