"""Frames directories, as the board's camera gives them and as host_sim reads them."""

import json
import math
import os
import re
import shutil
import subprocess

# Time stamps start here: v4l2loopback takes 0 for none.
TIME_0_US = 1000000
# Labelled dots of a rig that fits lie nearer to their lines than this; 0.6 px is ih_labels' limit.
ACROSS_MAX_PX = 0.3
# Of the rig file that is wrong.
MOVED_DEG = 0.2


class Frames:
    """A frames directory."""

    def __init__(self, directory, rig):
        self.directory = directory
        self.rig = rig  # its name on the board
        self.records = None  # host_sim's, once they are known
        with open(os.path.join(directory, "frames.jsonl"), encoding="ascii") as file:
            self.entries = [json.loads(line) for line in file]

    def __len__(self):
        return len(self.entries)

    def samples(self, index):
        """As a camera gives them: a byte each, or two, the least significant byte first."""
        with open(os.path.join(self.directory, self.entries[index]["file"]), "rb") as file:
            kind, _, maximum, content = file.read().split(b"\n", 3)
        if kind != b"P5":
            raise ValueError(f"{self.directory}: frame {index} is no PGM as render writes it")
        samples = bytearray(content)
        if int(maximum) > 255:
            samples[0::2], samples[1::2] = samples[1::2], samples[0::2]
        return bytes(samples)

    def time_us(self, index):
        return self.entries[index]["time_us"]

    def lit(self, index):
        return self.entries[index]["laser"]


def render(run, rig, *options):
    """Frames with time stamps from TIME_0_US on, rendered if they are not there."""
    directory = os.path.join(run.work, "frames", "_".join(options).replace("--", ""))
    if not os.path.exists(os.path.join(directory, "rig.json")):
        shutil.rmtree(directory, ignore_errors=True)
        os.makedirs(directory)
        subprocess.run([run.render, *options, directory], check=True, stdout=subprocess.DEVNULL)
        frames = Frames(directory, rig)
        with open(os.path.join(directory, "frames.jsonl"), "w", encoding="ascii") as file:
            for entry in frames.entries:
                entry["time_us"] += TIME_0_US
                file.write(json.dumps(entry) + "\n")
    return Frames(directory, rig)


def picked(run, name, frames, picks):
    """Some of the frames, at other times: picks are (index, time_us)."""
    directory = os.path.join(run.work, "frames", name)
    shutil.rmtree(directory, ignore_errors=True)
    os.makedirs(directory)
    shutil.copy(os.path.join(frames.directory, "rig.json"), directory)
    with open(os.path.join(directory, "frames.jsonl"), "w", encoding="ascii") as file:
        for number, (index, time_us) in enumerate(picks):
            entry = dict(frames.entries[index], file=f"{number:06}.pgm", time_us=time_us)
            file.write(json.dumps(entry) + "\n")
            source = os.path.join(frames.directory, frames.entries[index]["file"])
            os.symlink(os.path.abspath(source), os.path.join(directory, entry["file"]))
    return Frames(directory, frames.rig)


def clipped(run, name, frames, white):
    """The same frames of 8 bits, with another white; what is brighter becomes white."""
    directory = os.path.join(run.work, "frames", name)
    shutil.rmtree(directory, ignore_errors=True)
    os.makedirs(directory)
    for file in ["rig.json", "frames.jsonl"]:
        shutil.copy(os.path.join(frames.directory, file), directory)
    for index, entry in enumerate(frames.entries):
        with open(os.path.join(frames.directory, entry["file"]), "rb") as file:
            kind, size, _, _ = file.read().split(b"\n", 3)
        table = bytes(min(value, white) for value in range(256))
        with open(os.path.join(directory, entry["file"]), "wb") as file:
            file.write(b"\n".join([kind, size, b"%d" % white,
                                   frames.samples(index).translate(table)]))
    return Frames(directory, frames.rig)


def as_of_host(record):
    """A board's record without what it alone has: across_px once more."""
    try:
        found = json.loads(record)
    except json.JSONDecodeError:
        return record
    if "error" in found:
        return record
    across_px, rig = found.get("across_px"), found.get("rig")
    if not rig or (across_px is not None) != (found["labelled"] > 0):
        return "expected a rig, and across_px where there are labels: " + record
    if across_px is None:
        return record
    if not 0 < across_px < ACROSS_MAX_PX or rig["across_px"] != across_px:
        return f"across_px is not within 0 .. {ACROSS_MAX_PX}, or another one in rig: {record}"
    return re.sub(r'(.*),"across_px":[0-9.]+', r"\1", record)


def moved_rig(frames, path):
    """The rig file of these frames with its projector rotated about X."""
    with open(os.path.join(frames.directory, "rig.json"), encoding="ascii") as file:
        rig = json.load(file)
    sine, cosine = math.sin(math.radians(MOVED_DEG)), math.cos(math.radians(MOVED_DEG))
    rays = rig["dot_rays"]["data"]
    for i in range(0, len(rays), 3):
        y, z = rays[i + 1], rays[i + 2]
        rays[i + 1], rays[i + 2] = cosine * y - sine * z, sine * y + cosine * z
    with open(path, "w", encoding="ascii") as file:
        json.dump(rig, file)
    return path


def host_records(run, frames, *options):
    """What host_sim says, a line per lit frame."""
    if frames.records is None:
        frames.records = subprocess.run([run.host_sim, "--json", *options, frames.directory], check=True,
                                        stdout=subprocess.PIPE, text=True).stdout.splitlines()
    return frames.records
