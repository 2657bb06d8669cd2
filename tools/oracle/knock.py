#!/usr/bin/python3
"""Float64 reference of ih_health: a projector's turn from labelled dots, and what of a turn can be seen at all.

    knock.py FRAMES_DIR...     for the rig of each directory (with truth.jsonl): one dot's share, in px, of a turn by
                               0.3 degrees and of a shift by 0.3 mm, across and along the lines; how well 50 frames
                               with that truth's dots show each of the six when all are unknown, when only turns are

The rig is turned exactly (Rodrigues); equations and weights are the core's (firmware/core/ih_places.h), iterated to the
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
WEIGHT_MIN = 1 / 512  # half a step of the core's: a dot with less is none, and begins no place
STEPS_OF_PX = 4096  # of the core's figures
MOVE_PX = 2458 / STEPS_OF_PX  # along its line: another place
FRAMES_OF_PLACE = 20  # most that frames on one place count
MANY_FRAMES = 5  # that show the error of a place
SLOT_PX = 0.03
SLOTS = 361
NOISE_PX = 0.12  # of a dot, across its line
TURN_RAD = np.radians(0.3)
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

    def turned(self, turn):
        """By Rodrigues' formula, about the projector's origin."""
        out, angle = copy.copy(self), np.linalg.norm(turn)
        if angle > 0:
            n = turn / angle
            out.rays = (self.rays * np.cos(angle) + np.cross(n, self.rays) * np.sin(angle)
                        + np.outer(self.rays @ n, n) * (1 - np.cos(angle)))
        return out

    def save(self, path):
        out = copy.deepcopy(self.json)
        out["dot_rays"]["data"] = [float(value) for value in self.rays.ravel()]
        with open(path, "w", encoding="utf-8") as file:
            json.dump(out, file)

    def undistorted(self, place):
        target = (place - self.centre) / self.focal
        x, (k1, k2, p1, p2, k3) = target.copy(), self.lens
        for _ in range(60):
            r2, xy = (x * x).sum(axis=1), x[:, 0] * x[:, 1]
            bent = np.stack([2 * p1 * xy + p2 * (r2 + 2 * x[:, 0]**2), p1 * (r2 + 2 * x[:, 1]**2) + 2 * p2 * xy], 1)
            x = (target - bent) / (1 + r2 * (k1 + r2 * (k2 + r2 * k3)))[:, None]
        return x * self.focal + self.centre

    def lines(self):
        """Place at infinity, direction, and slopes: px across and along the line per rad, per axis."""
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


def true_turn(folder):
    """How the rays of the truth's dots are turned against those of rig.json: least squares."""
    rig, turn = Rig(os.path.join(folder, "rig.json")), np.zeros(3)
    dots = np.concatenate(truths(folder)[::5])
    index, depth = dots[:, 0].astype(int), dots[:, 3:]
    normal = (rig.undistorted(dots[:, 1:3]) - rig.centre) / rig.focal
    way = np.hstack([normal * depth, depth]) - rig.origin
    way /= np.linalg.norm(way, axis=1)[:, None]
    for _ in range(5):
        rays = rig.turned(turn).rays[index]
        matrix = np.stack([np.cross(axis, rays) for axis in np.eye(3)], axis=2)
        turn = turn + np.linalg.lstsq(matrix.reshape(-1, 3), (way - rays).ravel(), rcond=None)[0]
    return turn


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
    off, way = rows[:, 2:4] - infinity[slots], direction[slots]
    return off[:, 1] * way[:, 0] - off[:, 0] * way[:, 1], (off * way).sum(axis=1)


def weight_of(distance):
    """Tukey's."""
    return np.clip(1 - (distance / REACH_PX)**2, 0, None)**2


