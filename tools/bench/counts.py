#!/usr/bin/env python3
"""Instructions that isohead takes for a frame, stage by stage, counted by callgrind.

    counts.py            a table of all builds; build/bench_instructions.json
    counts.py --check    gcc -O2 alone, against the bounds bench_..._instructions of tests/limits.conf;
                         exit status 1 when one is passed

The same program, compiler and frames always take the same number; another compiler another one. What a stage
calls is counted with it. Only isohead_frame and what it calls counts.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

import builds

sys.path.insert(0, os.path.join(builds.ROOT, "tools", "size"))
import limits

CHECKED = "gcc-O2"
BOUND = "bench_%s_instructions"
# What isohead.c calls; parts of a stage begin with a dot.
FUNCTIONS = {
    "frame": ("isohead_frame",),
    "dots": ("ih_dots_find",),
    "labels": ("ih_labels_assign",),
    "points, samples": ("ih_points_from_labels", "ih_samples_select"),
    "surface": ("ih_surface_fit",),
    ". factor": ("ih_normal_factor", "ih_normal_solve"),
    "nests": ("ih_hypotheses_find",),
    ". cuts": ("ih_cuts_level",),
    ". parts": ("ih_ellipse_of_part",),
    "heads": ("ih_heads_select",),
    "findings": ("ih_findings_add",),
    ". scan": ("ih_scan_find",),
    ". fit": ("ih_fit_continue",),
    ". evidence": ("ih_evidence_collect",),
    "tracks": ("ih_tracks_expect", "ih_tracks_update"),
}
BOUNDED = ("frame", "dots", "labels", "surface", "nests", "findings")
LINE = re.compile(r"^\s*([\d,]+)\s.*:((?:ih|isohead|bench)_\w+)\b")


def count(command, frames, within):
    """Inclusive instructions by function, a frame; of what runs below the function `within`."""
    with tempfile.TemporaryDirectory() as work:
        out = os.path.join(work, "callgrind.out")
        subprocess.run(["valgrind", "--quiet", "--tool=callgrind", "--callgrind-out-file=" + out,
                        "--toggle-collect=" + within, *command],
                       check=True, stdout=subprocess.DEVNULL)
        listed = subprocess.run(["callgrind_annotate", "--inclusive=yes", "--threshold=100", out], check=True,
                                stdout=subprocess.PIPE, text=True).stdout
    counts = {}
    for line in listed.splitlines():
        found = LINE.match(line)
        if found:
            counts.setdefault(found[2], int(found[1].replace(",", "")) / frames)
    if within not in counts:
        builds.fail("callgrind saw no call of %s in %s" % (within, command[0]))
    return counts


def of_stages(counts):
    return {stage: round(sum(counts.get(f, 0) for f in functions)) for stage, functions in FUNCTIONS.items()}


def isohead_counts(name, frames):
    folder = builds.make(name, ["bench_isohead"])
    command = [builds.program(folder, "bench_isohead"), "--once", *frames]
    return of_stages(count(command, sum(path.endswith(".pgm") for path in frames), "isohead_frame"))


def check(frames):
    bounds = limits.read()
    counts = isohead_counts(CHECKED, frames)
    bad = 0
    for stage in BOUNDED:
        name = BOUND % stage
        over = counts[stage] > bounds[name]
        bad += over
        print("%-28s %11d of %11d%s" % (name, counts[stage], bounds[name], "  PASSED" if over else ""))
    if bad:
        print("%d bounds of tests/limits.conf are passed, with %s; measured there with gcc 12.2.0"
              % (bad, builds.compiler_version(CHECKED)))
    return 1 if bad else 0


def tabulate(columns):
    lines = ["| thousand instructions a frame | " + " | ".join(columns) + " |", "| --- " * (1 + len(columns)) + "|"]
    for stage in FUNCTIONS:
        cells = ["%d" % round(counts[stage] / 1000) if stage in counts else "" for counts in columns.values()]
        lines.append("| %s | " % stage + " | ".join(cells) + " |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    if shutil.which("valgrind") is None:
        builds.fail("no valgrind: tools/setup.sh test installs it")
    frames = builds.timed_frames()
    if options.check:
        return check(frames)
    columns = {"%s, %s" % (builds.compiler_version(name), builds.OPTIONS[name.split("-", 1)[1]]):
               isohead_counts(name, frames) for name in builds.NAMES}
    print("isohead, default mode, the mean of %d frames\n" % sum(p.endswith(".pgm") for p in frames))
    print(tabulate(columns))
    with open(os.path.join(builds.ROOT, "build", "bench_instructions.json"), "w", encoding="utf-8") as file:
        json.dump(columns, file, indent=1)
    return 0


if __name__ == "__main__":
    sys.exit(main())
