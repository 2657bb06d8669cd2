"""Frames for misaligned.py: rendered, or false dots that no rig explains."""

import json
import math
import os
import random
import shutil

import numpy as np

import misaligned_rows as rows
import runs
import scenes

FULL_GREY = 250
# The sensor's offset, and what noise adds to a maximum: exposure does not scale them.
DARK_GREY = 6.0
EXPOSURE_MAX = 20.0
RANDOM_DOTS = 1024
SPOT_SIGMA_PX, SPOT_REACH_PX = 1.2, 7
BACKGROUND_GREY, NOISE_GREY = 30.0, 1.5
# Of the paper's pitch in the image; one pitch is left out, the true one.
LATTICE_PITCHES = (0.7, 0.8, 0.88, 1.13, 1.25, 1.4)
PITCH_PX = 27.3


def read_truths(directory):
    return {line["file"]: line for line in runs.read_lines(os.path.join(directory, "truth.jsonl"))}


def read_image(path):
    """A PGM of 8 bits, as render writes it."""
    with open(path, "rb") as file:
        data = file.read()
    width, height = (int(word) for word in data.split(None, 3)[1:3])
    return np.frombuffer(data[-width * height:], np.uint8).reshape(height, width)


def write_image(path, image):
    with open(path, "wb") as file:
        file.write(b"P5\n%d %d\n255\n" % (image.shape[1], image.shape[0]))
        file.write(np.clip(image.round(), 0, 255).astype(np.uint8).tobytes())


def half_exposure(directory):
    """The exposure at which half of the visible dots reach the sensor's limit."""
    peaks = []
    truths = read_truths(directory)
    for name in sorted(truths)[::10]:
        image = np.pad(read_image(os.path.join(directory, name)), 1)
        for _, u, v, _ in truths[name]["dots"]:
            column, row = math.floor(u + 0.5), math.floor(v + 0.5)
            peaks.append(image[row:row + 3, column:column + 3].max())
    return min((FULL_GREY - DARK_GREY) / (float(np.median(peaks)) - DARK_GREY), EXPOSURE_MAX)


def rendered(programs, work, kind, rig, sequence, seed, frames):
    """The directory of a sequence: of a kind, or "still" ones, which a drift is compared with."""
    options = ["--rig", rig, "--sequence", str(sequence), "--frames", str(frames)]
    if kind == "missing":
        options += ["--missing", "0.5"]
    elif kind == "over-exposed":
        plain = rendered(programs, work, "plain", rig, sequence, seed, frames)
        options += ["--exposure", "%.2f" % half_exposure(plain)]
    elif kind == "drift":
        options += ["--drift", "%.6f,%.6f,%.6f" % rows.drift_deg(sequence, frames)]
    name = "%s_%s_sequence%d_%d_%d" % (kind, rig, sequence, seed, frames)
    directory = os.path.join(work, "frames", name)
    runs.render(programs["render"], programs["stamp"], directory, scenes.Scene(kind, rig, name, seed, tuple(options)))
    return directory


def random_dots(rng, width, height):
    return [(rng.uniform(0, width - 1), rng.uniform(0, height - 1)) for _ in range(RANDOM_DOTS)]


def lattice_dots(rng, width, height, pitch_px):
    """A regular lattice over the whole frame, rotated by up to 10 degrees."""
    angle, reach = math.radians(rng.uniform(-10, 10)), int(math.hypot(width, height) / pitch_px)
    along, across = pitch_px * math.cos(angle), pitch_px * math.sin(angle)
    u0, v0 = width / 2 + rng.uniform(0, pitch_px), height / 2 + rng.uniform(0, pitch_px)
    dots = ((u0 + along * i - across * j, v0 + across * i + along * j)
            for i in range(-reach, reach + 1) for j in range(-reach, reach + 1))
    return [(u, v) for u, v in dots if 0 <= u <= width - 1 and 0 <= v <= height - 1]


def draw_dots(rng, width, height, dots):
    image = np.full((height + 2 * SPOT_REACH_PX, width + 2 * SPOT_REACH_PX), BACKGROUND_GREY)
    image += np.random.default_rng(rng.getrandbits(32)).normal(0, NOISE_GREY, image.shape)
    reach = np.arange(-SPOT_REACH_PX, SPOT_REACH_PX + 1)
    for u, v in dots:
        column, row = round(u), round(v)
        across = np.exp(-0.5 * ((column + reach - u) / SPOT_SIGMA_PX)**2)
        down = np.exp(-0.5 * ((row + reach - v) / SPOT_SIGMA_PX)**2)
        image[row:row + reach.size, column:column + reach.size] += rng.uniform(60, 160) * np.outer(down, across)
    return image[SPOT_REACH_PX:-SPOT_REACH_PX, SPOT_REACH_PX:-SPOT_REACH_PX]


def false_dots(work, kind, rig_directory, name, seed, frames):
    """A directory of false dots, others in each frame, with the rig of another directory."""
    directory = os.path.join(work, "frames", "%s_%s_%d_%d" % (kind, name, seed, frames))
    if os.path.exists(os.path.join(directory, "rig.json")):
        return directory
    os.makedirs(directory, exist_ok=True)
    with open(os.path.join(rig_directory, "rig.json"), encoding="utf-8") as file:
        rig = json.load(file)
    size = rig["image_width"], rig["image_height"]
    with open(os.path.join(directory, "truth.jsonl"), "w", encoding="utf-8") as truth:
        for frame in range(frames):
            rng, file_name = random.Random("%s %d %d" % (kind, seed, frame)), "%06d.pgm" % frame
            pitch_px = PITCH_PX * LATTICE_PITCHES[frame % len(LATTICE_PITCHES)]
            dots = random_dots(rng, *size) if kind == "random" else lattice_dots(rng, *size, pitch_px)
            write_image(os.path.join(directory, file_name), draw_dots(rng, *size, dots))
            print(json.dumps({"file": file_name, "head": None, "dots": [], "dim_dots": []}), file=truth)
    shutil.copy(os.path.join(rig_directory, "rig.json"), directory)
    return directory
