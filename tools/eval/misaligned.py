#!/usr/bin/env python3
"""What a rig costs that is not as its file says: frames of fresh seeds, right and wrong rig files.

misaligned.py --host-sim PROGRAM --render PROGRAM --work DIR [--rows REGEX] [--short] ...

Renders both rigs and sequences once into DIR/frames (what is there stays) and runs host_sim over them with
the right rig file and with wrong ones; only a drift has frames of its own. Prints by row and rig:

  right      frames selected right (docs/contract.md, "Score"), and their fraction of those with the right rig; a rotation
             about Y is depth, which the frame before must show: there from the second frame on
  late       the worst directory: its first frames that are lost, of those with a head that the right rig gets
             right, and of those whose labels it gets (fewer than 90 % of them are right)
  labels     fraction right: the dot lies within 1 px of that index's true dot, dim ones too; their count against the right rig's
  centre     the centre error's median from frame 10 on, mm, and with the right rig
  2 sigma    fraction of the selected heads that lie within two reported sigma_mm
  across     the reported alignment across the lines, px: median, and the largest magnitude
  rotation   what is left of the knock with the reported rotation taken off, degrees: median magnitude by axis
  limits     ok, or what is beyond its limit

A knock has the other sign in every second directory. Exit status 1 when a limit is not kept.
"""

import argparse
import collections
import concurrent.futures
import dataclasses
import hashlib
import itertools
import json
import math
import os
import re
import shutil
import sys
import time

import misaligned_frames as frames_of
import misaligned_rows as rows_of
import runs
import score

FIRST_SEED = 12001
NEAR_PX = 1.0
SETTLED_FRAME = 10
LATE_FRACTION = 0.9
FALSE_FRAMES = 60
RIGS = ("paper", "wide")
NO_TRUTH = ("random", "lattice")


@dataclasses.dataclass(frozen=True)
class Frame:
    file: str
    there: bool        # a head is there
    right: bool        # selected right
    error_mm: float    # of the selected head where one is there, else None
    sigma_mm: float    # that it reports, else None
    labels: int
    labels_right: int
    across_px: float   # of the reported alignment, else None
    rotation_deg: tuple


def first_number(value):
    """Of a number or of a field whose first member is the offset."""
    return value[0] if isinstance(value, list) and value else value


def judged(record, truth, trace):
    verdict = score.judge(record, truth)
    selected = None if record["head"] is None else record["hypotheses"][record["head"]]
    there = truth["head"] is not None
    error_mm = score.distance_mm(selected, truth["head"]["centre_mm"]) if there and selected else None
    # A dim dot that is found has its label as well.
    dots, true = trace["dots"], {dot[0]: dot[1:3] for dot in truth["dots"] + truth["dim_dots"]}
    labels = [(slot, label["dot"]) for slot, label in enumerate(trace["labels"]["slot"]) if label is not None]
    near = sum(math.dist((dots["u_px_q12"][dot] / 4096, dots["v_px_q12"][dot] / 4096), true[slot]) <= NEAR_PX
               for slot, dot in labels if slot in true)
    rig = record.get("rig") or {}
    # What lies on no lines moves no rig; its labels are chance.
    across_px = None if rig.get("state") == "lost" else first_number(rig.get("across_px"))
    return Frame(record["file"], there, verdict.right, error_mm, selected.get("sigma_mm") if selected else None,
                 len(labels), near, across_px, tuple(rig.get("rotation_deg") or ()))


