"""From rendered scenes to what the firmware saw in them: evidence and truth of every frame."""

import concurrent.futures
import glob
import json
import os
import shutil
import subprocess

import numpy


def render(program, directory, seed, options):
    """Render unless it is there: rig.json is written last."""
    if os.path.exists(os.path.join(directory, "rig.json")):
        return
    shutil.rmtree(directory, ignore_errors=True)
    os.makedirs(os.path.dirname(directory), exist_ok=True)
    subprocess.run([program, *options, "--seed", str(seed), directory], check=True)


def read_truth(directory):
    """Per file the heads' centres in mm, an empty array where nobody is."""
    truth = {}
    with open(os.path.join(directory, "truth.jsonl"), encoding="utf-8") as lines:
        for line in lines:
            entry = json.loads(line)
            heads = entry.get("heads") or ([entry["head"]] if entry.get("head") else [])
            truth[entry["file"]] = numpy.array([h["centre_mm"] for h in heads]).reshape(-1, 3)
    return truth


def read_trace(path):
    with open(path, encoding="utf-8") as file:
        trace = json.load(file)
    found = [detection for detection in trace["findings"] if not detection["predicted"]]
    return {
        "file": trace["file"],
        "kinds": trace["evidence"],
        "centre_mm": numpy.array([f["centre_mm_q8"] for f in found]).reshape(-1, 3) / 256,
        "evidence_q8": numpy.array([f["evidence_q8"] for f in found],
                                   dtype=numpy.int64).reshape(len(found), len(trace["evidence"])),
    }


def look(program, directory, scratch):
    """Every frame of a directory through the firmware."""
    name = os.path.relpath(directory, "/").replace(os.sep, "_")
    out = os.path.join(scratch, name)
    shutil.rmtree(out, ignore_errors=True)
    subprocess.run([program, "--trace", out, directory], check=True, stdout=subprocess.DEVNULL)
    truth = read_truth(directory)
    frames = []
    for path in sorted(glob.glob(os.path.join(out, "**", "*.json"), recursive=True)):
        frame = read_trace(path)
        frame["heads"] = truth[frame["file"]]
        frame["directory"] = directory
        frames.append(frame)
    shutil.rmtree(out)
    return frames


def look_at_all(program, directories, scratch, jobs):
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        work = [pool.submit(look, program, directory, scratch) for directory in directories]
        return [frame for one in work for frame in one.result()]
