#!/usr/bin/env python3
"""tools/eval: its scores of records that were made by hand, and a short run with the programs; tools/learn: its score, moves and promise.

eval.py HOST_SIM RENDER
"""

import json
import os
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

import numpy

TOOLS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools", "eval")
sys.path.insert(0, TOOLS)
import misaligned
import misaligned_rows
import people
import report
import runs
import scenes
import score

sys.path.insert(0, os.path.join(TOOLS, "..", "learn"))
import learn
import model
import ray_map

CENTRE = [10.0, -20.0, 800.0]
OTHER = [-400.0, 0.0, 900.0]
PROGRAMS = []


def record(centres, heads, head):
    return {"hypotheses": [{"centre_mm": list(c)} for c in centres], "heads": heads, "head": head}


def off(x_mm, y_mm=0.0, z_mm=0.0):
    return [CENTRE[0] + x_mm, CENTRE[1] + y_mm, CENTRE[2] + z_mm]


def truth(*centres):
    heads = [{"centre_mm": list(c)} for c in centres]
    return {"head": heads[0] if heads else None, **({"heads": heads} if len(heads) > 1 else {})}


class Judging(unittest.TestCase):
    def expect(self, verdict, detected, outcome, right, error_mm=None, what=""):
        self.assertEqual((verdict.detected, verdict.outcome, verdict.right, verdict.error_mm, verdict.what),
                         (detected, outcome, right, error_mm, what))

    def test_the_one_head_is_found(self):
        self.expect(score.judge(record([off(3, 4)], [0], 0), truth(CENTRE)), True, "correct", True, 5.0)

    def test_100_mm_is_a_match_and_more_is_none(self):
        self.expect(score.judge(record([off(0, 60, 80)], [0], 0), truth(CENTRE)), True, "correct", True,
                    100.0)
        self.expect(score.judge(record([off(0, 0, 100.1)], [0], 0), truth(CENTRE)), False, "wrong", False,
                    None, "100 mm off, head not among the hypotheses")

    def test_two_heads_of_which_the_right_one_is_selected(self):
        self.expect(score.judge(record([off(0), off(500)], [0, 1], 0), truth(CENTRE)), True, "ambiguous",
                    True, 0.0)

    def test_two_heads_of_which_the_wrong_one_is_selected(self):
        self.expect(score.judge(record([off(500), off(0)], [0, 1], 0), truth(CENTRE)), True, "ambiguous",
                    False, None, "500 mm off")

    def test_two_heads_and_none_selected(self):
        self.expect(score.judge(record([off(0), off(500)], [0, 1], None), truth(CENTRE)), True,
                    "ambiguous", False, None, "several heads, none selected")

    def test_two_wrong_heads(self):
        self.expect(score.judge(record([off(0), off(500), off(600)], [2, 1], 2), truth(CENTRE)), True,
                    "wrong", False, None, "600 mm off")

    def test_nothing_accepted(self):
        self.expect(score.judge(record([off(30)], [], None), truth(CENTRE)), True, "not done", False, None,
                    "head found, not accepted")
        self.expect(score.judge(record([], [], None), truth(CENTRE)), False, "not done", False, None,
                    "head not among the hypotheses")

    def test_nobody_there(self):
        self.expect(score.judge(record([off(0)], [], None), truth()), False, "not done", True)
        self.expect(score.judge(record([off(0)], [0], 0), truth()), False, "wrong", False, None,
                    "a head where nobody is")
        # as with --paper: nothing is selected, but the table counts it as wrong
        self.expect(score.judge(record([off(0), off(300)], [0, 1], None), truth()), False, "wrong", True)

    def test_the_other_person(self):
        self.expect(score.judge(record([OTHER], [0], 0), truth(CENTRE, OTHER)), False, "wrong", False, None,
                    "the other person")

    def test_truth_that_says_nothing(self):
        self.assertIsNone(score.judge(record([], [], None), {"heads": [{"centre_mm": CENTRE}]}))


