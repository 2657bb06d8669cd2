"""Cuts portraits out of depth images: python3 portraits.py OUT DIR... of frames directories of sets.py's range rig.

Of every sixth frame with one head that is clearly there: OUT/VIEW/... with one frame each, a picture that ends
  head, closely      1.5 and 1.2 times the head's half height from its centre, on every side
  chin, chest        10 and 60 mm below the chin
  crown              at 0.95 of the head's half height above its centre
and OUT/VIEW_alone the same with nothing measured farther than 450 mm behind the head. Without a head:
  body               begins below the chin; OUT/body_alone too
  thing              as closely around a point of a room without people
"""

import argparse
import json
import os

import numpy

from picture import read_pgm, write_pgm

EVERY = 6
BEHIND_MM = 450.0
SMALLEST_PX = 64
THINGS = 3  # of each frame
THING_MM = 125.0
MARGIN_PX = 60


def write(out, rig, z, box, truth):
    """The part of the picture in a box: left, top, right, bottom."""
    height, width = z.shape
    left, top = max(0, round(box[0])), max(0, round(box[1]))
    right, bottom = min(width, round(box[2])), min(height, round(box[3]))
    if right - left < SMALLEST_PX or bottom - top < SMALLEST_PX:
        return
    os.makedirs(out, exist_ok=True)
    matrix = list(rig["camera_matrix"]["data"])
    matrix[2] -= left
    matrix[5] -= top
    write_pgm(os.path.join(out, truth["file"]), z[top:bottom, left:right], 65535)
    part = dict(rig, image_width=right - left, image_height=bottom - top,
                camera_matrix=dict(rig["camera_matrix"], data=matrix))
    for name, entry in (("truth.jsonl", truth), ("rig.json", part)):
        with open(os.path.join(out, name), "w", encoding="utf-8") as file:
            file.write(json.dumps(entry) + "\n")


def around(u, v, reach):
    return u - reach, v - reach, u + reach, v + reach


def cut_head(out, name, rig, z, truth):
    focal, _, cx, _, _, cy, *_ = rig["camera_matrix"]["data"]
    x, y, depth = truth["head"]["centre_mm"]
    half = truth["head"]["semi_axes_mm"][1] * focal / depth
    u, v, mm = cx + focal * x / depth, cy + focal * y / depth, focal / depth
    alone = numpy.where(z > depth + BEHIND_MM, 0, z)
    height, width = z.shape
    for view, box in (("head", around(u, v, 1.5 * half)), ("closely", around(u, v, 1.2 * half)),
                      ("chin", (0, 0, width, v + half + 10 * mm)), ("chest", (0, 0, width, v + half + 60 * mm)),
                      ("crown", (0, v - 0.95 * half, width, height))):
        write(os.path.join(out, view, name), rig, z, box, truth)
        write(os.path.join(out, view + "_alone", name), rig, alone, box, truth)
    for view, picture in (("body", z), ("body_alone", alone)):
        write(os.path.join(out, view, name), rig, picture, (0, v + 1.2 * half, width, height),
              {"file": truth["file"], "head": None})


def cut_things(out, name, rig, z, truth, rng):
    focal = rig["camera_matrix"]["data"][0]
    for i in range(THINGS):
        v, u = (int(rng.integers(MARGIN_PX, size - MARGIN_PX)) for size in z.shape)
        near = z[v - 3:v + 4, u - 3:u + 4]
        if not near.any():
            continue
        depth = numpy.median(near[near > 0])
        picture = numpy.where(z > depth + BEHIND_MM, 0, z) if i % 2 else z
        write(os.path.join(out, "thing", "%s-%d" % (name, i)), rig, picture,
              around(u, v, rng.uniform(1.2, 1.5) * THING_MM * focal / depth), truth)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("directories", nargs="+")
    options = parser.parse_args()
    rng = numpy.random.default_rng(11)
    for directory in options.directories:
        with open(os.path.join(directory, "rig.json"), encoding="utf-8") as file:
            rig = json.load(file)
        if rig["kind"] != "range":
            parser.error("%s: not depth images" % directory)
        with open(os.path.join(directory, "truth.jsonl"), encoding="utf-8") as file:
            frames = [json.loads(line) for line in file]
        for truth in frames[::EVERY]:
            if "head" not in truth or truth.get("unclear") or len(truth.get("heads", [])) > 1:
                continue
            name = "%s-%s" % (os.path.basename(os.path.normpath(directory)), truth["file"].partition(".")[0])
            z = read_pgm(os.path.join(directory, truth["file"]))
            truth = {"file": truth["file"], "head": truth["head"]}
            if truth["head"]:
                cut_head(options.out, name, rig, z, truth)
            else:
                cut_things(options.out, name, rig, z, truth, rng)


if __name__ == "__main__":
    main()
