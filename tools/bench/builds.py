"""Builds of the benchmark programs, below build/bench: each compiler at each set of options."""

import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
WORK = os.path.join(ROOT, "build", "bench")
FRAMES = os.path.join(ROOT, "frames")

OPTIONS = {"O3-v3": "-O3 -march=x86-64-v3", "O2": "-O2"}
COMPILERS = {"gcc": ("gcc", "g++"), "clang": ("clang", "clang++")}
NAMES = ["%s-%s" % (compiler, option) for option in OPTIONS for compiler in COMPILERS]


def fail(text):
    sys.stderr.write("bench: %s\n" % text)
    sys.exit(1)


def run_quietly(command, log):
    """Its output is shown when it fails only."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    with open(log, "a", encoding="utf-8") as file:
        file.write(done.stdout)
    if done.returncode != 0:
        sys.stderr.write(done.stdout[-4000:])
        fail("failed: %s" % " ".join(command))


def make(name, targets, source=ROOT, work=WORK, cross=()):
    """Build targets as NAME says (compiler-options), from another source folder if one is given;
    the folder of the build."""
    compiler, options = name.split("-", 1)
    cc, cxx = COMPILERS[compiler]
    folder = os.path.join(work, name)
    os.makedirs(folder, exist_ok=True)
    log = os.path.join(folder, "log")
    peers = "ON" if "bench_peer" in targets else "OFF"
    # -w: warnings are the ordinary builds' business.
    command = ["cmake", "-S", source, "-B", folder, "-DCMAKE_BUILD_TYPE=Bench",
               "-DCMAKE_C_COMPILER=" + cc, "-DCMAKE_CXX_COMPILER=" + cxx, "-DISOHEAD_BENCH=" + peers,
               "-DCMAKE_C_FLAGS_BENCH=%s -w" % OPTIONS[options],
               "-DCMAKE_CXX_FLAGS_BENCH=%s -w" % OPTIONS[options], *cross]
    run_quietly(command, log)
    run_quietly(["cmake", "--build", folder, "--parallel", "2", "--target", *targets], log)
    return folder


def program(folder, name):
    return os.path.join(folder, "tools", "bench", name)


def compiler_version(name):
    line = subprocess.run([COMPILERS[name.split("-")[0]][0], "--version"], check=True,
                          stdout=subprocess.PIPE, text=True).stdout.splitlines()[0]
    return "%s %s" % (name.split("-")[0], re.search(r"(\d+\.\d+\.\d+)", line)[1])


def sequence(number, frames):
    """The arguments for some frames of frames/sequenceN."""
    folder = os.path.join(FRAMES, "sequence%d" % number)
    names = ["rig.json"] + ["%06d.pgm" % i for i in frames]
    paths = [os.path.join(folder, name) for name in names]
    for path in paths:
        if not os.path.exists(path):
            fail("no %s: make frames renders it" % path)
    return paths


# The frames that are timed and compared: people in both sequences, hands before the face in the second.
TIMED = [(1, range(12, 16)), (2, range(14, 18))]


def timed_frames():
    return [path for number, frames in TIMED for path in sequence(number, frames)]