class People(unittest.TestCase):
    def found(self, accepted, *centres):
        return score.people(record(accepted, list(range(len(accepted))), 0), centres)

    def test_both(self):
        self.assertEqual(self.found([OTHER, off(20)], CENTRE, OTHER), (2, 0, True))

    def test_one_and_something_else(self):
        self.assertEqual(self.found([off(20), off(0, 300)], CENTRE, OTHER), (1, 1, True))

    def test_one_between_two_heads_finds_one(self):
        self.assertEqual(self.found([off(60)], off(0), off(120)), (1, 0, True))

    def test_two_on_one_head_find_one(self):
        self.assertEqual(self.found([off(10), off(-20)], CENTRE, OTHER), (1, 0, True))

    def test_rejected_ones_find_nothing(self):
        self.assertEqual(score.people(record([off(0)], [], None), [CENTRE]), (0, 0, False))

    def test_heads_beyond_the_picture_are_not_asked_for(self):
        rig = {"image_width": 640, "image_height": 480, "near_mm": 400, "far_mm": 2600,
               "camera_matrix": {"data": [600, 0, 320, 0, 600, 240, 0, 0, 1]}}
        sees = runs.Camera(rig).sees
        self.assertTrue(sees([0, 0, 800]))
        self.assertFalse(sees([0, 0, -150]))
        self.assertFalse(sees([0, 0, 3000]))
        self.assertFalse(sees([-500, 0, 900]))


class Sums(unittest.TestCase):
    def counts(self):
        counts = score.Counts()
        for one, real in ((record([off(3, 4)], [0], 0), truth(CENTRE)),
                          (record([off(0), off(12)], [0, 1], 1), truth(CENTRE)),
                          (record([off(500)], [0], 0), truth(CENTRE)),
                          (record([off(0)], [], None), truth(CENTRE)),
                          (record([], [], None), truth()),
                          (record([OTHER], [0], 0), truth())):
            counts.add(score.judge(one, real))
        return counts

    def test_counts(self):
        expected = {"heads": 4, "detected": 3, "correct": 1, "ambiguous": 1, "wrong": 1, "not_done": 1,
                    "selected_right": 2, "selected_wrong": 1, "empty": 2, "empty_right": 1,
                    "error_50_mm": 5.0, "error_90_mm": 12.0}
        self.assertEqual(self.counts().as_json(), expected)

    def test_merging_adds(self):
        both = self.counts()
        both.merge(self.counts())
        self.assertEqual((both.frame_count, both.right_count, both.detected), (12, 6, 6))
        self.assertEqual(both.outcomes[True]["wrong"], 2)

    def test_percentiles_are_values_that_occur(self):
        values = [5, 1, 4, 2, 3, 6, 7, 8, 9, 10]
        self.assertEqual([score.percentile(values, p) for p in (1, 50, 51, 90, 100)], [1, 5, 6, 9, 10])
        self.assertIsNone(score.percentile([], 50))

    def test_a_part_that_helps_gains(self):
        scene = scenes.Scene("k", "empty", "n")
        helped = score.Counts()
        helped.add(score.judge(record([], [], None), truth()))
        without = score.Counts()
        without.add(score.judge(record([off(0)], [0], 0), truth()))
        results = {scene: runs.Run({runs.FULL: helped, "without scan": without}, [])}
        rows = report.gains(results, lambda c: c.right_count, lambda c: c.frame_count).splitlines()
        self.assertEqual(rows[2].split("|")[2].strip(), "1/1")
        self.assertEqual(rows[3].split("|")[2].strip(), "+1")


class Scenes(unittest.TestCase):
    def test_every_rendered_scene_has_a_seed_of_its_own(self):
        rendered = scenes.rendered_scenes()
        seeds = [scene.seed for scene in rendered]
        self.assertGreaterEqual(len(seeds), 40)
        self.assertEqual(seeds, list(range(scenes.FIRST_SEED, scenes.FIRST_SEED + len(seeds))))
        self.assertLess(seeds[-1], scenes.FIRST_CAST_SEED)
        self.assertEqual(len({scene.name for scene in rendered}), len(seeds))
        self.assertLessEqual({scene.group for scene in rendered}, set(scenes.GROUPS))


