#!/usr/bin/python3
"""Float64 reference of ih_health: a projector's rotation from labelled dots, and what of it can be seen at all.

    knock.py FRAMES_DIR...     for the rig of each directory (with truth.jsonl): how far, in px, one dot moves by a rotation of
                               0.3 degrees and of a shift by 0.3 mm, across and along the lines; how well 50 frames
                               with that truth's dots show each of the six when all are unknown, when only rotations are

The rig is rotated exactly (Rodrigues); equations and weights are the core's (firmware/core/upkeep/ih_rotation_estimate.h), iterated to the
end, over all frames at once.
"""

import copy
import json
import os
import shutil
import subprocess
import sys

import numpy as np

REACH_PX = 0.3
WEIGHT_MIN = 1 / 512  # half a step of the core's: a dot with less is none, and begins no position
STEPS_OF_PX = 4096  # of the core's figures
MOVE_PX = 1229 / STEPS_OF_PX  # along its line: another position
POSITIONS = 2  # that a slot remembers
FRAMES_OF_POSITION = 20  # most that frames at one position count
FRACTION_MIN = 1 / 3  # by which the dots' mean moves as they do
HALF_SCATTERS, HALF_OF_ONE_PX = 3, 0.3  # at sqrt(3 s^2 + 0.3^2 / n) from what the rotation says a slot counts half
LEFT_MAX_PX = 1
STEEP_MIN = 1 / 3
PASSES = 4  # the core's solutions
MANY_FRAMES = 5  # that show the error of a position
SLOT_PX = 0.03
SLOTS = 361
NOISE_PX = 0.12  # of a dot, across its line
ROTATION_RAD = np.radians(0.3)
SHIFT_MM = 0.3


class Rig:
    """rig.json in float64."""

    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            self.json = json.load(file)

        def matrix(name):
            return np.array(self.json[name]["data"], float).reshape(self.json[name]["rows"], -1)
        camera = matrix("camera_matrix")
        self.focal, self.centre = camera[[0, 1], [0, 1]], camera[:2, 2]
        self.lens = matrix("distortion_coefficients")[0]
        self.origin, self.rays = matrix("projector_origin")[:, 0], matrix("dot_rays")

    def rotated(self, rotation):
        """By Rodrigues' formula, about the projector's origin."""
        out, angle = copy.copy(self), np.linalg.norm(rotation)
        if angle > 0:
            n = rotation / angle
            out.rays = (self.rays * np.cos(angle) + np.cross(n, self.rays) * np.sin(angle)
                        + np.outer(self.rays @ n, n) * (1 - np.cos(angle)))
        return out

    def save(self, path):
        out = copy.deepcopy(self.json)
        out["dot_rays"]["data"] = [float(value) for value in self.rays.ravel()]
        with open(path, "w", encoding="utf-8") as file:
            json.dump(out, file)

    def undistorted(self, position):
        target = (position - self.centre) / self.focal
        x, (k1, k2, p1, p2, k3) = target.copy(), self.lens
        for _ in range(60):
            r2, xy = (x * x).sum(axis=1), x[:, 0] * x[:, 1]
            bent = np.stack([2 * p1 * xy + p2 * (r2 + 2 * x[:, 0]**2), p1 * (r2 + 2 * x[:, 1]**2) + 2 * p2 * xy], 1)
            x = (target - bent) / (1 + r2 * (k1 + r2 * (k2 + r2 * k3)))[:, None]
        return x * self.focal + self.centre

    def lines(self):
        """Position at infinity, direction, and slopes: px across and along the line per rad, per axis."""
        x, y = (self.rays[:, :2] / self.rays[:, 2:]).T
        shift = (self.origin[:2] - self.origin[2] * np.stack([x, y], 1)) * self.focal
        direction = shift / np.linalg.norm(shift, axis=1)[:, None]
        du = self.focal[0] * np.stack([-x * y, 1 + x * x, -y], 1)
        dv = self.focal[1] * np.stack([-1 - y * y, x * y, x], 1)
        across = direction[:, :1] * dv - direction[:, 1:] * du
        along = direction[:, :1] * du + direction[:, 1:] * dv
        return np.stack([x, y], 1) * self.focal + self.centre, direction, across, along


def truths(folder):
    """Index, u, v, depth of all visible dots of each frame."""
    with open(os.path.join(folder, "truth.jsonl"), encoding="utf-8") as file:
        return [np.array(json.loads(line)["dots"], float).reshape(-1, 4) for line in file]


