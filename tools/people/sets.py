"""Makes sets of sequences: python3 sets.py SET OUT [--rigs ...]. The seeds of `learn` and `judge` share nobody."""

import argparse
import os

import make
import rig as rigs
from body import Model
from scene import KINDS

# set: first seed, rounds of all kinds, frames a sequence, further empty rooms
SETS = {
    "learn": (
        410000, 80, 24, 240), "mounted_learn": (
        340000, 30, 24, 60), "judge": (
            70000, 2, 24, 8), "rigs": (
                80000, 1, 20, 0), "sample": (
                    90000, 1, 5, 0), "mounted": (
                310000, 2, 24, 8), "mounted_judge": (
                    330000, 1, 12, 4)}
# Sequences of these sets are seen by cameras that hang otherwise than level: tilt (down) and roll, in turn.
MOUNTS = ((45.0, 0.0), (30.0, 90.0), (60.0, 0.0), (-20.0, 180.0), (0.0, -90.0), (50.0, 30.0), (20.0, -15.0))
LEARNT_MOUNTS = ((45.0, 0.0), (30.0, 90.0), (60.0, 0.0), (-20.0, 180.0), (50.0, 30.0), (35.0, -15.0), (60.0, 10.0))
EMPTY_FRAMES = 30
# More people teach more than more frames of the same: of each sequence to learn from every fourth frame is made. What
# follows the people: kind, first seed after the people's, sequences.
LEARN_STEP = 4
LEARN_MORE = (("above", 60000, 80), ("seat", 70000, 180), ("ground", 80000, 250), ("far", 90000, 200), ("hands", 100000, 120))
# Each rig of these sets has so many seeds.
RIG_SEEDS = 2000
LEARNT_RIGS = ("paper", "wide", "range")
# All rigs of this set see the same people.
SAME_PEOPLE = "rigs"
ALL_RIGS = [*rigs.KINDS, "range"]


def sequences(name, rig_kind):
    """(directory, kind, seed, frames) of every sequence, kinds mixed so that a part is balanced."""
    first, rounds, frames, empty = SETS[name]
    if name == "mounted_learn":
        first += RIG_SEEDS * LEARNT_RIGS.index(rig_kind)
        listed = [*KINDS] * rounds + ["empty"] * empty
        return [("%04d_%s" % (i, kind), kind, first + i, frames) for i, kind in enumerate(listed)]
    if name != SAME_PEOPLE:
        first += (RIG_SEEDS if name == "learn" else 1000) * ALL_RIGS.index(rig_kind)
    if name == "learn":
        one_round = [*KINDS] + ["empty"] * (empty // rounds)
        people = [(kind, first + i) for i, kind in enumerate(one_round * rounds)]
        more = [(kind, first + seed + i) for kind, seed, count in LEARN_MORE for i in range(count)]
        return [("%04d_%s" % (i, kind), kind, seed, frames) for i, (kind, seed) in enumerate(people + more)]
    listed = [(kind, frames) for _ in range(rounds) for kind in KINDS]
    every = max(1, len(listed) // max(1, empty))
    mixed = []
    for i, item in enumerate(listed):
        mixed.append(item)
        if empty and i % every == every - 1 and i // every < empty:
            mixed.append(("empty", EMPTY_FRAMES))
    return [("%03d_%s" % (i, kind), kind, first + i, count) for i, (kind, count) in enumerate(mixed)]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("set", choices=SETS)
    parser.add_argument("out")
    parser.add_argument("--rigs", nargs="+", default=["paper", "wide", "range"], choices=ALL_RIGS)
    options = parser.parse_args()
    model = Model()
    by_rig = [[(rig_kind, *item) for item in sequences(options.set, rig_kind)] for rig_kind in options.rigs]
    for row in zip(*by_rig):
        for rig_kind, directory, kind, seed, frames in row:
            out = os.path.join(options.out, rig_kind, directory)
            if not os.path.exists(os.path.join(out, "rig.json")):
                mounts = LEARNT_MOUNTS if options.set == "mounted_learn" else MOUNTS
                make.make(model, out, rig_kind, kind, seed, frames, step=LEARN_STEP if options.set.endswith("learn") else 1,
                          mount=mounts[seed % len(mounts)] if options.set.startswith("mounted") else None)


if __name__ == "__main__":
    main()
