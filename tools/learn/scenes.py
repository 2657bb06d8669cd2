"""The rendered scenes that the score is learnt from: as many kinds as tools/render has.

Variety decides, not number: a score learnt in one kind of room fails in every other. So each scene has half of the frames
that it could have, 6 at least, and there are the more seeds. Depth images are seen from up to 2 m farther away than dots.
"""

RIGS = ("paper", "wide")
BACKGROUNDS = ("varied", "none", "far", "near")
AMBIENTS = ("varied", "normal", "bright", "dim", "varied", "sunlight")
PERSONS = ("varied", "child", "hat", "mask", "beard", "long-hair", "bald", "glasses", "headphones")
ACTS = ("phone", "face", "back", "none")
AWAY_MM = (0, 300, 700, 1200, 2000)


def scenes_of_seed(seed):
    """(name, options of tools/render) of every scene that is rendered for one seed."""
    rig, other = RIGS[seed % 2], RIGS[(seed + 1) % 2]
    background = BACKGROUNDS[seed // 2 % len(BACKGROUNDS)]
    ambient = AMBIENTS[seed % len(AMBIENTS)]
    person = PERSONS[seed % len(PERSONS)]
    act = ACTS[seed % len(ACTS)]
    tilt = str((seed * 7 % 11 - 5) * 6)  # -30 .. 30 degrees
    knock = ("0", "0", "0.01", "0.02")[seed % 4]
    missing = ("0.2", "0.35", "0.5")[seed % 3]

    def scene(name, kind, frames, rig, *more):
        return name, ["--scene", kind, "--frames", str(max(6, frames // 2)), "--rig", rig, "--ambient", ambient,
                      *more]

    return [
        scene("still", "person", 12, rig, "--background", background),
        scene("hands", "person", 20, rig, "--sequence", "2", "--background", background),
        scene("hands-other", "person", 20, other, "--sequence", "2"),
        scene("people", "person", 12, other, "--person", person, "--background", background),
        scene("acts", "person", 12, rig, "--act", act, "--person", person, "--knock", knock),
        scene("turning", "turning", 20, rig, "--background", background),
        scene("turning-other", "turning", 12, other, "--person", person),
        scene("visit", "visit", 60, rig, "--background", background),
        scene("two", "two", 12, other),
        scene("tilted", "person", 16, rig, "--sequence", "2", "--tilt", tilt),
        scene("tilted-turning", "turning", 12, other, "--background", background, "--tilt", tilt),
        scene("tilted-empty", "empty", 6, rig, "--background", background, "--tilt", tilt),
        scene("empty", "empty", 10, other, "--background", background),
        scene("table", "table", 20, rig),
        scene("room", "room", 20, other, "--background", background),
        scene("clutter", "clutter", 40, rig, "--background", background),
        scene("clutter-other", "clutter", 30, other),
        scene("missing", "person", 20, rig, "--sequence", "2", "--missing", missing),
        scene("missing-other", "person", 20, other, "--background", background, "--missing", missing),
        scene("missing-clutter", "clutter", 20, rig, "--missing", missing),
    ]


def depth_scenes_of_seed(seed):
    """The same for a depth camera; neighbouring scenes of a seed, and a scene of neighbouring seeds, differ in distance."""
    background = ["--background", BACKGROUNDS[seed // 2 % len(BACKGROUNDS)]]
    tilt = str((seed * 7 % 11 - 5) * 6)
    scenes = [
        ("still", "person", 6, *background),
        ("hands", "person", 10, "--sequence", "2"),
        ("people", "person", 8, "--person", PERSONS[seed % len(PERSONS)], *background),
        ("acts", "person", 6, "--act", ACTS[seed % len(ACTS)]),
        ("turning", "turning", 8, *background),
        ("two", "two", 6),
        ("visit", "visit", 16, *background),
        ("tilted", "person", 6, "--tilt", tilt),
        ("empty", "empty", 6),
        ("empty-other", "empty", 6, *background),
        ("table", "table", 10),
        ("room", "room", 10),
        ("clutter", "clutter", 20, *background),
    ]
    return [("depth-" + name, ["--rig", "range", "--scene", kind, "--frames", str(frames),
                               "--away", str(AWAY_MM[(3 * seed + number) % len(AWAY_MM)]), *more])
            for number, (name, kind, frames, *more) in enumerate(scenes)]


def clutter_of_seed(seed):
    """One more arrangement of things that look like heads: two frames show it, and there are many."""
    rigs = (*RIGS, "range")
    rig = rigs[seed % len(rigs)]
    return [("clutter-" + rig, ["--rig", rig, "--scene", "clutter", "--frames", "2"])]