def true_rotation(folder):
    """How the rays of the truth's dots are rotated against those of rig.json: least squares."""
    rig, rotation = Rig(os.path.join(folder, "rig.json")), np.zeros(3)
    dots = np.concatenate(truths(folder)[::5])
    index, depth = dots[:, 0].astype(int), dots[:, 3:]
    normal = (rig.undistorted(dots[:, 1:3]) - rig.centre) / rig.focal
    offset = np.hstack([normal * depth, depth]) - rig.origin
    offset /= np.linalg.norm(offset, axis=1)[:, None]
    for _ in range(5):
        rays = rig.rotated(rotation).rays[index]
        matrix = np.stack([np.cross(axis, rays) for axis in np.eye(3)], axis=2)
        rotation = rotation + np.linalg.lstsq(matrix.reshape(-1, 3), (offset - rays).ravel(), rcond=None)[0]
    return rotation


def labelled(folder, rig, host_sim, work):
    """Of host_sim with this rig: frame, slot, undistorted u, v of all labelled dots, and the core's own distance from the line
    and place along it; what it prints."""
    shutil.rmtree(work, ignore_errors=True)
    os.makedirs(work)
    rig.save(os.path.join(work, "rig.json"))
    out = subprocess.run([host_sim, "--rig", os.path.join(work, "rig.json"), "--trace", work, folder], check=True,
                         stdout=subprocess.PIPE, text=True).stdout
    paths = [os.path.join(directory, name) for directory, _, names in os.walk(work) for name in names
             if name.endswith(".json") and name != "rig.json"]
    rows = []
    for frame, path in enumerate(sorted(paths)):
        with open(path, encoding="utf-8") as file:
            trace = json.load(file)
        u, v = trace["dots"]["u_px_q12"], trace["dots"]["v_px_q12"]
        rows += [(frame, slot, u[label["dot"]] / STEPS_OF_PX, v[label["dot"]] / STEPS_OF_PX, label["perp_px_q12"] / STEPS_OF_PX,
                  label["t_px_q12"] / STEPS_OF_PX) for slot, label in enumerate(trace["labels"]["slot"]) if label is not None]
    rows = np.array(rows)
    rows[:, 2:4] = rig.undistorted(rows[:, 2:4])
    return rows, out


def distances(rig, rows):
    """From the line, and along it."""
    infinity, direction, _, _ = rig.lines()
    slots = rows[:, 1].astype(int)
    off, offset = rows[:, 2:4] - infinity[slots], direction[slots]
    return off[:, 1] * offset[:, 0] - off[:, 0] * offset[:, 1], (off * offset).sum(axis=1)


def weight_of(distance):
    """Tukey's."""
    return np.clip(1 - (distance / REACH_PX)**2, 0, None)**2


def rise_of(distance):
    """Derivative of weight times distance."""
    ratio = np.minimum((distance / REACH_PX)**2, 1)
    return (1 - ratio) * (1 - 5 * ratio)


def positions(rig, rows):
    """Number of the position of each dot: within MOVE_PX of where one began. A slot remembers two; a dot elsewhere begins one
    instead of the lighter."""
    distance, along = distances(rig, rows)
    weight, out, count = weight_of(distance), np.full(len(rows), -1), 0
    known = [[[None, 0.0, -1] for _ in range(POSITIONS)] for _ in range(SLOTS)]
    for i, slot in enumerate(rows[:, 1].astype(int)):
        if weight[i] < WEIGHT_MIN:
            continue
        position = next((p for p in known[slot] if p[0] is not None and abs(along[i] - p[0]) <= MOVE_PX), None)
        if position is None:
            position = min(known[slot], key=lambda p: p[1])
            position[:], count = [along[i], 0.0, count], count + 1
        position[1] += weight[i]
        out[i] = position[2]
    return out, count


class Trust:
    """Cauchy's weights of slots by how far their means are from what a rotation says, where the first one leaves scatter."""

    def __init__(self):
        self.scatter = None
        self.weight = 1.0

    def look(self, weight, mean):
        some = np.maximum(weight, 1e-9)
        square = np.minimum(np.abs(mean), LEFT_MAX_PX)**2
        if self.scatter is None:
            self.scatter = (weight * square).sum() / weight.sum()
        self.weight = 1 / (1 + square / (HALF_SCATTERS * self.scatter + HALF_OF_ONE_PX**2 / some))

    def steepness(self, weight):
        """What is left of the trusted weights when means move, as trust falls with them."""
        return max((weight * self.weight * (2 * self.weight - 1)).sum() / (weight * self.weight).sum(), STEEP_MIN)