def measure(program, work, directory, knock):
    """Every frame of a directory with the rig file from before this knock."""
    with open(os.path.join(directory, "rig.json"), encoding="utf-8") as file:
        rig = json.load(file)
    key = hashlib.sha256(("%s %s %s" % (program, directory, knock)).encode()).hexdigest()[:16]
    scratch = os.path.join(work, "scratch", key)
    shutil.rmtree(scratch, ignore_errors=True)
    os.makedirs(scratch)
    wrong = os.path.join(scratch, "wrong.json")
    with open(wrong, "w", encoding="utf-8") as file:
        json.dump(rows_of.before(rig, knock), file)
    arguments = ["--trace", os.path.join(scratch, "trace")] + ([] if knock == rows_of.Knock() else ["--rig", wrong])
    records, truths = runs.host_sim(program, arguments, directory), frames_of.read_truths(directory)
    frames = []
    for name in sorted(records):
        path = os.path.join(scratch, "trace", os.path.basename(directory), os.path.splitext(name)[0] + ".json")
        with open(path, encoding="utf-8") as file:
            frames.append(judged(records[name], truths[name], json.load(file)))
    shutil.rmtree(scratch)
    return frames


@dataclasses.dataclass(frozen=True)
class Piece:
    """A directory of a row."""

    rig: str
    directory: str
    sign: int       # of the row's knock
    knock: rows_of.Knock
    reference: str  # the directory that it is compared with


def directories(options, programs, pool):
    """Renders what the rows need. By (kind of frames, rig) a list of directories in the same order."""
    kinds = {row.frames for row in options.rows} | {"plain"}
    kinds |= {"still"} if "drift" in kinds else set()
    made = collections.OrderedDict()
    # Over-exposed frames need plain ones: those come first.
    for kind in sorted(kinds - set(NO_TRUTH), key=lambda kind: (kind != "plain", kind)):
        if kind == "over-exposed":
            concurrent.futures.wait(made.values())
        is_long = kind in ("drift", "still")
        length, seeds = (options.drift_frames, 1) if is_long else (options.frames, options.seeds)
        for rig, sequence, i in itertools.product(options.rig, (1, 2), range(seeds)):
            made[kind, rig, sequence, i] = pool.submit(frames_of.rendered, programs, options.work, kind, rig, sequence,
                                                       options.seed + i, length)
    found = collections.defaultdict(list)
    for done, (key, future) in enumerate(made.items(), 1):
        found[key[:2]].append(future.result())
        progress("%d of %d directories rendered" % (done, len(made)))
    for kind in NO_TRUTH:
        if kind in kinds:
            for rig in options.rig:
                found[kind, rig].append(frames_of.false_dots(options.work, kind, found["plain", rig][0], rig, options.seed,
                                                             min(FALSE_FRAMES, options.frames)))
    return found


def pieces_of(row, rig, found):
    pieces, kind = [], "still" if row.frames == "drift" else row.frames
    for i, (directory, reference) in enumerate(zip(found[row.frames, rig], found[kind, rig])):
        sign = (-1) ** i
        pieces.append(Piece(rig, directory, sign, row.knock.times(sign), reference))
    return pieces


def late(frames, reference, usual, lost):
    """How many of the first frames that count with the right rig are lost."""
    count = 0
    for frame, right in zip(frames, reference):
        if usual(right):
            if not lost(frame, right):
                return count
            count += 1
    return count


def percent(part, whole):
    return 100.0 * part / whole if whole else math.nan


def median(values):
    return score.percentile(values, 50)


@dataclasses.dataclass
class Figures:
    """Of a row with one rig."""

    frames: int
    right: int
    right_reference: int
    late_heads: int
    late_labels: int
    labels_percent: float
    labels_count_percent: float
    centre_mm: float
    centre_reference_mm: float
    within_percent: float
    across_px: tuple     # median and largest magnitude, or None
    rotation_deg: tuple  # what is left, or None


def errors_of(frames):
    return [frame.error_mm for frame in frames if frame.error_mm is not None]


def alignment(pairs):
    """(pieces, frames): the reported offset, and what is left of the knock."""
    across = [piece.sign * frame.across_px
              for piece, frames in pairs for frame in frames if frame.across_px is not None]
    left = [[abs(k - r) for k, r in zip(piece.knock.rotation_deg, frame.rotation_deg)]
            for piece, frames in pairs for frame in frames if len(frame.rotation_deg) == 3]
    return ((median(across), max(map(abs, across))) if across else None,
            tuple(median(list(axis)) for axis in zip(*left)) if left else None)


