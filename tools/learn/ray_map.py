"""Where a ray is around a head, as in ih_surroundings; the moves: how far aside, below and behind a fitted centre the head's
is, by what is seen at each place, by least squares; and the promise: is there a head where none was fitted yet, by logistic
regression. The maps themselves are learnt with the score (model.py)."""

import numpy
import scipy.sparse

COLUMNS, ROWS, DEPTHS, MAPS = 3, 10, 8, 48  # as in ih_surroundings.h
UNKNOWN, SEEN, EMPTY = range(3)  # of a ray, as in ih_rays.h
PLACES = COLUMNS * ROWS * DEPTHS
CELL_MM, TOP_MM = 64.0, 384.0
ASIDE_CELLS = 6  # the last column is all from 128 mm on
ROW_OF_CELL = numpy.array([0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 8, 9, 9])
LIMITS_MM = numpy.array([-176, -96, -40, 40, 128, 200]) - 0.5
BITS, ZERO, WORD_MAPS = 4, 8, 8
# A view that ends: chances that it does so at a border, and between which cells or ranges of depth: from the chin (128 mm
# below the centre) down, from the temples (128 mm) outwards, to the forehead (64 mm above the centre), from 200 mm behind.
ENDS_BELOW, ENDS_ASIDE, ENDS_ABOVE, ENDS_BEHIND = 0.6, 0.25, 0.33, 0.4
ROWS_KEPT, COLUMNS_KEPT, ROWS_LOST, DEPTHS_KEPT = (7, 9), (2, 2), (1, 4), (6, 6)
ENDS_SEED = 5
PROMISE_RIDGE, PROMISE_PASSES = 100.0, 8
MOVE_RIDGE, MOVE_PASSES, MOVE_ROBUST_MM = 200.0, 5, 20.0
# Against differences of neighbours: how many rays fall into a cell is a matter of chance, and a head that moves by half a
# dot's distance should not be moved otherwise (tests/properties/prop_shift.c). Ten times as much would take most of the moves.
# What rays say aside of the centre, on its two sides, are no neighbours: a penalty there steadies little (experiment 038).
MOVE_SMOOTH = 600.0
MOVE_MAX = 127  # of a place, in steps
STEP_MAX_MM = 1  # as ih_surroundings.h has it


def ending_views(place):
    """The same detections in views that end nearer: under the chin or on the chest, close beside the head, above it or
    within it, and with nothing measured far behind. What is beyond is not known and asks nothing."""
    random = numpy.random.default_rng(ENDS_SEED)
    count = len(place)

    def border(chance, limits, without):
        low, high = limits
        return numpy.where(random.random(count) < chance, random.integers(low, high + 1, count), without)[:, None]

    row, column, range_of_depth = place // (COLUMNS * DEPTHS), place // DEPTHS % COLUMNS, place % DEPTHS
    beyond = (row >= border(ENDS_BELOW, ROWS_KEPT, ROWS)) | (column >= border(ENDS_ASIDE, COLUMNS_KEPT, COLUMNS))
    beyond |= row < border(ENDS_ABOVE, ROWS_LOST, 0)
    beyond |= (range_of_depth >= border(ENDS_BEHIND, DEPTHS_KEPT, DEPTHS)) & (range_of_depth < DEPTHS - 1)
    return numpy.where(beyond, -1, place).astype(place.dtype)


def counts_of(place, counting=None):
    """A row for each detection: how many of its rays ask at each place of a map; counting: as what each ray counts, if not 1."""
    row, slot = numpy.nonzero(place >= 0)
    each = numpy.ones(len(row), dtype=numpy.int32) if counting is None else counting[row, slot]
    return scipy.sparse.coo_matrix((each, (row, place[row, slot])), shape=(len(place), PLACES), dtype=numpy.int32).tocsr()


def needed_of(place, weight_q12, counting=None):
    """The same times the weight of each."""
    return (scipy.sparse.diags(weight_q12 / 4096) @ counts_of(place, counting)).astype(numpy.float32)


