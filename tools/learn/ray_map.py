"""The maps of ih_surroundings: what a ray says at its place around a head.

All maps are learnt at once, as a part of the first layer of a small network, which has their answers and the other
evidence before it. The rest of the network is thrown away: curves and trees are learnt behind the maps.

And the moves: how far below and behind a fitted centre the head's is, by what is seen at each place; by least squares.
And the promise: is there a head where none was fitted yet, by logistic regression."""

import numpy
import scipy.sparse

COLUMNS, ROWS, DEPTHS, MAPS = 6, 13, 10, 8  # as in ih_surroundings.h
UNKNOWN, SEEN, EMPTY = range(3)  # of a ray, as in ih_rays.h
PLACES = COLUMNS * ROWS * DEPTHS
BITS, ZERO = 4, 8
CLIPPED = 0.98  # this fraction of a map's numbers is within its range
HIDDEN = 32
EPOCHS, BATCH, RATE = 20, 2048, 3e-3
DECAY = 0.3  # of weights, by rate and step
DROPPED = 0.2  # fraction of what is asked that a step does not see, so that no place decides alone
MEAN, SQUARE = 0.9, 0.999  # memories of the steps (Adam)
# A view that ends: chances that it does so at a border, and between which cells or ranges of depth: from the chin (128 mm
# below the centre) down, from the temples (128 mm) outwards, to the forehead (64 mm above the centre), from 200 mm behind.
ENDS_BELOW, ENDS_ASIDE, ENDS_ABOVE, ENDS_BEHIND = 0.75, 0.5, 0.4, 0.4
ROWS_KEPT, COLUMNS_KEPT, ROWS_LOST, DEPTHS_KEPT = (8, ROWS), (2, COLUMNS), (0, 5), (7, 8)
ENDS_SEED = 5
COARSE_COLUMNS = 3  # the last one is all that are farther aside
COARSE_PLACES = COARSE_COLUMNS * ROWS * DEPTHS
CELL_MM, TOP_MM = 64.0, 384.0
LIMITS_MM = numpy.array([-256, -176, -96, -40, 40, 128, 200, 304]) - 0.5
PROMISE_RIDGE, PROMISE_PASSES = 100.0, 8
MOVE_RIDGE, MOVE_PASSES, MOVE_ROBUST_MM = 300.0, 5, 20.0
# Against differences of neighbours: how many rays fall into a cell is a matter of chance, and a head that moves by half a
# dot's distance should not be moved otherwise.
MOVE_SMOOTH = 8000.0
STEP_MAX_MM = 8  # as ih_surroundings.h has it
QUANTILES = 65  # evidence is given to the network by its rank
SEED = 9


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


def counts_of(place):
    """A row for each detection: how many of its rays ask at each place of a map."""
    row, slot = numpy.nonzero(place >= 0)
    ones = numpy.ones(len(row), dtype=numpy.int32)
    return scipy.sparse.coo_matrix((ones, (row, place[row, slot])), shape=(len(place), PLACES)).tocsr()


def needed_of(place, weight_q12):
    """The same times the weight of each."""
    return (scipy.sparse.diags(weight_q12 / 4096) @ counts_of(place)).astype(numpy.float32)


def ranks(evidence):
    """Of each kind, from -1.5 to 1.5."""
    columns = []
    for values in evidence.T:
        limits = numpy.unique(numpy.quantile(values, numpy.linspace(0, 1, QUANTILES)))
        columns.append(numpy.interp(values, limits, numpy.linspace(-1.5, 1.5, len(limits))))
    return numpy.stack(columns, axis=1).astype(numpy.float32)