def fit(rig, rows, rotation):
    """The rotation that fits the dots best, from this one on, and its uncertainty: least squares first, then with trust."""
    slots, rotation, trust = rows[:, 1].astype(int), np.array(rotation, float), Trust()
    number, count = positions(rig.rotated(rotation), rows)
    number = np.where(number < 0, count, number)
    for i in range(60):
        now = rig.rotated(rotation)
        slope = now.lines()[2]
        distance, _ = distances(now, rows)
        weight = weight_of(distance)
        # The mean moves by less than all dots do, as their weights move, too.
        fraction = max(rise_of(distance).sum() / weight.sum(), FRACTION_MIN)
        weight = weight / (1 + np.bincount(number, weight, count + 1) / FRAMES_OF_POSITION)[number]
        sums = np.bincount(slots, weight, SLOTS)
        pull = np.bincount(slots, weight * distance, SLOTS) / fraction
        if i >= 20:
            trust.look(sums, pull / np.maximum(sums, 1e-9))
        inverse = np.linalg.inv((slope * (trust.weight * sums)[:, None]).T @ slope)
        rotation = rotation + inverse @ slope.T @ (trust.weight * pull)
    lever = slope @ inverse
    sigma = np.sqrt((lever**2 * (trust.weight**2 * (pull**2 + (SLOT_PX * sums)**2))[:, None]).sum(axis=0))
    return rotation, sigma / trust.steepness(sums)


def estimate(folder, host_sim, work, start, frames):
    """fit to what host_sim labels in these frames (a slice) with the rig rotated by start; what host_sim prints."""
    rig = Rig(os.path.join(folder, "rig.json"))
    rows, out = labelled(folder, rig.rotated(start), host_sim, work)
    rotation, sigma = fit(rig, rows[(rows[:, 0] >= frames.start) & (rows[:, 0] < frames.stop)], start)
    return rotation, sigma, out


class Sums:
    """What the core keeps of each slot (struct ih_dot_place), in float64: weight and pull of the positions that it remembers, and of
    those before."""

    def __init__(self):
        self.at, self.before = np.zeros((POSITIONS, 2, SLOTS)), np.zeros((2, SLOTS))
        self.begun = np.full((POSITIONS, SLOTS), np.nan)
        self.total = self.rise = 0.0

    def scaled(self):
        return self.at * FRAMES_OF_POSITION / (self.at[:, :1] + FRAMES_OF_POSITION)

    def add_frame(self, slots, distance, along):
        is_there = np.abs(along - self.begun[:, slots]) <= MOVE_PX
        new = ~is_there.any(axis=0)
        which = np.where(new, self.at[:, 0, slots].argmin(axis=0), is_there.argmax(axis=0))
        left, lighter = slots[new], which[new]
        self.before[:, left] += self.scaled()[lighter, :, left].T
        self.at[lighter, :, left] = 0
        self.begun[lighter, left] = along[new]
        weight = weight_of(distance)
        self.at[which, :, slots] += np.stack([weight, weight * distance], 1)
        self.total, self.rise = self.total + weight.sum(), self.rise + rise_of(distance).sum()

    def fraction(self):
        return max(self.rise / self.total, FRACTION_MIN)

    def step(self, slope):
        weight, pull = self.before + self.scaled().sum(axis=0)
        mean, trust, rotation = pull / np.maximum(weight, 1e-9) / self.fraction(), Trust(), None
        for _ in range(PASSES):
            if rotation is not None:
                trust.look(weight, mean - slope @ rotation)
            trusted = trust.weight * weight
            rotation = np.linalg.solve((slope * trusted[:, None]).T @ slope, slope.T @ (trusted * mean))
        return rotation

    def rotate(self, move):
        self.before[1] -= self.fraction() * self.before[0] * move
        self.at[:, 1] -= self.fraction() * self.at[:, 0] * move


