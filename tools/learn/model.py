"""The score: curves of measures, and of weighted sums of measures and of what rays say (projection pursuit regression); and
its numbers as the firmware has them.

Maps, weights and curves are learnt at once, by gradients. Then maps and weights are rounded, and the curves go on learning."""

import dataclasses

import numpy

import ray_map

KNOTS = 7
MIDDLE = (KNOTS - 1) / 2
WEIGHT_BITS = 2  # behind the point, of a measure's weight in a sum
WEIGHT_MAX, AT_MAX_Q10, BIAS_MAX_Q10 = 127, 1 << 15, 1 << 18  # as ih_score.h has them
CLIPPED = 0.98  # this fraction of a map's numbers is within its range
UNIT_MIN = 1e-3  # of a knot's distance, as a map's number counts: of one that says nothing
EPOCHS, EPOCHS_ROUNDED, BATCH, RATE = 30, 6, 2048, 3e-3
DECAY = 1.0  # of maps and weights, by rate and step
BEND_PENALTY = 1e-5
DROPPED = 0.2  # fraction of what is asked that a step does not see, so that no place decides alone
MEAN, SQUARE = 0.9, 0.999  # memories of the steps (Adam)
SEED = 9


@dataclasses.dataclass
class Score:
    """first_q8, step_q8 (kinds: measures, then sums), at_q10 (kinds x KNOTS), bias_q10, maps (places x sums),
    weight_q2 (sums x measures): exactly what the firmware has."""

    first_q8: numpy.ndarray
    step_q8: numpy.ndarray
    at_q10: numpy.ndarray
    bias_q10: int
    maps: numpy.ndarray
    weight_q2: numpy.ndarray

    def parts(self, value_q8, kinds):
        """What the curves of these kinds say, and where on them the values are."""
        position = numpy.clip((value_q8 - self.first_q8[kinds]) / self.step_q8[kinds], 0, KNOTS - 1)
        knot = numpy.minimum(position.astype(int), KNOTS - 2)
        at_q10, kind = self.at_q10[kinds], numpy.arange(value_q8.shape[1])
        low, high = at_q10[kind, knot], at_q10[kind, knot + 1]
        return (low + (high - low) * (position - knot)) / 1024, position

    def logits(self, measure_q8, answer_q8):
        measures = measure_q8.shape[1]
        own, position = self.parts(measure_q8, slice(0, measures))
        sum_q8 = answer_q8 + position @ self.weight_q2.T * 2**(8 - WEIGHT_BITS)
        return own.sum(axis=1) + self.parts(sum_q8, slice(measures, None))[0].sum(axis=1) + self.bias_q10 / 1024


def make_knots(measures):
    """Equally spaced from the first to the 99th percentile of each kind, in Q8."""
    low, high = numpy.percentile(measures, [1, 99], axis=0)
    step = numpy.maximum(numpy.round((high - low) * 256 / (KNOTS - 1)), 1).astype(int)
    return numpy.round(low * 256).astype(int), step


def hats(position):
    """Columns of a model that is linear in what its curves have at each knot."""
    columns = numpy.maximum(0, 1 - numpy.abs(position[:, :, None] - numpy.arange(KNOTS)))
    return columns.reshape(len(position), -1).astype(numpy.float32)


