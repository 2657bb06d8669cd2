#!/usr/bin/env python3
"""Learn where heads look (ih_pose_table.h of firmware/core/pose) from the points that tools/people/cast.py has cast.

learn_pose.py [--out DIR] FILE...

Multinomial logistic regression with a penalty on lines and squares of the features of tools/oracle/pose.py: a mean head
for each direction, all learnt together. Heads are seen as they were, and again with their size, centre, depths and missing
dots changed; a head's mirror image says the mirrored. What is to be said is a distribution: the true yaw within 9 degrees, the
true pitch within 5. Weights are rounded to the firmware's formats at the end.
"""

import argparse
import os
import sys

import numpy
import scipy.optimize

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, os.path.join(ROOT, "tools", "oracle"))

import pose  # noqa: E402

STEPS, BATCH, CHANGED = 300, 4096, 3
PENALTY = 1e-4
YAW_SIGMA_DEG, PITCH_SIGMA_DEG = 9.0, 5.0
YAW_DEG = (numpy.arange(pose.YAWS) + 0.5) * 360.0 / pose.YAWS - 180.0
PITCH_DEG = (numpy.arange(pose.PITCHES) - pose.PITCHES // 2) * 10.0
LOG2_E = numpy.log2(numpy.e)
LINE = 16


def wrap(degrees):
    return (degrees + 180.0) % 360.0 - 180.0


def load(paths):
    parts = [numpy.load(path) for path in paths]
    return {key: numpy.concatenate([part[key] for part in parts]) for key in parts[0].files}


def look(cast, rng=None):
    """Features; with a generator of heads that differ a little."""
    centre, points = cast["centre_mm"], cast["points_mm"].astype(float)
    seen = cast["seen"].astype(bool)
    place, distance = pose.in_plane(points, centre)
    sigma = pose.sigma_of(distance, cast["length_px_mm"])
    if rng is not None:
        count = len(centre)
        noise = rng.standard_normal(seen.shape) * (sigma * rng.uniform(0.0, 0.5, count))[:, None]
        shift, size = rng.normal(0.0, (4.0, 6.0, 4.0), (count, 3)), rng.normal(1.0, 0.04, (count, 3))
        ahead = points / points[..., 2:].clip(1.0)
        place = [(values + noise * ahead[..., axis] - shift[:, axis, None]) * size[:, axis, None]
                 for axis, values in enumerate(place)]
        seen = seen & (rng.random(seen.shape) > rng.choice([0.0, 0.1], count)[:, None])
    return pose.features_in_plane(place, seen, distance, sigma, 2.0 * cast["unit"] * distance,
                                  (centre[:, 1], cast["semi_mm"])).astype(numpy.float32)


def wanted(yaw, pitch):
    rows = [numpy.exp(-0.5 * (wrap(yaw[:, None] - YAW_DEG) / YAW_SIGMA_DEG) ** 2),
            numpy.exp(-0.5 * ((numpy.clip(pitch, PITCH_DEG[0], PITCH_DEG[-1])[:, None] - PITCH_DEG) / PITCH_SIGMA_DEG) ** 2)]
    return numpy.concatenate([row / row.sum(axis=1, keepdims=True) for row in rows], axis=1).astype(numpy.float32)


def probabilities(logits):
    out = []
    for part in (logits[:, :pose.YAWS], logits[:, pose.YAWS:]):
        power = numpy.exp(part - part.max(axis=1, keepdims=True))
        out.append(power / power.sum(axis=1, keepdims=True))
    return numpy.concatenate(out, axis=1)


def learn(given, want):
    """Weights (MEANS, 2 FEATURES) of lines and squares, and biases (MEANS,). What a mirrored head says is mirrored: a feature and
    its twin on the other side become their sum, which is the same for both, and their difference."""
    order, half = numpy.concatenate([pose.mirror(), pose.FEATURES + pose.mirror()]), pose.YAWS // 2
    given = numpy.concatenate([given, given * given], axis=1)
    middle, left = numpy.flatnonzero(order == numpy.arange(order.size)), numpy.flatnonzero(order > numpy.arange(order.size))
    root = numpy.float32(numpy.sqrt(0.5))
    both = numpy.concatenate([numpy.ones((len(given), 1), numpy.float32), given[:, middle],
                              root * (given[:, left] + given[:, order[left]])], axis=1)
    apart = root * (given[:, left] - given[:, order[left]])
    shapes = (pose.MEANS, both.shape[1]), (half, apart.shape[1])

    def parts(values):
        cut = shapes[0][0] * shapes[0][1]
        return values[:cut].reshape(shapes[0]), values[cut:].reshape(shapes[1])

    def loss(values):
        weights = [part.astype(numpy.float32) for part in parts(values)]
        slopes = [PENALTY * part for part in parts(values.copy())]
        slopes[0][:, 0] = 0.0
        value = 0.5 * sum((slope * part).sum() for slope, part in zip(slopes, parts(values)))
        for first in range(0, len(given), BATCH):
            rows = slice(first, first + BATCH)
            same, opposed = both[rows] @ weights[0].T, apart[rows] @ weights[1].T
            said = probabilities(numpy.concatenate([same[:, :half] + opposed, (same[:, :half] - opposed)[:, ::-1], same[:, half:]], axis=1))
            value -= (want[rows] * numpy.log(said + 1e-12)).sum() / len(given)
            error = (said - want[rows]) / len(given)
            one, other = error[:, :half], error[:, pose.YAWS - 1:half - 1:-1]
            slopes[0] += numpy.concatenate([one + other, error[:, pose.YAWS:]], axis=1).T @ both[rows]
            slopes[1] += (one - other).T @ apart[rows]
        return float(value), numpy.concatenate([slope.ravel() for slope in slopes])

    found = scipy.optimize.minimize(loss, numpy.zeros(sum(rows * columns for rows, columns in shapes)), jac=True,
                                    method="L-BFGS-B", options={"maxiter": STEPS, "maxcor": 20})
    same, opposed = parts(found.x)
    bias, same = same[:, 0], same[:, 1:]
    opposed = numpy.concatenate([opposed, numpy.zeros((pose.PITCHES, opposed.shape[1]))])
    weights = numpy.zeros((pose.MEANS, order.size))
    weights[:, middle] = same[:, :middle.size]
    weights[:, left] = root * (same[:, middle.size:] + opposed)
    weights[:, order[left]] = root * (same[:, middle.size:] - opposed)
    return weights, bias


def priors(yaw, pitch):
    return wanted(numpy.concatenate([yaw, -yaw]), numpy.concatenate([pitch, pitch])).mean(axis=0)


def rounded(weights, bias, prior):
    """The firmware's numbers: logarithms to the base of 2, against the prior."""
    whole = numpy.clip(numpy.rint(weights * LOG2_E * 2 ** 5), -127, 127).astype(int)
    prior = numpy.concatenate([prior[:pose.YAWS // 2], prior[pose.YAWS:]])
    return whole, numpy.rint((bias * LOG2_E - numpy.log2(prior)) * 2 ** 10).astype(int)


def table(weights, bias, prior, command):
    def lines(values, indent):
        texts = ["%d" % value for value in values]
        return ",\n".join(indent + ", ".join(texts[i:i + LINE]) for i in range(0, len(texts), LINE))

    def rows(values):
        return "".join("        {\n%s},\n" % lines(row, " " * 12) for row in values)

    return ("/* ih_pose_table - the mean heads of ih_pose_look and what they were learnt from, written by\n *     %s\n * Do not edit. */\n"
            "#ifndef IH_POSE_TABLE_H\n#define IH_POSE_TABLE_H\n\n#include \"pose/ih_pose_look.h\"\n\n/* clang-format off */\n"
            "const uint16_t ih_pose_prior_q16[IH_POSE_OUTPUTS] = {\n%s};\n\n"
            "const struct ih_pose_means ih_pose_means = {\n    .line_q5 = {\n%s    },\n    .square_q5 = {\n%s    },\n"
            "    .bias_q10 = {\n%s},\n};\n/* clang-format on */\n\n#endif\n" % (
                command, lines(numpy.rint(prior * 65536).astype(int), "    "), rows(weights[:, :pose.FEATURES]),
                rows(weights[:, pose.FEATURES:]), lines(bias, " " * 8)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", help="of tools/people/cast.py")
    parser.add_argument("--out", default=os.path.join(ROOT, "firmware", "core", "pose"))
    options = parser.parse_args()
    cast, rng = load(options.files), numpy.random.default_rng(1)
    centre = cast["centre_mm"]
    yaw = wrap(cast["yaw_deg"] + numpy.degrees(numpy.arctan2(centre[:, 0], centre[:, 2])))
    given = numpy.concatenate([look(cast, rng if i else None) for i in range(CHANGED)])
    weights, bias = learn(given, numpy.tile(wanted(yaw, cast["pitch_deg"]), (CHANGED, 1)))
    prior = priors(yaw, cast["pitch_deg"])
    people = len(numpy.unique(cast["person"]))
    command = "tools/learn/learn_pose.py, %d heads of %d people" % (len(yaw), people)
    with open(os.path.join(options.out, "ih_pose_table.h"), "w", encoding="ascii") as file:
        file.write(table(*rounded(weights, bias, prior), prior, command))


if __name__ == "__main__":
    main()
