#!/usr/bin/env python3
"""Would the tests notice a mistake? Mistakes are made in a part of the firmware one at a time: another
operator, a constant one more or less, a condition the other way round, a statement left out. The
tests that are linked with the mutated source run, its own first, until one fails; at last its own
once more with the sanitizers that make test has. The parts are
  core         firmware/core
  laser        what switches the laser on and off: policy, frames, the guards and their limits, signals.
               A guard with a mistake may kill whoever it finds: each test runs in a PID namespace of
               its own, with its own /proc. One that waits for ever needs no processor: a test ends after
               WALL_TIMES its time without the mutant, and where that is too short for the test without
               the mutant, too, as the machine has become busy, it is tried again with twice as much

A mutant is one of
  no C         does not compile; not counted
  equivalent   gcc -O2 makes the same object code of it as of the original; not counted
  caught       a test fails, crashes, does not end, or needs CPU_TIMES as much of the processor as
               without the mutant, CPU_MIN_S at least
  golden       no test fails, but the golden set's hashes of every stage's output differ
  alive        nobody noticed

mutation.py [PART] [--count N] [--min PERCENT] [--seed N] [--stage NAME]... [--jobs N] [--unity DIR]
            [--golden FILE]
            the mutants that live, the table per stage, and exit status 1 when fewer than PERCENT
            of them are caught by tests alone. The mutants are drawn by the seed, of
            each source as many as is its share; a source that was not changed keeps its own.
"""

import argparse
import collections
import concurrent.futures
import glob
import math
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import threading
import time

import mutation_sites as sites

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CPU_TIMES = 6
CPU_MIN_S = 2
WALL_TIMES = 4
WALL_MIN_S = 30
KILLED = 128 + 9  # the status of timeout and of unshare
RESULTS = ("no C", "equivalent", "caught", "golden", "alive")

COMPILE = ["gcc", "-std=c11", "-O2", "-ffp-contract=off", "-w", "-c"]
# Tests see no vectors either: their headers say what the core can do.
COMPILE_TEST = ["gcc", "-std=c11", "-O1", "-ffp-contract=off", "-U__SSE2__", "-w", "-c"]
SANITIZERS = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
SANITIZERS_SLOWER = 10


# root: where names begin. folders: copied with all that is in them. library: what tests are linked with.
# mutated: sources of it by name; None: all, and the headers that hold code. tests: by name; None: those
# of the sources.
Part = collections.namedtuple("Part", "root folders library mutated tests options may_kill")
PARTS = {
    "core": Part("firmware/core", ["."], ["**/*.c"], None, None, ["-mgeneral-regs-only", "-I."], False),
    "laser": Part(".", ["firmware/core", "firmware/app", "hal"],
                  ["firmware/core/%s/*.c" % name for name in "align base nests rig".split()] +
                  ["firmware/core/dots/ih_dot_rows.c", "hal/hal*.c", "hal/replay/hal_pgm.c", "hal/linux/hal_guard*.c",
                   "hal/linux/hal_descriptors.c", "hal/linux/hal_signals.c"] +
                  ["firmware/app/app_%s.c" % name for name in
                   "config frame health laser live log loop phase record rig_explain rig_text state status text view write".split()],
                  "app_laser app_frame app_phase hal_limits hal_guard hal_guard_child hal_guard_page "
                  "hal_signals hal_descriptors".split(),
                  "laser loop phase limits guard signals".split(),
                  ["-D_GNU_SOURCE", "-Ifirmware/core", "-Ifirmware/app", "-Ihal"], True),
}
# A process ID of one there is no process here; nothing is left of it when it ends.
NAMESPACE = ["unshare", "--pid", "--fork", "--mount-proc", "--kill-child"]


def run(command, directory=None):
    done = subprocess.run(command, cwd=directory, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, check=False)
    if done.returncode:
        sys.exit("mutation: %s\n%s" % (" ".join(command), done.stdout))
    return done.stdout


def read(path, mode="r"):
    with open(path, mode) as file:
        return file.read()