class Network:
    """Maps, two layers behind them, and the steps of Adam."""

    def __init__(self, kinds, random):
        def drawn(size, *shape):
            return (size * random.standard_normal(shape)).astype(numpy.float32)

        self.kinds = kinds
        self.weights = {"maps": drawn(0.05, PLACES, MAPS), "first": drawn(0.2, kinds + MAPS, HIDDEN),
                        "second": drawn(0.2, HIDDEN, HIDDEN), "last": drawn(0.1, HIDDEN),
                        "first_bias": drawn(0, HIDDEN), "second_bias": drawn(0, HIDDEN), "last_bias": drawn(0, 1)}
        self.mean = {name: numpy.zeros_like(value) for name, value in self.weights.items()}
        self.square = {name: numpy.zeros_like(value) for name, value in self.weights.items()}
        self.steps = 0

    def gradients(self, needed, ranked, labels, importance):
        """Of the weighted cross entropy."""
        own = self.weights
        seen = numpy.concatenate([ranked, needed @ own["maps"]], axis=1)
        first = numpy.maximum(seen @ own["first"] + own["first_bias"], 0)
        second = numpy.maximum(first @ own["second"] + own["second_bias"], 0)
        logits = numpy.clip(second @ own["last"] + own["last_bias"], -60, 60)
        by_logit = (importance * (1 / (1 + numpy.exp(-logits)) - labels) / len(labels)).astype(numpy.float32)
        by_second = numpy.outer(by_logit, own["last"]) * (second > 0)
        by_first = (by_second @ own["second"].T) * (first > 0)
        return {"maps": needed.T @ (by_first @ own["first"][self.kinds:].T),
                "first": seen.T @ by_first, "first_bias": by_first.sum(axis=0),
                "second": first.T @ by_second, "second_bias": by_second.sum(axis=0),
                "last": second.T @ by_logit, "last_bias": by_logit.sum(keepdims=True)}

    def step(self, gradients, rate):
        self.steps += 1
        for name, gradient in gradients.items():
            self.mean[name] += (1 - MEAN) * (gradient - self.mean[name])
            self.square[name] += (1 - SQUARE) * (gradient * gradient - self.square[name])
            size = numpy.sqrt(self.square[name] / (1 - SQUARE ** self.steps)) + 1e-8
            decay = DECAY * self.weights[name] if self.weights[name].ndim == 2 else 0
            self.weights[name] -= rate * (self.mean[name] / (1 - MEAN ** self.steps) / size + decay)


