#!/usr/bin/env python3
"""The limits of the tree's layout, as CONTRIBUTING.md states them.

  length     no .c of the firmware has more than 520 lines; ih_score_weights.h is generated and a table
  vectors    intrinsics and the names of vector units stand in firmware/core/simd alone; elsewhere a kernel
             asks for lanes (IH_I16_LANES and its kin), and at most 1,200 lines of the core do
  files      the repository has at most 1,000 files

layout.py      exit status 1 if a limit is passed, each with file and line
"""

import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
LINES_MAX = 520
VECTOR_LINES_MAX = 1200
FILES_MAX = 1000
VECTOR_UNIT = re.compile(r"\b(__SSE\w*__|__AVX\w*__|__ARM_NEON\w*|\w*mmintrin|arm_neon|_mm\d*_\w+|__m\d+i?|"
                         r"v[a-z]+\d?[a-z]*q?(_n|_lane|_high|_low)?_[su](8|16|32|64))\b")
CONDITION = re.compile(r"#\s*(if|ifdef|ifndef|elif|else|endif)\b(.*)")
LANES = re.compile(r"\bIH_[UI](8|16|32|64)_LANES\b|\bISOHEAD_PLAIN\b|\bIH_CORTEXM\b")


def tracked(*patterns):
    return subprocess.run(["git", "ls-files", "--", *patterns], cwd=ROOT, text=True, check=True,
                          stdout=subprocess.PIPE).stdout.split("\n")[:-1]


def lines_of(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read().split("\n")[:-1]


def under_lanes(lines):
    """How many lines stand under a condition on lanes; the plain twin under its #else is not one of them."""
    count, stack = 0, []
    for line in lines:
        found = CONDITION.match(line.strip())
        if found:
            kind, condition = found.groups()
            if kind in ("if", "ifdef", "ifndef"):
                stack.append(bool(LANES.search(condition)))
            elif kind == "elif" and stack:
                stack[-1] = bool(LANES.search(condition))
            elif kind == "else" and stack:
                stack[-1] = False
            elif stack:
                stack.pop()
        elif any(stack):
            count += 1
    return count


def main():
    wrong, vector_lines = [], 0
    for path in tracked("firmware/*.c", "firmware/*.h"):
        lines = lines_of(path)
        if path.endswith(".c") and len(lines) > LINES_MAX:
            wrong.append("%s: %d lines, at most %d: split it" % (path, len(lines), LINES_MAX))
        if path.startswith("firmware/core/simd/"):
            continue
        wrong += ["%s:%d: %s: vectors only through simd/ih_simd.h" % (path, number, found[0])
                  for number, line in enumerate(lines, 1) for found in [VECTOR_UNIT.search(line)] if found]
        vector_lines += under_lanes(lines)
    if vector_lines > VECTOR_LINES_MAX:
        wrong.append("firmware/core: %d lines under a condition on lanes, at most %d" % (vector_lines, VECTOR_LINES_MAX))
    files = len(tracked())
    if files > FILES_MAX:
        wrong.append("%d files, at most %d" % (files, FILES_MAX))
    for line in wrong:
        print("layout: " + line)
    print("layout: %d files, %d lines of the core under a condition on lanes, %d limits passed"
          % (files, vector_lines, len(wrong)))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
