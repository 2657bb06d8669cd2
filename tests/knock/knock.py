#!/usr/bin/python3
"""Projectors rotated by 0.3 degrees, in rendered frames that nobody has looked at: are they found and corrected?

    knock.py --knock PROGRAM --render PROGRAM --host-sim PROGRAM --work DIR [--seeds 1] [--frames 50]

Per rig and seed ordinary frames, the projector rotated about another axis each: it must be found and reported within 50 of
them. The estimate is compared with the true rotation, in units of its own uncertainty, and with two float64 references
(tools/oracle/knock.py) on the same frames: one that takes the same steps as the core, and the least squares that these steps
converge to. After 50 frames they have not converged, because most frames have the labels and weights of a rotation from
4 frames: 0.06 times its uncertainty off was seen, 0.3 is allowed; from 250 frames on 0.14 and 0.2. The bound on what
can be known is printed. Depth errors on the same frames: with the true rotation, without any correction, with the estimate; the
last is at most 5 times the first; with four seeds and 250 frames or more at most 1.3 times, with all rigs. A rig that fits stays as it
is; rotated by 0.3, 0.2 or 0.1 degrees after a long stable period it is reported within as many frames as at the start. Prints
TAP; exit status 1 when a case fails.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools", "oracle"))
import knock as oracle

SEED = 4202
SEEDS_OF_ALL = 4
FOUND_FRAMES = 50
FRAMES_OF_ALL = 250
ROTATION_DEG = 0.3
STABLE_FRAMES = 473  # steady ones; the rotation begins inside of a look
LATE_ROTATIONS_DEG = (0.3, 0.2, 0.1)
STABLE_SEEDS = 3
LATE_FRAMES = 65  # reported within 50, then refined
RATIO_OF_ALL, RATIO_MAX = 1.3, 5.0
# Along the baseline (X) and about the camera's axis (Z) a rotation moves dots across their lines; about Y hardly.
ERROR_DEG = (0.002, 0.04, 0.01)
ERROR_SIGMAS = 4
STEPS_SIGMAS, STEPS_DEG = 0.05, 0.0001
REFERENCE_SIGMAS, REFERENCE_DEG, REFERENCE_FRAMES = 0.2, 0.0005, 250
REFERENCE_SIGMAS_SOON = 0.3
FITS, ROTATED = 1, 2

number = failed = 0


def result(name, reason=None):
    global number, failed
    number += 1
    failed += reason is not None
    print("%s %d - %s%s" % ("not ok" if reason else "ok", number, name, "\n# " + reason if reason else ""), flush=True)


def must(*command):
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True,
                          stdin=subprocess.DEVNULL).stdout


def render(options, kind, seed, *more, frames=None, name=""):
    folder = os.path.join(options.work, "%s_%d%s%s" % (kind, seed, "_rotated" if more else "", name))
    if not os.path.exists(os.path.join(folder, "rig.json")):
        must(options.render, "--rig", kind, "--seed", seed, "--frames", frames or options.frames, *more, folder)
    return folder


def depth(out):
    """Labels, and the median error of right ones' depth in mm: the table that host_sim prints where there is truth."""
    row = out.splitlines()[-1].split()
    return int(row[5]), float("nan") if row[7] == "-" else float(row[7])


def depth_with(options, folder, rotation):
    path = os.path.join(options.work, "rig.json")
    oracle.Rig(os.path.join(folder, "rig.json")).rotated(rotation).save(path)
    return depth(must(options.host_sim, "--rig", path, folder))


def health(options, *folders):
    lines = [json.loads(line) for line in must(options.knock, *folders).splitlines()]
    return lines, np.array(lines[-1]["turn_rad_q30"]) / 2**30


def basis(lines):
    """The frames that the last rotation was estimated from."""
    last = max(i for i, line in enumerate(lines) if line["changed"])
    return slice(max(last + 1 - lines[last]["basis"], 0), last + 1)


def rotations(lines, frames):
    """Of the frames of the last rotation: first and last with one, that rotation, and the one the core took then."""
    taken = [np.array(line["turn_rad_q30"]) / 2**30 for line in lines]
    first, out = frames.start, []
    for last in range(frames.start, frames.stop):
        if lines[last]["changed"]:
            out.append((first, last, taken[first - 1] if first > 0 else np.zeros(3), taken[last]))
            first = last + 1
    return out


