"""Rendering, and running host_sim over scenes in every variant."""

import collections
import concurrent.futures
import dataclasses
import hashlib
import json
import os
import shutil
import subprocess

import score

PARTS = ("ambient", "scan", "nests", "expected", "fit", "move", "tracks", "windows", "skips", "missing")
FULL = "full"
PAPER = "paper"
PAPER_PLAIN = "paper, without missing"
VARIANTS = {FULL: [], PAPER: ["--paper"], PAPER_PLAIN: ["--paper", "--without", "missing"],
            **{"without " + part: ["--without", part] for part in PARTS}}


@dataclasses.dataclass(frozen=True)
class Failure:
    scene: object
    directory: str
    file: str
    what: str
    record: dict
    truth: dict
    trace: str  # its path, or ""


@dataclasses.dataclass
class Run:
    """What came of one scene: counts by variant, failures of the full method."""

    counts: dict
    failures: list


def read_lines(path):
    with open(path, encoding="utf-8") as file:
        return [json.loads(line) for line in file if line.strip()]


def render(program, stamp, directory, scene):
    """Render unless it is there as this program and these options give it."""
    made_by = "%s %s" % (stamp, " ".join(scene.options))
    note = directory + ".made"
    if os.path.exists(os.path.join(directory, "rig.json")) and os.path.exists(note):
        with open(note, encoding="utf-8") as file:
            if file.read() == made_by:
                return
    shutil.rmtree(directory, ignore_errors=True)
    os.makedirs(os.path.dirname(directory), exist_ok=True)
    subprocess.run([program, *scene.options, "--seed", str(scene.seed), directory], check=True,
                   stdout=subprocess.DEVNULL)
    with open(note, "w", encoding="utf-8") as file:
        file.write(made_by)


class Camera:
    """What of a rig says whether a head is in the picture at all."""

    def __init__(self, rig):
        self.size = rig["image_width"], rig["image_height"]
        self.matrix = rig["camera_matrix"]["data"]
        self.near_mm, self.far_mm = rig["near_mm"], rig["far_mm"]

    def sees(self, centre_mm):
        """Without the lens: a pixel or two do not matter here."""
        x, y, z = centre_mm
        if not self.near_mm <= z <= self.far_mm:
            return False
        u = self.matrix[0] * x / z + self.matrix[2]
        v = self.matrix[4] * y / z + self.matrix[5]
        return 0 <= u < self.size[0] and 0 <= v < self.size[1]


def host_sim(program, arguments, directory):
    """Records by file."""
    done = subprocess.run([program, "--json", *arguments, directory], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, check=False)
    records = {}
    for line in done.stdout.splitlines():
        record = json.loads(line)
        if "error" in record:
            raise RuntimeError("%s/%s: %s" % (directory, record["file"], record["error"]))
        records[record["file"]] = record
    if done.returncode:
        raise RuntimeError("host_sim %s %s: %s" % (" ".join(arguments), directory, done.stderr))
    return records


def count(records, truths, camera):
    """Counts of a run, and what went wrong by file."""
    counts, wrong = score.Counts(), {}
    for file, truth in sorted(truths.items()):
        if file not in records:
            continue  # a frame without laser has no record
        verdict = score.judge(records[file], truth)
        if verdict is not None:
            counts.add(verdict)
            if not verdict.right:
                wrong[file] = verdict.what
        if len(truth.get("heads", [])) > 1:
            centres = [head["centre_mm"] for head in truth["heads"] if camera.sees(head["centre_mm"])]
            counts.add_people(len(centres), *score.people(records[file], centres))
    return counts, wrong


def keep_traces(scratch, kept, files):
    """Of all traces of a run those of these frames; their paths by file."""
    found = {}
    for folder, _, names in os.walk(scratch):
        for name in names:
            file = os.path.splitext(name)[0]
            matching = [f for f in files if os.path.splitext(f)[0] == file]
            if matching:
                os.makedirs(kept, exist_ok=True)
                found[matching[0]] = os.path.join(kept, name)
                shutil.move(os.path.join(folder, name), found[matching[0]])
    shutil.rmtree(scratch, ignore_errors=True)
    return found


def idle_variants(directory, rig):
    """Those that leave out what this directory has not: they need no run of their own."""
    idle = set() if rig.get("kind") == "range" else {"without windows"}
    path = os.path.join(directory, "frames.jsonl")
    frames = read_lines(path) if os.path.exists(path) else []
    return idle if any(not frame.get("laser", True) for frame in frames) else idle | {"without ambient"}


def run(programs, work, scene, variants, with_traces):
    """One scene through every variant."""
    directory = scene.directory
    if not directory:
        directory = os.path.join(work, "frames", scene.name)
        render(programs["render"], programs["stamp"], directory, scene)
    truths = {t["file"]: t for t in read_lines(os.path.join(directory, "truth.jsonl"))}
    with open(os.path.join(directory, "rig.json"), encoding="utf-8") as file:
        rig = json.load(file)
    camera, idle = Camera(rig), idle_variants(directory, rig)
    result = Run({}, [])
    for variant in variants:
        if variant in idle and FULL in result.counts:
            result.counts[variant] = result.counts[FULL]
            continue
        scratch = os.path.join(work, "scratch", scene.name)
        trace = ["--trace", scratch] if variant == FULL and with_traces else []
        records = host_sim(programs["host_sim"], VARIANTS[variant] + trace, directory)
        result.counts[variant], wrong = count(records, truths, camera)
        if variant == FULL:
            kept = os.path.join(work, "trace", scene.name)
            shutil.rmtree(kept, ignore_errors=True)
            paths = keep_traces(scratch, kept, wrong)
            result.failures = [Failure(scene, directory, file, what, records[file], truths[file],
                                       paths.get(file, ""))
                               for file, what in wrong.items()]
    return result


def run_all(programs, work, scenes, variants, with_traces, jobs, reported):
    """By scene, in the order of scenes."""
    with open(programs["render"], "rb") as file:
        programs = dict(programs, stamp=hashlib.sha256(file.read()).hexdigest()[:16])
    results = collections.OrderedDict()
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        futures = [pool.submit(run, programs, work, scene, variants, with_traces) for scene in scenes]
        for scene, future in zip(scenes, futures):
            results[scene] = future.result()
            reported(scene, results[scene])
    shutil.rmtree(os.path.join(work, "scratch"), ignore_errors=True)
    return results
