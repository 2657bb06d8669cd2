"""What the evaluation looks at: rendered scenes, casts on real depth images, recorded data sets.

Every rendered scene has a seed of its own, from 7001 on. Nobody tunes on these: the score's curves
are learnt from other seeds, which their header names, and were looked at with CHECK_SEEDS
(tools/learn).
"""

import dataclasses
import os
import re

WEIGHTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "firmware", "core", "detect",
                       "ih_score_weights.h")
CHECK_SEEDS = "6001-6006"
FIRST_SEED = 7001
FIRST_CAST_SEED = 7101

# Columns of the tables of what each part brings, in this order.
GROUPS = ("six", "real", "seq 1", "seq 2", "people", "acts", "light", "rig", "visit", "two", "empty",
          "range", "cast")


@dataclasses.dataclass(frozen=True)
class Scene:
    kind: str        # a row of the report, and its sheets of failures
    group: str       # one of GROUPS
    name: str        # a folder of the work directory; unique
    seed: int = 0    # 0: a data set, which is not rendered
    options: tuple = ()
    directory: str = ""  # of a data set


# (group, kind, frames, options of every scene of this kind)
RENDERED = (
    ("seq 1", "sequence 1", 16, ("--rig paper", "--rig wide", "--rig paper --background far",
                                 "--rig wide --background near")),
    ("seq 2", "sequence 2", 20, ("--rig paper --sequence 2", "--rig wide --sequence 2",
                                 "--rig paper --sequence 2 --background none",
                                 "--rig wide --sequence 2 --background far",
                                 "--rig paper --sequence 2 --background near",
                                 "--rig wide --sequence 2 --background none")),
    ("people", "child", 12, ("--rig paper --person child", "--rig wide --person child")),
    ("people", "hat", 12, ("--rig paper --person hat", "--rig wide --person hat")),
    ("people", "mask", 12, ("--rig paper --person mask", "--rig wide --person mask")),
    ("people", "beard", 12, ("--rig paper --person beard", "--rig wide --person beard")),
    ("people", "long hair", 12, ("--rig paper --person long-hair", "--rig wide --person long-hair")),
    ("people", "bald, glasses, headphones", 12, ("--rig wide --person bald", "--rig paper --person glasses",
                                                 "--rig wide --person headphones")),
    ("acts", "hands on the face", 16, ("--rig paper --act face", "--rig wide --act face")),
    ("acts", "phone at the ear", 16, ("--rig paper --act phone", "--rig wide --act phone")),
    ("acts", "to the back seat", 16, ("--rig paper --act back", "--rig wide --act back")),
    ("acts", "turning right round", 20, ("--rig paper --scene turning", "--rig wide --scene turning",
                                         "--rig paper --scene turning --background far")),
    ("light", "sunlight", 12, ("--rig paper --ambient sunlight", "--rig wide --ambient sunlight",
                                    "--rig paper --ambient sunlight --sequence 2")),
    ("light", "bright, dim", 12, ("--rig paper --ambient bright", "--rig wide --ambient dim")),
    ("rig", "rotated rig", 12, ("--rig paper --knock 0.05", "--rig wide --knock 0.05",
                                       "--rig paper --knock 0.1", "--rig wide --knock 0.1")),
    ("rig", "noisy calibration", 12, ("--rig paper --calibration-noise 1",
                                             "--rig wide --calibration-noise 1",
                                             "--rig wide --calibration-noise 2")),
    ("visit", "entering and leaving", 60, ("--rig paper --scene visit", "--rig wide --scene visit",
                                           "--rig paper --scene visit --background far")),
    ("two", "two people", 12, ("--rig paper --scene two", "--rig wide --scene two",
                               "--rig wide --scene two --background far")),
    ("empty", "empty seat", 12, ("--rig paper --scene empty", "--rig wide --scene empty")),
    ("empty", "table", 16, ("--rig paper --scene table", "--rig wide --scene table")),
    ("empty", "room", 16, ("--rig paper --scene room", "--rig wide --scene room")),
    ("empty", "clutter", 24, ("--rig paper --scene clutter", "--rig wide --scene clutter",
                              "--rig paper --scene clutter --background near")),
    ("light", "sunlight, laser every second frame", 24, (
        "--rig paper --ambient sunlight --laser alternate",
        "--rig wide --ambient sunlight --laser alternate --sequence 2",
        "--rig paper --ambient bright --laser alternate")),
)

# The dots cast on real depth images: (kind, folder of DATA/range, frames an image, rigs).
CAST = (
    ("cast on a person", "pcl_person_seated", 8, ("paper", "wide")),
    ("cast on five people", "pcl_five_people_standing", 6, ("paper", "wide")),
    ("cast on rooms", "", 1, ("paper", "wide")),
)

# For a quick look whether everything works: a person and two people, a few frames each.
QUICK_KINDS = ("sequence 2", "two people")
QUICK_FRAMES = 4


def learnt_seeds():
    """As the curves themselves say."""
    with open(WEIGHTS, encoding="utf-8") as file:
        found = re.search(r"--seeds (\d+-\d+)", file.read())
    return found[1] if found else "(unknown)"


def rendered_scenes():
    scenes, seed = [], FIRST_SEED
    for group, kind, frames, variants in RENDERED:
        for options in variants:
            scenes.append(make(kind, group, seed, options.split() + ["--frames", str(frames)]))
            seed += 1
    return scenes


def cast_scenes(data):
    scenes, seed = [], FIRST_CAST_SEED
    for kind, folder, frames, rigs in CAST:
        for rig in rigs:
            source = os.path.join(data, "range", folder) if folder else os.path.join(data, "range")
            scenes.append(make(kind, "cast", seed, ["--range", source, "--rig", rig,
                                                    "--frames", str(frames)]))
            seed += 1
    return scenes


def make(kind, group, seed, options):
    words = "".join(c if c.isalnum() else " " for c in kind).split()
    return Scene(kind, group, "%s-%d" % ("-".join(words), seed), seed, tuple(options))


def recorded_scenes(data):
    scenes = []
    for part in ("dots", "range"):
        top = os.path.join(data, part)
        for name in sorted(os.listdir(top)) if os.path.isdir(top) else []:
            directory = os.path.join(top, name)
            if not os.path.exists(os.path.join(directory, "rig.json")):
                continue
            if part == "range":
                kind, group = "range images", "range"
            elif name.startswith("real_"):
                kind, group = "dots on real depth maps", "real"
            else:
                kind, group = "six sequences", "six"
            scenes.append(Scene(kind, group, "%s-%s" % (part, name), directory=directory))
    return scenes


def all_scenes(data):
    """Recorded, rendered, cast; without data sets only the rendered ones."""
    recorded = recorded_scenes(data)
    has_range = any(scene.group == "range" for scene in recorded)
    return recorded + rendered_scenes() + (cast_scenes(data) if has_range else [])


def quick_scenes():
    """The first scene of some kinds, cut short."""
    scenes = []
    for kind in QUICK_KINDS:
        scene = next(s for s in rendered_scenes() if s.kind == kind)
        scenes.append(dataclasses.replace(scene, options=scene.options + ("--frames", str(QUICK_FRAMES))))
    return scenes
