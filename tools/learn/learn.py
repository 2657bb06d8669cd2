#!/usr/bin/env python3
"""Learn the score's curves (firmware/core/detect/ih_score_weights.h) from rendered scenes.

learn.py --render PROGRAM --host-sim PROGRAM --work DIR [--seeds A-B] [--out FILE] [--also DIR...]

Renders every scene of scenes.py for every seed into DIR (those already there are kept), runs the
firmware over them, and fits a logistic model: log-odds = bias + one piecewise linear curve per kind
of evidence, with a penalty on curves that bend. A detection within 55 mm of a head is one, beyond
100 mm it is none, between it is not used. Run it twice: which detections remain depends a little on
the curves that rated them.
"""

import argparse
import os
import sys

import numpy

import frames
import model
import scenes

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
HEAD_MM = 55
NO_HEAD_MM = 100


def label(frame):
    """Of every detection: 1 a head, 0 none, nan not to be used."""
    count = len(frame["centre_mm"])
    if len(frame["heads"]) == 0:
        return numpy.zeros(count)
    distance = numpy.linalg.norm(frame["centre_mm"][:, None] - frame["heads"][None], axis=2)
    nearest = distance.min(axis=1)
    return numpy.where(nearest < HEAD_MM, 1.0, numpy.where(nearest > NO_HEAD_MM, 0.0, numpy.nan))


def gather(seen):
    evidence = numpy.concatenate([f["evidence_q8"] for f in seen if len(f["evidence_q8"])]) / 256
    labels = numpy.concatenate([label(f) for f in seen if len(f["evidence_q8"])])
    usable = ~numpy.isnan(labels)
    return evidence[usable], labels[usable]


def report(learnt, seen, limit):
    """Frames in which the most probable finding is right, by scene."""
    table = {}
    for frame in seen:
        row = table.setdefault(os.path.basename(frame["directory"]).rsplit("-", 1)[0], [0] * 5)
        logits = learnt.logits(frame["evidence_q8"] / 256) if len(frame["centre_mm"]) else []
        best = int(numpy.argmax(logits)) if len(logits) else -1
        accepted = best >= 0 and logits[best] > limit
        if len(frame["heads"]) > 0:
            distance = (numpy.linalg.norm(frame["heads"] - frame["centre_mm"][best], axis=1).min()
                        if accepted else numpy.inf)
            row[0] += 1
            row[1] += distance < 100
            row[2] += accepted and distance >= 100
        else:
            row[3] += 1
            row[4] += not accepted
    print("%-28s %9s %6s %9s" % ("scene", "heads", "wrong", "empty"))
    for name, row in sorted(table.items()) + [("all", numpy.sum(list(table.values()), axis=0))]:
        print("%-28s %4d/%4d %6d %4d/%4d" % (name, row[1], row[0], row[2], row[4], row[3]))


def parse():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--render", required=True)
    parser.add_argument("--host-sim", required=True)
    parser.add_argument("--work", required=True)
    parser.add_argument("--seeds", default="5001-5060", help="learnt from (default 5001-5060)")
    parser.add_argument("--check-seeds", default="6001-6006",
                        help="reported on, not learnt from (default 6001-6006)")
    parser.add_argument("--also", nargs="*", default=[], help="frames directories to report on")
    parser.add_argument("--limit", type=float, default=0.5, help="log-odds for the report")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", default=os.path.join(ROOT, "firmware/core/detect/ih_score_weights.h"))
    return parser.parse_args()


def directories_of(arguments, seeds):
    first, last = (int(part) for part in seeds.split("-"))
    made = []
    for seed in range(first, last + 1):
        for name, options in scenes.scenes_of_seed(seed):
            directory = os.path.join(arguments.work, "%s-%d" % (name, seed))
            frames.render(arguments.render, directory, seed, options)
            made.append(directory)
    return made


def main():
    arguments = parse()
    scratch = os.path.join(arguments.work, "trace")

    def see(directories):
        return frames.look_at_all(arguments.host_sim, directories, scratch, arguments.jobs)

    seen = see(directories_of(arguments, arguments.seeds))
    kinds = seen[0]["kinds"]
    evidence, labels = gather(seen)
    print("%d frames, %d detections, %d heads" % (len(seen), len(labels), labels.sum()))
    learnt = model.fit(evidence, labels)
    model.write(arguments.out, learnt, kinds,
                "tools/learn/learn.py --seeds %s" % arguments.seeds)
    report(learnt, seen, arguments.limit)
    report(learnt, see(directories_of(arguments, arguments.check_seeds)), arguments.limit)
    if arguments.also:
        report(learnt, see(arguments.also), arguments.limit)


if __name__ == "__main__":
    sys.exit(main())
