"""Float64 reference of the maps of the surroundings, of the moves and the promise, over the scenes of evidence.py and patterns of other pitch.

Rays whose place is a matter of rounding are made unknown ones.
"""

import numpy as np

import emit
import evidence
from rig import GRID, from_q, to_q

COLUMNS, ROWS, DEPTHS, MAPS = 3, 10, 8, 48
CELLS_ASIDE = 6  # the last column has all from the third on
# Cells above each other that are one row, by the first of each.
FIRST_CELLS, CELLS_DOWN = np.array([0, 2, 3, 4, 5, 6, 7, 8, 9, 11]), 13
STEP_MM = (0.0390625, 0.11328125, 0.9375)  # aside, down, away
BIAS_Q5 = -91
CELL_MM, TOP_MM = 64.0, 384.0
LIMITS_MM = np.array([-176, -96, -40, 40, 128, 200])
EMPTY_PLACE, NONE = DEPTHS - 1, -1
# Slopes that the pattern's own are multiplied by, and the centre moved by: dense, as it is, so far that a ray has a cell of its own.
CASES = (("head", 1.0, 0), ("hand", 0.4, 0), ("table", 1.7, 0), ("before_nothing", 3.0, 0), ("unknown", 1.0, 0),
         ("rough", 1.0, -260), ("neighbours", 1.0, 700))


def spacing_mm(slope, depth_mm):
    """Of rays at this depth: the mean of the cells that four of them span."""
    at = slope.reshape(GRID, GRID, 2)
    a, b, c, d = at[4, 4], at[4, 14], at[14, 14], at[14, 4]
    across, down = c - a, d - b
    return np.sqrt(abs(across[0] * down[1] - across[1] * down[0]) / 2 / 100) * depth_mm


def passes(slope_q20, centre):
    """Where rays pass a centre at its depth: how far right of it and below it."""
    return (evidence.ORIGIN[:2] + (centre[2] - evidence.ORIGIN[2]) * from_q(slope_q20, 20) - centre[:2]).T


def places(slope_q20, depth_q8, state, centre):
    """By slot; and how far, in mm, each ray is from being elsewhere."""
    x, y = passes(slope_q20, centre)
    dz = from_q(depth_q8, 8) - centre[2]
    column, cell = np.abs(x) // CELL_MM, (y + TOP_MM) // CELL_MM
    row = np.searchsorted(FIRST_CELLS, cell, side="right") - 1
    depth = np.where(state == evidence.EMPTY, EMPTY_PLACE, (dz[:, None] >= LIMITS_MM - 0.5).sum(1))
    inside = (column < CELLS_ASIDE) & (cell >= 0) & (cell < CELLS_DOWN) & (state != evidence.UNKNOWN)
    place = np.where(inside, (row * COLUMNS + np.minimum(column, COLUMNS - 1)) * DEPTHS + depth, NONE).astype(int)

    def edge(value):
        return np.abs(value - CELL_MM * np.round(value / CELL_MM))

    beside = np.abs(dz[:, None] - LIMITS_MM + 0.5).min(1)
    return place, np.minimum(np.minimum(edge(x), edge(y)), np.where(state == evidence.SEEN, beside, np.inf))


def promise(parts, place, weight):
    """Log-odds, of the rays of every other line and column."""
    counted = place.reshape(GRID, GRID)[::2, ::2].ravel()
    return (BIAS_Q5 + weight * parts.ravel()[counted[counted != NONE]].sum()) / 32


def write_vectors(directory):
    random = np.random.default_rng(83)
    maps = random.integers(-8, 8, (COLUMNS * ROWS * DEPTHS, MAPS))
    inc = emit.Inc("Scenes of simple bodies, where their rays are on the maps, and what maps of random numbers say.")
    inc.raw("\nstatic const int32_t vector_origin_mm_q8[] = {%d, %d, %d};\n" % tuple(to_q(evidence.ORIGIN, 8)))
    words = [["0x%08xu" % sum(int(value) + 8 << 4 * i for i, value in enumerate(word)) for word in row.reshape(-1, 8)] for row in maps]
    inc.raw("\nstatic const uint32_t vector_maps[][%d] = {\n%s};\n" % (MAPS // 8, emit.wrap(["{%s}" % ", ".join(row) for row in words])))
    steps = np.random.default_rng(84).integers(-128, 128, (COLUMNS * ROWS * DEPTHS, 3))
    inc.raw("\nstatic const struct ih_surroundings_moves vector_moves = {\n    {%d, %d, %d},\n    {\n%s    },\n};\n" % (
        *to_q(np.array(STEP_MM), 12), emit.wrap(["{%d, %d, %d}" % tuple(step) for step in steps])))
    parts = np.random.default_rng(85).integers(-127, 128, (ROWS, COLUMNS, DEPTHS))
    inc.raw("\nstatic const struct ih_surroundings_promise vector_promise = {\n    %d,\n    {\n%s    },\n};\n" % (
        BIAS_Q5, emit.wrap(["%d" % part for part in parts.ravel()])))
    rows = []
    for name, widen, farther in CASES:
        slope_q20 = np.rint(evidence.lattice() * widen).astype(np.int64)
        centre_q8 = to_q(evidence.CENTRE + [0, 0, farther], 8)
        depth_q8, state = evidence.make_scene(name, slope_q20, random)
        _, margin = places(slope_q20, depth_q8, state, from_q(centre_q8, 8))
        state = np.where(margin < 0.02, evidence.UNKNOWN, state)
        depth_q8 = np.where(state == evidence.SEEN, depth_q8, 0)
        place, _ = places(slope_q20, depth_q8, state, from_q(centre_q8, 8))
        spacing = spacing_mm(from_q(slope_q20, 20), from_q(centre_q8[2], 8) - evidence.ORIGIN[2])
        weight = min(1.0, spacing / CELL_MM)**2
        answer = weight * maps[place[place != NONE]].sum(axis=0)
        side = np.where(passes(slope_q20, from_q(centre_q8, 8))[0] < 0, -1, 1)
        by_ray = np.where((place != NONE)[:, None], steps[place], 0)
        move = weight * np.array([side @ by_ray[:, 0], *by_ray[:, 1:].sum(axis=0)]) * STEP_MM
        inc.raw("\nstatic const struct vector_ray vector_%s_rays[] = {\n%s};\n" % (
            name, emit.wrap(["{%d, %d, %d, %d, %d}" % r for r in zip(*slope_q20.T, depth_q8, state, place)])))
        rows.append('"%s", vector_%s_rays, {%d, %d, %d}, %s, {%s}, {%s}, %s' % (
            name, name, *centre_q8, emit.number(weight, 7), ", ".join(emit.numbers(answer, 5)),
            ", ".join(emit.numbers(move, 4)), emit.number(promise(parts, place, weight), 5)))
    inc.struct_array("vector_scene", "vector_scenes", rows)
    return inc.write(directory, "surroundings.inc")