def figures(pairs, references, first_frame):
    everything = [frame for _, frames in pairs for frame in frames]
    reference = [frame for frames in references for frame in frames]
    counted = [frame for _, frames in pairs for frame in frames[first_frame:]]
    counted_reference = [frame for frames in references for frame in frames[first_frame:]]
    settled = [frame for _, frames in pairs for frame in frames[SETTLED_FRAME:]]
    settled_reference = [frame for frames in references for frame in frames[SETTLED_FRAME:]]
    both = [(frames, right) for (_, frames), right in zip(pairs, references)]
    heads = [late(frames, right, lambda r: r.there and r.right, lambda f, r: not f.right) for frames, right in both]
    labels = [late(frames, right, lambda r: r.labels_right > 0,
                   lambda f, r: f.labels_right < LATE_FRACTION * r.labels_right) for frames, right in both]
    sure = [frame for frame in everything if frame.error_mm is not None and frame.sigma_mm is not None]
    within = sum(frame.error_mm <= 2 * frame.sigma_mm for frame in sure)
    label_count = sum(frame.labels for frame in everything)
    label_right = sum(frame.labels_right for frame in everything)
    across, rotation = alignment(pairs)
    return Figures(len(counted), sum(frame.right for frame in counted),
                   sum(frame.right for frame in counted_reference),
                   max(heads), max(labels), percent(label_right, label_count),
                   percent(label_right, sum(frame.labels_right for frame in reference)),
                   median(errors_of(settled)), median(errors_of(settled_reference)), percent(within, len(sure)),
                   across, rotation)


def broken(limits, rig, got):
    """Which limits are not kept, in words."""
    out = []
    if got.right < got.right_reference * (1 - limits.fewer_percent / 100):
        out.append("right")
    if limits.right_percent and got.right < got.frames * limits.right_percent[rig] / 100:
        out.append("right at all")
    if limits.late_frames is not None and max(got.late_heads, got.late_labels) > limits.late_frames:
        out.append("late")
    if limits.labels_percent and not got.labels_percent >= limits.labels_percent[rig]:
        out.append("labels")
    if limits.centre_more_mm is not None and (
            got.centre_mm is None or got.centre_mm > got.centre_reference_mm + limits.centre_more_mm):
        out.append("centre")
    if limits.within_percent is not None and not got.within_percent >= limits.within_percent:
        out.append("2 sigma")
    if limits.across_px is not None and got.across_px is not None and got.across_px[1] > limits.across_px:
        out.append("across")
    return out


HEADER = "%-28s %-5s %6s %6s %7s %11s %8s %7s %15s %8s %14s %20s  %s" % (
    "row", "rig", "frames", "right", "", "late", "labels", "count", "centre mm", "2 sigma", "across px", "rotation left", "limits")


def number(form, value):
    return "-" if value is None or value != value else form % value


def line(row, rig, got, wrong):
    across = "-" if got.across_px is None else "%.2f, %.2f" % got.across_px
    rotation = "-" if got.rotation_deg is None else " ".join("%.3f" % axis for axis in got.rotation_deg)
    return "%-28s %-5s %6d %6d %6.1f%% %5d %5d %8s %7s %7s %7s %8s %14s %20s  %s" % (
        row.name, rig, got.frames, got.right, percent(got.right, got.right_reference), got.late_heads, got.late_labels,
        number("%.2f%%", got.labels_percent), number("%.1f%%", got.labels_count_percent), number("%.1f", got.centre_mm),
        number("%.1f", got.centre_reference_mm), number("%.1f%%", got.within_percent), across, rotation,
        "NOT: " + ", ".join(wrong) if wrong else "ok")