def rotated_rig(options, kind, seed):
    folder = render(options, kind, seed, "--knock", ROTATION_DEG)
    truth = oracle.true_rotation(folder)
    lines, found = health(options, folder)
    sigma = np.array(lines[-1]["sigma_rad_q30"]) / 2**30
    at = next((i for i, line in enumerate(lines) if line["state"] == ROTATED), None)
    error = np.degrees(found - truth)
    worst = np.minimum(ERROR_DEG, np.degrees(ERROR_SIGMAS * sigma))
    reason = None
    if at is None or at >= FOUND_FRAMES:
        reason = "state %d at the end, expected %d within %d frames" % (lines[-1]["state"], ROTATED, FOUND_FRAMES)
    elif (np.abs(error) > worst).any():
        reason = "rotation off by %s degrees, expected less than %s" % (error.round(4), worst.round(4))
    known, noise, position = oracle.bound(folder, options.host_sim, os.path.join(options.work, "trace"), truth, options.frames)
    result("%s, seed %d: found after %s frames, about Y off by %.4f degrees, reported %.4f, bound %.4f (noise %.3f px, positions %.3f)"
           % (kind, seed, at, error[1], np.degrees(sigma[1]), np.degrees(known[1]), noise, position), reason)
    frames = basis(lines)
    reference, uncertainty, out = oracle.estimate(folder, options.host_sim, os.path.join(options.work, "trace"), found, frames)
    labels, straight = depth_with(options, folder, truth)
    labels_without, _ = depth_with(options, folder, np.zeros(3))
    labels_found, corrected = depth(out)
    ratio = corrected / straight
    result("%s, seed %d: labels %d, without the correction %d, with it %d; depth %.2f mm, with it %.2f, %.2f times"
           % (kind, seed, labels, labels_without, labels_found, straight, corrected, ratio),
           None if ratio <= RATIO_MAX and labels_found > 0.95 * labels else "%.2f times" % ratio)
    steps = oracle.follow(folder, options.host_sim, os.path.join(options.work, "trace"), rotations(lines, frames))
    far = np.abs(steps - found) > np.maximum(STEPS_SIGMAS * sigma, np.radians(STEPS_DEG))
    result("%s, seed %d: as float64 comes to by the same steps, frames %d to %d: off by %s sigma" %
           (kind, seed, frames.start, frames.stop - 1, ((found - steps) / sigma).round(3)),
           "%s, float64 %s degrees" % (np.degrees(found).round(4), np.degrees(steps).round(4)) if far.any() else None)
    sigmas = REFERENCE_SIGMAS if options.frames >= REFERENCE_FRAMES else REFERENCE_SIGMAS_SOON
    far = np.abs(reference - found) > np.maximum(sigmas * sigma, np.radians(REFERENCE_DEG))
    result("%s, seed %d: least squares of the same frames: off by %s sigma" % (kind, seed, ((found - reference) / sigma).round(2)),
           "%s, float64 %s degrees" % (np.degrees(found).round(4), np.degrees(reference).round(4)) if far.any() else None)
    result("%s, seed %d: uncertainty %s times that of float64" % (kind, seed, (sigma / uncertainty).round(2)),
           "expected 0.8 to 1.25 times" if (np.abs(np.log(sigma / uncertainty)) > np.log(1.25)).any() else None)
    return ratio


def after_stable_period(options, kind, seed):
    """The sums of a long stable period hide no rotation."""
    stable = render(options, kind, seed, frames=STABLE_FRAMES, name="_stable")
    for rotation in LATE_ROTATIONS_DEG:
        folder = render(options, kind, seed, "--knock", rotation, "--first-frame", "%d+%d" % (STABLE_FRAMES, LATE_FRAMES),
                        frames=STABLE_FRAMES + LATE_FRAMES, name="_late_%g" % rotation)
        truth = np.degrees(oracle.true_rotation(folder))
        lines, found = health(options, stable, folder)
        states = [line["state"] for line in lines]
        at = next((i - STABLE_FRAMES for i, state in enumerate(states) if state == ROTATED), None)
        error = np.degrees(found) - truth
        reason = None
        if any(line["changed"] for line in lines[:STABLE_FRAMES]) or states[STABLE_FRAMES - 1] != FITS:
            reason = "not left alone before"
        elif at is None or at >= FOUND_FRAMES:
            reason = "state %d at the end, expected %d within %d frames" % (states[-1], ROTATED, FOUND_FRAMES)
        elif (np.abs(error) > ERROR_DEG).any():
            reason = "off by %s degrees, expected at most %s" % (error.round(4), ERROR_DEG)
        result("%s, seed %d: after %d stable frames rotated by %s degrees, reported after %s frames, off by %s at the end"
               % (kind, seed, STABLE_FRAMES, truth.round(3), at, error.round(4)), reason)


def main():
    parser = argparse.ArgumentParser()
    for name in ("knock", "render", "host-sim", "work"):
        parser.add_argument("--" + name, required=True)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--frames", type=int, default=FOUND_FRAMES)
    options = parser.parse_args()
    os.makedirs(options.work, exist_ok=True)
    ratios = []
    for kind in ("paper", "wide"):
        for seed in range(SEED, SEED + options.seeds):
            ratios.append(rotated_rig(options, kind, seed))
        lines, found = health(options, render(options, kind, SEED))
        result("%s: a rig that fits is left alone" % kind,
               None if not found.any() and lines[-1]["state"] == FITS else "turned by %s" % np.degrees(found))
        for seed in range(SEED, SEED + min(options.seeds, STABLE_SEEDS)):
            after_stable_period(options, kind, seed)
    is_judged = options.seeds >= SEEDS_OF_ALL and options.frames >= FRAMES_OF_ALL
    result("depth errors are %s times those of a rig that fits, %.2f in the median" %
           (", ".join("%.2f" % r for r in ratios), statistics.median(ratios)),
           "expected at most %.1f" % RATIO_OF_ALL if is_judged and max(ratios) > RATIO_OF_ALL else None)
    print("1..%d" % number)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