def frame(right=True, labels=100, labels_right=100, error_mm=8.0, sigma_mm=10.0, there=True):
    return misaligned.Frame("0.pgm", there, right, error_mm, sigma_mm, labels, labels_right, None, ())


class Misaligned(unittest.TestCase):
    RIG = {"dot_rays": {"data": [0.0, 0.6, 0.8]}, "projector_origin": {"data": [12.5, 0.0, 0.2]},
           "camera_matrix": {"data": [900.0, 0.0, 375.5, 0.0, 920.0, 290.5, 0.0, 0.0, 1.0]}}

    def test_a_rotation_about_x_takes_y_to_z(self):
        for got, expected in zip(misaligned_rows.rotated([0.0, 1.0, 0.0], (90.0, 0.0, 0.0)), (0.0, 0.0, 1.0)):
            self.assertAlmostEqual(got, expected, 12)

    def test_the_file_from_before_a_knock(self):
        knock = misaligned_rows.Knock((0.0, 0.0, 90.0), (1.0, 2.0, -3.0), (-10.0, 5.0, -4.0))
        wrong = misaligned_rows.before(self.RIG, knock)
        for name, expected in (("dot_rays", (0.6, 0.0, 0.8)), ("projector_origin", (11.5, -2.0, 3.2)),
                               ("camera_matrix", (1000.0, 0.0, 370.5, 0.0, 1022.2222222, 294.5, 0.0, 0.0, 1.0))):
            for got, value in zip(wrong[name]["data"], expected):
                self.assertAlmostEqual(got, value, 6)
        self.assertEqual(misaligned_rows.before(self.RIG, misaligned_rows.Knock()), self.RIG)

    def test_a_drift_is_as_fast_in_a_short_sequence(self):
        self.assertEqual(misaligned_rows.drift_deg(1, 500), (0.3, 0.0, 0.0))
        self.assertAlmostEqual(misaligned_rows.drift_deg(2, 100)[1], -0.06 / 3**0.5)

    def test_a_label_is_right_within_1_px_of_its_own_dot(self):
        trace = {"dots": {"u_px_q12": [40960, 81920, 122880], "v_px_q12": [40960, 40960, 40960]},
                 "labels": {"slot": [{"dot": 0}, {"dot": 1}, None, {"dot": 2}]}}
        real = {**truth(CENTRE), "dots": [[0, 10.6, 10.79, 900], [1, 20.0, 8.9, 900]], "dim_dots": [[2, 30.0, 10.0, 900]]}
        said = record([off(3, 4)], [0], 0)
        said["hypotheses"][0]["sigma_mm"] = 2.4
        got = misaligned.judged({**said, "file": "0.pgm", "rig": {"across_px": [0.5, 0, 0], "rotation_deg": [1, 2, 3]}}, real, trace)
        self.assertEqual((got.labels, got.labels_right, got.error_mm, got.sigma_mm), (3, 1, 5.0, 2.4))
        self.assertEqual((got.across_px, got.rotation_deg), (0.5, (1, 2, 3)))
        self.assertIsNone(misaligned.judged({**said, "file": "0.pgm"}, real, trace).across_px)
        trace["labels"]["slot"][2] = {"dot": 2}
        self.assertEqual(misaligned.judged({**said, "file": "0.pgm"}, real, trace).labels_right, 2)

    def figures(self, frames, right, first_frame=0):
        piece = misaligned.Piece("paper", "d", 1, misaligned_rows.Knock(), "d")
        return misaligned.figures([(piece, frames)], [right], first_frame)

    def test_lost_at_the_start(self):
        right = [frame(there=False), frame(), frame(right=False), frame(), frame()]
        wrong = [frame(there=False), frame(False, 100, 89), frame(False), frame(False, 100, 91), frame()]
        got = self.figures(wrong, right)
        self.assertEqual((got.late_heads, got.late_labels, got.right, got.right_reference), (2, 0, 2, 4))
        got = self.figures([frame(labels_right=0)] + right[1:], right)
        self.assertEqual((got.late_heads, got.late_labels), (0, 1))

    def test_counted_from_a_later_frame_on(self):
        right = [frame(), frame(), frame(right=False), frame()]
        got = self.figures([frame(False), frame(), frame(), frame(False)], right, first_frame=1)
        self.assertEqual((got.frames, got.right, got.right_reference), (3, 2, 2))
        self.assertEqual(got.late_heads, 1, "what is late is, from the first frame on")

    def test_what_the_right_rig_finds_has_a_limit(self):
        limits = misaligned_rows.Limits(right_percent={"paper": 90.0, "wide": 50.0})
        some = [frame()] * 8 + [frame(False)] * 2
        got = self.figures(some, some)
        self.assertEqual(misaligned.broken(limits, "paper", got), ["right at all"])
        self.assertEqual(misaligned.broken(limits, "wide", got), [])
        limited = {row.name for row in misaligned_rows.all_rows() if row.limits.right_percent}
        self.assertEqual(limited, {"right rig", "missing: right rig", "over-exposed: right rig"})

    def test_limits(self):
        right = [frame() for _ in range(200)]
        limits = misaligned_rows.Limits(fewer_percent=1.0, late_frames=0, labels_percent={"paper": 99.5}, centre_more_mm=10.0,
                                        within_percent=90.0)
        self.assertEqual(misaligned.broken(limits, "paper", self.figures(right, right)), [])
        wrong = [frame(False, 100, 89)] + [frame() for _ in range(197)] + [frame(False), frame(False)]
        self.assertEqual(misaligned.broken(limits, "paper", self.figures(wrong, right)), ["right", "late"])
        far = [frame(True, 1000, 994, 18.1, 9.0)] * 200
        self.assertEqual(misaligned.broken(limits, "paper", self.figures(far, right)), ["labels", "centre", "2 sigma"])
        nothing = [frame(False, 0, 0, None, None)] * 200
        self.assertEqual(misaligned.broken(limits, "paper", self.figures(nothing, right)),
                         ["right", "late", "labels", "centre", "2 sigma"])

    def test_short_rows_exist(self):
        self.assertLessEqual(set(misaligned_rows.SHORT), {row.name for row in misaligned_rows.all_rows()})