def progress(text):
    if sys.stderr.isatty():
        print("\r\033[K%s" % text, end="", file=sys.stderr, flush=True)


def write_frames(out, row, piece, frames):
    for index, frame in enumerate(frames):
        print(json.dumps({"row": row.name, "rig": piece.rig, "directory": os.path.basename(piece.directory),
                          "index": index, "knock": dataclasses.asdict(piece.knock), **dataclasses.asdict(frame)}), file=out)


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--host-sim", required=True)
    parser.add_argument("--render", required=True)
    parser.add_argument("--work", required=True)
    parser.add_argument("--reference", help="host_sim that the right rig's results come from; default: the same")
    parser.add_argument("--rows", default="", help="only rows whose name has this regular expression")
    parser.add_argument("--rig", action="append", choices=RIGS, help="only this one")
    parser.add_argument("--frames", type=int, default=100, help="of each directory (default 100)")
    parser.add_argument("--seeds", type=int, default=3, help="of each rig and sequence (default 3)")
    parser.add_argument("--seed", type=int, default=FIRST_SEED, help="the first one (default %d)" % FIRST_SEED)
    parser.add_argument("--drift-frames", type=int, default=rows_of.FRAMES_OF_DRIFT, help="default 500; the drift is as fast")
    parser.add_argument("--short", action="store_true", help="a few rows, one seed, 20 frames, a drift of 100")
    parser.add_argument("--per-frame", metavar="FILE", type=argparse.FileType("w", encoding="utf-8"),
                        help="writes a JSON line for each frame of each row")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    options.rig = options.rig or list(RIGS)
    if options.short:
        options.frames, options.seeds, options.drift_frames = 20, 1, 100
    options.rows = [row for row in rows_of.all_rows() if re.search(options.rows, row.name)
                    and (not options.short or row.name in rows_of.SHORT)]
    options.work = os.path.abspath(options.work)
    return options


class Measured:
    """Results of directories, each measured once."""

    def __init__(self, pool, work):
        self.pool, self.work, self.futures = pool, work, {}

    def start(self, program, directory, knock):
        key = program, directory, knock
        if key not in self.futures:
            self.futures[key] = self.pool.submit(measure, program, self.work, directory, knock)
        return self.futures[key]


def report(options, program, reference_program, pool, found):
    """Prints the table. How many lines do not keep what is limits."""
    measured, started, failed = Measured(pool, options.work), [], 0
    for row in options.rows:
        for rig in options.rig:
            started.append((row, rig, [
                (piece, measured.start(program, piece.directory, piece.knock),
                 measured.start(reference_program, piece.reference, rows_of.Knock()))
                for piece in pieces_of(row, rig, found)]))
    print(HEADER, flush=True)
    for row, rig, futures in started:
        pairs = [(piece, future.result()) for piece, future, _ in futures]
        got = figures(pairs, [reference.result() for _, _, reference in futures], row.limits.first_frame)
        wrong = broken(row.limits, rig, got)
        failed += bool(wrong)
        print(line(row, rig, got, wrong), flush=True)
        if options.per_frame:
            for piece, frames in pairs:
                write_frames(options.per_frame, row, piece, frames)
    return failed


def main():
    options, start_s = parse(), time.monotonic()
    if not options.rows:
        print("misaligned: no row of this name", file=sys.stderr)
        return 2
    programs = {name: os.path.abspath(getattr(options, name)) for name in ("host_sim", "render")}
    with open(programs["render"], "rb") as file:
        programs["stamp"] = hashlib.sha256(file.read()).hexdigest()[:16]
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        found = directories(options, programs, pool)
        failed = report(options, programs["host_sim"], os.path.abspath(options.reference or options.host_sim), pool, found)
    shutil.rmtree(os.path.join(options.work, "scratch"), ignore_errors=True)
    count = len(options.rows) * len(options.rig)
    print("%d of %d lines keep their limits; %.0f s" % (count - failed, count, time.monotonic() - start_s))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