def places(rig, rows):
    """Number of the place of each dot: a slot's frames one after the other, until it is MOVE_PX away from where it began."""
    distance, along = distances(rig, rows)
    out, now, begun = np.full(len(rows), -1), np.full(SLOTS, -1), np.zeros(SLOTS)
    count, counts = 0, weight_of(distance) >= WEIGHT_MIN
    for i, slot in enumerate(rows[:, 1].astype(int)):
        if not counts[i]:
            continue
        if now[slot] < 0 or abs(along[i] - begun[slot]) > MOVE_PX:
            now[slot], begun[slot], count = count, along[i], count + 1
        out[i] = now[slot]
    return out, count


def fit(rig, rows, turn):
    """The turn that fits the dots best, from this one on, and its uncertainty."""
    slots, turn = rows[:, 1].astype(int), np.array(turn, float)
    number, count = places(rig.turned(turn), rows)
    number = np.where(number < 0, count, number)
    for _ in range(50):
        now = rig.turned(turn)
        slope = now.lines()[2]
        distance, _ = distances(now, rows)
        weight = weight_of(distance)
        frames = np.bincount(number, weight, count + 1)
        weight = weight / (1 + frames / FRAMES_OF_PLACE)[number]
        sums = np.bincount(slots, weight, SLOTS)
        inverse = np.linalg.inv((slope * sums[:, None]).T @ slope)
        pull = np.bincount(slots, weight * distance, SLOTS)
        turn = turn + inverse @ slope.T @ pull
    lever = slope @ inverse
    # The mean moves by less than all dots do, as their weights move, too.
    near = np.abs(distance) < REACH_PX
    ratio = (distance[near] / REACH_PX)**2
    pull = pull * ((1 - ratio)**2).sum() / ((1 - ratio) * (1 - 5 * ratio)).sum()
    sigma = np.sqrt((lever**2 * (pull**2 + (SLOT_PX * sums)**2)[:, None]).sum(axis=0))
    return turn, sigma


def estimate(folder, host_sim, work, start, frames):
    """fit to what host_sim labels in these frames (a slice) with the rig turned by start; what host_sim prints."""
    rig = Rig(os.path.join(folder, "rig.json"))
    rows, out = labelled(folder, rig.turned(start), host_sim, work)
    turn, sigma = fit(rig, rows[(rows[:, 0] >= frames.start) & (rows[:, 0] < frames.stop)], start)
    return turn, sigma, out


class Sums:
    """What the core keeps of each slot (struct ih_place), in float64."""

    def __init__(self):
        self.weight, self.pull, self.here_weight, self.here_pull = np.zeros((4, SLOTS))
        self.begun = np.full(SLOTS, np.nan)
        self.total = self.rise = 0.0

    def of_place(self):
        share = FRAMES_OF_PLACE / (self.here_weight + FRAMES_OF_PLACE)
        return self.here_weight * share, self.here_pull * share

    def add_frame(self, slots, distance, along):
        weight, ratio = weight_of(distance), (distance / REACH_PX)**2
        self.total, self.rise = self.total + weight.sum(), self.rise + ((1 - ratio) * (1 - 5 * ratio)).sum()
        left = slots[np.abs(along - self.begun[slots]) > MOVE_PX]
        place_weight, place_pull = self.of_place()
        self.weight[left] += place_weight[left]
        self.pull[left] += place_pull[left]
        self.here_weight[left] = self.here_pull[left] = 0
        self.begun[left] = np.nan
        self.begun[slots] = np.where(np.isnan(self.begun[slots]), along, self.begun[slots])
        self.here_weight[slots] += weight
        self.here_pull[slots] += weight * distance

    def share(self):
        return max(self.rise / self.total, 1 / 3)

    def step(self, slope):
        place_weight, place_pull = self.of_place()
        sums = self.weight + place_weight
        return np.linalg.solve((slope * sums[:, None]).T @ slope, slope.T @ (self.pull + place_pull)) / self.share()

    def turn(self, move):
        self.pull -= self.share() * self.weight * move
        self.here_pull -= self.share() * self.here_weight * move


