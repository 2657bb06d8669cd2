#!/usr/bin/env python3
"""What a trace says of the rays around each detection is what its evidence was computed from: tools/learn needs it.

    trace_map.py HOST_SIM FRAMES...

Looks at the frames, and at a depth image of three figures, of which each is seen in a window of its own.
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
import frames  # pylint: disable=wrong-import-position
import ray_map  # pylint: disable=wrong-import-position
import score  # pylint: disable=wrong-import-position


LOGIT_ERROR = 0.03  # each of 56 parts is rounded to 1/1024
BALLS_MM = ((-400.0, 1000.0), (0.0, 1500.0), (600.0, 1900.0))


def complaints(trace, maps, learnt):
    for detection in trace["findings"]:
        rays = detection.get("surroundings")
        if detection["predicted"]:
            continue
        if rays is None:
            yield "%s: a detection without its rays" % trace["file"]
            continue
        answers = ray_map.answers(maps, numpy.array([rays["place"]]), numpy.array([rays["weight_q12"]]))[0]
        given_q8 = detection["answer_q8"]
        centre_mm = numpy.array([detection["centre_mm_q8"]]) / 256
        # Of another view, or of a ray at a cell's edge, which is rounded otherwise.
        if min((ray_map.places_around(frames.read_rays(view), centre_mm)[0] != rays["place"]).sum()
               for view in trace["rays"]) > 3:
            yield "%s: rays of the trace are elsewhere in the maps" % trace["file"]
        if [round(256 * answer) for answer in answers] != given_q8:
            yield "%s: rays say %s, the trace %s in Q8" % (trace["file"], answers, given_q8)
        expected = learnt.logits(numpy.array([detection["evidence_q8"]]), numpy.array([given_q8]))[0]
        logit = (learnt.bias_q10 + sum(detection["part_q10"])) / 1024
        if abs(logit - expected) > LOGIT_ERROR:
            yield "%s: log-odds of %.4f, of this evidence %.4f are expected" % (trace["file"], logit, expected)


def write_depth_image(folder):
    """Three balls above boxes before a wall."""
    width, height, focal, wall_mm = 640, 480, 400.0, 3000.0
    rig = {"kind": "range", "image_width": width, "image_height": height, "near_mm": 400.0, "far_mm": 10000.0,
           "camera_matrix": {"type_id": "opencv-matrix", "rows": 3, "cols": 3, "dt": "d",
                             "data": [focal, 0, width / 2, 0, focal, height / 2, 0, 0, 1]},
           "distortion_coefficients": {"type_id": "opencv-matrix", "rows": 1, "cols": 5, "dt": "d", "data": [0, 0, 0, 0, 0]}}
    with open(os.path.join(folder, "rig.json"), "w", encoding="utf-8") as file:
        json.dump(rig, file)
    y, x = ((numpy.mgrid[:height, :width] + 0.5) - [[[height / 2]], [[width / 2]]]) / focal
    depth_mm = numpy.full((height, width), wall_mm)
    for centre_x, centre_z in BALLS_MM:
        across = numpy.hypot(x * centre_z - centre_x, y * centre_z) / 100.0
        ball = numpy.where(across < 1.0, centre_z - 100.0 * numpy.sqrt(numpy.maximum(1.0 - across ** 2, 0.0)), wall_mm)
        is_box = (abs(x * centre_z - centre_x) < 200.0) & (y * centre_z > 130.0)
        depth_mm = numpy.minimum(depth_mm, numpy.where(is_box, centre_z, ball))
    with open(os.path.join(folder, "000000.pgm"), "wb") as file:
        file.write(b"P5\n%d %d\n65535\n" % (width, height) + depth_mm.astype(">u2").tobytes())


def main():
    maps, *_ = score.read_map(os.path.join(ROOT, "firmware/core/detect/ih_surroundings_map.h"))
    with tempfile.TemporaryDirectory() as work:
        depth = os.path.join(work, "depth")
        os.mkdir(depth)
        write_depth_image(depth)
        out = os.path.join(work, "out")
        subprocess.run([sys.argv[1], "--trace", out, *sys.argv[2:], depth], check=True, stdout=subprocess.DEVNULL)
        traces = []
        for path in sorted(glob.glob(os.path.join(out, "*", "*.json"))):
            with open(path, encoding="utf-8") as file:
                traces.append(json.load(file))
    _, learnt, _ = score.read_header(os.path.join(ROOT, "firmware/core/detect/ih_score_weights.h"))
    bad = [text for trace in traces for text in complaints(trace, maps, learnt)]
    depths = [detection["centre_mm_q8"][2] / 256 for detection in traces[0]["findings"]]
    bad += ["depth image: no detection at %g mm" % ball for _, ball in BALLS_MM
            if not any(abs(depth - ball) < 100.0 for depth in depths)]
    count = sum(len(trace["findings"]) for trace in traces)
    print("\n".join(bad) or "%d detections, all as their rays say" % count)
    return 1 if bad or count < len(traces) / 2 else 0


if __name__ == "__main__":
    sys.exit(main())
