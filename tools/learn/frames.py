"""From rendered scenes to what the firmware saw in them: evidence and truth of every frame."""

import concurrent.futures
import glob
import json
import os
import shutil
import subprocess

import numpy

SLOTS = 361


def render(program, directory, seed, options):
    """Render unless it is there: rig.json is written last."""
    if os.path.exists(os.path.join(directory, "rig.json")):
        return
    shutil.rmtree(directory, ignore_errors=True)
    os.makedirs(os.path.dirname(directory), exist_ok=True)
    subprocess.run([program, *options, "--seed", str(seed), directory], check=True)


def centres(heads):
    return numpy.array([head["centre_mm"] for head in heads]).reshape(-1, 3)


def read_truth(directory):
    """Per file the heads' centres in mm, an empty array where nobody is; and those of which too little is seen."""
    truth = {}
    with open(os.path.join(directory, "truth.jsonl"), encoding="utf-8") as lines:
        for line in lines:
            entry = json.loads(line)
            if "head" in entry:
                heads = entry.get("heads") or ([entry["head"]] if entry["head"] else [])
                truth[entry["file"]] = centres(heads), centres(entry.get("unclear", []))
    return truth


def read_trace(path):
    with open(path, encoding="utf-8") as file:
        trace = json.load(file)
    found = [f for f in trace["findings"] if "surroundings" in f]
    return {
        "file": trace["file"],
        "kinds": trace["evidence"],
        # To the level frame, in which detections are; a camera that hangs level has none.
        "level": numpy.array(trace.get("level_q30", (1 << 30) * numpy.eye(3))).reshape(3, 3) / (1 << 30),
        "centre_mm": numpy.array([f["centre_mm_q8"] for f in found]).reshape(-1, 3) / 256,
        "evidence_q8": numpy.array([f["evidence_q8"] for f in found],
                                   dtype=numpy.int64).reshape(len(found), len(trace["evidence"])),
        "weight_q12": numpy.array([f["surroundings"]["weight_q12"] for f in found], dtype=int),
        "place": numpy.array([f["surroundings"]["place"] for f in found], dtype=numpy.int16).reshape(len(found), SLOTS),
    }


def look(program, options, directory, scratch):
    """Every frame of a directory through the firmware."""
    name = os.path.relpath(directory, "/").replace(os.sep, "_")
    out = os.path.join(scratch, name[-200:])
    shutil.rmtree(out, ignore_errors=True)
    subprocess.run([program, *options, "--trace", out, directory], check=True, stdout=subprocess.DEVNULL)
    truth = read_truth(directory)
    frames = []
    for path in sorted(glob.glob(os.path.join(out, "**", "*.json"), recursive=True)):
        frame = read_trace(path)
        if frame["file"] in truth:
            frame["heads"], frame["unclear"] = (heads @ frame["level"].T for heads in truth[frame["file"]])
            frame["directory"] = directory
            frames.append(frame)
    shutil.rmtree(out)
    return frames


def look_at_all(program, directories, scratch, jobs, options=()):
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        work = [pool.submit(look, program, options, directory, scratch) for directory in directories]
        return [frame for one in work for frame in one.result()]
