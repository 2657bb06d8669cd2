#!/usr/bin/env python3
"""A closed loop: tools/render is the camera, host_sim sees, the exposure rule proposes.

check_exposure.py RENDER HOST_SIM [render options, such as --seed 7 --ambient sunlight]

Every step renders the next frame of a scene with the exposure proposed for it (render --exposure
--first-frame), from four beginnings. The duty is left at its limit: the renderer has none. 2000 us
stand for --exposure 1. Exit status 1 when the last frames do not agree or one of them has under
nine tenths of the labels of the best fixed exposure.
"""

import json
import os
import subprocess
import sys
import tempfile

import numpy as np

import exposure

FRAMES = 20
NOMINAL_US = 2000
FIRST = 8
LIMITS = dict(exposure.DEFAULTS, exposure=(200, 20000), duty=(256, 256))


def see(render, host_sim, options, frame, exposure_us):
    """labelled, weak, strong, lost of one frame."""
    with tempfile.TemporaryDirectory() as work:
        frames = os.path.join(work, "f")
        subprocess.run([render, *options, "--exposure", "%.4f" % (exposure_us / NOMINAL_US),
                        "--first-frame", "%d+1" % frame, "--frames", str(frame + 1), frames],
                       check=True)
        subprocess.run([host_sim, "--json", "--trace", os.path.join(work, "t"), frames], check=True,
                       stdout=subprocess.DEVNULL)
        name = next(n for n in sorted(os.listdir(frames)) if n.endswith(".pgm"))
        with open(os.path.join(work, "t", "f", name[:-4] + ".json"), encoding="utf-8") as file:
            return look(json.load(file), read_pgm(os.path.join(frames, name)))


def read_pgm(path):
    """Grey levels of 0 to 255."""
    with open(path, "rb") as file:
        data = file.read()
    _, width, height, full = data.split(maxsplit=4)[:4]
    kind, count = (np.uint8, 1) if int(full) < 256 else (">u2", 2)
    samples = np.frombuffer(data[-int(width) * int(height) * count:], kind)
    return samples.reshape(int(height), int(width)) * (255.0 / int(full))


def look(trace, grey):
    def bright(u, v):
        u, v = int(u) // 8 * 8, int(v) // 8 * 8
        return grey[v:v + 8, u:u + 8].mean() > 200 if 0 <= v < len(grey) and 0 <= u < len(grey[0]) else 0
    dots = trace["dots"]
    slots = [None if s is None else s["dot"] for s in trace["labels"]["slot"]]
    labelled = [d for d in slots if d is not None]
    fraction = np.mean([bright(u, v) for v in range(0, len(grey), 8) for u in range(0, len(grey[0]), 8)])
    if len(labelled) < exposure.LABELLED_MIN:
        return len(labelled), 0, 0, int(fraction * 361 / 8)
    peaks = sorted(dots["peak"][d] for d in labelled)
    lost = 0
    for slot in (s for s in range(361) if slots[s] is None):
        row, column = divmod(slot, 19)
        near = [slots[r * 19 + c] for r in range(max(0, row - 2), min(19, row + 3))
                for c in range(max(0, column - 2), min(19, column + 3)) if slots[r * 19 + c] is not None]
        if len(near) >= 3:
            lost += bright(*(np.mean([dots[k][d] for d in near]) / 4096 for k in ("u_px_q12", "v_px_q12")))
    return len(peaks), peaks[len(peaks) // 4], peaks[len(peaks) * 9 // 10], max(lost, int(fraction * 361 / 8))


def main():
    if len(sys.argv) < 3:
        print(__doc__, file=sys.stderr)
        return 2
    render, host_sim, options = sys.argv[1], sys.argv[2], sys.argv[3:]
    last = FIRST + FRAMES - 1
    fixed = {us: see(render, host_sim, options, last, us)[0] for us in (250, 500, 1000, 2000, 4000, 8000)}
    print("fixed:", ", ".join("%d us %d labels" % item for item in fixed.items()))
    good = True
    for start in (250, 1000, 4000, 16000):
        state, steps = (float(start), 256.0, 20000.0, 0), []
        for frame in range(FIRST, FIRST + FRAMES):
            seen = see(render, host_sim, options, frame, state[0])
            steps.append((round(state[0]), seen[0]))
            state = exposure.proposed(state, seen, **LIMITS)
        settled = [us for us, _ in steps[-4:]]
        ok = max(settled) <= 1.3 * min(settled) and steps[-1][1] >= 0.9 * max(fixed.values())
        good = good and ok
        print("from %5d us:" % start, " ".join("%d:%d" % step for step in steps), "good" if ok else "NOT GOOD")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
