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
        410000, 40, 24, 120), "judge": (
            70000, 2, 24, 8), "rigs": (
                80000, 1, 20, 0), "sample": (
                    90000, 1, 5, 0), "mounted": (
                310000, 2, 24, 8), "mounted_judge": (
                    330000, 1, 12, 4)}
# Sequences of these sets are seen by cameras that hang otherwise than level: tilt (down) and roll, in turn.
MOUNTS = ((45.0, 0.0), (30.0, 90.0), (60.0, 0.0), (-20.0, 180.0), (0.0, -90.0), (50.0, 30.0), (20.0, -15.0))
EMPTY_FRAMES = 30
# More people teach more than more frames of the same: of each sequence to learn from every fourth frame is made. What
# follows the people: kind, first seed after the people's, sequences.
LEARN_STEP = 4
LEARN_MORE = (("above", 60000, 60), ("seat", 70000, 60), ("ground", 80000, 200), ("far", 90000, 120), ("hands", 100000, 60))
# All rigs of this set see the same people.
SAME_PEOPLE = "rigs"
ALL_RIGS = [*rigs.KINDS, "range"]


def sequences(name, rig_kind):
    """(directory, kind, seed, frames) of every sequence, kinds mixed so that a part is balanced."""
    first, rounds, frames, empty = SETS[name]
    if name != SAME_PEOPLE:
        first += 1000 * ALL_RIGS.index(rig_kind)
    if name == "learn":
        one_round = [*KINDS] + ["empty"] * (empty // rounds)
        people = [(kind, first + i) for i, kind in enumerate(one_round * rounds)]
        more = [(kind, first + seed + i) for kind, seed, count in LEARN_MORE for i in range(count)]
        return [("%03d_%s" % (i, kind), kind, seed, frames) for i, (kind, seed) in enumerate(people + more)]
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
                make.make(model, out, rig_kind, kind, seed, frames, step=LEARN_STEP if options.set == "learn" else 1,
                          mount=MOUNTS[seed % len(MOUNTS)] if options.set.startswith("mounted") else None)


if __name__ == "__main__":
    main()
