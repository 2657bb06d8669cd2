#!/usr/bin/env python3
"""Learn the score (ih_score_weights.h and ih_surroundings_map.h of firmware/core/detect) from rendered scenes.

learn.py --render PROGRAM --host-sim PROGRAM --work DIR [--seeds A-B] [--depth-seeds A-B] [--clutter-seeds A-B]
    [--people DIR...] [--out DIR] [--also DIR...]

Renders every scene of scenes.py for every seed into DIR (those already there are kept), runs the firmware over them and
over the frames of people that tools/people has made, and learns the maps of the surroundings and the score behind them
(model.py). A detection within 55 mm of a head is one, beyond 100 mm it is none, between it is not used, and neither is
one within 150 mm of a head that is hardly seen. A sequence of tools/people counts as six frames of tools/render. Every
detection is learnt from once more, for half as much, as if the view ended nearer.
What the firmware skips, as it has found a head there, or as it is hopeless, is learnt from, too. How far off a fitted centre
is (the moves of ih_surroundings.h) is learnt from some of the same frames without moves; whether a centre is worth a fit (its
promise), from what ih_scan tries in the first and every eighth frame after it of a directory, which depends on nothing that is
learnt.
Run it twice: where detections are depends on the moves, and which remain a little on the promise and the score.
"""

import argparse
import collections
import glob
import os
import sys

import numpy

import frames
import model
import ray_map
import scenes

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
HEAD_MM = 55
NO_HEAD_MM = 100
UNCLEAR_MM = 150
PROMISED_MM = 90
# Hardly a head is farther away in the scenes: what is would teach that far things are no heads.
FAR_MM = 2900
# Of a rendered frame, and of a whole sequence of people: what scenes teach of clutter takes something from people
# (docs/experiments/036).
FRAME_WEIGHT, SEQUENCE_WEIGHT = 1.0, 6.0
# Of a detection in a view that ends nearer, against the one in the whole view.
ENDING_WEIGHT = 0.5
# Of so many directories one says how far off fits are: a few numbers, from many heads. Without a common divisor with the
# scenes of a seed or the kinds of a round: otherwise some would never be asked.
MOVES_STEP = 11
# Of these a head of a rendered scene counts so often: they are few, and their heads' centres lie a little higher.
MOVES_SCENE_WEIGHT = 6.0
# Log-odds that are added to every score: far more clutter is learnt from than cameras see.
PRIOR = 0.75


def nearest(centre_mm, heads):
    """Of every centre the distance to the nearest of the heads."""
    if len(heads) == 0:
        return numpy.full(len(centre_mm), numpy.inf)
    return numpy.linalg.norm(centre_mm[:, None] - heads[None], axis=2).min(axis=1)


def label(frame):
    """Of every detection: 1 a head, 0 none, nan not to be used."""
    distance = nearest(frame["centre_mm"], frame["heads"])
    none = (distance > NO_HEAD_MM) & (nearest(frame["centre_mm"], frame["unclear"]) > UNCLEAR_MM)
    none &= frame["centre_mm"][:, 2] < FAR_MM
    return numpy.where(distance < HEAD_MM, 1.0, numpy.where(none, 0.0, numpy.nan))


def importance(seen, people):
    """Of every frame: each sequence of people counts as much as the others, in however many frames."""
    count = collections.Counter(frame["directory"] for frame in seen)
    return [SEQUENCE_WEIGHT / count[f["directory"]] if f["directory"] in people else FRAME_WEIGHT for f in seen]


def gather(seen, people):
    """Measures, places, their weights, labels, importance."""
    weights = importance(seen, people)
    parts = [(f["measure_q8"], f["place"], f["weight_q12"], label(f), numpy.full(len(f["place"]), w))
             for f, w in zip(seen, weights) if len(f["place"])]
    columns = [numpy.concatenate(column) for column in zip(*parts)]
    usable = ~numpy.isnan(columns[3])
    return [column[usable] for column in columns]


def moves_of(seen, people):
    """Of every head how far it is aside of, below and behind the nearest place where the fit alone put one. Others near it are
    fitted badly and not used."""
    parts = []
    for frame in seen:
        for head in frame["heads"] if len(frame["centre_mm"]) else []:
            off_mm = head - frame["centre_mm"]
            best = numpy.linalg.norm(off_mm, axis=1).argmin()
            if numpy.linalg.norm(off_mm[best]) < NO_HEAD_MM:
                weight = 1.0 if frame["directory"] in people else MOVES_SCENE_WEIGHT
                parts.append((*(frame[key][best] for key in ("place", "side", "weight_q12")), off_mm[best], weight))
    return ray_map.fit_moves(*(numpy.array(column) for column in zip(*parts)))


