#!/usr/bin/env python3
"""Who may include whom: the rules of the source tree, read from the #include lines.

  core     the stages form a chain; a stage's header includes the stage before it and the few
           headers that all share, its source only its own header and the arithmetic. isohead.c sees
           the stages through isohead.h alone. Of the system: fixed-width integers, bool, size_t and
           string.h, nothing that does I/O, allocates or knows floating point.
  hal      hal.h, what all back ends share, its own files and the system; never firmware.
  app      core, hal.h, its own files; of the back ends only app_board and app_live_main know one,
           hal/linux, and app_cortexm one, hal/cortexm, with the decoder of PGM.
  sim      core, the app's records and rig, hal, its own files.
  render   its own files and the system: what draws the frames shares no line with what reads them.
  rigblob  core, the app's rig, hal_file.h.
  size     the system: a plugin of QEMU.
  bench    core, the app's rig, hal's files, its own files.
  tests    anything.

includes.py [--self-test]      exit status 1 if a rule is broken, each with file and line
"""

import argparse
import os
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

# Each core header and what it may include; CORE_SHARED goes without saying above ih_rig.h.
CORE_SHARED = {"ih_config.h", "ih_types.h", "ih_rig.h"}
CORE_HEADERS = {
    "ih_config.h": set(),
    "ih_types.h": set(),
    "ih_range.h": set(),
    "ih_fix.h": {"ih_range.h"},
    "ih_words.h": set(),
    "ih_lanes.h": set(),
    "ih_lane16.h": {"ih_range.h"},
    "ih_rig.h": {"ih_config.h", "ih_types.h"},
    "ih_blob.h": CORE_SHARED,
    "ih_cholesky.h": {"ih_config.h", "ih_types.h"},
    "ih_normal.h": {"ih_config.h", "ih_types.h"},
    "ih_basis.h": {"ih_config.h", "ih_types.h"},
    "ih_band.h": {"ih_config.h", "ih_types.h"},
    "ih_noise.h": {"ih_config.h", "ih_types.h", "ih_band.h"},
    "ih_dots.h": CORE_SHARED | {"ih_noise.h"},
    "ih_lens.h": CORE_SHARED | {"ih_dots.h"},
    "ih_labels.h": CORE_SHARED | {"ih_dots.h", "ih_lens.h"},
    "ih_exposure.h": CORE_SHARED | {"ih_labels.h"},
    "ih_turn.h": CORE_SHARED | {"ih_dots.h"},
    "ih_places.h": CORE_SHARED | {"ih_labels.h", "ih_turn.h"},
    "ih_health.h": CORE_SHARED | {"ih_places.h"},
    "ih_cloud.h": CORE_SHARED,
    "ih_windows.h": CORE_SHARED,
    "ih_points.h": CORE_SHARED | {"ih_labels.h", "ih_windows.h"},
    "ih_samples.h": CORE_SHARED | {"ih_points.h"},
    "ih_surface.h": CORE_SHARED | {"ih_samples.h", "ih_basis.h", "ih_normal.h"},
    "ih_cuts.h": CORE_SHARED | {"ih_surface.h"},
    "ih_parts.h": CORE_SHARED | {"ih_cuts.h"},
    "ih_ellipse.h": CORE_SHARED | {"ih_parts.h"},
    "ih_hypotheses.h": CORE_SHARED | {"ih_ellipse.h"},
    "ih_heads.h": CORE_SHARED | {"ih_hypotheses.h"},
    "ih_space.h": CORE_SHARED | {"ih_samples.h"},
    "ih_ellipsoid.h": CORE_SHARED | {"ih_space.h"},
    "ih_rating.h": CORE_SHARED | {"ih_ellipsoid.h"},
    "ih_scan.h": CORE_SHARED | {"ih_rating.h"},
    "ih_row.h": CORE_SHARED | {"ih_ellipsoid.h", "ih_cholesky.h"},
    "ih_glance.h": CORE_SHARED | {"ih_row.h"},
    "ih_fit.h": CORE_SHARED | {"ih_row.h"},
    "ih_tally.h": CORE_SHARED | {"ih_ellipsoid.h"},
    "ih_evidence.h": CORE_SHARED | {"ih_fit.h", "ih_tally.h"},
    "ih_score.h": CORE_SHARED | {"ih_evidence.h"},
    "ih_score_weights.h": {"ih_score.h"},
    "ih_findings.h": CORE_SHARED | {"ih_glance.h", "ih_heads.h", "ih_scan.h", "ih_score.h"},
    "ih_tracks.h": CORE_SHARED | {"ih_findings.h"},
    "ih_result.h": CORE_SHARED | {"ih_tracks.h"},
    "isohead.h": CORE_SHARED | {"ih_result.h"},
}
CORE_SYSTEM = {"stdbool.h", "stddef.h", "stdint.h", "string.h"}
# The vectors of x86 and the pairs of a Cortex-M, for files that have the same without.
CORE_VECTORS = {("ih_normal.c", "immintrin.h"), ("ih_normal.c", "arm_acle.h"), ("ih_basis.c", "immintrin.h"),
                ("ih_lanes.h", "immintrin.h"), ("ih_lanes.h", "arm_neon.h"), ("ih_cuts.c", "immintrin.h"),
                ("ih_row.c", "immintrin.h"), ("ih_rating.c", "immintrin.h"), ("ih_rating.c", "arm_neon.h"),
                ("ih_words.h", "arm_acle.h"), ("ih_parts.c", "immintrin.h"),
                ("ih_parts.c", "arm_acle.h"), ("ih_lens.c", "immintrin.h"), ("ih_surface.c", "immintrin.h")}

