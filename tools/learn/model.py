"""Logistic regression on piecewise linear curves, trees beside them, and the rounding to the firmware's numbers."""

import dataclasses

import numpy

KNOTS = 7
# As in ih_score.h.
QUESTIONS, TREES, BRANCHES, PLACES = 256, 150, 7, 32
SIZE_PENALTY = 1.0
STEP_PENALTY = 3.0
BEND_PENALTY = 10.0


@dataclasses.dataclass
class Curves:
    """first_q8, step_q8 (kinds), at_q10 (kinds x KNOTS), bias_q10; questions' kind, limit (QUESTIONS), trees' question
    (TREES x BRANCHES), leaf_q8 (TREES x BRANCHES + 1), or none of them: exactly what the firmware has."""

    first_q8: numpy.ndarray
    step_q8: numpy.ndarray
    at_q10: numpy.ndarray
    bias_q10: int
    kind: numpy.ndarray = None
    limit: numpy.ndarray = None
    question: numpy.ndarray = None
    leaf_q8: numpy.ndarray = None

    def position(self, evidence):
        return numpy.clip((evidence * 256 - self.first_q8) / self.step_q8, 0, KNOTS - 1)

    def places(self, evidence):
        """In parts of a knot's step; the firmware rounds a position to 16 bits first."""
        return numpy.floor(numpy.round(self.position(evidence) * 65536) * PLACES / 65536).astype(int)

    def leaves(self, evidence):
        """What the trees add."""
        yes, row = self.places(evidence)[:, self.kind] >= self.limit, numpy.arange(len(evidence))
        total = numpy.zeros(len(evidence))
        for question, leaf in zip(self.question, self.leaf_q8):
            at = numpy.zeros(len(evidence), dtype=int)
            for _ in range(3):
                at = 2 * at + 1 + yes[row, question[at]]
            total += leaf[at - BRANCHES] / 256
        return total

    def logits(self, evidence):
        position = self.position(evidence)
        knot = numpy.minimum(position.astype(int), KNOTS - 2)
        part = position - knot
        kind = numpy.arange(evidence.shape[1])
        low, high = self.at_q10[kind, knot], self.at_q10[kind, knot + 1]
        sums = ((low * (1 - part) + high * part).sum(axis=1) + self.bias_q10) / 1024
        return sums if self.kind is None else sums + self.leaves(evidence)


def make_knots(evidence):
    """Equally spaced from the first to the 99th percentile of each kind, in Q8."""
    low, high = numpy.percentile(evidence, [1, 99], axis=0)
    step = numpy.maximum(numpy.round((high - low) * 256 / (KNOTS - 1)), 1).astype(int)
    return numpy.round(low * 256).astype(int), step


def hats(evidence, first_q8, step_q8):
    """Columns of the linear model: KNOTS hat functions per kind, and a one."""
    position = numpy.clip((evidence * 256 - first_q8) / step_q8, 0, KNOTS - 1)
    columns = [numpy.maximum(0, 1 - numpy.abs(position - knot)) for knot in range(KNOTS)]
    design = numpy.stack(columns, axis=2).reshape(len(evidence), -1)
    return numpy.concatenate([design, numpy.ones((len(evidence), 1))], axis=1)


def penalty(kinds):
    one = numpy.eye(KNOTS)
    step = numpy.diff(one, axis=0)
    bend = numpy.diff(one, 2, axis=0)
    block = SIZE_PENALTY * one + STEP_PENALTY * step.T @ step + BEND_PENALTY * bend.T @ bend
    size = kinds * KNOTS + 1
    whole = numpy.zeros((size, size))
    for kind in range(kinds):
        at = slice(kind * KNOTS, (kind + 1) * KNOTS)
        whole[at, at] = block
    whole[-1, -1] = 1e-3
    return whole


def fit(evidence, labels, importance):
    """Newton's method on the penalised likelihood; importance: how often each row counts."""
    first_q8, step_q8 = make_knots(evidence)
    design = hats(evidence, first_q8, step_q8)
    smooth = penalty(evidence.shape[1])
    weights = numpy.zeros(design.shape[1])
    for _ in range(40):
        probability = 1 / (1 + numpy.exp(-design @ weights))
        slope = design.T @ (importance * (probability - labels)) + smooth @ weights
        spread = importance * probability * (1 - probability) + 1e-6
        change = numpy.linalg.solve((design * spread[:, None]).T @ design + smooth, slope)
        weights -= change * min(1, 5 / numpy.abs(design @ change).max())
        if numpy.abs(change).max() < 1e-5:
            break
    curves = weights[:-1].reshape(-1, KNOTS)
    middle = curves.mean(axis=1, keepdims=True)
    bias = weights[-1] + middle.sum()
    at_q10 = numpy.round((curves - middle) * 1024).astype(int)
    return Curves(first_q8, step_q8, at_q10, int(round(bias * 1024)))


def listed(values):
    return ", ".join(str(value) for value in values)


def write(path, learnt, kinds, command):
    """The header that ih_score.c includes."""
    rows = []
    for kind, first, step, at in zip(kinds, learnt.first_q8, learnt.step_q8, learnt.at_q10):
        rows.append("        [IH_EVIDENCE_%s] = {%d, %d, {%s}}," %
                    (kind.upper(), first, step, listed(at)))
    questions = ["{%d, %d}" % pair for pair in zip(learnt.kind, learnt.limit)]
    lines = ["        %s," % ", ".join(questions[i:i + 12]) for i in range(0, len(questions), 12)]
    trees = ["        {{%s}, {%s}}," % (listed(question), listed(leaf)) for question, leaf in zip(learnt.question, learnt.leaf_q8)]
    with open(path, "w", encoding="utf-8") as file:
        file.write("""/* ih_score_weights - the curves and trees of ih_score, written by
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
    /* kinds of evidence in the order of ih_evidence.h */
    .question = {
%s
    },
    .tree = {
%s
    },
};
/* clang-format on */

#endif
""" % (command, learnt.bias_q10, "\n".join(rows), "\n".join(lines), "\n".join(trees)))