class Bench:
    """A part and its tests, built once, in a folder; a mutant is built and run in its own one."""

    def __init__(self, part, unity, work, golden=None):
        self.part, self.unity, self.work = part, unity, work
        self.tree = os.path.join(work, "tree")
        self.tests = tests_of(part)
        self.golden_file, self.golden_hashes = golden, None
        self.seconds, self.wall, self.patience = {}, {}, 1
        self.linked = {}  # objects of the library, by test
        self.lock = threading.Lock()
        for folder in part.folders:
            shutil.copytree(os.path.join(ROOT, part.root, folder), os.path.join(self.tree, folder), dirs_exist_ok=True)
        self.sources = files_of(part)
        self.compile = COMPILE + part.options
        for source in self.sources:
            run(self.compile + [source, "-o", source[:-2] + ".o"], self.tree)
        self.library = os.path.join(work, "libpart.a")
        run(["ar", "rcs", self.library] + [os.path.join(self.tree, source[:-2] + ".o") for source in self.sources])
        if unity:
            run(COMPILE_TEST + [unity + "/unity.c", "-o", work + "/unity.o"])
        for test in self.tests:
            self.build_test(test)
        if golden:
            self.build_golden()

    def program(self, test):
        return os.path.join(self.work, os.path.basename(test)[:-2])

    def sanitized(self, test):
        """The object of a test with the sanitizers, built when it is first asked for."""
        output = self.program(test) + ".sanitized.o"
        with self.lock:
            if not os.path.exists(output):
                run(self.compile_test(test, self.tree, output) + SANITIZERS)
                program = output[:-2]
                self.link([output], program, options=SANITIZERS)
                if self.fails(program, test, SANITIZERS_SLOWER):
                    sys.exit("mutation: %s fails with sanitizers without any mutant" % os.path.basename(test))
        return output

    def compile_test(self, test, tree, output):
        options = [re.sub("^-I", "-I%s/" % tree, option) for option in self.part.options if option[1] in "ID"]
        folders = [os.path.dirname(test), os.path.join(ROOT, "tests/unit"), os.path.join(ROOT, "tests/vectors")] + \
            ([self.unity] if self.unity else [])
        return COMPILE_TEST + options + ["-I" + folder for folder in folders] + [test, "-o", output]

    def link(self, objects, output, library=None, options=()):
        unity = [self.work + "/unity.o"] if self.unity else []
        return run(["gcc", *options, *objects, library or self.library, *unity, "-lm", "-Wl,-t,-t", "-o",
                    output])

    def build_test(self, test):
        program = self.program(test)
        run(self.compile_test(test, self.tree, program + ".o"))
        trace = self.link([program + ".o"], program)
        self.linked[test] = set(re.findall(r"libpart\.a\W+(\w+)\.o", trace))
        included = included_source(test)
        if included:
            self.linked[test].add(os.path.basename(included)[:-2])
        begin, wall = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime, time.monotonic()
        if subprocess.run([program], stdout=subprocess.DEVNULL, check=False).returncode:
            sys.exit("mutation: %s fails without any mutant" % os.path.basename(test))
        self.seconds[test] = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - begin
        self.wall[test] = time.monotonic() - wall

    def build_golden(self):
        folder, hal = os.path.join(ROOT, "tests", "golden"), os.path.join(ROOT, "hal")
        names = ("golden", "golden_hash", "golden_inner", "golden_scene", "golden_host")
        objects = []
        for source in [os.path.join(folder, name + ".c") for name in names] + [os.path.join(hal, "hal_text.c")]:
            objects.append(os.path.join(self.work, os.path.basename(source)[:-2] + ".o"))
            run(COMPILE_TEST + ["-I", self.tree, "-I", hal, source, "-o", objects[-1]])
        self.golden_objects = objects
        program = os.path.join(self.work, "golden")
        self.link(objects, program)
        self.golden_hashes = run([program, self.golden_file])

    def fails(self, program, test, slower=1):
        command = limited(program, slower * self.seconds[test])
        if not self.part.may_kill:
            return run_to_failure(command) != 0
        while True:
            limit = self.patience * slower * max(WALL_MIN_S, WALL_TIMES * self.wall[test])
            status = run_to_failure(in_namespace(command, limit))
            if status != KILLED or run_to_failure(in_namespace([self.program(test)], limit)) == 0:
                return status != 0
            self.patience *= 2

    def tests_of(self, source):
        """Those that the source is linked with: its own, then the others, the quick ones first."""
        own = [test for test in self.tests if is_own(test, source)]
        others = [test for test in self.tests if test not in own and
                  (source.endswith(".h") or stem_of(source) in self.linked[test])]
        return own + sorted(others, key=lambda test: self.seconds[test])


def files_of(part, patterns=None):
    root = os.path.join(ROOT, part.root)
    return sorted(set(sum((glob.glob(pattern, root_dir=root, recursive=True)
                           for pattern in patterns or part.library), [])))


def stem_of(source):
    return os.path.basename(source)[:-2]


def is_own(test, source):
    return os.path.basename(test)[5:-2] == re.sub(r"^(ih|app|hal)_", "", stem_of(source))


def included_source(test):
    """The source of the part that a test includes, to reach its static functions."""
    found = re.search(r'^#include "([\w/]+\.c)"', read(test), re.MULTILINE)
    return found[1] if found else None


