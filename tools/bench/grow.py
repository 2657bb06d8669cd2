#!/usr/bin/env python3
"""How a frame's cost grows: with frame size, dots, baseline, centres, grid, levels, points; and RAM.

    grow.py [frames|constants]    all tables, or those of the one kind

Instructions of gcc -O2 for x86-64, counted by callgrind, the mean of four rendered frames. What is a constant
or a default of the core (centres, grid, levels, points on a contour, widest frame) is changed in a copy of the
sources below build/bench/grow. One row of each such table must be the core as it is.
"""

import json
import math
import os
import random
import re
import shutil
import subprocess
import sys

import numpy as np

import builds
import counts

WORK = os.path.join(builds.WORK, "grow")
STAGES = ("frame", "dots", "labels", "surface", "nests", "findings")
FIRST, COUNT = 12, 4
CORE = os.path.join("firmware", "core")
PARTS = ("firmware", "hal", "sim", "tools", "tests", "cmake", "CMakeLists.txt")
SIZES = ((320, 240), (640, 480), (752, 582), (1024, 768), (1280, 800))
DOTS = (50, 100, 200, 300, 361)
CENTRES = (4, 8, 12)
GRIDS = (31, 47, 63)  # 4, 6 and 8 steps from centre to centre
LEVEL_STEPS_MM = (5, 10, 20, 40)
POINTS = (24, 32, 40, 48, 56)


def render(name, options):
    folder = os.path.join(WORK, "frames", name)
    if not os.path.exists(os.path.join(folder, "rig.json")):
        program = os.path.join(builds.ROOT, "build", "host", "tools", "render", "render")
        subprocess.run([program, "--seed", "1", "--first-frame", "%d+%d" % (FIRST, COUNT), *options, folder],
                       check=True, stdout=subprocess.DEVNULL)
    return folder


def arguments_of(folder):
    names = sorted(name for name in os.listdir(folder) if name.endswith(".pgm"))
    if len(names) != COUNT:
        builds.fail("%s: %d frames, expected %d" % (folder, len(names), COUNT))
    return [os.path.join(folder, "rig.json")] + [os.path.join(folder, name) for name in names]


def read_pgm(path):
    with open(path, "rb") as file:
        data = file.read()
    found = re.match(rb"P5\s+(\d+)\s+(\d+)\s+255\s", data)
    width, height = int(found[1]), int(found[2])
    return np.frombuffer(data[found.end():], np.uint8).reshape(height, width).copy()


def write_pgm(path, image):
    with open(path, "wb") as file:
        file.write(b"P5\n%d %d\n255\n" % (image.shape[1], image.shape[0]) + image.tobytes())


def erase(image, u, v):
    """Put what lies 6 to 8 px left and right of a dot over it, row by row."""
    u, v = int(round(u)), int(round(v))
    for row in range(max(v - 5, 0), min(v + 6, image.shape[0])):
        around = np.concatenate([image[row, max(u - 8, 0):max(u - 5, 0)], image[row, u + 6:u + 9]])
        if around.size:
            image[row, max(u - 5, 0):u + 6] = np.resize(around, image[row, max(u - 5, 0):u + 6].size)


def with_dots(source, count):
    """A copy of the frames with at most so many dots: the others are painted over. Its folder, and how many
    dots there are in the mean."""
    folder = os.path.join(WORK, "frames", "dots-%d" % count)
    os.makedirs(folder, exist_ok=True)
    chooser, kept = random.Random(7), 0
    with open(os.path.join(source, "truth.jsonl"), encoding="utf-8") as file:
        truth = [json.loads(line) for line in file]
    for entry in truth:
        image = read_pgm(os.path.join(source, entry["file"]))
        dots = entry["dots"][:]
        chooser.shuffle(dots)
        kept += min(count, len(dots))
        for _, u, v, _ in dots[count:]:
            erase(image, u, v)
        write_pgm(os.path.join(folder, entry["file"]), image)
    shutil.copy(os.path.join(source, "rig.json"), folder)
    return folder, round(kept / len(truth))


def edited(edits):
    """Of each file that the edits (file, pattern, replacement) change its new text."""
    texts = {}
    for file, pattern, replacement in edits:
        if file not in texts:
            with open(os.path.join(builds.ROOT, CORE, file), encoding="utf-8") as opened:
                texts[file] = (opened.read(),) * 2
        before, text = texts[file]
        text, number = re.subn(pattern, replacement, text)
        if number != 1:
            builds.fail("%s: '%s' stands there %d times, expected once: tools/bench/grow.py changes it"
                        % (file, pattern, number))
        texts[file] = (before, text)
    return {file: text for file, (before, text) in texts.items() if text != before}


def variant(name, edits):
    """The folder of a copy of the sources with some constants changed; that of the sources if none is."""
    texts = edited(edits)
    if not texts:
        return builds.ROOT
    folder = os.path.join(WORK, re.sub(r"\W+", "-", name))
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    for part in PARTS:
        source = os.path.join(builds.ROOT, part)
        copy = shutil.copytree if os.path.isdir(source) else shutil.copy
        copy(source, os.path.join(folder, part))
    for file, text in texts.items():
        with open(os.path.join(folder, CORE, file), "w", encoding="utf-8") as opened:
            opened.write(text)
    return folder


def define(file, name, value):
    return (file, r"(?m)^#define %s( .*)$" % name, "#define %s %s" % (name, value))


def fraction(numerator, denominator):
    common = math.gcd(numerator, denominator)
    return numerator // common, denominator // common


