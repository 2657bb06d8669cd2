#!/usr/bin/env python3
"""What tests run of firmware/core, and of the board's program (firmware/app and hal): lines and branches per file, from
gcov.

A branch is one of the ways out of one condition of the source, as gcc -O0 compiles it: `a && b` has
four. A line or branch that several compilations have (an inline function of a header) counts once,
and is run when any of them ran it.

coverage.py core|board BUILD    after the tests ran in a build with gcc --coverage -O0: the table, what was not
                                run, and exit status 1 below the limits

Of the board's program these do not count: what runs on a Cortex-M alone; and what runs in the jail of the live view's
process (hal_jail.h), which may write no file, so that nobody learns what it ran. test_view.py tests that one from outside.
"""

import argparse
import collections
import fnmatch
import glob
import json
import os
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

# Folders, sources that do not count, and the limits of all lines and branches, in per cent.
PARTS = {
    "core": (["firmware/core"], [], 97.0, 92.0),
    "board": (["firmware/app", "hal"],
              ["firmware/app/app_cortexm.c", "firmware/app/app_live_main.c", "hal/cortexm/*",
               "hal/linux/hal_jail.c", "hal/linux/hal_serve*.c"], 96.0, 90.0),
}


def data_files(build):
    return sorted(os.path.join(directory, name) for directory, _, names in os.walk(build)
                  for name in names if name.endswith(".gcda"))


def gcov(path):
    """The reports on one object's sources. None of an object whose counts are cut, by a process that was killed while it
    wrote them."""
    done = subprocess.run(["gcov", "--json-format", "--stdout", "--branch-probabilities", path],
                          cwd=os.path.dirname(path), text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, check=False)
    if done.returncode != 0:
        print("coverage of %s cannot be read: not counted" % os.path.basename(path))
        return
    for text in done.stdout.splitlines():
        report = json.loads(text)
        for file in report["files"]:
            yield os.path.realpath(os.path.join(report["current_working_directory"],
                                                file["file"])), file


def is_counted(name, part):
    """A source of the part, by its path in the tree."""
    folders, without, _, _ = PARTS[part]
    return (any(name.startswith(folder + "/") for folder in folders) and
            not any(fnmatch.fnmatch(name, pattern) for pattern in without))


def counts(build, part):
    """{file: {line: runs}}, {file: {(line, number of the branch): times taken}}"""
    lines = collections.defaultdict(collections.Counter)
    branches = collections.defaultdict(collections.Counter)
    found = data_files(os.path.abspath(build))
    if not found:
        sys.exit("coverage: no .gcda below %s: run the tests of a build with --coverage" % build)
    for path in found:
        for source, file in gcov(path):
            name = os.path.relpath(source, ROOT)
            if not is_counted(name, part):
                continue
            for line in file["lines"]:
                lines[name][line["line_number"]] += line["count"]
                for i, branch in enumerate(line["branches"]):
                    branches[name][line["line_number"], i] += branch["count"]
    return lines, branches


def per_cent(counter):
    return 100.0 * sum(count > 0 for count in counter.values()) / len(counter) if counter else 100.0


def table(lines, branches):
    """Prints it; the two figures of the whole."""
    print("%-36s %6s %7s   %8s %7s" % ("file", "lines", "run", "branches", "taken"))
    for name in sorted(lines):
        print("%-36s %6d %6.1f%%   %8d %6.1f%%" % (name, len(lines[name]), per_cent(lines[name]),
                                                 len(branches[name]), per_cent(branches[name])))
    all_lines = {(name, key): n for name in lines for key, n in lines[name].items()}
    all_branches = {(name, key): n for name in branches for key, n in branches[name].items()}
    result = per_cent(all_lines), per_cent(all_branches)
    print("%-36s %6d %6.1f%%   %8d %6.1f%%" % ("all", len(all_lines), result[0],
                                             len(all_branches), result[1]))
    return result


def left(lines, branches):
    """Each source line of which something was not run."""
    for name in sorted(lines):
        with open(os.path.join(ROOT, name), encoding="utf-8") as file:
            text = file.read().splitlines()
        for line in sorted(lines[name]):
            taken = [n for (at, _), n in branches[name].items() if at == line]
            missed = sum(n == 0 for n in taken)
            if lines[name][line] == 0:
                yield "%s:%d: never run: %s" % (name, line, text[line - 1].strip())
            elif missed:
                yield "%s:%d: %d of %d branches not taken: %s" % (name, line, missed, len(taken),
                                                                 text[line - 1].strip())


def check(part, build):
    folders, _, lines_min, branches_min = PARTS[part]
    lines, branches = counts(build, part)
    sources = {os.path.join(folder, name) for folder in folders
               for name in glob.glob("**/*.c", root_dir=os.path.join(ROOT, folder), recursive=True)}
    absent = sorted(name for name in sources - set(lines) if is_counted(name, part))
    if absent:
        sys.exit("coverage: no test is linked with %s" % ", ".join(absent))
    lines_run, branches_taken = table(lines, branches)
    print("\nnot run:")
    for line in left(lines, branches):
        print("  " + line)
    bad = lines_run < lines_min or branches_taken < branches_min
    print("coverage: %s: %.1f %% of lines, at least %.0f; %.1f %% of branches, at least %.0f%s"
          % (part, lines_run, lines_min, branches_taken, branches_min, ": NOT reached" if bad else ""))
    return 1 if bad else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=sorted(PARTS))
    parser.add_argument("build")
    arguments = parser.parse_args()
    return check(arguments.part, arguments.build)


if __name__ == "__main__":
    sys.exit(main())