class Programs(unittest.TestCase):
    def test_rows_of_a_wrong_rig_and_of_false_dots(self):
        with tempfile.TemporaryDirectory() as work:
            done = subprocess.run(["/usr/bin/python3", os.path.join(TOOLS, "misaligned.py"), "--host-sim", PROGRAMS[0],
                                   "--render", PROGRAMS[1], "--work", work, "--rows", "^(right rig|cy 4 px|random dots)$", "--rig",
                                   "paper", "--frames", "4", "--seeds", "1"], stdout=subprocess.PIPE, text=True, check=False)
        table = done.stdout.splitlines()
        self.assertEqual([row.split("  ")[0] for row in table[:4]], ["row", "right rig", "cy 4 px", "random dots"])
        self.assertIn("100.0%", table[1])

    def evaluate(self, work):
        subprocess.run(["/usr/bin/python3", os.path.join(TOOLS, "evaluate.py"), "--quick", "--host-sim",
                        PROGRAMS[0], "--render", PROGRAMS[1], "--work", work], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        written = []
        for name in ("report.md", "results.json"):
            with open(os.path.join(work, name), encoding="utf-8") as file:
                written.append(file.read())
        return written

    def test_a_short_run(self):
        with tempfile.TemporaryDirectory() as work:
            text, results = self.evaluate(work)
            self.assertEqual(self.evaluate(work), [text, results], "twice is the same")
        two = json.loads(results)["scenes"]
        self.assertEqual([scene["kind"] for scene in two], list(scenes.QUICK_KINDS))
        for scene in two:
            full = scene["variants"][runs.FULL]
            self.assertEqual(full["heads"] + full["empty"], scenes.QUICK_FRAMES)
            self.assertEqual(len(scene["failures"]), scenes.QUICK_FRAMES - full["selected_right"]
                             - full["empty_right"])
        self.assertGreater(two[1]["variants"][runs.FULL]["people"]["there"], 0)
        for heading in ("by kind of scene", "What each part brings", "Table 1", "Several people"):
            self.assertIn(heading, text)
        for seeds in ("7005 to 7048", scenes.learnt_seeds(), "6001-6006"):
            self.assertIn(seeds, text)


def drawn_detections(random, count):
    """Measures, places, a ray's weight, and true log-odds: a valley of a weighted sum, which no sum of curves of its parts is."""
    measure_q8 = random.integers(0, 25600, (count, 2))
    place = random.integers(-1, ray_map.PLACES, (count, 30)).astype(numpy.int16)
    weight_q12 = random.integers(1000, 4097, count)
    row = numpy.arange(ray_map.PLACES) // (ray_map.COLUMNS * ray_map.DEPTHS)
    said = weight_q12 / 4096 * numpy.where(place >= 0, (row - 4.5)[place], 0.0).sum(axis=1)
    return measure_q8, place, weight_q12, abs(said / 4 + measure_q8[:, 0] / 25600 * 6 - 3) * 3 - 4


class Score(unittest.TestCase):
    def test_a_valley_of_a_weighted_sum_is_learnt(self):
        """On detections that nothing was learnt from, with all numbers rounded, against the true log-odds."""
        random = numpy.random.default_rng(8)
        with unittest.mock.patch.multiple(ray_map, MAPS=8), unittest.mock.patch.multiple(model, EPOCHS=8, BATCH=128, DROPPED=0.0):
            *known, log_odds = drawn_detections(random, 30000)
            labels = (random.random(len(log_odds)) < 1 / (1 + numpy.exp(-log_odds))).astype(float)
            learnt = model.fit(*known, labels, numpy.ones(len(labels)))
            measure_q8, place, weight_q12, log_odds = drawn_detections(random, 10000)
            said = learnt.logits(measure_q8, 256 * ray_map.answers(learnt.maps, place, weight_q12))
        probability = 1 / (1 + numpy.exp(-log_odds))
        entropy, learnt_entropy = (numpy.mean(probability * numpy.logaddexp(0, -x) + (1 - probability) * numpy.logaddexp(0, x)) for x in (log_odds, said))
        without = -numpy.mean(probability) * numpy.log(numpy.mean(probability)) - numpy.mean(1 - probability) * numpy.log(numpy.mean(1 - probability))
        # Nine tenths of what can be known.
        self.assertLess(learnt_entropy - entropy, (without - entropy) / 10)
        self.assertGreaterEqual(learnt.maps.min(), -ray_map.ZERO)
        self.assertLess(learnt.maps.max(), ray_map.ZERO)
        self.assertLessEqual(abs(learnt.weight_q2).max(), model.WEIGHT_MAX)


class TrueAnatomy(unittest.TestCase):
    def frame(self, said, truth_of_it, *persons):
        """Of a picture of these: centre, points, fraction of them."""
        notes = [{"centre_mm": centre, "points": points, "visible": fraction} for centre, points, fraction in persons]
        return people.looked_at(said, truth_of_it, {"kind": "calm", "people": notes}, "paper", "level")

    def test_a_head_is_found_within_100_mm_of_one_that_is_there(self):
        both = {**truth(CENTRE), "heads": [{"centre_mm": CENTRE}, {"centre_mm": OTHER}]}
        persons = ((OTHER, 9, 0.3), (CENTRE, 40, 0.9))
        frame = self.frame(record([off(0, 3, 4), OTHER], [0, 1], 1), both, *persons)
        self.assertEqual((frame.there, frame.right, frame.both, frame.off_mm), (2, True, True, 0.0))
        self.assertEqual((frame.points, frame.visible), (40, 0.9))
        third = self.frame(record([off(0, 3, 4), OTHER, off(900)], [0, 1, 2], 0), both, *persons)
        self.assertEqual((third.right, third.both, third.off_mm), (True, False, 5.0))
        self.assertEqual(self.frame(record([off(101)], [0], 0), truth(CENTRE), (CENTRE, 9, 1.0)).right, False)
        self.assertEqual(self.frame(record([off(0)], [], None), truth(CENTRE), (CENTRE, 9, 1.0)).right, False)

    def test_nobody_must_be_found_where_none_is_and_what_is_unclear_does_not_count(self):
        self.assertTrue(self.frame(record([off(0)], [], None), truth()).right)
        self.assertFalse(self.frame(record([off(0)], [0], 0), truth()).right)
        self.assertIsNone(self.frame(record([], [], None), {**truth(), "unclear": [{"centre_mm": CENTRE}]}, (CENTRE, 3, 0.1)))
        self.assertIsNone(self.frame(record([], [], None), {"heads": [{"centre_mm": CENTRE}]}, (CENTRE, 3, 0.1)))

    def test_every_row_has_its_frames(self):
        near, far = ([10.0, -20.0, z] for z in (440.0, 2100.0))
        frames = [self.frame(record([near], [0], 0), truth(near), (near, 61, 1.0)),
                  self.frame(record([], [], None), truth(far), (far, 6, 0.1)),
                  self.frame(record([OTHER], [0], 0), truth(far), (far, 17, 0.6)),
                  self.frame(record([OTHER], [0], 0), truth())]
        cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in people.text(frames).splitlines()]
        for row in (["calm", "3", "1", "33.3", "1", "0", "0"], ["60 and more", "1", "1", "100.0", "0", "0", "0"],
                    ["0 to below 9", "1", "0", "0.0", "0", "-", "-"], ["12 to below 18", "1", "0", "0.0", "1", "-", "-"],
                    ["0 to below 0.25", "1", "0", "0.0", "0", "-", "-"], ["0 to below 600 mm", "1", "1", "100.0", "0", "0", "0"],
                    ["2000 mm and more", "2", "0", "0.0", "1", "-", "-"], ["calm", "1", "1"], ["all", "1", "1"]):
            self.assertIn(row, cells)

    def test_a_camera_hangs_as_its_rig_says(self):
        for tilt, roll, name in ((30, 90, "down 30, rolled 90"), (-20, 180, "up 20, rolled 180"), (45, 0, "down 45, rolled 0")):
            t, r = numpy.radians([tilt, roll])
            up = [numpy.cos(t) * numpy.sin(r), -numpy.cos(t) * numpy.cos(r), -numpy.sin(t)]
            self.assertEqual(people.mount_of({"up": up}), name)
        self.assertEqual(people.mount_of({}), "no up, level or little tilted")


