#!/usr/bin/env python3
"""tools/people: the same seed gives the same bytes, and truth says where heads are.

    people.py HOST_SIM

Exit status 77, which ctest calls skipped: the packages of tools/setup.sh people are not there.
"""

import filecmp
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
TOOL = os.path.join(ROOT, "tools", "people")
SKIPPED = 77
sys.path.insert(0, TOOL)

HOST_SIM = None
# A person with short hair before a room full of things.
SEED = 8


def make(out, rig, kind, seed=SEED, frames=2, *options):
    subprocess.run([sys.executable, "-B", os.path.join(TOOL, "make.py"), "--rig", rig, "--kind", kind,
                    "--seed", str(seed), "--frames", str(frames), *options, out], check=True)
    return out


def lines_of(directory, name):
    with open(os.path.join(directory, name), encoding="utf-8") as lines:
        return [json.loads(line) for line in lines]


def matrix_of(rig, name):
    entry = rig[name]
    return np.array(entry["data"]).reshape(entry["rows"], entry["cols"])


class People(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.work = tempfile.mkdtemp()
        cls.dots = make(os.path.join(cls.work, "dots"), "wide", "calm")
        cls.depth = make(os.path.join(cls.work, "depth"), "range", "calm")

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.work)

    def test_the_same_seed_gives_the_same_bytes(self):
        for directory, rig in ((self.dots, "wide"), (self.depth, "range")):
            again = make(directory + "_again", rig, "calm")
            names = sorted(os.listdir(directory))
            self.assertEqual(names, sorted(os.listdir(again)))
            for name in names:
                pair = (os.path.join(path, name) for path in (directory, again))
                self.assertTrue(filecmp.cmp(*pair, shallow=False), name)

    def test_missing_dots_are_others_in_each_frame(self):
        """All else stays: the dots that are there are where they were."""
        sparse = make(os.path.join(self.work, "missing"), "wide", "calm", SEED, 2, "--missing", "0.5")
        kept = []
        for mine, theirs in zip(lines_of(self.dots, "truth.jsonl"), lines_of(sparse, "truth.jsonl")):
            whole, part = ({dot[0]: dot[1:] for dot in entry["dots"]} for entry in (mine, theirs))
            self.assertLess(abs(len(part) / len(whole) - 0.5), 0.15)
            self.assertEqual(part, {index: whole[index] for index in part})
            kept.append(set(part) & set(whole))
        self.assertLess(len(kept[0] & kept[1]), 0.4 * len(whole))

    def test_another_seed_gives_another_person(self):
        other = make(os.path.join(self.work, "other"), "wide", "calm", SEED + 1, 1)
        mine, theirs = (lines_of(path, "truth.jsonl")[0]["head"]["semi_axes_mm"] for path in (self.dots, other))
        self.assertNotEqual(mine, theirs)

    def points_of_dots(self):
        """The dots of truth in space: a ray of the projector, to the depth that truth has."""
        with open(os.path.join(self.dots, "rig.json"), encoding="utf-8") as file:
            rig = json.load(file)
        rays, origin = matrix_of(rig, "dot_rays"), matrix_of(rig, "projector_origin").ravel()
        for entry in lines_of(self.dots, "truth.jsonl"):
            dots = np.array(entry["dots"])
            ray = rays[dots[:, 0].astype(int)]
            yield entry["head"], origin + ray * ((dots[:, 3] - origin[2]) / ray[:, 2])[:, None]

    def points_of_depths(self):
        with open(os.path.join(self.depth, "rig.json"), encoding="utf-8") as file:
            camera = matrix_of(json.load(file), "camera_matrix")
        for entry in lines_of(self.depth, "truth.jsonl"):
            with open(os.path.join(self.depth, entry["file"]), "rb") as file:
                magic, size, max_value, data = file.read().split(b"\n", 3)
            self.assertEqual((magic, max_value), (b"P5", b"65535"))
            width, height = map(int, size.split())
            z = np.frombuffer(data, ">u2").reshape(height, width)[::6, ::6].astype(float)
            v, u = np.mgrid[0:height:6, 0:width:6]
            x, y = (u - camera[0, 2]) / camera[0, 0], (v - camera[1, 2]) / camera[1, 1]
            yield entry["head"], np.stack([x * z, y * z, z], axis=-1)[z > 0]

    def test_what_is_measured_lies_on_the_head_of_truth(self):
        """A face and short hair stand off an ellipsoid by a few mm, a nose and ears by 20."""
        for points_of in (self.points_of_dots, self.points_of_depths):
            for head, points in points_of():
                offset = (points - head["centre_mm"]) / head["semi_axes_mm"]
                near = (np.linalg.norm(offset[:, :2], axis=1) < 0.8) & (abs(offset[:, 2]) < 2.0)
                away_mm = abs(np.linalg.norm(offset[near], axis=1) - 1.0) * np.mean(head["semi_axes_mm"])
                self.assertGreater(np.count_nonzero(near), 15)
                self.assertLess(np.median(away_mm), 12.0)

    def test_dots_are_where_truth_has_them(self):
        """The program finds and names them, by their grey values alone."""
        done = subprocess.run([HOST_SIM, "--json", self.dots], check=True, text=True, stdout=subprocess.PIPE)
        for line, entry in zip(done.stdout.splitlines(), lines_of(self.dots, "truth.jsonl")):
            record = json.loads(line)
            self.assertGreater(len(entry["dots"]), 150)
            self.assertGreater(record["labelled"], 0.8 * len(entry["dots"]))

    def test_a_mounted_camera_sees_the_same_person(self):
        """Truth in the level frame is that of a level camera, moved about the head; up is the camera's."""
        level = make(os.path.join(self.work, "level"), "range", "calm", SEED, 1, "--tilt", "0")
        down = make(os.path.join(self.work, "down"), "range", "calm", SEED, 1, "--tilt", "30", "--roll", "90")
        with open(os.path.join(down, "rig.json"), encoding="utf-8") as file:
            np.testing.assert_allclose(json.load(file)["up"], [np.cos(np.pi / 6), 0.0, -0.5], atol=1e-9)
        mine, theirs = (lines_of(path, "truth.jsonl")[0]["head"] for path in (level, down))
        self.assertEqual(mine["semi_axes_mm"], theirs["semi_axes_mm"])
        # The middle of the sequence's head is where the camera is turned about: it stays as far off.
        self.assertAlmostEqual(np.linalg.norm(mine["centre_mm"]), np.linalg.norm(theirs["centre_mm"]), delta=40.0)

    def test_nobody_has_no_head(self):
        for kind in ("empty", "body"):
            out = make(os.path.join(self.work, kind), "paper", kind, SEED)
            for entry in lines_of(out, "truth.jsonl"):
                self.assertIsNone(entry["head"])

    def test_learning_and_judging_share_nobody(self):
        import scene
        import sets

        def seeds_of(name, rig):
            first = {seed for _, _, seed, _ in sets.sequences(name, rig)}
            return first | {seed + scene.SECOND_SEED for seed in first}

        seeds = {}
        for name in ("learn", "mounted_learn", "anywhere_learn", "more_learn", "judge", "mounted", "mounted_judge", "missing"):
            seeds[name] = set().union(*(seeds_of(name, rig) for rig in sets.ALL_RIGS))
            paper, wide, depth = (seeds_of(name, rig) for rig in ("paper", "wide", "range"))
            self.assertFalse(paper & wide | wide & depth | depth & paper, name)
        for learn in ("learn", "mounted_learn", "anywhere_learn", "more_learn", "mounted"):
            for judge in ("judge", "mounted_judge", "missing"):
                self.assertFalse(seeds[learn] & seeds[judge])


if __name__ == "__main__":
    HOST_SIM = os.path.abspath(sys.argv.pop(1))
    try:
        import mesh  # noqa: F401, needs the packages
    except ImportError as error:
        print("people: no %s: tools/setup.sh people brings it" % error.name)
        sys.exit(SKIPPED)
    unittest.main(verbosity=2)
