#!/usr/bin/env python3
"""The benchmark's own judgement: results that do not agree are refused, bounds that are passed are reported.

Results are made here, as bench_isohead and bench_peer print them, and spoilt one way at a time.
"""

import copy
import os
import sys
import unittest
from unittest import mock

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
sys.path.insert(0, os.path.join(ROOT, "tools", "bench"))
import agree
import counts

NODES = 47 * 47


class OneNode:
    """A rig whose dots all stand at different nodes."""

    @staticmethod
    def node(slot, _depth_mm):
        return slot


def good():
    """100 labelled dots 20 px apart, at 800 mm, a flat surface, a head."""
    dots = [[20.0 * (i % 10) + 5.25, 20.0 * (i // 10) + 7.5] for i in range(100)]
    truth = {"dots": [[i, u, v, 800.0] for i, (u, v) in enumerate(dots)]}
    result = {"dots": dots, "labels": [[i, i, 800.0] for i in range(100)], "surface": [800.0] * NODES,
              "centres": 8, "points": 32, "head": [0.0, 0.0, 900.0]}
    return result, truth


def complaints(found, frame="sequence1/000000.pgm"):
    reference, truth = good()
    arguments = ["rig.json", frame]
    frames = agree.measure([found], [reference], [(truth, OneNode)], arguments)
    return agree.check("it", arguments, frames)


class Agreement(unittest.TestCase):
    def refused(self, key, spoil):
        found = copy.deepcopy(good()[0])
        spoil(found)
        bad = complaints(found)
        self.assertTrue(any(": %s is" % key in line for line in bad), "%s: %s" % (key, bad))

    def test_the_same(self):
        self.assertEqual(complaints(good()[0]), [])

    def test_dots_elsewhere(self):
        self.refused("dot_error_px", lambda r: r.update(dots=[[u + 0.5, v] for u, v in r["dots"]]))
        self.refused("found", lambda r: r.update(dots=[[u + 3 * (i % 2), v] for i, (u, v) in enumerate(r["dots"])]))

    def test_labels(self):
        swapped = [[slot, (slot + 1) % 100 if slot < 5 else slot, 800.0] for slot in range(100)]
        self.refused("labels_right", lambda r: r.update(labels=swapped))
        self.refused("same_dot", lambda r: r.update(labels=swapped))
        self.refused("labels_of_isohead", lambda r: r.update(labels=r["labels"][:70]))
        self.refused("depth_error_mm", lambda r: r.update(labels=[[s, d, 830.0] for s, d, _ in r["labels"]]))

    def test_surface(self):
        self.refused("surface_mm", lambda r: r.update(surface=[830.0] * NODES))
        self.refused("surface_at_dots_mm", lambda r: r.update(surface=[820.0] * 100 + [800.0] * (NODES - 100)))

    def test_head(self):
        self.refused("head_mm", lambda r: r.update(head=[30.0, 0.0, 900.0]))
        self.refused("head_mm", lambda r: r.update(head=None))
        behind_hands = copy.deepcopy(good()[0])
        behind_hands.update(head=None)
        self.assertEqual(complaints(behind_hands, "sequence2/000000.pgm"), [])

    def test_other_work_ends_it(self):
        for key, other in (("surface", []), ("centres", 12), ("points", 56)):
            found = copy.deepcopy(good()[0])
            found[key] = other
            with self.assertRaises(SystemExit):
                complaints(found)


class Bounds(unittest.TestCase):
    def status(self, dots):
        bounds = {counts.BOUND % stage: 1000 for stage in counts.BOUNDED}
        stages = {stage: 1000 for stage in counts.BOUNDED}
        stages["dots"] = dots
        with mock.patch.object(counts.limits, "read", return_value=bounds), \
                mock.patch.object(counts, "isohead_counts", return_value=stages), mock.patch("builtins.print"):
            return counts.check([])

    def test_one_instruction_too_many(self):
        self.assertEqual(self.status(1000), 0)
        self.assertEqual(self.status(1001), 1)

    def test_lines_of_callgrind(self):
        for line, name, number in (
                ("2,124,025,497 (99.36%)  ???:isohead_frame [/b/bench_isohead]", "isohead_frame", "2,124,025,497"),
                ("  7 ( 0.00%)  /core/ih_dots.c:ih_dots_find'2 [/b/bench_isohead]", "ih_dots_find", "7"),
                ("297,336,008 (62.21%)  ???:peer_find_dots [/b/bench_peer]", "peer_find_dots", "297,336,008")):
            found = counts.LINE.match(line)
            self.assertEqual((found[2], found[1]), (name, number))


if __name__ == "__main__":
    unittest.main()
