#!/usr/bin/env python3
"""Who is found of people of true anatomy, and what is taken for a head: by rig, kind, points on the head, and more.

people.py --host-sim PROGRAM [--jobs N] DIR...

Runs host_sim over every frames directory of tools/people below each DIR (sets.py makes whole sets of them) and prints the tables.
A frame counts as in docs/people.md: where a head is there, the selected one must be within 100 mm of a head that is there; where
none is and none is unclear, none may be selected; other frames are left out.
"""

import argparse
import collections
import concurrent.futures
import dataclasses
import glob
import json
import math
import os
import sys

import report
import runs
import score

# From here to below the next, and the last and more.
POINTS = (0, 9, 12, 18, 24, 30, 40, 60)
VISIBLE = (0.0, 0.25, 0.5, 0.75)
DISTANCE_MM = (0, 600, 800, 1000, 1300, 1600, 2000)


@dataclasses.dataclass(frozen=True)
class Frame:
    """One that counts. Of the nearest head: centre, points on it, which fraction of those that nothing would hide it is."""

    rig: str
    mount: str
    kind: str
    there: int  # heads
    right: bool
    selected: bool
    both: bool = False  # all heads that are there are accepted, and no third
    off_mm: float = math.nan  # of the selected one from the nearest head that is there
    distance_mm: float = 0.0
    points: int = 0
    visible: float = 0.0


def mount_of(rig):
    """How the camera hangs by its rig file, to 5 degrees."""
    if "up" not in rig:
        return "no up, level or little tilted"
    right, below, away = rig["up"]
    down, roll = (5 * round(math.degrees(angle) / 5) for angle in (math.asin(max(-1.0, min(1.0, -away))), math.atan2(right, -below)))
    return "%s %d, rolled %d" % ("down" if down >= 0 else "up", abs(down), roll)


def looked_at(record, truth, scene, rig, mount):
    """The frame, or None where it does not count."""
    heads = truth.get("heads") or [head for head in [truth.get("head")] if head]
    if "head" not in truth or (not heads and truth.get("unclear")):
        return None
    kind, selected = scene["kind"], record["head"] is not None
    if not heads:
        return Frame(rig, mount, kind, 0, not selected, selected)
    centres_mm = [head["centre_mm"] for head in heads]
    found, nobody, right = score.people(record, centres_mm)
    off_mm = math.nan
    if selected:
        off_mm = min(score.distance_mm(record["hypotheses"][record["head"]], centre_mm) for centre_mm in centres_mm)
    note = min(scene["people"], key=lambda person: math.dist(person["centre_mm"], centres_mm[0]))
    return Frame(rig, mount, kind, len(heads), right, selected, found == len(heads) and nobody == 0, off_mm,
                 math.hypot(*centres_mm[0]), note["points"], note["visible"])


def frames_of(program, directory):
    with open(os.path.join(directory, "rig.json"), encoding="utf-8") as file:
        calibration = json.load(file)
    # Which rig with dots it is, only the folders of sets.py say.
    rig = "range" if calibration.get("kind") == "range" else os.path.basename(os.path.dirname(directory))
    mount = mount_of(calibration)
    truths, scenes = ({line["file"]: line for line in runs.read_lines(os.path.join(directory, name))}
                      for name in ("truth.jsonl", "scene.jsonl"))
    records = runs.host_sim(program, [], directory)
    frames = (looked_at(record, truths[file], scenes[file], rig, mount) for file, record in records.items())
    return [frame for frame in frames if frame is not None]


def steps(limits, unit=""):
    """Of a value the range between limits that it is in, and all ranges."""
    names = ["%g to below %g%s" % (low, high, unit) for low, high in zip(limits, limits[1:])] + ["%g%s and more" % (limits[-1], unit)]
    return lambda value: names[sum(value >= limit for limit in limits) - 1], names


def head_row(name, frames):
    off_mm = [frame.off_mm for frame in frames if frame.right]
    right = len(off_mm)
    return [name, len(frames), right, "%.1f" % (100 * right / len(frames)), sum(f.selected and not f.right for f in frames),
            report.mm(score.percentile(off_mm, 50)), report.mm(score.percentile(off_mm, 90))]


def heads_by(title, frames, group, names=None):
    """A row for each group of frames with a head."""
    groups = collections.defaultdict(list)
    for frame in frames:
        if frame.there:
            groups[group(frame)].append(frame)
    rows = [head_row(name, groups[name]) for name in names or sorted(groups) if groups[name]]
    rows += [head_row("all", [frame for frame in frames if frame.there])] if rows else []
    return report.table([title, "heads", "right", "%", "elsewhere", "off 50 %, mm", "90 %"], rows) + "\n"


def two(frames):
    of_two = [frame for frame in frames if frame.there > 1]
    return "Two heads there: both and no third accepted in %d of %d frames.\n\n" % (sum(f.both for f in of_two), len(of_two))


def nobody_by(title, frames, group):
    groups = collections.defaultdict(list)
    for frame in frames:
        if not frame.there:
            groups[group(frame)].append(frame)
            groups["all"].append(frame)
    names = sorted(groups.keys() - {"all"}) + ["all"]
    return report.table([title, "frames without a head", "one selected"],
                        [[name, len(groups[name]), sum(f.selected for f in groups[name])] for name in names]) + "\n"


def text(frames):
    by_points, points = steps(POINTS)
    by_fraction, fractions = steps(VISIBLE)
    by_distance, distances = steps(DISTANCE_MM, " mm")
    dots = [frame for frame in frames if frame.rig != "range"]
    return "".join([
        heads_by("rig", frames, lambda f: f.rig), heads_by("camera", frames, lambda f: f.mount),
        heads_by("kind", frames, lambda f: f.kind),
        heads_by("dots on the head", dots, lambda f: by_points(f.points), points),
        heads_by("of it measured", frames, lambda f: by_fraction(f.visible), fractions),
        heads_by("distance", frames, lambda f: by_distance(f.distance_mm), distances),
        two(frames), nobody_by("rig", frames, lambda f: f.rig), nobody_by("kind", frames, lambda f: f.kind)])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--host-sim", required=True)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("directory", nargs="+")
    arguments = parser.parse_args()
    directories = sorted(os.path.dirname(path) for directory in arguments.directory
                         for path in glob.glob(os.path.join(directory, "**", "scene.jsonl"), recursive=True))
    if not directories:
        print("people: no scene.jsonl below %s" % " ".join(arguments.directory), file=sys.stderr)
        return 1
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        frames = [frame for one in pool.map(lambda d: frames_of(arguments.host_sim, d), directories) for frame in one]
    print(text(frames), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