INCLUDE = re.compile(r'^\s*#\s*include\s*(["<])([^">]+)[">]')


def allowed_in_core(name):
    if name in CORE_HEADERS:
        return CORE_HEADERS[name]
    own = name[:-len(".c")] + ".h"
    if name == "isohead.c":
        return {own}
    if name == "ih_score.c":
        return {own, "ih_fix.h", "ih_score_weights.h"}
    return {own, "ih_fix.h", "ih_range.h", "ih_words.h", "ih_lanes.h", "ih_lane16.h"} if own in CORE_HEADERS else None


def judge_core(path, quoted, target):
    name = os.path.basename(path)
    allowed = allowed_in_core(name)
    if allowed is None:
        return "this file stands in no rule: add it to tests/checks/includes.py"
    if not quoted:
        return None if target in CORE_SYSTEM or (name, target) in CORE_VECTORS else "the core does without <%s>" % target
    if target in allowed:
        return None
    return "%s may include only %s" % (name, ", ".join(sorted(allowed)) or "nothing of ours")


def is_core(target):
    return os.path.basename(target) in CORE_HEADERS or target.startswith(("ih_", "isohead"))


def judge_hal(path, quoted, target):
    if is_core(target):
        return "hal knows no firmware"
    own = os.path.basename(os.path.dirname(path))
    if quoted and not re.fullmatch(r"hal\.h|hal_(file|text)\.h|(%s/)hal_\w+\.h" % own, target):
        return "a back end includes hal.h, hal_file.h, hal_text.h and its own files by their folder"
    return None


def judge_app(path, quoted, target):
    if not quoted or is_core(target):
        return None
    good = re.fullmatch(r"app_\w+\.h|hal\.h|hal_(file|text)\.h", target)
    if os.path.basename(path).startswith(("app_board.", "app_live_main.")):
        good = good or re.fullmatch(r"linux/hal_\w+\.h", target)
    if os.path.basename(path) == "app_cortexm.c":
        good = good or re.fullmatch(r"cortexm/hal_\w+\.h|replay/hal_pgm\.h", target)
    return None if good else "the app includes the core, hal.h and its own files"


