#!/usr/bin/env python3
"""Which of ten thousand frames costs most, how much, and what bounds it?

    worst.py [--frames N] --plugin-header DIR

Frames that are drawn to cost much (bench_worst.c) with the paper's rig and with a wide one, rendered sequences
of all kinds, and rendered ones seen through the other rig. Instructions are those of a 64-bit ARM build
(gcc -O2: a Cortex-A53's), counted in QEMU by worst_count.c, so they are the same each time. The worst frame
is written to build/bench/worst.pgm, and what its stages take on x86-64 is counted by callgrind.
"""

import argparse
import os
import re
import statistics
import subprocess
import sys

import builds
import counts

ARM = os.path.join(builds.WORK, "arm64-O2")
SCENES = ("person", "turning", "table", "room", "clutter", "visit", "two")
SEQUENCE = 100  # drawn frames of a sequence
RENDERED = 50


def build_arm():
    cjson = os.path.join(builds.ROOT, "build", "third_party", "cjson")
    os.makedirs(ARM, exist_ok=True)
    log = os.path.join(ARM, "log")
    builds.run_quietly(
        ["cmake", "-S", builds.ROOT, "-B", ARM, "-DCMAKE_BUILD_TYPE=Bench", "-DCMAKE_C_FLAGS_BENCH=-O2",
         "-DCMAKE_TOOLCHAIN_FILE=" + os.path.join(builds.ROOT, "cmake", "arm64.cmake"),
         "-DISOHEAD_CJSON_DIR=" + cjson, "-DCMAKE_EXE_LINKER_FLAGS=-static"], log)
    builds.run_quietly(["cmake", "--build", ARM, "--parallel", "2", "--target", "bench_worst"], log)
    return builds.program(ARM, "bench_worst")


def build_plugin(header_folder):
    plugin = os.path.join(builds.WORK, "libworst_count.so")
    source = os.path.join(builds.ROOT, "tools", "bench", "worst_count.c")
    builds.run_quietly(["gcc", "-std=c11", "-O2", "-fPIC", "-shared", "-Wall", "-Wextra", "-Werror", "-isystem",
                        header_folder, source, "-o", plugin], os.path.join(ARM, "log"))
    return plugin


def address(program, symbol):
    listed = subprocess.run(["aarch64-linux-gnu-nm", program], check=True, stdout=subprocess.PIPE, text=True).stdout
    return re.search(r"^([0-9a-f]+) T %s$" % symbol, listed, re.M)[1]


class Counter:
    def __init__(self, header_folder):
        self.program = build_arm()
        self.out = os.path.join(builds.WORK, "worst.counts")
        self.plugin = "%s,out=%s,from=%s,to=%s" % (build_plugin(header_folder), self.out,
                                                   address(self.program, "bench_worst_frame"),
                                                   address(self.program, "bench_worst_end"))

    def run(self, arguments):
        """(instructions, what was found) of each frame."""
        found = subprocess.run(["qemu-aarch64", "-plugin", self.plugin, self.program, *arguments], check=True,
                               stdout=subprocess.PIPE, text=True).stdout.splitlines()
        with open(self.out, encoding="utf-8") as file:
            numbers = [int(line) for line in file]
        if len(numbers) != len(found) or not numbers:
            builds.fail("%d frames were counted, %d processed: %s" % (len(numbers), len(found), arguments[:3]))
        return list(zip(numbers, found))


def render(rig, scene, seed):
    """A rendered sequence's rig and frames."""
    folder = os.path.join(builds.WORK, "rendered", "%s-%s-%d" % (rig, scene, seed))
    if not os.path.exists(os.path.join(folder, "rig.json")):
        program = os.path.join(builds.ROOT, "build", "host", "tools", "render", "render")
        subprocess.run([program, "--rig", rig, "--scene", scene, "--sequence", str(1 + seed % 2), "--seed", str(seed),
                        "--frames", str(RENDERED), folder], check=True, stdout=subprocess.DEVNULL)
    names = sorted(name for name in os.listdir(folder) if name.endswith(".pgm"))
    return os.path.join(folder, "rig.json"), [os.path.join(folder, name) for name in names]


def batches(frames):
    """Arguments of bench_worst, until there are enough frames: of ten sequences four drawn for each rig, and
    two rendered ones as long as a drawn one together with the same ones seen through the other rig."""
    rigs = {rig: render(rig, "person", 1)[0] for rig in ("paper", "wide")}
    done = number = 0
    while done < frames:
        rig = ("paper", "wide")[number % 2]
        if number % 10 < 8:
            yield [rigs[rig], str(number // 2 * SEQUENCE), str(min(SEQUENCE, frames - done))]
            done += SEQUENCE
        else:
            own, paths = render(rig, SCENES[number // 10 % len(SCENES)], 7101 + number)
            for used in (own, rigs["wide" if rig == "paper" else "paper"]):
                yield [used, "0", str(len(paths)), *paths]
                done += len(paths)
        number += 1


def alone(arguments, index):
    """The arguments for one frame of a batch, after those before it in its sequence."""
    paths = arguments[3:]
    if paths:
        return [arguments[0], str(index), "1", *paths[:index + 1]]
    return [arguments[0], str(int(arguments[1]) + index), "1"]


def save(arguments, target):
    paths = arguments[3:]
    if paths:
        with open(paths[-1], "rb") as source, open(target, "wb") as file:
            file.write(source.read())
    else:
        program = builds.program(os.path.join(builds.WORK, counts.CHECKED), "bench_worst")
        subprocess.run([program, "--save", target, *arguments], check=True, stdout=subprocess.DEVNULL)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=10000)
    parser.add_argument("--plugin-header", required=True)
    options = parser.parse_args()
    counter, by_kind, worst = Counter(options.plugin_header), {}, (0, "", [])
    for batch in batches(options.frames):
        rig = os.path.basename(os.path.dirname(batch[0])).split("-")[0]
        for index, (number, found) in enumerate(counter.run(batch)):
            kind = "%s, %s rig" % (found.split(" ")[1], rig)
            by_kind.setdefault(kind, []).append((number, found, batch, index))
            if number > worst[0]:
                worst = (number, found, alone(batch, index))
    print("| kind | frames | median, thousand instructions | most | of the frame with most |\n"
          "| --- | --- | --- | --- | --- |")
    for kind in sorted(by_kind, key=lambda k: -max(entry[0] for entry in by_kind[k])):
        numbers = [entry[0] for entry in by_kind[kind]]
        largest = max(by_kind[kind], key=lambda entry: entry[0])
        print("| %s | %d | %d | %d | %s |" % (kind, len(numbers), statistics.median(numbers) / 1000, largest[0] / 1000,
                                              largest[1].split(" ", 2)[2]))
    target = os.path.join(builds.WORK, "worst.pgm")
    folder = builds.make(counts.CHECKED, ["bench_worst"])
    program = builds.program(folder, "bench_worst")
    stages = counts.of_stages(counts.count([program, *worst[2]], 1, "bench_worst_frame"))
    save(worst[2], target)
    print("\nThe worst frame, %s: %d thousand instructions on arm64 (%s); %s\n" %
          (os.path.relpath(target, builds.ROOT), worst[0] / 1000, worst[1], " ".join(["bench_worst", *worst[2][:3]])))
    print(counts.tabulate({"the worst frame, x86-64, gcc -O2": stages}))


if __name__ == "__main__":
    sys.exit(main())