class Moves(unittest.TestCase):
    def test_how_far_off_a_centre_is_is_learnt_by_place(self):
        """Of heads whose rays say it, a few that are elsewhere, and some that weigh nothing and say the contrary: a slope from
        row to row, other in each direction."""
        random = numpy.random.default_rng(5)
        row = numpy.arange(ray_map.PLACES) // (ray_map.COLUMNS * ray_map.DEPTHS)
        true_mm = numpy.stack([(row - 6) / 7.0, (row - 5) / 5.0, (4 - row) / 8.0], axis=1)
        place = random.integers(-1, ray_map.PLACES, (6000, 120)).astype(numpy.int16)
        side = random.choice([-1, 1], place.shape)
        weight_q12 = random.integers(1000, 4097, len(place))
        steps_mm = numpy.where((place >= 0)[..., None], true_mm[place], 0.0)
        steps_mm[..., 0] *= side
        off_mm = weight_q12[:, None] / 4096 * steps_mm.sum(axis=1)
        off_mm[::300] += 80.0
        importance = numpy.ones(len(place))
        importance[1::10] = 0.0
        off_mm[1::10] *= -1.0
        with unittest.mock.patch.multiple(ray_map, MOVE_RIDGE=3.0, MOVE_SMOOTH=3.0):  # few heads, little noise
            steps, step_mm_q12 = ray_map.fit_moves(place, side, weight_q12, off_mm, importance)
        error_mm = abs(steps * step_mm_q12 / 4096 - true_mm)
        self.assertLessEqual(abs(steps).max(), 127)
        # A step is below a hundredth mm. One head of 300 pulls with up to 20 mm, 1.2 mm a head, and a place is met 3,000 times,
        # with a mean squared weight of 0.4: by 0.034 mm, within which the median is, and within four times that all 720 numbers.
        self.assertLess(numpy.median(error_mm), 0.034)
        self.assertLess(error_mm.max(), 4 * 0.034)

    def test_a_ray_counts_to_the_side_on_which_it_passes(self):
        """Rays that start 100 mm on the right and pass 10 mm left and right of the axis at a depth of 1 m."""
        rays = {"origin_mm": numpy.array([100.0, 0.0, 0.0]), "slope": numpy.array([[-0.11, 0.0], [-0.09, 0.0]])}
        sides = ray_map.sides_around(rays, numpy.array([[0.0, 0.0, 1000.0], [30.0, 0.0, 1000.0], [-30.0, 0.0, 1000.0]]))
        self.assertEqual(sides.tolist(), [[-1, 1], [-1, -1], [1, 1]])

    def test_they_are_learnt_from_the_fit_nearest_to_each_head(self):
        centre_mm = numpy.array([[200.0, 0.0, 1000.0], [30.0, 0.0, 1000.0], [-40.0, 0.0, 1000.0]])
        frame = {"directory": "rendered", "heads": numpy.array([[0.0, 5.0, 1000.0]]), "centre_mm": centre_mm,
                 "place": numpy.array([[1], [2], [3]]), "side": numpy.array([[1], [-1], [1]]), "weight_q12": numpy.array([4, 5, 6])}
        alone = {**frame, **{key: frame[key][:1] for key in ("centre_mm", "place", "side", "weight_q12")}}
        with unittest.mock.patch.object(ray_map, "fit_moves") as fit:
            learn.moves_of([frame, alone, {**frame, "directory": "people"}], {"people"})
        place, side, weight_q12, off_mm, importance = (column.tolist() for column in fit.call_args[0])
        self.assertEqual((place, side, weight_q12), ([[2], [2]], [[-1], [-1]], [5, 5]))
        self.assertEqual(off_mm, 2 * [[-30.0, 5.0, 0.0]])
        self.assertEqual(importance, [learn.MOVES_SCENE_WEIGHT, 1.0])

    def test_neighbours_are_those_beside_and_not_nothing(self):
        rough = ray_map.move_roughness()
        self.assertTrue(numpy.allclose(rough.sum(axis=0), 0.0))
        # Inside four neighbours aside and by row, two by range; the last place, nothing, has none of those.
        inside = (5 * ray_map.COLUMNS + 1) * ray_map.DEPTHS
        self.assertEqual([rough[inside + depth, inside + depth] for depth in (0, 3, 6, 7)], [5.0, 6.0, 5.0, 4.0])


