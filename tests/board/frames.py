"""Frames directories, as the board's camera gives them and as host_sim reads them."""

import json
import os
import shutil
import subprocess

# Time stamps start here: v4l2loopback takes 0 for none.
TIME_0_US = 1000000


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
        with open(os.path.join(self.directory, self.entries[index]["file"]), "rb") as file:
            content = file.read()
        head = content.split(b"\n", 3)
        if head[0] != b"P5" or head[2] != b"255":
            raise ValueError(f"{self.directory}: frame {index} is no 8-bit PGM")
        return head[3]

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


def host_records(run, frames):
    """What host_sim says, a line per lit frame."""
    if frames.records is None:
        frames.records = subprocess.run([run.host_sim, "--json", frames.directory], check=True,
                                        stdout=subprocess.PIPE, text=True).stdout.splitlines()
    return frames.records