def answers(maps, place, weight_q12):
    """What ih_surroundings_ask_maps gives: a column for each map."""
    return ((counts_of(place) @ maps * weight_q12[:, None] + (1 << 3)) >> 4) / 256


def move_roughness():
    """Of moves by place: a form whose value is the sum of squared differences of neighbours. Nothing has none in depth."""
    index = numpy.arange(PLACES).reshape(ROWS, COLUMNS, DEPTHS)
    pairs = ((index[1:], index[:-1]), (index[:, 1:], index[:, :-1]), (index[..., 1:-1], index[..., :-2]))
    one, other = (numpy.concatenate([pair[side].ravel() for pair in pairs]) for side in (0, 1))
    difference = numpy.eye(PLACES)[one] - numpy.eye(PLACES)[other]
    return difference.T @ difference


def fit_moves(place, side, weight_q12, off_mm, importance):
    """Steps aside, down and away at each place, and a step's mm in Q12; off_mm: of every fitted centre, how far right of it,
    below and behind it the head's is; importance: how often each counts. What a ray says aside counts to its own side. Few that
    are far off do not decide: after a pass they weigh less."""
    to_both, to_side = needed_of(place, weight_q12), needed_of(place, weight_q12, side)
    penalty = MOVE_RIDGE * numpy.eye(PLACES) + MOVE_SMOOTH * move_roughness()
    weight = importance
    for _ in range(MOVE_PASSES):
        by_place_mm = numpy.empty((PLACES, 3))
        for needed, axes in ((to_side, slice(0, 1)), (to_both, slice(1, 3))):
            weighed = scipy.sparse.diags(weight) @ needed
            by_place_mm[:, axes] = numpy.linalg.solve((weighed.T @ needed).toarray() + penalty, weighed.T @ off_mm[:, axes])
        moved_mm = numpy.column_stack([to_side @ by_place_mm[:, 0], to_both @ by_place_mm[:, 1:]])
        far_mm = numpy.linalg.norm(off_mm - moved_mm, axis=1)
        weight = importance * numpy.minimum(1.0, MOVE_ROBUST_MM / numpy.maximum(far_mm, 1e-6))
    step_mm_q12 = numpy.ceil(abs(by_place_mm).max(axis=0) / MOVE_MAX * 4096).astype(int)
    if not ((step_mm_q12 > 0) & (step_mm_q12 <= STEP_MAX_MM << 12)).all():
        raise ValueError("steps of %s / 4096 mm: expected more than 0, at most %d mm" % (step_mm_q12, STEP_MAX_MM))
    return numpy.round(by_place_mm * 4096 / step_mm_q12).astype(int), step_mm_q12


def passes_around(rays, centre_mm):
    """A row for each centre: how far right of it and below it each ray of a trace (frames.read_rays) passes, at its depth."""
    away_mm = rays["origin_mm"] - centre_mm
    return away_mm[:, None, :2] - away_mm[:, 2, None, None] * rays["slope"]


def sides_around(rays, centre_mm):
    """On which side of each centre that is: -1 left, 1 right."""
    return numpy.where(passes_around(rays, centre_mm)[..., 0] < 0, -1, 1)


def places_around(rays, centre_mm):
    """A row for each centre: where each ray of a trace is in the maps, -1 where it asks nothing."""
    passes_mm = passes_around(rays, centre_mm)
    column, cell = abs(passes_mm[..., 0]) // CELL_MM, (passes_mm[..., 1] + TOP_MM) // CELL_MM
    depth = numpy.searchsorted(LIMITS_MM, rays["point_mm"][:, 2] - centre_mm[:, 2, None], side="right")
    depth = numpy.where(rays["state"] == EMPTY, DEPTHS - 1, depth)
    counted = (column < ASIDE_CELLS) & (cell >= 0) & (cell < len(ROW_OF_CELL)) & (rays["state"] != UNKNOWN)
    row = ROW_OF_CELL[numpy.clip(cell, 0, len(ROW_OF_CELL) - 1).astype(int)]
    place = (row * COLUMNS + numpy.minimum(column, COLUMNS - 1)) * DEPTHS + depth
    return numpy.where(counted, place, -1).astype(numpy.int16)


