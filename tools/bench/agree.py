#!/usr/bin/env python3
"""Do isohead and its peers find the same? Nothing is timed before they do.

    agree.py        exit status 1 when they do not; gcc -O2 builds

Against the truth of the rendered frames: dots found, labels right. Against isohead: the same dots behind
the same labels; the surface in mm, at the nodes next to dots that both have labelled (elsewhere one of
them has to guess) and on all 47x47 nodes; the head, where no hands are before it: the peers have neither the
evidence nor the learnt score that finds it then. And the same work: as many nodes, centres and points.
"""

import json
import os
import subprocess
import sys

import numpy as np

import builds

DOT_PX = 1.0  # farther from every true dot: not found
LABEL_PX = 1.5  # farther from the true position of its slot: a wrong label
HANDS = "sequence2"
LIMITS = {
    # name: (least, most) of every frame
    "found": (0.78, 1.0),
    "dot_error_px": (0.0, 0.3),
    "labels_right": (0.97, 1.0),
    "labels_of_isohead": (0.8, 1.0),
    "same_dot": (0.98, 1.0),
    "depth_error_mm": (0.0, 25.0),
    # Medians. What lies far behind is clipped 250 mm behind the 8th percentile of the depths, which moves by
    # some mm with every dot that only one of them found, and the whole background with it.
    "surface_at_dots_mm": (0.0, 15.0),
    "surface_mm": (0.0, 20.0),
    "head_mm": (0.0, 25.0),
}
# What the work is, in which results that are alike may differ.
SIZES = {
    "nodes of the surface": lambda result: len(result["surface"]),
    "its centres in a row": lambda result: result["centres"],
    "points on a contour": lambda result: result["points"],
}


def results(program, arguments):
    out = subprocess.run([*program, "--results", *arguments], check=True, stdout=subprocess.PIPE, text=True).stdout
    return [json.loads(line) for line in out.splitlines()]


def truth_of(arguments):
    """Of each frame its truth and its rig."""
    truth, found = {}, []
    for path in arguments:
        if path.endswith(".json"):
            rig = Rig(path)
            with open(os.path.join(os.path.dirname(path), "truth.jsonl"), encoding="utf-8") as file:
                truth = {entry["file"]: entry for entry in map(json.loads, file)}
        else:
            found.append((truth[os.path.basename(path)], rig))
    return found