def follow(folder, host_sim, work, turns):
    """The last turn as the core comes to it, which does not iterate: a frame's dots keep the labels and the weights that the
    lines of its time gave them, and each time the rig is turned it is by one step. Places are told apart in the image, where no
    turn of the rig moves them; which dots count and when one is on another place is decided with the core's own figures: a dot
    at the limit may begin a place or not, and one place more of a corner is a twentieth of the uncertainty. turns: first and
    last frame with a turn, that turn, and the one that the core took then."""
    rig, sums = Rig(os.path.join(folder, "rig.json")), Sums()
    for first, last, before, after in turns:
        now = rig.turned(before)
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
        sums.turn(slope @ (after - before))
    return found


def bound(folder, host_sim, work, truth, frame_count):
    """Cramer-Rao bound of the three turns' uncertainty, from that many of the folder's first frames, if a dot's distance is
    normal noise of its own in each frame plus a normal error of its place, each as large as it is with the true rig; the
    two errors in px."""
    rig = Rig(os.path.join(folder, "rig.json")).turned(truth)
    rows, _ = labelled(folder, rig, host_sim, work)
    rows = rows[rows[:, 0] < frame_count]
    number, count = places(rig, rows)
    rows, number = rows[number >= 0], number[number >= 0]
    distance, _ = distances(rig, rows)
    frames = np.bincount(number, minlength=count)
    mean = np.bincount(number, distance, count) / frames
    noise = ((distance - mean[number])**2).sum() / (frames - 1).sum()
    many = frames >= MANY_FRAMES
    place = max((mean[many]**2 - noise / frames[many]).mean(), 0.0)
    slot_of = np.zeros(count, int)
    slot_of[number] = rows[:, 1].astype(int)
    slope = rig.lines()[2][slot_of]
    information = (slope / (place + noise / frames)[:, None]).T @ slope
    return np.sqrt(np.diag(np.linalg.inv(information))), np.sqrt(noise), np.sqrt(place)


def observable(folder):
    """Rows of (name, rms px across, rms px along, sigma with all six, sigma with turns alone)."""
    rig = Rig(os.path.join(folder, "rig.json"))
    dots = np.concatenate(truths(folder)[:50])
    index = dots[:, 0].astype(int)
    _, direction, across, along = rig.lines()
    way, near = direction[index], 1 / dots[:, 3:]
    x = rig.rays[index, :2] / rig.rays[index, 2:]
    du = rig.focal[0] * np.hstack([near, 0 * near, -x[:, :1] * near])
    dv = rig.focal[1] * np.hstack([0 * near, near, -x[:, 1:] * near])
    shift_across = way[:, :1] * dv - way[:, 1:] * du
    shift_along = way[:, :1] * du + way[:, 1:] * dv
    matrix = np.hstack([across[index], shift_across])
    scale = np.array([TURN_RAD] * 3 + [SHIFT_MM] * 3)
    # Nothing is known of what is not seen at all: a prior of 100 times the knock keeps it finite.
    six = np.linalg.inv((matrix * scale).T @ (matrix * scale) / NOISE_PX**2 + 1e-4 * np.eye(6))
    three = np.linalg.inv((matrix * scale)[:, :3].T @ (matrix * scale)[:, :3] / NOISE_PX**2)
    sides = np.hstack([along[index], shift_along])
    names = ["turn X", "turn Y", "turn Z", "shift X", "shift Y", "shift Z"]
    for i, name in enumerate(names):
        yield (name, np.sqrt((matrix[:, i]**2).mean()) * scale[i], np.sqrt((sides[:, i]**2).mean()) * scale[i],
               np.sqrt(six[i, i]), np.sqrt(three[i, i]) if i < 3 else None)


def main():
    for folder in sys.argv[1:]:
        print("%s: of a turn by 0.3 degrees or a shift by 0.3 mm" % folder)
        print("            px across   px along   sigma of six   of turns alone (shares of it, 50 frames)")
        for name, across, along, six, three in observable(folder):
            print("  %-8s %10.3f %10.3f %14.4f %16s" % (name, across, along, six, "" if three is None else "%.4f" % three))
    return 0


if __name__ == "__main__":
    sys.exit(main())
