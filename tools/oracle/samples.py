"""A second, plain implementation of the choice of samples.

Depths are clipped before they are compared, so that two points on the far wall are neighbours
however far it is. Missing dots count as far points only where few of their neighbours are seen."""

import numpy as np

import emit
import rig as rigs
from rig import GRID, SLOTS, from_q, to_q

MISSING, SEEN, UNKNOWN = 0, 1, 2
REACH = 40
BRIGHT_U = 400  # the frame is over-exposed left of this
NOT_CLOSE_PX = 1.5


class Params:
    isolated_mm, clip_behind_mm, clip_min_mm = 60, 400, 1100
    fill_neighbours, fill_root_weight_q15 = 3, 17948


def around(values, row, column, reach):
    """Values of the square around a slot without itself."""
    rows = slice(max(0, row - reach), row + reach + 1)
    columns = slice(max(0, column - reach), column + reach + 1)
    keep = np.ones(values.shape, bool)
    keep[row, column] = False
    return values[rows, columns][keep[rows, columns]]


def select(rig, field_q28, x, y, depth_mm, state, bright, params):
    """Rows (slot, x, y, depth, root weight) and the counters."""
    seen = (state == SEEN).reshape(GRID, GRID)
    ordered = np.sort(depth_mm[state == SEEN])
    low = ordered[len(ordered) * 8 // 100] if len(ordered) else 0
    clip = max(low + params.clip_behind_mm, params.clip_min_mm)
    depth = np.where(seen, np.minimum(depth_mm.reshape(GRID, GRID), clip), np.nan)
    rows, count = [], dict(seen=0, filled=0, isolated=0, outside=0)
    for slot in range(SLOTS):
        row, column = divmod(slot, GRID)
        near = around(depth, row, column, 1)
        near = near[np.isfinite(near)]
        if state[slot] == SEEN:
            alike = np.abs(near - depth[row, column]) <= params.isolated_mm
            if len(near) >= 3 and alike.sum() <= 1:
                count["isolated"] += 1
                continue
            kind, position, z, weight = "seen", (x[slot], y[slot]), depth[row, column], 32768
        elif state[slot] == MISSING and len(near) < params.fill_neighbours \
                and params.fill_root_weight_q15:
            z = clip
            position = rig.dot_at(slot, z)
            u, v = rig.distort(*position)
            edges = np.array([u, v, rig.width - 1 - u, rig.height - 1 - v, u - BRIGHT_U])
            if np.abs(edges).min() < NOT_CLOSE_PX:
                raise ValueError("slot %d is too close to an edge to be a clear case" % slot)
            if edges[:4].min() < 0 or (bright and u < BRIGHT_U):
                continue
            kind, weight = "filled", params.fill_root_weight_q15
        else:
            continue
        at = (np.array(position) - from_q(field_q28[:2], 28)) / from_q(field_q28[2], 28)
        if np.abs(at).max() >= REACH:
            count["outside"] += 1
            continue
        count[kind] += 1
        rows.append((slot, at[0], at[1], z, weight))
    nearest = min([r[3] for r in rows if r[4] == 32768], default=None)
    return rows, count, nearest, clip


def scene(random, missing, spread, reach):
    """Points of a head before a wall with gross outliers and holes."""
    index = np.arange(SLOTS)
    row, column = index // GRID - 9, index % GRID - 9
    depth = np.where((column / 3.5)**2 + ((row + 2) / 5)**2 < 1, 850.0, 1500.0)
    depth += random.normal(0, spread, SLOTS)
    wild = random.uniform(size=SLOTS) < 0.08
    depth[wild] = random.uniform(420, 2550, wild.sum())
    # Holes of several slots and single ones
    state = np.where(random.uniform(size=SLOTS) < missing, MISSING, SEEN)
    r0, c0 = random.integers(-9, 6, 2)
    state[(row >= r0) & (row < r0 + 5) & (column >= c0) & (column < c0 + 4)] = MISSING
    state[random.uniform(size=SLOTS) < 0.03] = UNKNOWN
    x = column * 0.03 * reach + random.uniform(-0.003, 0.003, SLOTS)
    y = row * 0.03 * reach + random.uniform(-0.003, 0.003, SLOTS)
    return to_q(x, 28), to_q(y, 28), np.where(state == SEEN, to_q(depth, 8), 0), state


def write_vectors(directory):
    inc = emit.Inc("Points of a 19x19 table, and the samples that they give.")
    rig = rigs.paper()
    field_q28 = to_q([0.002, -0.001, 0.015], 28)
    rows = []
    inc.raw("\nstatic const struct ih_field vector_field = {%d, %d, %d};\n" % tuple(field_q28))
    inc.raw("#define VECTOR_BRIGHT_U %d\n" % BRIGHT_U)
    for index, (missing, spread, reach, bright) in enumerate(
            [(0.1, 15, 1, False), (0.3, 40, 1, True), (0.6, 20, 1, False), (0.9, 20, 1, True),
             (0.2, 25, 2.5, False), (1, 1, 1, True)]):
        seed = 100 * index
        while True:  # until no case is a matter of rounding
            random = np.random.default_rng(seed)
            x, y, depth, state = scene(random, missing, spread, reach)
            try:
                found = select(rig, field_q28, from_q(x, 28), from_q(y, 28), from_q(depth, 8),
                               state, bright, Params)
                break
            except ValueError:
                seed += 1
        chosen, count, nearest, clip = found
        points = ["{%d, %d, %d, %d}" % p for p in zip(x, y, depth, state)]
        inc.raw("\nstatic const struct ih_point vector_%d_points[] = {\n%s};\n"
                % (index, emit.wrap(points)))
        samples = ["{%d, %s, %d}" % (s[0], ", ".join(emit.numbers(s[1:4], 6)), s[4])
                   for s in chosen]
        inc.raw("\nstatic const struct vector_sample vector_%d_samples[] = {\n%s};\n"
                % (index, emit.wrap(samples or ["{0, 0, 0, 0, 0}"])))
        rows.append("vector_%d_points, %d, %d, %d, %d, %d, %d, %s, %s, vector_%d_samples" % (
            index, bright, len(chosen), count["seen"], count["filled"], count["isolated"],
            count["outside"], emit.number(nearest or 0, 6), emit.number(clip, 6), index))
    inc.struct_array("vector_choice", "vector_choices", rows)
    return inc.write(directory, "samples.inc")
