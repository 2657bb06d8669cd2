"""What each part of the core costs: instructions of a frame, memory, code.

Instructions are counted by callgrind in the optimised host build, everything that a stage calls
included; memory and code are of gcc -O2 -mgeneral-regs-only for this machine, by the functions of
tests/checks/core_rules.py. Working memory is shared: the largest counts.
"""

import dataclasses
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile

import report

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
sys.path.insert(0, os.path.join(ROOT, "tests", "checks"))
import core_rules

DOT_FRAMES = os.path.join(ROOT, "frames", "sequence2")
DOT_FILES = ["%06d.pgm" % i for i in range(10, 16)]  # on end, so that there are tracks
RANGE_FOLDERS = ("pcl_person_seated", "neg_realsense_office_corner", "neg_slambook_diningroom")
LINE = re.compile(r"^\s*([\d,]+)\s.*[:/ ]((?:ih|isohead)_\w+)\b")


@dataclasses.dataclass(frozen=True)
class Part:
    name: str
    functions: tuple  # that isohead.c calls, or for a part of a part that it calls
    files: tuple = ()  # without .c
    state: tuple = ()
    scratch: str = ""
    inner: bool = False


PARTS = (
    Part("dots", ("ih_dots_find",), ("ih_bandpass", "ih_noise", "ih_dots"), ("dots",), "dots"),
    Part("align", ("ih_align_find", "ih_align_learn"),
         ("ih_dot_rows", "ih_align", "ih_align_fit", "ih_align_pairs", "ih_align_vote"), ("align",), "labels"),
    Part("labels", ("ih_labels_assign",), ("ih_labels",), ("labels",), "labels"),
    Part("windows", ("ih_windows_find",), ("ih_windows",), ("windows",), "windows"),
    Part("points", ("ih_points_from_labels", "ih_points_from_range"), ("ih_points",), ("points",)),
    Part("samples", ("ih_samples_select",), ("ih_samples",), ("samples",)),
    Part("surface", ("ih_surface_fit",), ("ih_normal_equations", "ih_surface"), ("surface",), "surface"),
    Part("cuts, hypotheses", ("ih_nests_find",), ("ih_contours", "ih_ellipse", "ih_nests"),
         ("hypotheses",), "hypotheses"),
    Part("heads", ("ih_hypotheses_select",), ("ih_hypotheses",), ("heads",)),
    Part("findings", ("ih_detections_add",), ("ih_detections",), ("findings",), "findings"),
    Part(". space", ("ih_rays_make",), ("ih_rays",), inner=True),
    Part(". scan", ("ih_scan_find",), ("ih_scan",), inner=True),
    Part(". fit", ("ih_fit_continue",), ("ih_fit",), inner=True),
    Part(". evidence", ("ih_evidence_collect",), ("ih_evidence",), inner=True),
    Part(". score", ("ih_score_rate",), ("ih_score",), inner=True),
    Part("tracks", ("ih_tracks_expect", "ih_tracks_update"), ("ih_tracks",), ("tracks",)),
)


def instructions(program, directory, files):
    """Inclusive instructions per frame by function."""
    with tempfile.TemporaryDirectory() as work:
        shutil.copy(os.path.join(directory, "rig.json"), work)
        for file in files:
            shutil.copy(os.path.join(directory, file), work)
        out = os.path.join(work, "callgrind.out")
        subprocess.run(["valgrind", "--quiet", "--tool=callgrind", "--callgrind-out-file=" + out, program,
                        "--json", work], check=True, stdout=subprocess.DEVNULL)
        listed = subprocess.run(["callgrind_annotate", "--inclusive=yes", "--threshold=100", out],
                                check=True, stdout=subprocess.PIPE, text=True).stdout
    counts = {}
    for line in listed.splitlines():
        found = LINE.match(line)
        if found:
            counts.setdefault(found[2], int(found[1].replace(",", "")) / len(files))
    return counts


def range_instructions(program, data):
    """The mean over the first images of some folders; empty without data."""
    sums, count = {}, 0
    for folder in RANGE_FOLDERS:
        directory = os.path.join(data, "range", folder)
        if data and os.path.isdir(directory):
            count += 1
            for name, number in instructions(program, directory, ["000000.pgm"]).items():
                sums[name] = sums.get(name, 0) + number
    return {name: number / count for name, number in sums.items()}


def code_bytes():
    """(code, constants) by file."""
    with tempfile.TemporaryDirectory() as work:
        sizes = {}
        for source in core_rules.core_sources():
            total = core_rules.check_data([core_rules.compile_one(source, work)])
            sizes[os.path.basename(source)[:-len(".c")]] = (total["code"], total["constants"])
        return sizes


def state_bytes():
    with tempfile.TemporaryDirectory() as work:
        return core_rules.ram.sizes(["gcc"], "nm", work)[0]


def kilo(number):
    return "-" if number is None else "%d" % round(number / 1000)


def row_of(part, counts, code, state):
    spent = [sum(c.get(f, 0) for f in part.functions) for c in counts]
    return ([part.name] + [kilo(n) if n else "-" for n in spent]
            + [sum(state[name] for name in part.state) or "-",
               state["scratch." + part.scratch] if part.scratch else "-",
               sum(code[name][0] for name in part.files), sum(code[name][1] for name in part.files)])


def text(programs, data):
    if shutil.which("valgrind") is None:
        return "(valgrind is not there: not measured)"
    counts = [instructions(programs["host_sim"], DOT_FRAMES, DOT_FILES),
              range_instructions(programs["host_sim"], data)]
    code, state = code_bytes(), state_bytes()
    rows = [row_of(part, counts, code, state) for part in PARTS]
    others = sorted(set(code) - {name for part in PARTS for name in part.files})
    other_state = [name for name in ("rig", "params", "result") if name in state]
    rows.append(["the rest", "-", "-", sum(state[n] for n in other_state), "-",
                 sum(code[n][0] for n in others), sum(code[n][1] for n in others)])
    rows.append(["a frame, all"] + [kilo(c.get("isohead_frame")) for c in counts]
                + [state["struct isohead"], state["scratch"], sum(c[0] for c in code.values()),
                   sum(c[1] for c in code.values())])
    head = ("Thousands of instructions of a frame: %s, callgrind; the mean of six frames of "
            "frames/sequence2, and of %d depth images. Parts of detections are in its instructions; all of the "
            "memory of a run is %d bytes, `scratch` once included. The rest: %s.\n\n"
            % (platform.machine(), len(RANGE_FOLDERS) if counts[1] else 0, state["struct isohead"],
               ", ".join(others)))
    return head + report.table(["part", "dot frame, 1000", "depth image, 1000", "state, bytes", "scratch, bytes",
                                "code, bytes", "constants, bytes"], rows)