def follow(folder, host_sim, work, rotations):
    """The last rotation as the core computes it, without iteration: a frame's dots keep the labels and the weights that the
    lines of its time gave them, and each correction of the rig is one step. Positions are distinguished in the image, where no
    rotation of the rig moves them; which dots are used and when one is at another position is decided with the core's own figures:
    a dot at the limit may begin a position or not, and one position more of a corner is a twentieth of the uncertainty.
    rotations: first and last frame with a rotation, that rotation, and the one that the core took then."""
    rig, sums = Rig(os.path.join(folder, "rig.json")), Sums()
    for first, last, before, after in rotations:
        now = rig.rotated(before)
        rows, _ = labelled(folder, now, host_sim, work)
        rows = rows[weight_of(rows[:, 4]) >= WEIGHT_MIN]
        infinity, direction, slope, _ = now.lines()
        distance, _ = distances(now, rows)
        begins = ((infinity * direction).sum(axis=1) * STEPS_OF_PX).round() / STEPS_OF_PX
        along = rows[:, 5] + begins[rows[:, 1].astype(int)]
        for frame in range(first, last + 1):
            here = rows[:, 0] == frame
            sums.add_frame(rows[here, 1].astype(int), distance[here], along[here])
        found = before + sums.step(slope)
        sums.rotate(slope @ (after - before))
    return found


def bound(folder, host_sim, work, truth, frame_count):
    """Cramer-Rao bound of the uncertainty of the three rotations, from that many of the folder's first frames, if a dot's distance is
    normal noise of its own in each frame plus a normal error of its position, each as large as it is with the true rig; the
    two errors in px."""
    rig = Rig(os.path.join(folder, "rig.json")).rotated(truth)
    rows, _ = labelled(folder, rig, host_sim, work)
    rows = rows[rows[:, 0] < frame_count]
    number, count = positions(rig, rows)
    rows, number = rows[number >= 0], number[number >= 0]
    distance, _ = distances(rig, rows)
    frames = np.bincount(number, minlength=count)
    mean = np.bincount(number, distance, count) / frames
    noise = ((distance - mean[number])**2).sum() / (frames - 1).sum()
    many = frames >= MANY_FRAMES
    position = max((mean[many]**2 - noise / frames[many]).mean(), 0.0)
    slot_of = np.zeros(count, int)
    slot_of[number] = rows[:, 1].astype(int)
    slope = rig.lines()[2][slot_of]
    information = (slope / (position + noise / frames)[:, None]).T @ slope
    return np.sqrt(np.diag(np.linalg.inv(information))), np.sqrt(noise), np.sqrt(position)


def observable(folder):
    """Rows of (name, rms px across, rms px along, sigma with all six, sigma with rotations alone)."""
    rig = Rig(os.path.join(folder, "rig.json"))
    dots = np.concatenate(truths(folder)[:50])
    index = dots[:, 0].astype(int)
    _, direction, across, along = rig.lines()
    offset, near = direction[index], 1 / dots[:, 3:]
    x = rig.rays[index, :2] / rig.rays[index, 2:]
    du = rig.focal[0] * np.hstack([near, 0 * near, -x[:, :1] * near])
    dv = rig.focal[1] * np.hstack([0 * near, near, -x[:, 1:] * near])
    shift_across = offset[:, :1] * dv - offset[:, 1:] * du
    shift_along = offset[:, :1] * du + offset[:, 1:] * dv
    matrix = np.hstack([across[index], shift_across])
    scale = np.array([ROTATION_RAD] * 3 + [SHIFT_MM] * 3)
    # Nothing is known of what is not seen at all: a prior of 100 times the rotation keeps it finite.
    six = np.linalg.inv((matrix * scale).T @ (matrix * scale) / NOISE_PX**2 + 1e-4 * np.eye(6))
    three = np.linalg.inv((matrix * scale)[:, :3].T @ (matrix * scale)[:, :3] / NOISE_PX**2)
    sides = np.hstack([along[index], shift_along])
    names = ["rot. X", "rot. Y", "rot. Z", "shift X", "shift Y", "shift Z"]
    for i, name in enumerate(names):
        yield (name, np.sqrt((matrix[:, i]**2).mean()) * scale[i], np.sqrt((sides[:, i]**2).mean()) * scale[i],
               np.sqrt(six[i, i]), np.sqrt(three[i, i]) if i < 3 else None)


def main():
    for folder in sys.argv[1:]:
        print("%s: of a rotation by 0.3 degrees or a shift by 0.3 mm" % folder)
        print("            px across   px along   sigma of six   of rotations alone (fractions of it, 50 frames)")
        for name, across, along, six, three in observable(folder):
            print("  %-8s %10.3f %10.3f %14.4f %16s" % (name, across, along, six, "" if three is None else "%.4f" % three))
    return 0


if __name__ == "__main__":
    sys.exit(main())