def fit(evidence, place, weight_q12, labels, importance):
    """The maps, PLACES times MAPS numbers of BITS bits; evidence: all that is beside them."""
    random = numpy.random.default_rng(SEED)
    needed, ranked, importance = needed_of(place, weight_q12), ranks(evidence), importance / importance.mean()
    network = Network(evidence.shape[1], random)
    batches = max(1, len(labels) // BATCH)
    for epoch in range(EPOCHS):
        order = random.permutation(len(labels))
        for i in range(batches):
            rows = order[i * BATCH:(i + 1) * BATCH]
            part = needed[rows]
            part.data = part.data * (random.random(len(part.data)) >= DROPPED).astype(numpy.float32) / (1 - DROPPED)
            done = (epoch + i / batches) / EPOCHS
            network.step(network.gradients(part, ranked[rows], labels[rows], importance[rows]),
                         RATE * (1 + numpy.cos(numpy.pi * done)) / 2)
    maps = network.weights["maps"]
    step = numpy.quantile(numpy.abs(maps), CLIPPED, axis=0) / (ZERO - 1)
    return numpy.clip(numpy.round(maps / step), -ZERO, ZERO - 1).astype(int)


def answers(maps, place, weight_q12):
    """What ih_surroundings_ask_maps gives: a column for each map."""
    return ((counts_of(place) @ maps * weight_q12[:, None] + (1 << 3)) >> 4) / 256


def coarse_places():
    """Of each place of the maps that of the coarse ones."""
    place = numpy.arange(PLACES)
    column = numpy.minimum(place // DEPTHS % COLUMNS, COARSE_COLUMNS - 1)
    return (place // (COLUMNS * DEPTHS) * COARSE_COLUMNS + column) * DEPTHS + place % DEPTHS


def move_roughness():
    """Of moves by place: a form whose value is the sum of squared differences of neighbours. Nothing has none in depth."""
    index = numpy.arange(COARSE_PLACES).reshape(ROWS, COARSE_COLUMNS, DEPTHS)
    pairs = ((index[1:], index[:-1]), (index[:, 1:], index[:, :-1]), (index[..., 1:-1], index[..., :-2]))
    one, other = (numpy.concatenate([pair[side].ravel() for pair in pairs]) for side in (0, 1))
    difference = numpy.eye(COARSE_PLACES)[one] - numpy.eye(COARSE_PLACES)[other]
    return difference.T @ difference


def fit_moves(place, weight_q12, off_mm):
    """Steps down and away at each place of the moves, and a step's mm in Q8; off_mm: of every fitted centre, how far
    below and behind it the head's is. Few that are far off do not decide: after a pass they weigh less."""
    gathered = scipy.sparse.coo_matrix((numpy.ones(PLACES), (numpy.arange(PLACES), coarse_places()))).tocsr()
    needed = (needed_of(place, weight_q12).astype(float) @ gathered).tocsr()
    penalty = MOVE_RIDGE * numpy.eye(COARSE_PLACES) + MOVE_SMOOTH * move_roughness()
    weight = numpy.ones(len(off_mm))
    for _ in range(MOVE_PASSES):
        weighed = scipy.sparse.diags(weight) @ needed
        by_place_mm = numpy.linalg.solve((weighed.T @ needed).toarray() + penalty, weighed.T @ off_mm)
        left_mm = numpy.linalg.norm(off_mm - needed @ by_place_mm, axis=1)
        weight = numpy.minimum(1.0, MOVE_ROBUST_MM / numpy.maximum(left_mm, 1e-6))
    step_mm_q8 = numpy.round(numpy.quantile(numpy.abs(by_place_mm), CLIPPED, axis=0) / (ZERO - 1) * 256).astype(int)
    if not ((step_mm_q8 > 0) & (step_mm_q8 <= STEP_MAX_MM << 8)).all():
        raise ValueError("steps of %s / 256 mm: expected more than 0, at most %d mm" % (step_mm_q8, STEP_MAX_MM))
    return numpy.clip(numpy.round(by_place_mm * 256 / step_mm_q8), -ZERO, ZERO - 1).astype(int), step_mm_q8


def coarse_places_around(rays, centre_mm):
    """A row for each centre: where each ray of a trace (frames.read_rays) is in the coarse maps, -1 where it asks nothing."""
    away_mm = rays["origin_mm"] - centre_mm
    passes_mm = away_mm[:, None, :2] - away_mm[:, 2, None, None] * rays["slope"]
    column, row = abs(passes_mm[..., 0]) // CELL_MM, (passes_mm[..., 1] + TOP_MM) // CELL_MM
    depth = numpy.searchsorted(LIMITS_MM, rays["point_mm"][:, 2] - centre_mm[:, 2, None], side="right")
    depth = numpy.where(rays["state"] == EMPTY, DEPTHS - 1, depth)
    counted = (column < COLUMNS) & (row >= 0) & (row < ROWS) & (rays["state"] != UNKNOWN)
    place = (row * COARSE_COLUMNS + numpy.minimum(column, COARSE_COLUMNS - 1)) * DEPTHS + depth
    return numpy.where(counted, place, -1).astype(numpy.int16)


def fit_promise(place, weight, labels):
    """The bias and the part of each place, in Q5: log-odds of a label of 1. Newton's steps."""
    row, ray = numpy.nonzero(place >= 0)
    needed = scipy.sparse.coo_matrix((weight[row], (row, place[row, ray])), shape=(len(place), COARSE_PLACES)).tocsr()
    needed = scipy.sparse.hstack([needed, numpy.ones((len(place), 1))]).tocsr()
    penalty = numpy.append(numpy.full(COARSE_PLACES, PROMISE_RIDGE), 0.0)
    parts = numpy.zeros(COARSE_PLACES + 1)
    for _ in range(PROMISE_PASSES):
        probability = 1 / (1 + numpy.exp(-numpy.clip(needed @ parts, -30, 30)))
        curvature = needed.T @ scipy.sparse.diags(probability * (1 - probability)) @ needed
        slope = needed.T @ (labels - probability) - penalty * parts
        parts += numpy.linalg.solve(curvature.toarray() + numpy.diag(penalty), slope)
    return int(round(parts[-1] * 32)), numpy.clip(numpy.round(parts[:-1] * 32), -127, 127).astype(int)


def packed(maps):
    """A word for each place, the first map's number lowest."""
    return ((maps + ZERO) << BITS * numpy.arange(maps.shape[1])).sum(axis=1)


def unpacked(words, count=MAPS):
    return (numpy.array(words)[:, None] >> BITS * numpy.arange(count) & (1 << BITS) - 1) - ZERO


def write(path, maps, moves, promise, command):
    """The header that ih_surroundings.c includes: a line for a cell, its ranges of depth from near to far, then nothing."""
    steps, step_mm_q8 = moves
    bias_q5, parts_q5 = promise
    promise_lines = ["        %s," % ", ".join("%d" % part for part in cell) for cell in parts_q5.reshape(-1, DEPTHS)]
    move_lines = ["        %s," % ", ".join("0x%02x" % byte for byte in cell) for cell in packed(steps).reshape(-1, DEPTHS)]
    lines = []
    for row, cells in enumerate(packed(maps).reshape(ROWS, COLUMNS, DEPTHS)):
        lines.append("    /* row %d */" % row)
        lines += ["    %s," % ", ".join("0x%08xu" % word for word in cell) for cell in cells]
    with open(path, "w", encoding="utf-8") as file:
        file.write("""/* ih_surroundings_map - the maps of ih_surroundings, its moves and its promise, written by
 *     %s
 * Do not edit. A line is a cell: its nine ranges of depth, the nearest first, then an empty ray. */
#ifndef IH_SURROUNDINGS_MAP_H
#define IH_SURROUNDINGS_MAP_H

#include <stdint.h>

#include "detect/ih_surroundings.h"

/* clang-format off */
static const uint32_t surroundings_maps[IH_SURROUNDINGS_PLACES] = {
%s
};

static const struct ih_surroundings_moves surroundings_moves = {
    {%d, %d},
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
""" % (command, "\n".join(lines), *step_mm_q8, "\n".join(move_lines), bias_q5, "\n".join(promise_lines)))