def centres(count, only=False):
    """So many centres in a row where no scan and fit are left out; only: there is room for no more."""
    if count == 12:
        return [("surface/ih_surface.c", r"centres = IH_SURFACE_CENTRES_FEW,", "centres = IH_SURFACE_CENTRES_MAX,")]
    edits = [define("surface/ih_surface.h", "IH_SURFACE_CENTRES_FEW", count)]
    if count * count <= 32:
        edits.append(define("surface/ih_surface.c", "FINE_ROWS", "IH_NORMAL_EQUATIONS_ROWS"))
    if only:
        edits.append(define("surface/ih_surface.h", "IH_SURFACE_CENTRES_MAX", count))
    return edits


def grid(nodes):
    """A grid of so many nodes that spans as much, on which the centres stand where they did."""
    steps = nodes + 1
    numerator, denominator = fraction(10 * 48, 11 * steps)
    return [define("surface/ih_surface.h", "IH_SURFACE_CENTRES_STEPS", steps),
            define("surface/ih_surface.h", "IH_SURFACE_GRID", nodes),
            define("surface/ih_surface.h", "IH_SURFACE_STEP_NUMERATOR", numerator),
            define("surface/ih_surface.h", "IH_SURFACE_STEP_DENOMINATOR", denominator),
            define("surface/ih_surface_grid.c", "TABLE_WIDTH", "(%d * TABLE_LINE)" % -(-(nodes - 1) // 8)),
            define("isohead.h", "IH_RAM_MAX", "(%d * 1024)" % (192 if nodes <= 47 else 1024))]


def points(count, only=False):
    edits = [("nests/ih_arcs.c", r"\.point_count = 32,", ".point_count = %d," % count)]
    if only:
        edits.append(define("nests/ih_arcs.h", "IH_ARCS_POINTS_MAX", count))
    return edits


def levels(step_mm):
    return [("nests/ih_nests.c", r"level_step_mm = 20;", "level_step_mm = %d;" % step_mm),
            define("nests/ih_nests.h", "IH_NESTS_SLICES_MAX", max(16, 110 // step_mm + 2))]


def ram_bytes(source):
    program = os.path.join(WORK, "ram")
    text = ('#include <stdio.h>\n#include "isohead.h"\n'
            'int main(void) { printf("%zu\\n", sizeof(struct isohead)); return 0; }\n')
    subprocess.run(["gcc", "-x", "c", "-I", os.path.join(source, "firmware", "core"), "-o", program, "-"], check=True,
                   input=text, text=True)
    return int(subprocess.run([program], check=True, stdout=subprocess.PIPE, text=True).stdout)


def measure(source, arguments):
    work = builds.WORK if source == builds.ROOT else source
    folder = builds.make("gcc-O2", ["bench_isohead"], source=source, work=work)
    command = [builds.program(folder, "bench_isohead"), "--once", *arguments]
    return counts.of_stages(counts.count(command, COUNT, "isohead_frame"))


def table(title, rows):
    """rows: name, stages, other cells by heading."""
    others = list(rows[0][2])
    heads = [title, *STAGES, *others]
    lines = ["| " + " | ".join(heads) + " |", "| --- " * len(heads) + "|"]
    for name, stages, cells in rows:
        lines.append("| %s | " % name + " | ".join(["%d" % round(stages[s] / 1000) for s in STAGES]
                                                   + [str(cells[o]) for o in others]) + " |")
    print("\n".join(lines) + "\n", flush=True)


def widest(size):
    """RAM of a core for frames of at most this size."""
    return ram_bytes(variant("size-%dx%d" % size, [define("base/ih_config.h", "IH_FRAME_WIDTH_MAX", size[0]),
                                                  define("base/ih_config.h", "IH_FRAME_HEIGHT_MAX", size[1])]))


def grow_frames(base):
    rows = []
    for size in SIZES:
        name = "%dx%d" % size
        rows.append((name, measure(builds.ROOT, arguments_of(render(name, ["--size", name]))),
                     {"RAM, made for this size": widest(size), "the frame": size[0] * size[1]}))
    table("frame size", rows)
    rows = []
    for count in DOTS:
        folder, kept = with_dots(base, count)
        rows.append((str(kept), measure(builds.ROOT, arguments_of(folder)), {}))
    table("dots present", rows)
    rows = [("%s mm" % mm, measure(builds.ROOT, arguments_of(render(rig, ["--rig", rig]))), {})
            for rig, mm in (("paper", "12.5"), ("wide", "125"))]
    table("baseline", rows)


def grow_constants(base):
    arguments = arguments_of(base)
    for title, variants in (
            ("centres", [("%d" % (c * c), centres(c), centres(c, True)) for c in CENTRES]),
            ("grid", [("%dx%d" % (n, n), grid(n), grid(n)) for n in GRIDS]),
            ("mm between levels", [(str(mm), levels(mm), levels(mm)) for mm in LEVEL_STEPS_MM]),
            ("points on a contour", [(str(p), points(p), points(p, True)) for p in POINTS])):
        shipped, rows = 0, []
        for name, edits, only in variants:
            source = variant(title + " " + name, edits)
            shipped += source == builds.ROOT
            rows.append((name, measure(source, arguments),
                         {"RAM": ram_bytes(source), "with room for no more": ram_bytes(variant("only", only))}))
        if shipped != 1:
            builds.fail("%s: %d variants are the core as it is: one of them should be it" % (title, shipped))
        table(title, rows)


def main():
    kinds = {"frames": grow_frames, "constants": grow_constants}
    if len(sys.argv) > 2 or not set(sys.argv[1:]) <= set(kinds):
        builds.fail("usage: grow.py [frames|constants]")
    os.makedirs(WORK, exist_ok=True)
    base = render("752x582", ["--size", "752x582"])
    print("Thousand instructions of a frame, and bytes.\n")
    for kind in sys.argv[1:] or kinds:
        kinds[kind](base)


if __name__ == "__main__":
    sys.exit(main())
