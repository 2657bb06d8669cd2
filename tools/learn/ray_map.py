"""The map of ih_surroundings: what a ray says at its place around a head, learnt together with the curves."""

import numpy
import scipy.optimize
import scipy.sparse

import model

COLUMNS, ROWS, DEPTHS = 6, 13, 10  # as in ih_surroundings.h
PLACES = COLUMNS * ROWS * DEPTHS
RANGES = DEPTHS - 1  # of depth; the last place is a ray that met nothing, which has no neighbour in depth
SIZE_PENALTY = 30.0
CELL_PENALTY, DEPTH_PENALTY = 300.0, 150.0
STEPS = 200


def needed_of(place, weight_q12):
    """A row for each detection: how much its rays ask at each place of the map."""
    row, slot = numpy.nonzero(place >= 0)
    return scipy.sparse.coo_matrix((weight_q12[row] / 4096, (row, place[row, slot])),
                                   shape=(len(place), PLACES)).tocsr()


def penalty():
    index = numpy.arange(PLACES).reshape(ROWS, COLUMNS, DEPTHS)
    whole = SIZE_PENALTY * scipy.sparse.identity(PLACES, format="csr")
    for low, high, weight in ((index[1:], index[:-1], CELL_PENALTY), (index[:, 1:], index[:, :-1], CELL_PENALTY),
                              (index[:, :, 1:RANGES], index[:, :, :RANGES - 1], DEPTH_PENALTY)):
        rows = numpy.arange(low.size)
        step = scipy.sparse.coo_matrix(
            (numpy.repeat([1.0, -1.0], low.size), (numpy.tile(rows, 2), numpy.append(low.ravel(), high.ravel()))),
            shape=(low.size, PLACES)).tocsr()
        whole = whole + weight * (step.T @ step)
    return whole


def fit(evidence, place, weight_q12, labels, importance):
    """The map, PLACES numbers of 8 bits in Q9: with curves beside it, so that neither says what the other has said."""
    first_q8, step_q8 = model.make_knots(evidence)
    design, curves = model.hats(evidence, first_q8, step_q8), model.penalty(evidence.shape[1])
    rays, smooth = needed_of(place, weight_q12), penalty()

    def loss(weights):
        own, others = weights[:PLACES], weights[PLACES:]
        logits = rays @ own + design @ others
        stiff, bent = smooth @ own, curves @ others
        slope = importance * (1 / (1 + numpy.exp(-logits)) - labels)
        value = (importance * (numpy.logaddexp(0, logits) - labels * logits)).sum() + (own @ stiff + others @ bent) / 2
        return value, numpy.append(rays.T @ slope + stiff, design.T @ slope + bent)

    start = numpy.zeros(PLACES + design.shape[1])
    found = scipy.optimize.minimize(loss, start, jac=True, method="L-BFGS-B", options={"maxiter": STEPS})
    return numpy.clip(numpy.round(512 * found.x[:PLACES]), -128, 127).astype(int)


def logits(map_q9, place, weight_q12):
    """What ih_surroundings_logit_q8 gives, in log-odds."""
    sums_q9 = numpy.where(place >= 0, map_q9[place], 0).sum(axis=1)
    return ((sums_q9 * weight_q12 + (1 << 12)) >> 13) / 256


def write(path, map_q9, command):
    """The header that ih_surroundings.c includes: a line for a cell, its ranges of depth from near to far, then nothing."""
    lines = []
    for row, cells in enumerate(map_q9.reshape(ROWS, COLUMNS, DEPTHS)):
        lines.append("    /* row %d */" % row)
        lines += ["    %s," % ", ".join(str(value) for value in cell) for cell in cells]
    with open(path, "w", encoding="utf-8") as file:
        file.write("""/* ih_surroundings_map - the map of ih_surroundings, written by
 *     %s
 * Do not edit. A line is a cell: its nine ranges of depth, the nearest first, then an empty ray. */
#ifndef IH_SURROUNDINGS_MAP_H
#define IH_SURROUNDINGS_MAP_H

#include <stdint.h>

#include "detect/ih_surroundings.h"

/* clang-format off */
static const int8_t surroundings_map_q9[IH_SURROUNDINGS_PLACES] = {
%s
};
/* clang-format on */

#endif
""" % (command, "\n".join(lines)))
