#!/usr/bin/env python3
"""What a trace says of the rays around each detection is what its evidence was computed from: tools/learn needs it.

    trace_map.py HOST_SIM FRAMES...
"""

import glob
import json
import os
import subprocess
import sys
import tempfile

import numpy

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path[:0] = [os.path.join(ROOT, "tools", part) for part in ("learn", "oracle")]
import ray_map  # pylint: disable=wrong-import-position
import score  # pylint: disable=wrong-import-position


def complaints(trace, map_q9):
    kind = trace["evidence"].index("surroundings")
    for detection in trace["findings"]:
        rays = detection.get("surroundings")
        if detection["predicted"]:
            continue
        if rays is None:
            yield "%s: a detection without its rays" % trace["file"]
            continue
        logit = ray_map.logits(map_q9, numpy.array([rays["place"]]), numpy.array([rays["weight_q12"]]))[0]
        if round(256 * logit) != detection["evidence_q8"][kind]:
            yield "%s: rays say %.3f, the evidence %.3f" % (trace["file"], logit, detection["evidence_q8"][kind] / 256)


def main():
    map_q9, _ = score.read_map(os.path.join(ROOT, "firmware/core/detect/ih_surroundings_map.h"))
    with tempfile.TemporaryDirectory() as work:
        subprocess.run([sys.argv[1], "--trace", work, *sys.argv[2:]], check=True, stdout=subprocess.DEVNULL)
        traces = []
        for path in sorted(glob.glob(os.path.join(work, "*", "*.json"))):
            with open(path, encoding="utf-8") as file:
                traces.append(json.load(file))
    bad = [text for trace in traces for text in complaints(trace, map_q9)]
    count = sum(len(trace["findings"]) for trace in traces)
    print("\n".join(bad) or "%d detections, all as their rays say" % count)
    return 1 if bad or count < len(traces) / 2 else 0


if __name__ == "__main__":
    sys.exit(main())
