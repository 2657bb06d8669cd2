"""Makes sets of sequences: python3 sets.py SET OUT [--rigs ...]. Those to learn from and those to judge by share nobody."""

import argparse
import concurrent.futures
import functools
import os

import numpy

import make
import rig as rigs
from body import Model
from scene import KINDS, ROOMS

# set: first seed, rounds of all kinds, frames a sequence, and beside them so many empty rooms, or, to learn from, these rooms
# in each round
SETS = {
    "learn": (410000, 66, 24, ("empty",) * 3),
    "mounted_learn": (340000, 60, 24, ("empty",) * 2),
    "anywhere_learn": (1500000, 80, 24, ("empty", *ROOMS)),
    "more_learn": (1600000, 100, 24, ("empty", *ROOMS)),
    "judge": (70000, 2, 24, 8),
    "rigs": (80000, 1, 20, 0),
    "sample": (90000, 1, 5, 0),
    "mounted": (310000, 2, 24, 8),
    "mounted_judge": (330000, 1, 12, 4),
    "missing": (370000, 1, 12, 4),
}
# Sequences of these sets are seen by cameras that hang otherwise than level: tilt (down) and roll, in turn.
MOUNTS = ((45.0, 0.0), (30.0, 90.0), (60.0, 0.0), (-20.0, 180.0), (0.0, -90.0), (50.0, 30.0), (20.0, -15.0))
LEARN_TILTS = (45.0, 30.0, 60.0, -20.0, 50.0, 20.0, 40.0)
LEARN_ROLLS = (0.0, 90.0, 0.0, 180.0, -30.0, 15.0)
# And those of "anywhere", and every second one of "more", by cameras that hang by chance, within these tilts, about one of the
# four sides or in between.
ANYWHERE_TILTS, ANYWHERE_SIDES, ANYWHERE_SIGMA = (-20.0, 62.0), (0.0, 0.0, 90.0, -90.0, 180.0), 15.0
EMPTY_FRAMES = 30
# More people teach more than more frames of the same: of each sequence to learn from every fourth frame is made. What
# follows the people of the level set: kind, first seed after the people's, sequences.
LEARN_STEP = 4
# Of pictures of dots, which take longer than a depth image, two frames of three times as many people teach more yet.
MORE_STEP = 12
LEARN_MORE = (("above", 60000, 50), ("seat", 70000, 110), ("ground", 80000, 150), ("far", 90000, 120), ("hands", 100000, 70))
# Of these fractions of the dots, drawn anew in each frame, none is seen; where weak dots are missed they are the same in
# each. To learn from there are the people of another set again, of every fifth sequence.
MISSING = (0.15, 0.6)
AGAIN = {"missing_learn": "learn", "mounted_missing_learn": "mounted_learn"}
AGAIN_STEP, AGAIN_FIRST = 5, 2
# Paper, wide and range see other people in a set: the rigs' first seeds are so far apart, 2000 to learn from and 1000 to judge
# by where nothing else is said. The further rigs of "learn" share some of the sets that follow with them.
SEEDS_OF_A_RIG = {"more_learn": 4000}
# All rigs of this set see the same people.
SAME_PEOPLE = "rigs"
ALL_RIGS = [*rigs.KINDS, "range"]


def is_learnt(name):
    return name.endswith("learn")


def mount_of(name, seed):
    """How the camera hangs, tilt and roll; None: level."""
    if name.startswith("anywhere") or (name.startswith("more") and seed % 2):
        rng = numpy.random.default_rng([seed, 8])
        return rng.uniform(*ANYWHERE_TILTS), rng.choice(ANYWHERE_SIDES) + rng.normal(0.0, ANYWHERE_SIGMA)
    if not name.startswith("mounted"):
        return None
    if is_learnt(name):
        return LEARN_TILTS[seed % len(LEARN_TILTS)], LEARN_ROLLS[seed // len(LEARN_TILTS) % len(LEARN_ROLLS)]
    return MOUNTS[seed % len(MOUNTS)]


def step_of(name, rig_kind):
    """Every so many frames are made."""
    if name.startswith("more") and rig_kind != "range":
        return MORE_STEP
    return LEARN_STEP if is_learnt(name) else 1


def missing_of(name, seed):
    """The fraction of dots that are not there."""
    if "missing" not in name:
        return 0.0
    return numpy.random.default_rng([seed, 7]).uniform(*MISSING)


def sequences(name, rig_kind):
    """(directory, kind, seed, frames) of every sequence, kinds mixed so that a part is balanced."""
    if name in AGAIN:
        return sequences(AGAIN[name], rig_kind)[AGAIN_FIRST::AGAIN_STEP]
    first, rounds, frames, rooms = SETS[name]
    if name != SAME_PEOPLE:
        first += SEEDS_OF_A_RIG.get(name, 2000 if is_learnt(name) else 1000) * ALL_RIGS.index(rig_kind)
    if is_learnt(name):
        listed = [(kind, first + i) for i, kind in enumerate([*KINDS, *rooms] * rounds)]
        if name == "learn":
            listed += [(kind, first + seed + i) for kind, seed, count in LEARN_MORE for i in range(count)]
        return [("%04d_%s" % (i, kind), kind, seed, frames) for i, (kind, seed) in enumerate(listed)]
    listed = [(kind, frames) for _ in range(rounds) for kind in KINDS]
    every = max(1, len(listed) // max(1, rooms))
    mixed = []
    for i, item in enumerate(listed):
        mixed.append(item)
        if rooms and i % every == every - 1 and i // every < rooms:
            mixed.append(("empty", EMPTY_FRAMES))
    return [("%03d_%s" % (i, kind), kind, first + i, count) for i, (kind, count) in enumerate(mixed)]


@functools.cache
def bodies():
    """Read once in each process, which takes seconds."""
    return Model()


def make_one(name, out, rig_kind, kind, seed, frames):
    make.make(bodies(), out, rig_kind, kind, seed, frames, step=step_of(name, rig_kind),
              mount=mount_of(name, seed), missing=missing_of(name, seed))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("set", choices=[*SETS, *AGAIN])
    parser.add_argument("out")
    parser.add_argument("--rigs", nargs="+", default=["paper", "wide", "range"], choices=ALL_RIGS)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    if missing_of(options.set, 0) and "range" in options.rigs:
        parser.error("depth images have no dots that may be missing: --rigs paper wide")
    by_rig = [[(rig_kind, *item) for item in sequences(options.set, rig_kind)] for rig_kind in options.rigs]
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        work = []
        for rig_kind, directory, kind, seed, frames in (item for row in zip(*by_rig) for item in row):
            out = os.path.join(options.out, rig_kind, directory)
            if not os.path.exists(os.path.join(out, "rig.json")):
                work.append(pool.submit(make_one, options.set, out, rig_kind, kind, seed, frames))
        for one in work:
            one.result()


if __name__ == "__main__":
    main()
