"""From rendered scenes to what the firmware saw in them: evidence and truth of every frame."""

import concurrent.futures
import glob
import json
import os
import shutil
import subprocess

import numpy

import ray_map

SLOTS = 361
GRID = 19
DEEP_MM = 98  # behind a point, where ih_scan tries a head
# Of a directory every so many frames are learnt the promise from: a frame has 90 centres.
TRIED_EVERY = 8
COUNTED = numpy.arange(SLOTS).reshape(GRID, GRID)[::2, ::2].ravel()  # rays, as in ih_surroundings.c


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


def read_rays(columns):
    """Of a view: where the rays start, their pitch, and of each its slope, its point, its state."""
    def of(names, bits):
        return numpy.stack([numpy.array(columns[name]) for name in names], axis=-1) / (1 << bits)

    return {"origin_mm": numpy.array(columns["origin_mm_q8"]) / 256, "pitch": columns["pitch_q20"] / (1 << 20),
            "slope": of(("slope_x_q20", "slope_y_q20"), 20), "point_mm": of(("x_mm_q8", "y_mm_q8", "z_mm_q8"), 8),
            "state": numpy.array(columns["state"])}


def tried(rays):
    """Centres that ih_scan tries: behind the first seen point of each block of two by two slots."""
    slots = numpy.flatnonzero(rays["state"] == ray_map.SEEN)
    block = slots // GRID // 2 * GRID + slots % GRID // 2
    slots = slots[numpy.unique(block, return_index=True)[1]]
    ahead = numpy.column_stack([rays["slope"][slots], numpy.ones(len(slots))])
    return rays["point_mm"][slots] + DEEP_MM * ahead / numpy.linalg.norm(ahead, axis=1)[:, None]


def read_tried(views):
    """All centres that are tried in a frame, where the rays that are counted are in the map, and a ray's weight."""
    parts = [(numpy.zeros((0, 3)), numpy.zeros((0, len(COUNTED)), numpy.int16), numpy.zeros(0))]
    for rays in views:
        centre_mm = tried(rays)
        away_mm = centre_mm[:, 2] - rays["origin_mm"][2]
        weight = numpy.minimum(numpy.maximum(away_mm, 0) * rays["pitch"] / ray_map.CELL_MM, 1)**2
        counted = {**rays, **{key: rays[key][COUNTED] for key in ("slope", "point_mm", "state")}}
        parts.append((centre_mm, ray_map.places_around(counted, centre_mm), weight))
    centre_mm, place, weight = (numpy.concatenate(column) for column in zip(*parts))
    return {"centre_mm": centre_mm, "place": place, "weight": weight}


def read_trace(path, also):
    """What was seen in a frame, and also: "tried", "side" (of its centre on which each ray passes, by detection and slot)."""
    with open(path, encoding="utf-8") as file:
        trace = json.load(file)
    found = [f for f in trace["findings"] if "surroundings" in f]
    centre_mm = numpy.array([f["centre_mm_q8"] for f in found]).reshape(-1, 3) / 256
    more, views = {}, [read_rays(view) for view in trace["rays"]] if also else []
    if "tried" in also:
        more["tried"] = read_tried(views)
    if "side" in also:
        sides = [ray_map.sides_around(views[f["surroundings"]["view"]], at[None]) for f, at in zip(found, centre_mm)]
        more["side"] = numpy.array(sides, dtype=numpy.int8).reshape(len(found), SLOTS)
    return more | {
        "file": trace["file"],
        "kinds": trace["evidence"],
        # To the level frame, in which detections are; a camera that hangs level has none.
        "level": numpy.array(trace.get("level_q30", (1 << 30) * numpy.eye(3))).reshape(3, 3) / (1 << 30),
        "centre_mm": centre_mm,
        "measure_q8": numpy.array([f["evidence_q8"] for f in found],
                                  dtype=numpy.int64).reshape(len(found), len(trace["evidence"])),
        "weight_q12": numpy.array([f["surroundings"]["weight_q12"] for f in found], dtype=int),
        "place": numpy.array([f["surroundings"]["place"] for f in found], dtype=numpy.int16).reshape(len(found), SLOTS),
    }


def look(program, options, also, directory, scratch):
    """Every frame of a directory through the firmware, and also what read_trace gives; what the scan tries of some of them."""
    name = os.path.relpath(directory, "/").replace(os.sep, "_")
    out = os.path.join(scratch, name[-200:])
    shutil.rmtree(out, ignore_errors=True)
    subprocess.run([program, *options, "--trace", out, directory], check=True, stdout=subprocess.DEVNULL)
    truth = read_truth(directory)
    frames = []
    for index, path in enumerate(sorted(glob.glob(os.path.join(out, "**", "*.json"), recursive=True))):
        frame = read_trace(path, [name for name in also if name != "tried" or index % TRIED_EVERY == 0])
        if frame["file"] in truth:
            frame["heads"], frame["unclear"] = (heads @ frame["level"].T for heads in truth[frame["file"]])
            frame["directory"] = directory
            frames.append(frame)
    shutil.rmtree(out)
    return frames


def look_at_all(program, directories, scratch, jobs, options=(), also=()):
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        work = [pool.submit(look, program, options, also, directory, scratch) for directory in directories]
        return [frame for one in work for frame in one.result()]
