#!/usr/bin/env python3
"""Time isohead and its peers A and B, which do the same work with OpenCV and Eigen.

    timing.py [--repetitions N]

One run on one core: every program of every build (gcc and clang, -O3 -march=x86-64-v3 and plain -O2) waits
with its frames in memory and takes its turn, all of them in each repetition, so that whatever else the
machine does meets all alike. First they must agree on what is in the frames (agree.py). A table of medians
over the repetitions, of the 5th percentiles and of the ratios of the medians; build/bench.json has all of it.
Only ratios within one run mean something.
"""

import argparse
import json
import os
import subprocess
import sys

import numpy as np

import agree
import builds

# Rows of the table: name, what isohead's stages and the peers' are called.
ROWS = [("dots", ("dots",)), ("labels", ("align", "labels")), ("points, samples", ("points",)), ("surface", ("surface",)),
        ("cuts, nests", ("nests",)), ("heads to tracks", ("heads", "findings", "tracks", "rest"))]
SUM_TOLERANCE = 0.05  # of the stages against the whole that was timed without timers inside


class Worker:
    """A program that takes turns, on one core."""

    def __init__(self, name, command, arguments, core):
        self.name = name
        self.turns = []
        self.process = subprocess.Popen(
            [*command, "--turns", *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            preexec_fn=lambda: os.sched_setaffinity(0, {core}))

    def turn(self, counts):
        self.process.stdin.write("turn\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            builds.fail("%s ended with status %d" % (self.name, self.process.wait()))
        if counts:
            self.turns.append(json.loads(line))

    def end(self):
        self.process.stdin.close()
        self.process.wait()

    def us(self, keys):
        """Microseconds a frame of some stages, by repetition."""
        return np.array([sum(turn.get(key, 0) for key in keys) for turn in self.turns]) / 1000


def summary(worker):
    rows = ROWS + [("whole frame", ("whole",))]
    return {row: {"median_us": round(float(np.median(worker.us(keys))), 2),
                  "p5_us": round(float(np.quantile(worker.us(keys), 0.05)), 2)} for row, keys in rows}


def sum_complaint(worker):
    """What is wrong with the sum of the stages; None when it is the whole. Quiet repetitions decide."""
    total = np.quantile(worker.us([key for _, keys in ROWS for key in keys]), 0.05)
    whole = np.quantile(worker.us(("whole",)), 0.05)
    if abs(total / whole - 1) <= SUM_TOLERANCE:
        return None
    return "%s: the stages take %.0f us, the whole frame %.0f" % (worker.name, total, whole)


def table(name, stages):
    lines = ["| us a frame: median (5th percentile) | isohead | A | B | A / isohead | B / isohead |",
             "| --- | --- | --- | --- | --- | --- |"]
    for row in [row for row, _ in ROWS] + ["whole frame"]:
        cells = [stages[who][row] for who in ("isohead", "A", "B")]
        own = cells[0]["median_us"]
        ratios = ["%.1f" % (cell["median_us"] / own) for cell in cells[1:]]
        lines.append("| " + " | ".join([row] + ["%.0f (%.0f)" % (c["median_us"], c["p5_us"]) for c in cells] + ratios)
                     + " |")
    options = builds.OPTIONS[name.split("-", 1)[1]]
    return "%s, %s\n\n%s\n" % (builds.compiler_version(name), options, "\n".join(lines))


def processor():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    return names[0] if names else os.uname().machine


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=200)
    options = parser.parse_args()
    frames = builds.timed_frames()
    programs = {name: agree.programs(builds.make(name, ["bench_isohead", "bench_peer"])) for name in builds.NAMES}
    accuracy = {name: agree.compare(p["isohead"], {who: p[who] for who in "AB"}, frames)
                for name, p in programs.items()}
    core = max(os.sched_getaffinity(0))
    workers = [(name, Worker("%s %s" % (name, who), command, frames, core))
               for name, program in programs.items() for who, command in program.items()]
    for i in range(-2, options.repetitions):  # two that do not count, to get warm
        for _, worker in workers:
            worker.turn(i >= 0)
    stages = {name: {} for name in programs}
    for name, worker in workers:
        worker.end()
        stages[name][worker.name.split(" ")[1]] = summary(worker)
    count = sum(path.endswith(".pgm") for path in frames)
    print("%s, one core, %d frames, %d repetitions\n" % (processor(), count, options.repetitions))
    for name in programs:
        print(table(name, stages[name]))
    print(agree.table(accuracy["gcc-O3-v3"]))
    with open(os.path.join(builds.ROOT, "build", "bench.json"), "w", encoding="utf-8") as file:
        json.dump({"processor": processor(), "repetitions": options.repetitions, "frames": count,
                   "compilers": {name: builds.compiler_version(name) for name in programs},
                   "accuracy": accuracy, "stages": stages}, file, indent=1)
    bad = [text for text in (sum_complaint(worker) for _, worker in workers) if text is not None]
    if bad:
        builds.fail("timers or a restless machine, expected the same within %d %%:\n  %s"
                    % (100 * SUM_TOLERANCE, "\n  ".join(bad)))


if __name__ == "__main__":
    sys.exit(main())