def limited(program, seconds):
    """The command for a program that must not run for ever; how busy the machine is is no matter."""
    return ["prlimit", "--cpu=%d" % math.ceil(max(CPU_MIN_S, CPU_TIMES * seconds)), program]


def in_namespace(command, seconds):
    """The command where it can end nobody else, and is ended with all that it has begun."""
    user = [] if os.getuid() == 0 else ["--user", "--map-root-user"]
    return NAMESPACE + user + ["timeout", "--signal=KILL", str(math.ceil(seconds))] + command


def run_to_failure(command):
    """Runs a test until its first failure; its status, 0 where there was none."""
    # stdbuf: each line as it is written, not all of them at the end
    with subprocess.Popen(["stdbuf", "-oL"] + command, text=True, errors="replace",
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                          env=dict(os.environ, ASAN_OPTIONS="verify_asan_link_order=0")) as process:
        if any(":FAIL" in text for text in process.stdout):
            process.kill()
    return process.returncode


class Trial:
    """One mutant, in a folder of its own."""

    def __init__(self, bench, source, mutant, folder):
        self.bench, self.source, self.mutant, self.folder = bench, source, mutant, folder
        self.tree = os.path.join(folder, "tree")
        shutil.copytree(bench.tree, self.tree)
        text = read(os.path.join(self.tree, source))
        with open(os.path.join(self.tree, source), "w", encoding="utf-8") as file:
            file.write(sites.apply(text, mutant))
        # A header's mutant is in every source; which of them include it is not looked up.
        self.sources = bench.sources if source.endswith(".h") else [source]
        self.objects = [os.path.join(self.tree, name[:-2] + ".o") for name in self.sources]

    def compile(self):
        return all(subprocess.run(self.bench.compile + [name, "-o", name[:-2] + ".o"], cwd=self.tree,
                                  stderr=subprocess.DEVNULL, check=False).returncode == 0 for name in self.sources)

    def is_equivalent(self):
        return all(read(path, "rb") == read(os.path.join(self.bench.tree, os.path.relpath(path, self.tree)), "rb")
                   for path in self.objects)

    def put_into_library(self):
        self.library = shutil.copy(self.bench.library, self.folder)
        run(["ar", "r", self.library] + self.objects)

    def is_caught_by(self, test):
        built = self.bench.program(test) + ".o"
        if included_source(test) == self.source or \
                self.source.endswith(".h") and is_own(test, self.source):
            built = os.path.join(self.folder, "test.o")
            if subprocess.run(self.bench.compile_test(test, self.tree, built), check=False,
                              stderr=subprocess.DEVNULL).returncode:
                return True  # a static assertion of the test
        program = os.path.join(self.folder, "test")
        self.bench.link([built], program, self.library)
        return self.bench.fails(program, test)

    def is_caught_by_sanitizers(self, test):
        """A source's own test, with both of them compiled as make test does."""
        objects = [os.path.join(self.folder, "sanitized.o")]
        if included_source(test) == self.source:
            run(self.bench.compile_test(test, self.tree, objects[0]) + SANITIZERS)
        else:
            run(self.bench.compile + ["-O1", self.source, "-o", objects[0]] + SANITIZERS, self.tree)
            objects.append(self.bench.sanitized(test))
        program = os.path.join(self.folder, "test")
        self.bench.link(objects, program, self.library, SANITIZERS)
        return self.bench.fails(program, test, SANITIZERS_SLOWER)

    def differs_in_golden(self):
        if not self.bench.golden_file:
            return False
        program = os.path.join(self.folder, "golden")
        self.bench.link(self.bench.golden_objects, program, self.library)
        done = subprocess.run(limited(program, CPU_MIN_S) + [self.bench.golden_file], text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False)
        return done.stdout != self.bench.golden_hashes

    def result(self):
        """(one of RESULTS, the test that caught it)"""
        if not self.compile():
            return "no C", ""
        if self.is_equivalent():
            return "equivalent", ""
        self.put_into_library()
        tests = self.bench.tests_of(self.source)
        for test in tests:
            if self.is_caught_by(test):
                return "caught", os.path.basename(test)
        if self.source.endswith(".c") and tests and is_own(tests[0], self.source) and \
                self.is_caught_by_sanitizers(tests[0]):
            return "caught", os.path.basename(tests[0]) + " with sanitizers"
        return ("golden" if self.differs_in_golden() else "alive"), ""


def try_one(bench, source, mutant):
    with tempfile.TemporaryDirectory(dir=bench.work) as folder:
        return mutant, Trial(bench, source, mutant, folder).result()


def mutated_sources(part):
    """Those named; else every source, and the headers that hold code."""
    if part.mutated:
        return [name for name in files_of(part) if stem_of(name) in part.mutated]
    return [name for name in files_of(part, ["**/*.[ch]"])
            if name.endswith(".c") or "static inline" in read(os.path.join(ROOT, part.root, name))]


