#!/usr/bin/env python3
"""Compare traced dots and labels with the truth of rendered sequences.

TRACE_DIR holds a directory of frames per sequence (host_sim --trace); DATA_DIR the sequences' own
directories of the same names with truth.jsonl, whose "dots" are [index, u, v, z_mm] of every
visible dot. Reported per sequence and for all:
  recall   fraction of the true dots with a detected dot within 1.5 px
  error    median distance of those to the nearest detected dot, px
  right    fraction of the assigned labels whose dot lies within 1.5 px of the true dot of that index;
           a label where no such dot is visible is wrong
Exit status 1 if a limit given as an option is not kept, 2 if there was nothing to compare.
"""

import argparse
import json
import os
import sys

import numpy as np
from scipy.spatial import cKDTree

import traces

NEAR_PX = 1.5


class Counts:
    def __init__(self):
        self.frames = self.true = self.found = self.labels = self.right = 0
        self.error_px = []

    def add(self, other):
        for name in ("frames", "true", "found", "labels", "right"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.error_px += other.error_px

    @property
    def recall(self):
        return self.found / self.true if self.true else float("nan")

    @property
    def median_px(self):
        return float(np.median(self.error_px)) if self.error_px else float("nan")

    @property
    def fraction(self):
        return self.right / self.labels if self.labels else float("nan")

    def as_dict(self):
        return {"frames": self.frames, "true_dots": self.true, "recall": self.recall,
                "error_median_px": self.median_px, "labels": self.labels, "wrong_labels":
                self.labels - self.right, "right": self.fraction}


def read_truth(path):
    """stem of the frame -> its true dots."""
    with open(path, encoding="utf-8") as file:
        lines = [json.loads(line) for line in file if line.strip()]
    return {os.path.splitext(t["file"])[0]: t["dots"] for t in lines if "dots" in t}


def check_frame(frame, truth):
    counts = Counts()
    counts.frames, counts.true = 1, len(truth)
    dots = np.array([frame["dots"]["u_px_q12"], frame["dots"]["v_px_q12"]], dtype=float).T / 4096
    position = {int(t[0]): np.array(t[1:3]) for t in truth}
    if len(dots) and position:
        distance, _ = cKDTree(dots).query(np.array(list(position.values())))
        near = distance[distance <= NEAR_PX]
        counts.found, counts.error_px = len(near), near.tolist()
    for slot, label in enumerate(frame["labels"]["slot"]):
        if label is not None:
            counts.labels += 1
            counts.right += bool(slot in position
                                and np.hypot(*(dots[label["dot"]] - position[slot])) <= NEAR_PX)
    return counts


def check_sequence(trace_directory, truth_path):
    counts = Counts()
    truth = read_truth(truth_path)
    for stem, frame in traces.frames(trace_directory):
        if stem in truth:
            counts.add(check_frame(frame, truth[stem]))
    return counts


def truth_of(data_dir, name):
    """truth.jsonl of a sequence: by its path in the trace, by its last part, or DATA_DIR's own."""
    for candidate in (name, os.path.basename(name), "."):
        path = os.path.join(data_dir, candidate, "truth.jsonl")
        if os.path.exists(path):
            return path
    return None


def within_limits(counts, arguments):
    return ((arguments.min_recall is None or counts.recall >= arguments.min_recall)
            and (arguments.max_error_px is None or counts.median_px <= arguments.max_error_px)
            and (arguments.min_right is None or counts.fraction >= arguments.min_right))


def report(name, counts):
    print("%-24s %4d frames  recall %.4f  error %.4f px  right %.4f (%d of %d labels wrong)"
          % (name, counts.frames, counts.recall, counts.median_px, counts.fraction,
             counts.labels - counts.right, counts.labels))


def parse():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trace_dir")
    parser.add_argument("data_dir")
    parser.add_argument("sequence", nargs="*", help="only these; default all with truth")
    parser.add_argument("--json", action="store_true", help="one JSON object instead of lines")
    parser.add_argument("--min-recall", type=float, help="limits hold for the overall figures")
    parser.add_argument("--max-error-px", type=float)
    parser.add_argument("--min-right", type=float)
    return parser.parse_args()


def main():
    arguments = parse()
    by_sequence = {}
    for name, directory in traces.sequences(arguments.trace_dir):
        path = truth_of(arguments.data_dir, name)
        if path and (not arguments.sequence or os.path.basename(name) in arguments.sequence):
            counts = check_sequence(directory, path)
            if counts.frames:
                by_sequence[name] = counts
    overall = Counts()
    for counts in by_sequence.values():
        overall.add(counts)
    if not overall.frames:
        print("no frame with true dots found", file=sys.stderr)
        return 2
    if arguments.json:
        print(json.dumps({"sequences": {n: t.as_dict() for n, t in by_sequence.items()},
                          "overall": overall.as_dict()}))
    else:
        for name, counts in by_sequence.items():
            report(name, counts)
        report("overall", overall)
    return 0 if within_limits(overall, arguments) else 1


if __name__ == "__main__":
    sys.exit(main())
