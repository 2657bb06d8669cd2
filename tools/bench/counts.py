#!/usr/bin/env python3
"""Instructions that isohead takes for a frame, stage by stage, counted by callgrind.

    counts.py            a table of all builds; build/bench_instructions.json
    counts.py --peers    of gcc's builds, beside those of the peers A and B; build/bench_peers.json
    counts.py --check    gcc -O2 alone, against the bounds bench_..._instructions of tests/limits.conf;
                         exit status 1 when one is passed

The same program, compiler and frames always take the same number; another compiler another one. What a stage
calls is counted with it. Only isohead_frame or peer_frame and what it calls counts. Of OpenCV's functions that
choose by the processor the ones for AVX2 run, which is all that valgrind says it has.
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
    "align": ("ih_align_find", "ih_align_learn"),
    "labels": ("ih_labels_assign",),
    "points, samples": ("ih_points_from_labels", "ih_samples_select"),
    "surface": ("ih_surface_fit",),
    ". factor": ("ih_normal_equations_factor", "ih_normal_solve"),
    "nests": ("ih_nests_find",),
    ". cuts": ("ih_contours_level",),
    ". parts": ("ih_ellipse_of_part",),
    "heads": ("ih_hypotheses_select",),
    "findings": ("ih_detections_add",),
    ". scan": ("ih_scan_find",),
    ". fit": ("ih_fit_continue",),
    ". evidence": ("ih_evidence_collect",),
    "tracks": ("ih_tracks_expect", "ih_tracks_update"),
}
# Rows beside the peers: isohead's and theirs. What the peers' last stage does isohead does in four.
BESIDE = {
    "dots": (("dots",), "peer_find_dots"),
    "labels": (("align", "labels"), "peer_find_labels"),
    "points, samples": (("points, samples",), "peer_find_samples"),
    "surface": (("surface",), "peer_fit_surface"),
    "cuts, nests": (("nests",), "peer_find_nests"),
    "heads to tracks": (("heads", "findings", "tracks"), "peer_find_hypotheses"),
    "whole frame": (("frame",), "peer_frame"),
}
BOUNDED = ("frame", "dots", "labels", "surface", "nests", "findings")
LINE = re.compile(r"^\s*([\d,]+)\s.*:((?:ih|isohead|bench|peer)_\w+)\b")


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


def beside_counts(name, frames):
    """Of isohead and both peers, by row."""
    import agree  # which needs numpy; the other modes do without

    programs = agree.programs(builds.make(name, ["bench_isohead", "bench_peer"]))
    agree.compare(programs["isohead"], {who: programs[who] for who in "AB"}, frames)
    number = sum(path.endswith(".pgm") for path in frames)
    own = of_stages(count([*programs["isohead"], "--once", *frames], number, "isohead_frame"))
    columns = {"isohead": {row: sum(own[stage] for stage in stages) for row, (stages, _) in BESIDE.items()}}
    for who in "AB":
        found = count([*programs[who], "--once", *frames], number, "peer_frame")
        missing = [function for _, function in BESIDE.values() if function not in found]
        if missing:
            builds.fail("callgrind saw no call of %s by peer %s" % (", ".join(missing), who))
        columns[who] = {row: round(found[function]) for row, (_, function) in BESIDE.items()}
    return columns


def tabulate_beside(columns):
    lines = ["| thousand instructions a frame | isohead | A | B | A / isohead | B / isohead |",
             "| --- | --- | --- | --- | --- | --- |"]
    for row in BESIDE:
        own, *others = [columns[who][row] for who in ("isohead", "A", "B")]
        cells = ["%d" % round(number / 1000) for number in (own, *others)]
        lines.append("| " + " | ".join([row, *cells, *["%.1f" % (other / own) for other in others]]) + " |")
    return "\n".join(lines)


def peers(frames):
    found = {}
    for name in builds.NAMES:
        if name.startswith("gcc"):
            found[name] = beside_counts(name, frames)
            print("%s, %s\n\n%s\n" % (builds.compiler_version(name), builds.OPTIONS[name.split("-", 1)[1]],
                                     tabulate_beside(found[name])), flush=True)
    with open(os.path.join(builds.ROOT, "build", "bench_peers.json"), "w", encoding="utf-8") as file:
        json.dump(found, file, indent=1)
    return 0


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
    parser.add_argument("--peers", action="store_true")
    options = parser.parse_args()
    if shutil.which("valgrind") is None:
        builds.fail("no valgrind: tools/setup.sh test installs it")
    frames = builds.timed_frames()
    if options.check:
        return check(frames)
    if options.peers:
        return peers(frames)
    columns = {"%s, %s" % (builds.compiler_version(name), builds.OPTIONS[name.split("-", 1)[1]]):
               isohead_counts(name, frames) for name in builds.NAMES}
    print("isohead, default mode, the mean of %d frames\n" % sum(p.endswith(".pgm") for p in frames))
    print(tabulate(columns))
    with open(os.path.join(builds.ROOT, "build", "bench_instructions.json"), "w", encoding="utf-8") as file:
        json.dump(columns, file, indent=1)
    return 0


if __name__ == "__main__":
    sys.exit(main())