def promise_of(seen):
    """Is a head near the centres that the scan tries? One near a head that is hardly seen is not used."""
    parts = []
    for frame in seen:
        if "tried" not in frame:
            continue
        centre_mm, place, weight = (frame["tried"][key] for key in ("centre_mm", "place", "weight"))
        used = nearest(centre_mm, frame["unclear"]) > UNCLEAR_MM
        parts.append((place[used], weight[used], nearest(centre_mm, frame["heads"])[used] < PROMISED_MM))
    return ray_map.fit_promise(*(numpy.concatenate(column) for column in zip(*parts)))


def and_in_ending_views(measure_q8, place, weight_q12, labels, importances):
    """The same, then all once more in views that end nearer."""
    return [numpy.concatenate(pair) for pair in (
        (measure_q8, measure_q8), (place, ray_map.ending_views(place)), (weight_q12, weight_q12), (labels, labels),
        (importances, ENDING_WEIGHT * importances))]


def logits(learnt, frame):
    return learnt.logits(frame["measure_q8"], 256 * ray_map.answers(learnt.maps, frame["place"], frame["weight_q12"]))


def report(learnt, seen, limit):
    """Frames in which the most probable finding is right, by scene."""
    table = {}
    for frame in seen:
        row = table.setdefault(os.path.basename(frame["directory"]).rsplit("-", 1)[0], [0] * 5)
        log_odds = logits(learnt, frame) if len(frame["centre_mm"]) else []
        best = int(numpy.argmax(log_odds)) if len(log_odds) else -1
        accepted = best >= 0 and log_odds[best] > limit
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
    parser.add_argument("--seeds", default="5001-5020", help="learnt from (default 5001-5020)")
    parser.add_argument("--depth-seeds", default="5001-5060", help="the same of depth images (default 5001-5060)")
    parser.add_argument("--clutter-seeds", default="20001-22400", help="arrangements of things that look like heads (default 20001-22400)")
    parser.add_argument("--check-seeds", default="6001-6006",
                        help="reported on, not learnt from (default 6001-6006)")
    parser.add_argument("--people", nargs="*", default=[], help="folders of frames directories of tools/people to learn from")
    parser.add_argument("--also", nargs="*", default=[], help="frames directories to report on")
    parser.add_argument("--limit", type=float, default=0.5, help="log-odds for the report")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", default=os.path.join(ROOT, "firmware/core/detect"))
    return parser.parse_args()


def rendered(arguments, seeds, scenes_of_seed):
    first, last = (int(part) for part in seeds.split("-"))
    made = []
    for seed in range(first, last + 1):
        for name, options in scenes_of_seed(seed):
            directory = os.path.join(arguments.work, "%s-%d" % (name, seed))
            frames.render(arguments.render, directory, seed, options)
            made.append(directory)
    return made


def directories_of(arguments, seeds, depth_seeds, clutter_seeds):
    return (rendered(arguments, seeds, scenes.scenes_of_seed)
            + rendered(arguments, depth_seeds, scenes.depth_scenes_of_seed)
            + rendered(arguments, clutter_seeds, scenes.clutter_of_seed))


def main():
    arguments = parse()
    scratch = os.path.join(arguments.work, "trace")

    def see(directories, options=(), also=()):
        return frames.look_at_all(arguments.host_sim, directories, scratch, arguments.jobs, options, also)

    people = sorted(os.path.dirname(path) for folder in arguments.people
                    for path in glob.glob(os.path.join(folder, "**", "rig.json"), recursive=True))
    directories = directories_of(arguments, arguments.seeds, arguments.depth_seeds, arguments.clutter_seeds) + people
    moves = moves_of(see(directories[::MOVES_STEP], ("--without", "move,skips"), ("side",)), set(people))
    seen = see(directories, ("--without", "skips"), ("tried",))
    promise = promise_of(seen)
    kinds = seen[0]["kinds"]
    rows = gather(seen, set(people))
    print("%d frames, %d detections, %d heads" % (len(seen), len(rows[3]), rows[3].sum()))
    learnt = model.fit(*and_in_ending_views(*rows))
    learnt.bias_q10 += round(PRIOR * 1024)
    command = "tools/learn/learn.py --seeds %s --depth-seeds %s --clutter-seeds %s --people %s" % (
        arguments.seeds, arguments.depth_seeds, arguments.clutter_seeds,
        " ".join(os.path.basename(os.path.normpath(folder)) for folder in arguments.people))
    model.write(os.path.join(arguments.out, "ih_score_weights.h"), learnt, kinds, command)
    ray_map.write(os.path.join(arguments.out, "ih_surroundings_map.h"), learnt.maps, moves, promise, command)
    report(learnt, seen, arguments.limit)
    check = arguments.check_seeds
    report(learnt, see(directories_of(arguments, check, check, check)), arguments.limit)
    if arguments.also:
        report(learnt, see(arguments.also), arguments.limit)


if __name__ == "__main__":
    sys.exit(main())