def fractions(weights, count):
    """Whole numbers in proportion to the weights, at least 1 each, that add up to count or more."""
    total = sum(weights.values())
    return {name: max(1, round(count * weight / total)) for name, weight in weights.items()}


def draw(bench, source, count, seed, pool):
    """Tries mutants of one source until so many count, or there are no more."""
    every = sites.mutants(read(os.path.join(bench.tree, source)))
    random.Random("%d %s" % (seed, source)).shuffle(every)
    tried, counted = [], 0
    while every and counted < count:
        batch, every = every[:count - counted], every[count - counted:]
        for mutant, result in pool.map(lambda one: try_one(bench, source, one), batch):
            tried.append((mutant, result))
            counted += result[0] not in ("no C", "equivalent")
    return tried


def rate(count, *results):
    all_counted = sum(count[name] for name in ("caught", "golden", "alive"))
    return 100.0 * sum(count[name] for name in results) / all_counted if all_counted else 100.0


def line(name, count):
    if count is None:
        print(name)
        return
    counted = sum(count[result] for result in ("caught", "golden", "alive"))
    print("%-14s %7d %7d %6.1f%% %7d %6.1f%% %6d   %10d" %
          (name, counted, count["caught"], rate(count, "caught"), count["golden"],
           rate(count, "caught", "golden"), count["alive"], count["equivalent"]))


def report(bench, quota, seed, jobs):
    """Runs them all and prints those that live as they come, then the tables; the counts of all."""
    stages, kinds = {}, collections.defaultdict(collections.Counter)
    print("not caught by a test (golden: the golden set's hashes differ):", flush=True)
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for source, count in quota.items():
            text = read(os.path.join(bench.tree, source))
            results = stages[source] = collections.Counter()
            for mutant, (result, _) in draw(bench, source, count, seed, pool):
                results[result] += 1
                kinds[mutant.kind][result] += 1
                if result in ("golden", "alive"):
                    print("  %-6s %s:%d %s" % (result, source, sites.line_of(text, mutant),
                                               sites.describe(text, mutant)), flush=True)
    total = sum(stages.values(), collections.Counter())
    print("\n%-14s %7s %15s %15s %6s   %10s" % ("source", "mutants", "caught by tests", "or golden",
                                               "alive", "equivalent"))
    for name, count in list(stages.items()) + [("all", total)] + [("", None)] + \
            [(kind, kinds[kind]) for kind in sites.KINDS]:
        line(name, count)
    return total


def check(arguments):
    part = PARTS[arguments.part]
    if part.may_kill:
        run(in_namespace(["true"], 10))
    quota = fractions({name: len(sites.mutants(read(os.path.join(ROOT, part.root, name))))
                       for name in mutated_sources(part)}, arguments.count)
    if arguments.stage:
        quota = {name: quota[name] for name in quota
                 if re.sub(r"^(ih|app|hal)_", "", stem_of(name)) in arguments.stage}
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as work:
        bench = Bench(part, arguments.unity, work, arguments.golden)
        total = report(bench, quota, arguments.seed, arguments.jobs)
    caught = rate(total, "caught")
    counted = sum(total[name] for name in ("caught", "golden", "alive"))
    bad = caught < arguments.min
    print("mutation of %s: %d mutants, tests alone catch %.1f %%, at least %.0f%s; with the golden set %.1f %%; "
          "%.0f s" % (arguments.part, counted, caught, arguments.min, ": NOT reached" if bad else "",
                      rate(total, "caught", "golden"), time.monotonic() - begin))
    return 1 if bad else 0


def tests_of(part):
    """Those named; else the tests of a source of the part by its name, and those that include one."""
    every = sorted(glob.glob(ROOT + "/tests/unit/**/test_*.c", recursive=True))
    if part.tests:
        return [test for test in every if os.path.basename(test)[5:-2] in part.tests]
    names = {os.path.basename(name) for name in files_of(part)}

    def is_of_part(test):
        stem, included = os.path.basename(test)[5:-2], included_source(test)
        return bool({stem + ".c", "ih_" + stem + ".c", included and os.path.basename(included)} & names)
    return [test for test in every if is_of_part(test)]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", nargs="?", default="core", choices=sorted(PARTS))
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--min", type=float, default=85.0, metavar="PERCENT")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--stage", action="append", help="only this one; dots, isohead ...")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--unity", default=os.path.join(ROOT, "build", "third_party", "unity", "src"))
    parser.add_argument("--golden", metavar="FILE", help="frames of golden_pack")
    arguments = parser.parse_args()
    os.nice(10)
    return check(arguments)


if __name__ == "__main__":
    sys.exit(main())