def fit_promise(place, weight, labels):
    """The bias and the part of each place, in Q5: log-odds of a label of 1. Newton's steps."""
    row, ray = numpy.nonzero(place >= 0)
    needed = scipy.sparse.coo_matrix((weight[row], (row, place[row, ray])), shape=(len(place), PLACES)).tocsr()
    needed = scipy.sparse.hstack([needed, numpy.ones((len(place), 1))]).tocsr()
    penalty = numpy.append(numpy.full(PLACES, PROMISE_RIDGE), 0.0)
    parts = numpy.zeros(PLACES + 1)
    for _ in range(PROMISE_PASSES):
        probability = 1 / (1 + numpy.exp(-numpy.clip(needed @ parts, -30, 30)))
        curvature = needed.T @ scipy.sparse.diags(probability * (1 - probability)) @ needed
        slope = needed.T @ (labels - probability) - penalty * parts
        parts += numpy.linalg.solve(curvature.toarray() + numpy.diag(penalty), slope)
    return int(round(parts[-1] * 32)), numpy.clip(numpy.round(parts[:-1] * 32), -127, 127).astype(int)


def packed(maps):
    """Words for each place, of as many maps as fit in one, the first map's number lowest."""
    by_word = (maps + ZERO).reshape(len(maps), -1, WORD_MAPS)
    return (by_word << BITS * numpy.arange(WORD_MAPS)).sum(axis=2)


def unpacked(words):
    """A row for each row of words."""
    numbers = (numpy.array(words)[..., None] >> BITS * numpy.arange(WORD_MAPS) & (1 << BITS) - 1) - ZERO
    return numbers.reshape(len(words), -1)


def write(path, maps, moves, promise, command):
    """The header that ih_surroundings.c includes."""
    steps, step_mm_q12 = moves
    bias_q5, parts_q5 = promise
    promise_lines = ["        %s," % ", ".join("%d" % part for part in cell) for cell in parts_q5.reshape(-1, DEPTHS)]
    move_lines = ["        %s," % ", ".join("{%d, %d, %d}" % tuple(step) for step in cell) for cell in steps.reshape(-1, DEPTHS, 3)]
    lines = []
    for place, words in enumerate(packed(maps)):
        if place % DEPTHS == 0:
            lines.append("    /* row %d, column %d */" % (place // DEPTHS // COLUMNS, place // DEPTHS % COLUMNS))
        lines.append("    {%s}," % ", ".join("0x%08xu" % word for word in words))
    with open(path, "w", encoding="utf-8") as file:
        file.write("""/* ih_surroundings_map - the maps of ih_surroundings, its moves and its promise, written by
 *     %s
 * Do not edit. Of each cell seven ranges of depth, the nearest first, then an empty ray: of the maps a line each, of the
 * moves and the promise in one line. */
#ifndef IH_SURROUNDINGS_MAP_H
#define IH_SURROUNDINGS_MAP_H

#include <stdint.h>

#include "detect/ih_surroundings.h"

/* clang-format off */
static const uint32_t surroundings_maps[IH_SURROUNDINGS_PLACES][IH_SURROUNDINGS_WORDS] = {
%s
};

static const struct ih_surroundings_moves surroundings_moves = {
    {%d, %d, %d},
    {
%s
    },
};

static const struct ih_surroundings_promise surroundings_promise = {
    %d,
    {
%s
    },
};
/* clang-format on */

#endif
""" % (command, "\n".join(lines), *step_mm_q12, "\n".join(move_lines), bias_q5, "\n".join(promise_lines)))