class Learning:
    """What is learnt, and Adam's memories of its steps. The knots of a sum's curve are at -3 to 3; "zero" shifts the sum along
    them."""

    def __init__(self, measures, random):
        def drawn(size, *shape):
            return (size * random.standard_normal(shape)).astype(numpy.float32)

        sums = ray_map.MAPS
        valley = abs(numpy.arange(KNOTS) - MIDDLE) * numpy.sign(drawn(1, sums, 1))
        self.own = {"maps": drawn(0.05, ray_map.PLACES, sums), "weights": drawn(0.3, measures, sums), "zero": drawn(1, sums),
                    "curves": (drawn(0.1, sums, KNOTS) + 0.05 * valley).astype(numpy.float32),
                    "measures": drawn(0.01, measures * KNOTS), "bias": drawn(0, 1)}
        self.mean = {name: numpy.zeros_like(value) for name, value in self.own.items()}
        self.square = {name: numpy.zeros_like(value) for name, value in self.own.items()}
        self.steps = 0

    def forward(self, needed, position, by_knot):
        """Log-odds, and of each sum its knot, the part of the way to the next one, and the curve's slope there."""
        own = self.own
        at = needed @ own["maps"] + position @ own["weights"] + own["zero"] + numpy.float32(MIDDLE)
        within = (at > 0) & (at < KNOTS - 1)
        at = numpy.clip(at, 0, KNOTS - 1)
        knot = numpy.minimum(at.astype(int), KNOTS - 2)
        part, which = at - knot.astype(numpy.float32), numpy.arange(at.shape[1])
        low, high = own["curves"][which, knot], own["curves"][which, knot + 1]
        logits = (low + (high - low) * part).sum(axis=1) + by_knot @ own["measures"] + own["bias"]
        return numpy.clip(logits, -60, 60), knot, part, (high - low) * within

    def gradients(self, needed, position, by_knot, labels, importance):
        """Of the weighted cross entropy, and of the penalty on curves of sums that bend."""
        logits, knot, part, slope = self.forward(needed, position, by_knot)
        by_logit = (importance * (1 / (1 + numpy.exp(-logits)) - labels) / len(labels)).astype(numpy.float32)
        by_sum = by_logit[:, None] * slope
        curves = numpy.stack([by_logit @ ((knot == k) * (1 - part) + (knot == k - 1) * part) for k in range(KNOTS)], axis=1)
        bend = BEND_PENALTY * numpy.diff(self.own["curves"], 2, axis=1)
        for first, times in enumerate((1, -2, 1)):
            curves[:, first:first + KNOTS - 2] += times * bend
        return {"maps": needed.T @ by_sum, "weights": position.T @ by_sum, "zero": by_sum.sum(axis=0), "curves": curves,
                "measures": by_knot.T @ by_logit, "bias": by_logit.sum(keepdims=True)}

    def step(self, gradients, rate, names):
        self.steps += 1
        for name in names:
            self.mean[name] += (1 - MEAN) * (gradients[name] - self.mean[name])
            self.square[name] += (1 - SQUARE) * (gradients[name]**2 - self.square[name])
            size = numpy.sqrt(self.square[name] / (1 - SQUARE**self.steps)) + 1e-8
            decay = DECAY * self.own[name] if name in ("maps", "weights") else 0
            self.own[name] -= (rate * (self.mean[name] / (1 - MEAN**self.steps) / size + decay)).astype(numpy.float32)

    def learn(self, random, data, names, epochs, rate):
        """data: needed, and arrays with a row for each of its rows."""
        needed, *columns = data
        batches = max(1, len(columns[-1]) // BATCH)
        for epoch in range(epochs):
            order = random.permutation(len(columns[-1]))
            for i in range(batches):
                rows = order[i * BATCH:(i + 1) * BATCH]
                part = needed[rows]
                part.data = part.data * (random.random(len(part.data)) >= DROPPED).astype(numpy.float32) / (1 - DROPPED)
                done = (epoch + i / batches) / epochs
                self.step(self.gradients(part, *(column[rows] for column in columns)), rate * (1 + numpy.cos(numpy.pi * done)) / 2, names)

    def rounded(self):
        """Maps, weights, and of each sum how far apart its knots are, in Q8; what is learnt on goes on with the same."""
        unit = numpy.maximum(numpy.quantile(abs(self.own["maps"]), CLIPPED, axis=0) / (ray_map.ZERO - 1), UNIT_MIN)
        maps = numpy.clip(numpy.round(self.own["maps"] / unit), -ray_map.ZERO, ray_map.ZERO - 1).astype(int)
        step_q8 = numpy.maximum(numpy.round(256 / unit), 1).astype(int)
        weight_q2 = numpy.clip(numpy.round(self.own["weights"].T / 2 / unit[:, None] * 2**WEIGHT_BITS), -WEIGHT_MAX, WEIGHT_MAX).astype(int)
        self.own["maps"] = (maps * 256 / step_q8).astype(numpy.float32)
        self.own["weights"] = (2 * weight_q2.T * 2**(8 - WEIGHT_BITS) / step_q8).astype(numpy.float32)
        return maps, weight_q2, step_q8


def fit(measure_q8, place, weight_q12, labels, importance):
    """importance: how often each row counts."""
    random = numpy.random.default_rng(SEED)
    first_q8, step_q8 = make_knots(measure_q8 / 256)
    position = numpy.clip((measure_q8 - first_q8) / step_q8, 0, KNOTS - 1)
    learning = Learning(measure_q8.shape[1], random)
    data = (ray_map.needed_of(place, weight_q12), ((position - MIDDLE) / 2).astype(numpy.float32), hats(position), labels,
            (importance / importance.mean()).astype(numpy.float32))
    learning.learn(random, data, list(learning.own), EPOCHS, RATE)
    maps, weight_q2, sum_step_q8 = learning.rounded()
    learning.learn(random, data, ("zero", "curves", "measures", "bias"), EPOCHS_ROUNDED, RATE / 3)
    own = learning.own
    curves = numpy.concatenate([own["measures"].reshape(-1, KNOTS), own["curves"]])
    middle = curves.mean(axis=1, keepdims=True)
    bias_q10 = int(round((own["bias"][0] + middle.sum()) * 1024))
    at_q10 = numpy.round((curves - middle) * 1024).astype(int)
    if abs(at_q10).max() >= AT_MAX_Q10 or abs(bias_q10) >= BIAS_MAX_Q10:
        raise ValueError("curves up to %d and a bias of %d in Q10: expected less than %d and %d" % (abs(at_q10).max(), bias_q10, AT_MAX_Q10, BIAS_MAX_Q10))
    # The firmware weighs places from the first knot on.
    middle_q8 = MIDDLE * weight_q2.sum(axis=1) * 2**(8 - WEIGHT_BITS)
    sum_first_q8 = numpy.round(middle_q8 - (MIDDLE + own["zero"]) * sum_step_q8).astype(int)
    return Score(numpy.concatenate([first_q8, sum_first_q8]), numpy.concatenate([step_q8, sum_step_q8]),
                 at_q10, bias_q10, maps, weight_q2)


def listed(values):
    return ", ".join(str(value) for value in values)


def write(path, learnt, measures, command):
    """The header that ih_score.c includes; measures: their names."""
    rows = ["        {%d, %d, {%s}}, /* %s */" % (first, step, listed(at), name)
            for name, first, step, at in zip([*measures, *("map %d" % i for i in range(ray_map.MAPS))],
                                             learnt.first_q8, learnt.step_q8, learnt.at_q10)]
    weights = ["        {%s}," % listed(row) for row in learnt.weight_q2]
    with open(path, "w", encoding="utf-8") as file:
        file.write("""/* ih_score_weights - the curves and weights of ih_score, written by
 *     %s
 * Do not edit. */
#ifndef IH_SCORE_WEIGHTS_H
#define IH_SCORE_WEIGHTS_H

#include <stdint.h>

#include "detect/ih_evidence.h"
#include "detect/ih_score.h"

/* clang-format off */
static const struct ih_score_tables learnt = {
    .bias_q10 = %d,
    .curve = {
%s
    },
    /* a line for each map: of each measure, in the order of ih_evidence.h */
    .weight_q2 = {
%s
    },
};
/* clang-format on */

#endif
""" % (command, learnt.bias_q10, "\n".join(rows), "\n".join(weights)))
