#!/usr/bin/env python3
"""Who may include whom: the rules of the source tree, read from the #include lines.

  core     its folders stand in an order, CORE_ORDER: a file includes what its own folder and those before
           have, each header by its folder. Only isohead.h lists the stages. Of the system: fixed-width
           integers, bool, size_t and string.h, nothing that does I/O, allocates or knows floating point;
           a processor's vectors in simd alone.
  hal      hal.h, what all back ends share, its own files and the system; never firmware. hal_directory makes a live
           camera of hal/replay.
  app      core, hal.h, its own files; of the back ends only app_board and app_live_main know one,
           hal/linux, and app_cortexm one, hal/cortexm, with the decoder of PGM.
  sim      core, the app's records and rig, hal, its own files.
  render   its own files and the system: what draws the frames shares no line with what reads them.
  people   core.
  rigblob  core, the app's rig, hal_file.h.
  size     the system: a plugin of QEMU.
  bench    core, the app's rig, hal's files, its own files.
  tests    anything.

includes.py      exit status 1 if a rule is broken, each with file and line
"""

import os
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

CORE_ORDER = ["base", "simd", "rig", "dots", "labels", "align", "points", "surface", "nests", "detect", "tracks", "pose", "upkeep"]
CORE_SYSTEM = {"stdalign.h", "stdbool.h", "stddef.h", "stdint.h", "string.h"}
# The vectors of x86 and ARM, and the pairs of a Cortex-M: for simd alone.
VECTOR_HEADERS = {"immintrin.h", "emmintrin.h", "arm_neon.h", "arm_acle.h"}

INCLUDE = re.compile(r'^\s*#\s*include\s*(["<])([^">]+)[">]')


def judge_core(path, quoted, target):
    parts = path.split("/")[2:]
    folder = parts[0] if len(parts) == 2 else None
    if folder is not None and folder not in CORE_ORDER:
        return "this folder stands in no order: add it to CORE_ORDER in tests/checks/includes.py"
    if not quoted:
        if target in CORE_SYSTEM:
            return None
        if target in VECTOR_HEADERS and folder == "simd":
            return None
        return "the core does without <%s>" % target
    if "/" not in target:
        if path.endswith("/isohead.c") and target == "isohead.h":
            return None
        return "a header is named with its folder; isohead.h is for isohead.c"
    if target.split("/")[0] not in CORE_ORDER:
        return "nothing of ours outside of the core"
    before = CORE_ORDER[:CORE_ORDER.index(folder) + 1] if folder else CORE_ORDER
    return None if target.split("/")[0] in before else "%s may include %s" % (folder, ", ".join(before))


def is_core(target):
    return target == "isohead.h" or target.split("/")[0] in CORE_ORDER


def judge_hal(path, quoted, target):
    if is_core(target):
        return "hal knows no firmware"
    own = os.path.basename(os.path.dirname(path))
    if target == "replay/hal_replay.h" and os.path.basename(path).startswith("hal_directory."):
        return None
    if quoted and not re.fullmatch(r"hal\.h|hal_(file|limits|text)\.h|(%s/)hal_\w+\.h" % own, target):
        return "a back end includes hal.h, hal_file.h, hal_limits.h, hal_text.h and its own files by their folder"
    return None


def judge_app(path, quoted, target):
    if not quoted or is_core(target):
        return None
    good = re.fullmatch(r"app_\w+\.h|hal\.h|hal_(file|limits|text)\.h", target)
    if os.path.basename(path).startswith(("app_board.", "app_live_main.")):
        good = good or re.fullmatch(r"linux/hal_\w+\.h", target)
    if os.path.basename(path) == "app_cortexm.c":
        good = good or re.fullmatch(r"cortexm/hal_\w+\.h|replay/hal_pgm\.h", target)
    return None if good else "the app includes the core, hal.h and its own files"


def judge_sim(path, quoted, target):
    if not quoted or is_core(target):
        return None
    good = re.fullmatch(r"sim_\w+\.h|hal\.h|hal_file\.h|replay/hal_\w+\.h|"
                        r"app_(rig|rig_explain|rig_text|record|text|view|write)\.h", target)
    return None if good else "sim includes the core, hal, the app's records and its own files"


def judge_render(path, quoted, target):
    if is_core(target) or re.match(r"(sim|hal|app)\b|(sim|hal|app)_", target):
        return "render shares nothing with the programs that read its frames"
    if quoted and not re.fullmatch(r"rd_\w+\.h", target):
        return "render includes its own files"
    return None


def judge_size(_path, quoted, _target):
    return "a plugin of QEMU knows nothing of ours" if quoted else None


def judge_people(_path, quoted, target):
    return None if is_core(target) or not quoted else "only the core"


def judge_rigblob(path, quoted, target):
    if not quoted or is_core(target) or re.fullmatch(r"app_rig(_explain)?\.h|hal\.h|hal_file\.h", target):
        return None
    return "rigblob includes the core, the app's rig and hal_file.h"


def judge_bench(path, quoted, target):
    if not quoted or is_core(target):
        return None
    good = re.fullmatch(r"(bench|worst)_\w+\.h|hal_file\.h|replay/hal_pgm\.h|app_rig\.h", target)
    return None if good else "bench includes the core, the app's rig, hal's files and its own"


FOLDERS = {"firmware/core": judge_core, "firmware/app": judge_app, "hal": judge_hal, "sim": judge_sim,
           "tools/render": judge_render, "tools/rigblob": judge_rigblob, "tools/size": judge_size,
           "tools/bench": judge_bench, "tools/people": judge_people}


def judge(path, line):
    """What is wrong with a line of a file; None when nothing is."""
    found = INCLUDE.match(line)
    if not found:
        return "an include of a macro" if re.match(r"\s*#\s*include", line) else None
    if ".." in found[2].split("/"):
        return "no way up: name the file from an include directory"
    for folder, rule in FOLDERS.items():
        if path.startswith(folder + "/"):
            return rule(path, found[1] == '"', found[2])
    return "this folder stands in no rule: add it to tests/checks/includes.py"


def sources():
    for top in ("firmware", "hal", "sim", "tools"):
        for directory, below, files in os.walk(os.path.join(ROOT, top)):
            below.sort()
            for name in sorted(files):
                if name.endswith((".c", ".h")):
                    yield os.path.relpath(os.path.join(directory, name), ROOT)


def check():
    bad = lines = files = 0
    for path in sources():
        files += 1
        with open(os.path.join(ROOT, path), encoding="utf-8") as file:
            for number, line in enumerate(file, 1):
                lines += bool(INCLUDE.match(line))
                reason = judge(path, line)
                if reason:
                    bad += 1
                    print("%s:%d: %s: %s" % (path, number, line.strip(), reason))
    print("includes: %d files, %d includes, %d against the rules" % (files, lines, bad))
    return 1 if bad or not lines else 0


if __name__ == "__main__":
    sys.exit(check())
