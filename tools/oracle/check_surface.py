#!/usr/bin/env python3
"""Compare traced surfaces with the float64 solution of the same system.

For every frame under each TRACE_DIR (written by host_sim --trace) two differences are reported, the
largest anywhere on the grid, in mm:
  weights   the system is solved once with the final weights of the trace, if there are such
  two-pass  the system is solved from the first weights, with Huber weights or moved samples of our own
Exit status 1 if any is above the limit, 2 if there was nothing to compare.
"""

import argparse
import json
import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # for 144 unknowns threads only cost

import numpy as np

import surface


def sequences(root):
    """(name, directory) of every directory under root, or root itself, that holds frames."""
    for directory, below, files in os.walk(root):
        below.sort()
        if any(f.endswith(".json") for f in files):
            name = os.path.relpath(directory, root)
            yield os.path.basename(os.path.abspath(root)) if name == "." else name, directory


def frames(directory):
    """(stem, trace) of every frame in the order of their names."""
    for name in sorted(os.listdir(directory)):
        if name.endswith(".json"):
            with open(os.path.join(directory, name), encoding="utf-8") as file:
                yield name[:-len(".json")], json.load(file)


def column(table, key, fraction_bits):
    return np.array(table[key], dtype=float) / 2.0**fraction_bits


def differences(frame, ridge, huber_mm):
    """(weights, two-pass) of one valid frame."""
    samples = frame["samples"]
    positions = np.stack([column(samples, "x_q16", 16), column(samples, "y_q16", 16)], axis=1)
    depth_mm = column(samples, "depth_mm_q8", 8)
    mean_mm = surface.mean_of(samples["depth_mm_q8"])
    grid_mm = np.array(frame["surface"]["depth_mm_q8"], dtype=float) / 256
    final = column(samples, "final_root_weight_q15", 15)
    centres = frame["surface"]["centres"]
    own, _ = surface.fit(positions, depth_mm, column(samples, "root_weight_q15", 15), mean_mm,
                         centres, surface.MOVING[centres], ridge, huber_mm)
    off_mm = np.abs(grid_mm - own).max()
    if surface.MOVING[centres]:
        return off_mm, off_mm  # weights alone do not say where samples were moved to
    once = surface.on_grid(surface.solve(positions, depth_mm, final, mean_mm, ridge, centres), mean_mm,
                           depth_mm)
    return np.abs(grid_mm - once).max(), off_mm


def check_sequence(name, directory, arguments):
    """The differences of all frames with a surface, one row each."""
    rows, without = [], 0
    for stem, frame in frames(directory):
        if not frame.get("surface", {}).get("valid"):
            without += 1
            continue
        row = differences(frame, arguments.ridge_q30 / 2**30, arguments.huber_mm)
        rows.append(row)
        if arguments.verbose or max(row) > arguments.limit_mm:
            print("%s/%s: weights %.4f two-pass %.4f mm" % (name, stem, *row))
    if rows:
        print("%-40s %4d frames, %d without surface: worst weights %.4f two-pass %.4f mm"
              % (name, len(rows), without, *np.max(rows, axis=0)))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trace_dir", nargs="+")
    parser.add_argument("--limit-mm", type=float, default=0.2, help="default %(default)s")
    parser.add_argument("--ridge-q30", type=int, default=surface.RIDGE_Q30,
                        help="ih_surface_params.ridge_q30, default %(default)s")
    parser.add_argument("--huber-mm", type=float, default=surface.HUBER_MM,
                        help="ih_surface_params.huber_mm, default %(default)s")
    parser.add_argument("--verbose", action="store_true", help="a line for every frame")
    arguments = parser.parse_args()
    rows = []
    for root in arguments.trace_dir:
        for name, directory in sequences(root):
            rows += check_sequence(name, directory, arguments)
    if not rows:
        print("no frame with a surface found", file=sys.stderr)
        return 2
    worst = np.max(rows, axis=0)
    good = worst.max() <= arguments.limit_mm
    print("overall %d frames: worst weights %.4f two-pass %.4f mm, limit %g: %s"
          % (len(rows), *worst, arguments.limit_mm, "good" if good else "TOO LARGE"))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