class Promise(unittest.TestCase):
    def test_parts_are_learnt_from_what_was_near_a_head(self):
        """Centres of which some are near a head, as a bias and parts by row say; as many as make chance small."""
        random = numpy.random.default_rng(6)
        row = numpy.arange(ray_map.PLACES) // (ray_map.COLUMNS * ray_map.DEPTHS)
        true_part = (row - 5) / 12.0
        place = random.integers(-1, ray_map.PLACES, (40000, 40)).astype(numpy.int16)
        weight = random.uniform(0.3, 1.0, len(place))
        log_odds = -1.0 + weight * numpy.where(place >= 0, true_part[place], 0.0).sum(axis=1)
        labels = random.random(len(place)) < 1 / (1 + numpy.exp(-log_odds))
        with unittest.mock.patch.object(ray_map, "PROMISE_RIDGE", 1.0):
            bias_q5, part_q5 = ray_map.fit_promise(place, weight, labels)
        # A part's standard error is 0.04 or so of log-odds (4,000 rays each): the mean of a row has 24 of them.
        self.assertLess(abs(bias_q5 / 32 + 1.0), 0.15)
        by_row = numpy.array([part_q5[row == k].mean() / 32 for k in range(ray_map.ROWS)])
        self.assertLess(abs(by_row - (numpy.arange(ray_map.ROWS) - 5) / 12.0).max(), 0.08)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        print("usage: eval.py HOST_SIM RENDER", file=sys.stderr)
        sys.exit(2)
    PROGRAMS += sys.argv[1:]
    unittest.main(argv=sys.argv[:1])