class Rig:
    """Where a slot's dot at a depth lies on the surface's grid (ih_rig.h, ih_surface.h)."""

    GRID, NODES, FIELD_MM, STEP = 19, 47, 900, 10 / 11

    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            rig = json.load(file)
        rays = np.array(rig["dot_rays"]["data"]).reshape(-1, 3)
        self.slope = rays[:, :2] / rays[:, 2:]
        origin = np.array(rig["projector_origin"]["data"])
        self.offset = origin[:2] - origin[2] * self.slope
        last = self.GRID * (self.GRID - 1)
        depth = min(max(self.FIELD_MM, rig["near_mm"]), rig["far_mm"])
        sides = [(0, self.GRID - 1), (last, last + self.GRID - 1), (0, last), (self.GRID - 1, last + self.GRID - 1)]
        length = [np.linalg.norm(self.place(b, depth) - self.place(a, depth)) for a, b in sides]
        self.unit = np.sum(length) / (4 * (self.GRID - 1) * 2)
        self.centre = self.place(last // 2 + self.GRID // 2, depth)

    def place(self, slot, depth_mm):
        return self.slope[slot] + self.offset[slot] / depth_mm

    def node(self, slot, depth_mm):
        """The index of the nearest node; None outside the grid."""
        steps = (self.place(slot, depth_mm) - self.centre) / (self.unit * self.STEP) + self.NODES // 2
        x, y = np.rint(steps).astype(int)
        return y * self.NODES + x if 0 <= min(x, y) and max(x, y) < self.NODES else None


def labelled(result):
    """Position and depth by slot."""
    return {slot: (np.array(result["dots"][dot]), depth) for slot, dot, depth in result["labels"]}


def against_truth(result, truth):
    places = np.array([entry[1:3] for entry in truth["dots"]])
    dots = np.array(result["dots"])
    nearest = np.linalg.norm(places[:, None] - dots[None], axis=2).min(axis=1)
    by_slot = {entry[0]: (np.array(entry[1:3]), entry[3]) for entry in truth["dots"]}
    own = labelled(result)
    known = [slot for slot in own if slot in by_slot]
    off = np.array([np.linalg.norm(own[slot][0] - by_slot[slot][0]) for slot in known])
    depth_off = np.array([abs(own[slot][1] - by_slot[slot][1]) for slot in known])
    return {"found": float((nearest < DOT_PX).mean()),
            "dot_error_px": float(np.median(nearest[nearest < DOT_PX])),
            "labels_right": float((off < LABEL_PX).mean()),
            "depth_error_mm": float(np.median(depth_off[off < LABEL_PX]))}


def against_isohead(result, reference, rig, has_hands):
    own, other = labelled(result), labelled(reference)
    both = [slot for slot in other if slot in own]
    off = np.array([np.linalg.norm(own[slot][0] - other[slot][0]) for slot in both])
    numbers = {"labels_of_isohead": len(both) / len(other), "same_dot": float((off < LABEL_PX).mean())}
    for name, size in SIZES.items():
        if size(result) != size(reference):
            builds.fail("%s: %s, expected isohead's %s" % (name, size(result), size(reference)))
    apart = np.abs(np.array(result["surface"]) - np.array(reference["surface"]))
    nodes = {rig.node(slot, other[slot][1]) for slot in both} - {None}
    numbers["surface_at_dots_mm"] = float(np.median(apart[sorted(nodes)]))
    numbers["surface_mm"] = float(np.median(apart))
    if reference["head"] is not None and not has_hands:
        head = result["head"] if result["head"] is not None else [1e9] * 3
        numbers["head_mm"] = float(np.linalg.norm(np.array(head) - np.array(reference["head"])))
    return numbers


def names_of(arguments):
    return [os.path.join(*path.split(os.sep)[-2:]) for path in arguments if not path.endswith(".json")]


def measure(found, reference, truth, arguments):
    """The numbers of every frame."""
    return [{**against_truth(f, t), **against_isohead(f, r, rig, name.startswith(HANDS))}
            for f, r, (t, rig), name in zip(found, reference, truth, names_of(arguments))]


def check(who, arguments, frames):
    """Complaints, one a line."""
    bad = []
    for name, numbers in zip(names_of(arguments), frames):
        for key, value in numbers.items():
            smallest, largest = LIMITS[key]
            if not smallest <= value <= largest:
                bad.append("%s, %s: %s is %.3f, expected %g to %g" % (who, name, key, value, smallest, largest))
    return bad


def mean(frames):
    keys = LIMITS.keys()
    return {key: float(np.mean([f[key] for f in frames if key in f])) for key in keys}


def compare(isohead, peers, arguments):
    """isohead: a program; peers: programs by name. Their mean numbers by name; ends where they do not agree."""
    reference, truth = results(isohead, arguments), truth_of(arguments)
    own = measure(reference, reference, truth, arguments)
    if sum("head_mm" in numbers for numbers in own) * 2 < len(reference):
        builds.fail("heads can be compared in less than half of the frames")
    numbers, bad = {"isohead": mean(own)}, []
    for name, program in peers.items():
        frames = measure(results(program, arguments), reference, truth, arguments)
        bad += check(name, arguments, frames)
        numbers[name] = mean(frames)
    if bad:
        builds.fail("no agreement, so nothing is timed:\n  " + "\n  ".join(bad))
    return numbers


def programs(folder):
    """Commands by name, of a build's folder."""
    peer = builds.program(folder, "bench_peer")
    return {"isohead": [builds.program(folder, "bench_isohead")], "A": [peer, "a"], "B": [peer, "b"]}


def table(numbers):
    lines = ["| mean of the frames | isohead | A | B |", "| --- | --- | --- | --- |"]
    for key in LIMITS:
        lines.append("| %s | " % key + " | ".join("%.3g" % numbers[who][key] for who in ("isohead", "A", "B")) + " |")
    return "\n".join(lines)


def main():
    commands = programs(builds.make("gcc-O2", ["bench_isohead", "bench_peer"]))
    frames = builds.timed_frames()
    numbers = compare(commands.pop("isohead"), commands, frames)
    print(table(numbers) + "\n\nok: isohead and its peers agree on %d frames"
          % sum(path.endswith(".pgm") for path in frames))


if __name__ == "__main__":
    sys.exit(main())