def judge_sim(path, quoted, target):
    if not quoted or is_core(target):
        return None
    good = re.fullmatch(r"sim_\w+\.h|hal\.h|hal_file\.h|replay/hal_\w+\.h|"
                        r"app_(rig|rig_explain|record|text|view|write)\.h", target)
    return None if good else "sim includes the core, hal, the app's records and its own files"


def judge_render(path, quoted, target):
    if is_core(target) or re.match(r"(sim|hal|app)\b|(sim|hal|app)_", target):
        return "render shares nothing with the programs that read its frames"
    if quoted and not re.fullmatch(r"rd_\w+\.h", target):
        return "render includes its own files"
    return None


def judge_size(_path, quoted, _target):
    return "a plugin of QEMU knows nothing of ours" if quoted else None


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
           "tools/bench": judge_bench}


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


def self_test():
    """Lines that must be refused, and lines that must not."""
    refused = [("firmware/core/ih_dots.h", '#include "ih_labels.h"'),
               ("firmware/core/ih_points.h", '#include "ih_dots.h"'),
               ("firmware/core/ih_dots.c", '#include "ih_rig.h"'),
               ("firmware/core/ih_dots.c", "#include <stdio.h>"),
               ("firmware/core/ih_dots.c", "#include <stdlib.h>"),
               ("firmware/core/ih_dots.c", "#include <math.h>"),
               ("firmware/core/isohead.c", '#include "ih_tracks.h"'),
               ("firmware/core/ih_new.c", '#include "ih_new.h"'),
               ("hal/replay/hal_pgm.c", '#include "ih_types.h"'),
               ("hal/linux/hal_v4l2.c", '#include "replay/hal_pgm.h"'),
               ("hal/hal.h", '#include "app_text.h"'),
               ("sim/sim_run.c", '#include "rd_rig.h"'),
               ("sim/sim_run.c", '#include "../firmware/core/isohead.h"'),
               ("tools/render/main.c", '#include "isohead.h"'),
               ("tools/render/main.c", "#include <hal.h>"),
               ("tools/bench/bench_isohead.c", '#include "app_loop.h"'),
               ("firmware/app/app_loop.c", '#include "linux/hal_gpio.h"'),
               ("firmware/app/app_live.c", '#include "linux/hal_serve.h"'),
               ("firmware/app/app_loop.c", '#include "sim_run.h"'),
               ("sim/sim_run.c", '#include "app_laser.h"'),
               ("tools/rigblob/main.c", '#include "app_record.h"'),
               ("tools/size/count.c", '#include "isohead.h"'),
               ("firmware/app/app_loop.c", '#include "cortexm/hal_semihosting.h"'),
               ("firmware/app/app_cortexm.c", '#include "linux/hal_gpio.h"'),
               ("firmware/other/main.c", '#include "isohead.h"')]
    good = [("firmware/core/ih_labels.h", '#include "ih_dots.h"'),
            ("firmware/core/ih_labels.c", '#include "ih_fix.h"'),
            ("firmware/core/ih_labels.c", "#include <string.h>"),
            ("hal/replay/hal_pgm.c", "#include <cjson/cJSON.h>"),
            ("sim/sim_run.c", '#include "replay/hal_replay.h"'),
            ("sim/sim_run.c", '#include "app_record.h"'),
            ("firmware/app/app_board.c", '#include "linux/hal_gpio.h"'),
            ("firmware/app/app_loop.c", '#include "isohead.h"'),
            ("tools/render/main.c", '#include "rd_rig.h"'),
            ("tools/bench/bench_isohead.c", '#include "isohead.h"')]
    missed = [line for line in refused if judge(*line) is None]
    missed += [line for line in good if judge(*line) is not None]
    for path, line in missed:
        print("judged wrongly: %s: %s" % (path, line))
    print("includes: %d made-up lines, %d judged wrongly" % (len(refused + good), len(missed)))
    return 1 if missed else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--self-test", action="store_true")
    return self_test() if parser.parse_args().self_test else check()


if __name__ == "__main__":
    sys.exit(main())
