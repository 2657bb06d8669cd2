#!/usr/bin/env python3
"""tools/export: is all of a run in the MCAP file and in the table, with its values, and what is refused?

    export.py HOST_SIM RENDER

The MCAP file is read by the mcap library, and decoded by nothing but the schemas that stand in it. What is
expected comes from the records, traces and pictures themselves; where points belong is worked out the other
way round, from space into the picture.
"""

import csv
import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
TOOL = os.path.join(ROOT, "tools", "export", "isohead-export")
sys.path.insert(0, os.path.join(ROOT, "build", "export", "python"))

from google.protobuf.unknown_fields import UnknownFieldSet
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

HOST_SIM = RENDER = None
UNREADABLE = "000006.pgm"
BODY_MM = 930
SCHEMAS = {
    "/tf": "FrameTransform", "/camera/calibration": "CameraCalibration", "/camera/image": "RawImage",
    "/camera/dots": "ImageAnnotations", "/camera/labels": "ImageAnnotations", "/camera/heads": "ImageAnnotations",
    "/camera/rejected": "ImageAnnotations", "/points": "PointCloud", "/surface": "SceneUpdate",
    "/heads": "SceneUpdate", "/rejected": "SceneUpdate", "/head": "PoseInFrame", "/log": "Log",
}


def setUpModule():
    global WORK
    WORK = tempfile.mkdtemp(prefix="isohead-export-")
    make_dots("dots", "8", "0+9")
    damage(UNREADABLE)
    make_dots("bits10", "10", "5+3")
    make_range("range")
    tilt("bits10", "tilted")
    run_sim("tilted", [], ["tilted"])
    run_sim("both", [], ["dots", "range"])
    run_sim("bits10", [], ["bits10"])
    run_sim("paper", ["--paper"], ["bits10"])


def tearDownModule():
    shutil.rmtree(WORK)


def at(*parts):
    return os.path.join(WORK, *parts)


def read(path):
    with open(path, "rb") as file:
        return file.read()


def make_dots(name, bits, frames):
    """An empty seat, from the fifth frame on a person."""
    subprocess.run([RENDER, "--sequence", "1", "--seed", "1", "--bits", bits, "--first-frame", frames, at(name)],
                   check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


# Not the one of these frames: what is found is of no matter, but where it is.
UP = np.array([0.25, -0.85, -np.sqrt(1 - 0.25**2 - 0.85**2)])


def tilt(source, name):
    shutil.copytree(at(source), at(name))
    with open(at(name, "rig.json"), encoding="utf-8") as file:
        rig = json.load(file)
    with open(at(name, "rig.json"), "w", encoding="utf-8") as file:
        json.dump({**rig, "up": list(UP)}, file)


def damage(frame):
    path = at("dots", frame)
    half = read(path)[:1000]
    with open(path, "wb") as file:
        file.write(half)


def make_range(name):
    """A depth camera before a wall at 2 m, a ball at 900 mm in front of it, a flat body below; then the same as a
    list of points."""
    os.mkdir(at(name))
    rig = {"kind": "range", "image_width": 160, "image_height": 120, "near_mm": 300, "far_mm": 3000,
           "camera_matrix": {"data": [150.0, 0, 79.5, 0, 150.0, 59.5, 0, 0, 1]},
           "distortion_coefficients": {"data": [0.0] * 5}}
    for key, rows in (("camera_matrix", 3), ("distortion_coefficients", 1)):
        rig[key].update(type_id="opencv-matrix", rows=rows, cols=len(rig[key]["data"]) // rows, dt="d")
    v, u = np.mgrid[:120, :160]
    x, y = (u - 79.5) / 150, (v - 59.5) / 150
    # the nearer point where the ray (x, y, 1) meets a ball of 100 mm at 900 mm
    a, b = x * x + y * y + 1, -2 * 900.0
    inside = b * b - 4 * a * (900.0**2 - 100.0**2)
    body = np.where((y * BODY_MM > 110) & (np.abs(x * BODY_MM) < 220), BODY_MM, 2000)
    depth = np.where(inside > 0, (-b - np.sqrt(np.maximum(inside, 0))) / (2 * a), body)
    with open(at(name, "000000.pgm"), "wb") as file:
        file.write(b"P5\n# depth\n160 120\n65535\n" + depth.astype(">u2").tobytes())
    with open(at(name, "000001.xyz"), "w", encoding="utf-8") as file:
        for i in range(0, 120, 3):
            for j in range(0, 160, 3):
                file.write("%.1f %.1f %.1f\n" % (x[i, j] * depth[i, j], y[i, j] * depth[i, j], depth[i, j]))
    with open(at(name, "rig.json"), "w", encoding="utf-8") as file:
        json.dump(rig, file)


def run_sim(name, options, directories):
    """Records and traces. One frame is unreadable, which host_sim reports and says with its status."""
    with open(at(name + ".jsonl"), "wb") as file:
        done = subprocess.run([HOST_SIM, "--json", "--trace", at("trace-" + name), *options,
                               *(at(d) for d in directories)], stdout=file, stderr=subprocess.DEVNULL, check=False)
    assert done.returncode == (1 if "dots" in directories else 0), done


def export(*arguments, **how):
    return subprocess.run(["/usr/bin/python3", TOOL, *arguments], capture_output=True, text=True, check=False, **how)


def mcap_arguments(name, directory, out, trace=None):
    return [at(name + ".jsonl"), "--mcap", at(out), "--frames", at(directory),
            "--trace", trace or at("trace-" + name, directory)]


def records_of(name, directory=None):
    with open(at(name + ".jsonl"), encoding="utf-8") as file:
        records = [json.loads(line) for line in file]
    return [r for r in records if directory is None or r["dir"] == at(directory)]


def trace_of(name, directory, record):
    with open(at("trace-" + name, directory, record["file"].split(".")[0] + ".json"), encoding="utf-8") as file:
        return json.load(file)


def columns(stage, *keys):
    return np.array([stage[key] for key in keys], dtype=float).T


def time_ns(stamp):
    return stamp.seconds * 10**9 + stamp.nanos


def missing(message, path):
    """Parts of a message that are not there, though the schema does not say that they may be: in Foxglove's
    JSON form of the schemas they are required."""
    found = []
    for field in message.DESCRIPTOR.fields:
        if field.message_type is None or field.has_presence and field.containing_oneof is not None:
            continue
        if field.label == field.LABEL_REPEATED:
            for part in getattr(message, field.name):
                found += missing(part, path + "." + field.name)
        elif message.HasField(field.name):
            found += missing(getattr(message, field.name), path + "." + field.name)
        else:
            found.append(path + "." + field.name)
    return found


class Mcap:
    """All messages of a file: topic -> [(log time, message)]."""

    def __init__(self, path):
        self.messages = {}
        self.times = []
        with open(path, "rb") as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            self.statistics = reader.get_summary().statistics
            for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
                assert decoded.SerializeToString(deterministic=True) == message.data
                assert len(UnknownFieldSet(decoded)) == 0
                assert missing(decoded, channel.topic) == []
                self.messages.setdefault(channel.topic, []).append((message.log_time, decoded))
                self.times.append(message.log_time)
                assert schema.name == "foxglove." + SCHEMAS[channel.topic], channel.topic

    def at(self, topic, time_us):
        found = [m for time, m in self.messages[topic] if time == time_us * 1000]
        assert len(found) == 1, (topic, time_us, len(found))
        return found[0]


def project(calibration, places):
    """Points of the camera's frame to pixels whose centres are whole numbers: OpenCV's lens."""
    k = np.reshape(calibration.K, (3, 3))
    k1, k2, p1, p2, k3 = calibration.D
    x, y = (places[:, :2] / places[:, 2:]).T
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return np.stack([k[0, 0] * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + k[0, 2],
                     k[1, 1] * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + k[1, 2]], axis=1)


def matrix_of(q):
    return np.array([[1 - 2 * (q.y**2 + q.z**2), 2 * (q.x * q.y - q.z * q.w), 2 * (q.x * q.z + q.y * q.w)],
                     [2 * (q.x * q.y + q.z * q.w), 1 - 2 * (q.x**2 + q.z**2), 2 * (q.y * q.z - q.x * q.w)],
                     [2 * (q.x * q.z - q.y * q.w), 2 * (q.y * q.z + q.x * q.w), 1 - 2 * (q.x**2 + q.y**2)]])


def cloud(message):
    kind = np.dtype([("place", "<f4", 3), ("slot", "<u4")])
    assert message.point_stride == kind.itemsize
    fields = [(field.name, field.offset, field.type) for field in message.fields]
    assert fields == [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("slot", 12, 5)]
    return np.frombuffer(message.data, kind)


def depth_at(nodes, slopes):
    """Depth of a 47x47 lattice between its nodes."""
    lattice = nodes.reshape(47, 47, 3)
    first = lattice[0, 0, :2] / lattice[0, 0, 2]
    step = (lattice[-1, -1, :2] / lattice[-1, -1, 2] - first) / 46
    place = (slopes - first) / step
    column, row = np.floor(place).astype(int).T
    across, down = (place - np.floor(place)).T
    depth = lattice[..., 2]
    upper = depth[row, column] * (1 - across) + depth[row, column + 1] * across
    lower = depth[row + 1, column] * (1 - across) + depth[row + 1, column + 1] * across
    return upper * (1 - down) + lower * down


def check_outlines(test, record, heads, rejected):
    others = [i for i in range(len(record["hypotheses"])) if i not in record["heads"]]
    for message, indices in ((heads, sorted(record["heads"])), (rejected, others)):
        test.assertEqual((len(message.points), len(message.texts)), (len(indices), len(indices)))
        for index, line in zip(indices, message.points):
            h = record["hypotheses"][index]
            test.assertEqual(line.type, line.LINE_LOOP)
            places = np.array([[p.x - 0.5, p.y - 0.5] for p in line.points])
            np.testing.assert_allclose(places.mean(axis=0), h["pixel"], atol=1e-6)
            # an ellipse's points spread by a^2/2 along a, if they are even in its own angle
            rotation = np.radians(h["angle_deg"])
            axes = np.array([[np.cos(rotation), np.sin(rotation)], [-np.sin(rotation), np.cos(rotation)]])
            np.testing.assert_allclose(axes @ np.cov(places.T, bias=True) @ axes.T,
                                       np.diag(np.square(h["axes_px"]) / 2), rtol=1e-6, atol=1e-6)


class DotsFile(unittest.TestCase):
    """A directory with dots, whose run had another one too."""

    @classmethod
    def setUpClass(cls):
        done = export(*mcap_arguments("both", "dots", "dots.mcap"))
        assert done.returncode == 0, done.stderr
        cls.said = done.stdout
        cls.mcap = Mcap(at("dots.mcap"))
        cls.records = records_of("both", "dots")
        cls.frames = [r for r in cls.records if "error" not in r]
        cls.traces = {r["file"]: trace_of("both", "dots", r) for r in cls.frames}

    def each(self, *topics):
        for record in self.frames:
            yield (record, self.traces[record["file"]], *(self.mcap.at(t, record["time_us"]) for t in topics))

    def test_what_the_run_shows(self):
        """The run must have what the other tests are about."""
        self.assertEqual(len(self.frames), 8)
        self.assertTrue(any(r["head"] is None for r in self.frames))
        self.assertTrue(any(r["head"] is not None for r in self.frames))
        self.assertTrue(any(h["rejected"] for r in self.frames for h in r["hypotheses"]))
        self.assertEqual([r["file"] for r in self.records if "error" in r], [UNREADABLE])

    def test_counts(self):
        heads = sum(r["head"] is not None for r in self.frames)
        expected = {topic: len(self.frames) for topic in SCHEMAS}
        expected.update({"/tf": 2 * len(self.frames), "/head": heads, "/log": 1})
        self.assertEqual({topic: len(found) for topic, found in self.mcap.messages.items()}, expected)
        self.assertEqual(self.mcap.statistics.message_count, sum(expected.values()))
        self.assertEqual(self.mcap.statistics.schema_count, len(set(SCHEMAS.values())))
        self.assertIn("%d frames, %d messages" % (len(self.frames), sum(expected.values())), self.said)

    def test_times(self):
        self.assertEqual(self.mcap.times, sorted(self.mcap.times))
        self.assertEqual(sorted(set(self.mcap.times)), [r["time_us"] * 1000 for r in self.frames])
        for topic, found in self.mcap.messages.items():
            for log_time, message in found:
                stamps = [message] if message.DESCRIPTOR.fields_by_name.get("timestamp") else []
                for part in ("points", "texts", "deletions", "entities"):
                    stamps += [m for m in getattr(message, part, []) if hasattr(m, "timestamp")]
                for stamped in stamps:
                    self.assertEqual(time_ns(stamped.timestamp), log_time, topic)

    def test_pictures(self):
        for record, _, image in self.each("/camera/image"):
            pgm = read(at("dots", record["file"]))
            self.assertEqual((image.width, image.height, image.step, image.encoding), (752, 582, 752, "mono8"))
            self.assertEqual(image.data, pgm[-752 * 582:])
            self.assertEqual(image.frame_id, "camera")

    def test_calibration(self):
        with open(at("dots", "rig.json"), encoding="utf-8") as file:
            rig = json.load(file)
        for _, _, found in self.each("/camera/calibration"):
            self.assertEqual(list(found.K), rig["camera_matrix"]["data"])
            self.assertEqual(list(found.D), rig["distortion_coefficients"]["data"])
            np.testing.assert_array_equal(np.reshape(found.P, (3, 4))[:, :3], np.reshape(found.K, (3, 3)))
            self.assertEqual((found.width, found.height, found.distortion_model), (752, 582, "plumb_bob"))
        parents = {m.child_frame_id: m for _, m in self.mcap.messages["/tf"]}
        place = parents["projector"].translation
        np.testing.assert_allclose([place.x, place.y, place.z], np.array(rig["projector_origin"]["data"]) / 1000)
        self.assertEqual(parents["projector"].parent_frame_id, "camera")
        # forward is the rig's X, down its -Z
        rotation = matrix_of(parents["camera"].rotation)
        np.testing.assert_allclose(rotation @ [0, 0, 1], [1, 0, 0], atol=1e-12)
        np.testing.assert_allclose(rotation @ [0, 1, 0], [0, 0, -1], atol=1e-12)

    def test_dots_and_labels(self):
        for record, trace, dots, labels in self.each("/camera/dots", "/camera/labels"):
            places = np.array([[p.x, p.y] for p in dots.points[0].points])
            np.testing.assert_allclose(places - 0.5, columns(trace["dots"], "u_px_q12", "v_px_q12") / 4096)
            self.assertEqual(len(places), record["dots"])
            self.assertEqual(len(dots.points[0].outline_colors), record["dots"])
            self.assertEqual(len(labels.texts), record["labelled"])
            for text in labels.texts:
                dot = trace["labels"]["slot"][int(text.text)]["dot"]
                np.testing.assert_allclose([text.position.x, text.position.y], places[dot])

    def test_points_stand_where_their_dots_are(self):
        for record, trace, dots, points, calibration in self.each("/camera/dots", "/points", "/camera/calibration"):
            found = cloud(points)
            self.assertEqual(len(found), trace["points"]["seen_count"])
            self.assertEqual(points.frame_id, "camera")
            np.testing.assert_allclose(found["place"][:, 2] * 1000 * 256,
                                       np.array(trace["points"]["depth_mm_q8"])[found["slot"]], rtol=1e-6)
            seen = project(calibration, found["place"].astype(float))
            of_dots = np.array([[p.x - 0.5, p.y - 0.5] for p in dots.points[0].points])
            mine = of_dots[[trace["labels"]["slot"][slot]["dot"] for slot in found["slot"]]]
            off_px = np.hypot(*(seen - mine).T)
            self.assertLess(np.median(off_px), 0.3, record["file"])
            self.assertLess(off_px.max(), 6, record["file"])

    def test_the_surface(self):
        for _, trace, scene in self.each("/surface"):
            self.assertTrue(trace["surface"]["valid"])
            self.assertEqual([d.type for d in scene.deletions], [1])
            shape, = scene.entities[0].triangles
            nodes = np.array([[p.x, p.y, p.z] for p in shape.points])
            depth = np.array(trace["surface"]["depth_mm_q8"]).ravel()
            np.testing.assert_allclose(nodes[:, 2] * 256000, depth)
            self.assertEqual(len(shape.colors), len(nodes))
            corners = nodes[np.reshape(shape.indices, (-1, 3))]
            self.assertEqual(len(corners), 2 * 46 * 46)
            # together the triangles cover the field once: all wind the same way, and their area is its own
            flat = corners[..., :2] / corners[..., 2:]
            area = np.cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]) / 2
            self.assertTrue((area > 0).all())
            lattice = (nodes[:, :2] / nodes[:, 2:])
            self.assertAlmostEqual(area.sum(), np.prod(lattice.max(axis=0) - lattice.min(axis=0)), places=9)

    def test_the_surface_lies_where_the_points_are(self):
        """It smooths, so it misses a point by millimetres."""
        for record, trace, points, scene in self.each("/points", "/surface"):
            nodes = np.array([[p.x, p.y, p.z] for p in scene.entities[0].triangles[0].points])
            samples = trace["samples"]
            used = set(np.array(samples["slot"])[(np.array(samples["final_root_weight_q15"]) > 32000)
                                                 & (np.array(samples["depth_mm_q8"]) < samples["clip_mm_q8"])])
            places = np.array([p["place"] for p in cloud(points) if p["slot"] in used], dtype=float)
            self.assertGreater(len(places), 60)
            off = depth_at(nodes, places[:, :2] / places[:, 2:]) - places[:, 2]
            self.assertLess(np.abs(off).mean(), 0.025, record["file"])

    def test_heads_and_rejected(self):
        for record, trace, heads, rejected in self.each("/heads", "/rejected"):
            found = {int(e.id): e for scene in (heads, rejected) for e in scene.entities}
            self.assertEqual(sorted(int(e.id) for e in heads.entities), sorted(record["heads"]))
            self.assertEqual(sorted(found), list(range(len(record["hypotheses"]))))
            self.assertEqual([d.type for d in [*heads.deletions, *rejected.deletions]], [1, 1])
            for index, h in enumerate(record["hypotheses"]):
                ball, = found[index].spheres
                place = ball.pose.position
                np.testing.assert_allclose([place.x, place.y, place.z], np.array(h["centre_mm"]) / 1000)
                np.testing.assert_allclose([ball.size.x, ball.size.y, ball.size.z],
                                           np.array(trace["findings"][index]["semi_mm_q8"]) / 256 * 2 / 1000)
                facts = {pair.key: pair.value for pair in found[index].metadata}
                self.assertEqual(float(facts["distance_mm"]), h["distance_mm"])
                self.assertEqual(float(facts["score"]), h["score"])
                self.assertEqual(facts.get("rejected"), h["rejected"])
                self.assertEqual(facts.get("selected"), "true" if index == record["head"] else None)
                text, = found[index].texts
                self.assertEqual(text.text.count("score %.3f" % h["score"]), 1)
                self.assertIn("%.1f mm" % h["distance_mm"] if index in record["heads"] else h["rejected"], text.text)

    def test_the_head_stands_where_its_ellipse_is(self):
        found = 0
        for record, _, calibration in self.each("/camera/calibration"):
            if record["head"] is None:
                continue
            found += 1
            h = record["hypotheses"][record["head"]]
            place = self.mcap.at("/head", record["time_us"]).pose.position
            np.testing.assert_allclose([place.x, place.y, place.z], np.array(h["centre_mm"]) / 1000)
            seen, = project(calibration, np.array([[place.x, place.y, place.z]]))
            self.assertLess(np.hypot(*(seen - h["pixel"])), 1, record["file"])
        self.assertGreater(found, 2)

    def test_outlines(self):
        for record, _, heads, rejected in self.each("/camera/heads", "/camera/rejected"):
            check_outlines(self, record, heads, rejected)

    def test_the_unreadable_frame(self):
        (log_time, message), = self.mcap.messages["/log"]
        lost, = (r for r in self.records if "error" in r)
        self.assertEqual((message.file, message.message, message.level), (UNREADABLE, lost["error"], message.ERROR))
        before = [r["time_us"] for r in self.frames if r["file"] < UNREADABLE]
        self.assertEqual(log_time, before[-1] * 1000)

    def test_the_same_bytes_again(self):
        self.assertEqual(export(*mcap_arguments("both", "dots", "again.mcap")).returncode, 0)
        self.assertEqual(read(at("again.mcap")), read(at("dots.mcap")))


class OtherFiles(unittest.TestCase):
    def test_range(self):
        done = export(*mcap_arguments("both", "range", "range.mcap"))
        self.assertEqual(done.returncode, 0, done.stderr)
        mcap = Mcap(at("range.mcap"))
        first, second = records_of("both", "range")
        (log_time, image), = mcap.messages["/camera/image"]
        self.assertEqual((log_time, image.encoding, image.step), (first["time_us"] * 1000, "16UC1", 320))
        pgm = np.frombuffer(read(at("range", "000000.pgm"))[-160 * 120 * 2:], ">u2")
        np.testing.assert_array_equal(np.frombuffer(image.data, "<u2"), pgm)
        self.assertEqual({m.child_frame_id for _, m in mcap.messages["/tf"]}, {"camera"})
        for record in (first, second):
            found = cloud(mcap.at("/points", record["time_us"]))["place"].astype(float)
            self.assertGreater(len(found), 50)
            off = np.min([np.abs(np.linalg.norm(found - [0, 0, 0.9], axis=1) - 0.1), np.abs(found[:, 2] - 2),
                          np.abs(found[:, 2] - BODY_MM / 1000)], axis=0)
            self.assertLess(off.max(), 0.03)
            self.assertEqual(len(mcap.at("/camera/dots", record["time_us"]).points), 0)
            # the surface bulges where the ball does, alike to both sides
            shape, = mcap.at("/surface", record["time_us"]).entities[0].triangles
            nodes = np.array([[p.x, p.y, p.z] for p in shape.points])
            middle, left, right, above = depth_at(nodes, np.array([[0, 0], [-0.1, 0], [0.1, 0], [0, -0.1]]))
            # 64 centres overshoot a step to the wall; ih_surface's float64 reference: 0.74
            self.assertAlmostEqual(middle, 0.8, delta=0.08)
            self.assertAlmostEqual(left, right, delta=0.02)
            self.assertGreater(min(left, right, above), middle + 0.05)

    def test_a_camera_that_does_not_hang_level(self):
        """Everything is in its own frame, heads stand upright in space, and the rig's Z is up."""
        done = export(*mcap_arguments("tilted", "tilted", "tilted.mcap"))
        self.assertEqual(done.returncode, 0, done.stderr)
        mcap = Mcap(at("tilted.mcap"))
        rotation = matrix_of(next(m for _, m in mcap.messages["/tf"] if m.child_frame_id == "camera").rotation)
        np.testing.assert_allclose(rotation @ UP, [0, 0, 1], atol=1e-12)
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
        forward = rotation @ [0, 0, 1]
        self.assertGreater(forward[0], 0.8)
        self.assertAlmostEqual(forward[1], 0, delta=1e-12)
        balls = 0
        for record in records_of("tilted"):
            trace = trace_of("tilted", "tilted", record)
            level = np.reshape(trace["level_q30"], (3, 3)) / 2**30
            np.testing.assert_allclose(level @ UP, [0, -1, 0], atol=1e-8)
            topics = ("/camera/dots", "/points", "/surface", "/camera/calibration", "/heads", "/rejected")
            dots, points, scene, calibration, *ellipsoids = (mcap.at(topic, record["time_us"]) for topic in topics)
            places = cloud(points)["place"].astype(float)
            of_dots = np.array([[p.x - 0.5, p.y - 0.5] for p in dots.points[0].points])
            mine = of_dots[[trace["labels"]["slot"][slot]["dot"] for slot in cloud(points)["slot"]]]
            off_px = np.hypot(*(project(calibration, places) - mine).T)
            self.assertLess(np.median(off_px), 0.3, record["file"])
            self.assertLess(off_px.max(), 6, record["file"])
            nodes = np.array([[p.x, p.y, p.z] for p in scene.entities[0].triangles[0].points]) @ level.T
            np.testing.assert_allclose(nodes[:, 2] * 256000, np.ravel(trace["surface"]["depth_mm_q8"]), rtol=1e-6)
            used = set(np.array(trace["samples"]["slot"])[np.array(trace["samples"]["final_root_weight_q15"]) > 32000])
            places = np.array([p["place"] for p in cloud(points) if p["slot"] in used], dtype=float) @ level.T
            slopes, lattice = places[:, :2] / places[:, 2:], nodes[:, :2] / nodes[:, 2:]
            on_it = ((slopes > lattice.min(axis=0)) & (slopes < lattice.max(axis=0))).all(axis=1)
            near = on_it & (places[:, 2] * 256000 < trace["samples"]["clip_mm_q8"])
            self.assertGreater(near.sum(), 40)
            self.assertLess(np.abs(depth_at(nodes, slopes[near]) - places[near, 2]).mean(), 0.03, record["file"])
            for entity in (entity for one in ellipsoids for entity in one.entities):
                np.testing.assert_allclose(matrix_of(entity.spheres[0].pose.orientation), level.T, atol=1e-8)
                above = np.subtract(*([getattr(p, axis) for axis in "xyz"] for p in
                                      (entity.texts[0].pose.position, entity.spheres[0].pose.position)))
                np.testing.assert_allclose(above / np.linalg.norm(above), UP, atol=1e-6)
                balls += 1
        self.assertGreater(balls, 2)

    def test_ten_bits(self):
        done = export(*mcap_arguments("bits10", "bits10", "bits10.mcap"))
        self.assertEqual(done.returncode, 0, done.stderr)
        mcap = Mcap(at("bits10.mcap"))
        for record in records_of("bits10"):
            image = mcap.at("/camera/image", record["time_us"])
            self.assertEqual(image.encoding, "mono16")
            pgm = np.frombuffer(read(at("bits10", record["file"]))[-752 * 582 * 2:], ">u2")
            self.assertEqual(pgm.max() >> 10, 0)
            np.testing.assert_array_equal(np.frombuffer(image.data, "<u2"), pgm)

    def test_the_papers_method_has_mean_heads(self):
        done = export(*mcap_arguments("paper", "bits10", "paper.mcap"))
        self.assertEqual(done.returncode, 0, done.stderr)
        mcap = Mcap(at("paper.mcap"))
        balls = 0
        angles = [h["angle_deg"] for record in records_of("paper") for h in record["hypotheses"]]
        self.assertTrue(any(5 < angle % 90 < 85 for angle in angles), angles)
        for record in records_of("paper"):
            check_outlines(self, record, *(mcap.at(topic, record["time_us"])
                                           for topic in ("/camera/heads", "/camera/rejected")))
            self.assertEqual(len(mcap.at("/heads", record["time_us"]).entities), len(record["heads"]))
            for entity in mcap.at("/heads", record["time_us"]).entities:
                size = entity.spheres[0].size
                np.testing.assert_allclose([size.x, size.y, size.z], [0.156, 0.226, 0.196])
                balls += 1
        self.assertGreater(balls, 2)


class Table(unittest.TestCase):
    def rows(self, name, expected=0):
        done = export(at(name + ".jsonl"), "--csv", at(name + ".csv"))
        self.assertEqual(done.returncode, expected, done.stderr)
        with open(at(name + ".csv"), encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file, strict=True))

    def test_values(self):
        rows = self.rows("both")
        expected = [(record, index) for record in records_of("both")
                    for index in (range(len(record.get("hypotheses", []))) or [None])]
        self.assertEqual(len(rows), len(expected))
        self.assertTrue(any(index is None for _, index in expected))
        for row, (record, index) in zip(rows, expected):
            for key in ("dir", "file", "time_us", "dots", "labelled", "points", "error"):
                self.assertEqual(row[key], str(record.get(key, "")))
            if index is None:
                of_hypothesis = ("hypothesis", "pixel_u_px", "centre_z_mm", "score", "head_rank", "selected")
                self.assertEqual({row[key] for key in of_hypothesis}, {""})
                continue
            h = record["hypotheses"][index]
            self.assertEqual(row["hypothesis"], str(index))
            numbers = {"pixel_u_px": h["pixel"][0], "pixel_v_px": h["pixel"][1], "axis_a_px": h["axes_px"][0],
                       "axis_b_px": h["axes_px"][1], "angle_deg": h["angle_deg"], "distance_mm": h["distance_mm"],
                       "centre_x_mm": h["centre_mm"][0], "centre_y_mm": h["centre_mm"][1],
                       "centre_z_mm": h["centre_mm"][2], "score": h["score"]}
            self.assertEqual({key: float(row[key]) for key in numbers}, numbers)
            for key in ("track", "sigma_mm", "rejected"):
                value = h.get(key)
                self.assertEqual(row[key], "" if value is None else str(value))
            self.assertEqual(row["predicted"], "true" if h.get("predicted") else "false")
            self.assertEqual(row["head_rank"], str(record["heads"].index(index)) if index in record["heads"] else "")
            self.assertEqual(row["selected"], "true" if record["head"] == index else "false")

    def test_numbers_as_written(self):
        """0.000 stays 0.000, and 90.0 does not become 90."""
        self.rows("both")
        table, records = read(at("both.csv")).decode(), read(at("both.jsonl")).decode()
        for key in ("distance_mm", "angle_deg", "score"):
            written = re.findall(r'"%s":([-0-9.]+)' % key, records)
            column = table.splitlines()[0].split(",").index(key)
            shown = [line.split(",")[column] for line in table.splitlines()[1:]]
            self.assertEqual([s for s in shown if s], written)

    def test_form(self):
        """RFC 4180: lines end in CR LF, as many fields in each, quotes where they are needed."""
        odd = 'frames, "the\nsecond"'
        record = {"file": "ä.pgm", "time_us": 1, "dots": 0, "labelled": 0, "hypotheses": [], "heads": [], "head": None,
                  "dir": odd, "dropped": {"minima": 3, "dots": 1}, "lost": 2, "skipped": 1, "strobe": "late",
                  "across_px": 0.25, "rig": "turned", "new": 5}
        with open(at("odd.jsonl"), "w", encoding="utf-8") as file:
            file.write("\n%s\n" % json.dumps(record))
        row, = self.rows("odd")
        self.assertEqual((row["dir"], row["file"], row["dropped"]), (odd, "ä.pgm", "minima=3 dots=1"))
        self.assertEqual((row["lost"], row["skipped"], row["strobe"]), ("2", "1", "late"))
        self.assertEqual((row["across_px"], row["rig"], row["rig_depth_known"]), ("0.25", "turned", ""))
        record["rig"] = {"state": "moved", "across_px": 0.08, "rotation_deg": [0.2, -1, 0], "sigma_deg": [0, 0, 0],
                         "focal_percent": -0.5, "shift_px": [0, 2.25], "depth_known": True}
        with open(at("odd.jsonl"), "w", encoding="utf-8") as file:
            file.write("%s\n" % json.dumps(record))
        row, = self.rows("odd")
        self.assertEqual([row[key] for key in ("across_px", "rig", "rig_rotation_x_deg", "rig_rotation_y_deg",
                                               "rig_rotation_z_deg", "rig_focal_percent", "rig_shift_u_px",
                                               "rig_shift_v_px", "rig_depth_known")],
                         ["0.08", "moved", "0.2", "-1", "0", "-0.5", "0", "2.25", "true"])
        self.rows("both")
        lines = read(at("both.csv")).split(b"\r\n")
        self.assertEqual(lines.pop(), b"")
        self.assertTrue(all(b"\n" not in line for line in lines))
        self.assertEqual({line.count(b",") for line in lines[:5]}, {lines[0].count(b",")})

    def test_no_formulas(self):
        """A text that a spreadsheet would run is one no more, whichever column it stands in; all others, and numbers
        below zero, are as they were."""
        formulas = ['=cmd|"/C calc"!A0', "+1", "-2.pgm", "@SUM(1)", "\t=1", "\r=1", "\n=1"]
        others = ["a=1.pgm", "'quoted", " -2.pgm", "2-1.pgm", ""]
        h = {"pixel": [-1.5, 2], "axes_px": [4, 3], "angle_deg": 0, "distance_mm": 900, "centre_mm": [-7, -0.25, 1000]}
        with open(at("formulas.jsonl"), "w", encoding="utf-8") as file:
            for word in formulas + others:
                file.write(json.dumps({"file": word, "time_us": 0, "dots": 0, "labelled": 0, "dir": word, "strobe": word,
                                       "rig": word, "dropped": {word: 1}, "heads": [], "head": None,
                                       "hypotheses": [{**h, "rejected": word}]}) + "\n")
                file.write(json.dumps({"file": "a.pgm", "error": word}) + "\n")
        rows = self.rows("formulas")
        for word, row, bad in zip(formulas + others, rows[::2], rows[1::2]):
            shown = "'" + word if word in formulas else word
            self.assertEqual([row[key] for key in ("file", "dir", "strobe", "rig", "rejected")], [shown] * 5)
            self.assertEqual((row["dropped"], bad["error"]), (shown + "=1" if word else "'=1", shown))
            self.assertEqual((row["pixel_u_px"], row["centre_x_mm"], row["centre_y_mm"]), ("-1.5", "-7", "-0.25"))
        for line in rows:
            for key, cell in line.items():
                self.assertFalse(cell.startswith(tuple("=@+\t\r\n")), (key, cell))

    def test_two_heads(self):
        """The paper's method selects none of two; a tracked run has one of them selected."""
        h = {"pixel": [1, 2], "axes_px": [4, 3], "angle_deg": 0, "distance_mm": 900, "centre_mm": [0, 0, 1000],
             "rejected": None}
        record = {"file": "a.pgm", "time_us": 0, "dots": 0, "labelled": 0,
                  "hypotheses": [h, {**h, "rejected": "area"}, h],
                  "heads": [2, 0], "head": None}
        with open(at("two.jsonl"), "w", encoding="utf-8") as file:
            file.write("%s\n%s\n" % (json.dumps(record), json.dumps({**record, "head": 2})))
        found = [(row["head_rank"], row["selected"], row["rejected"]) for row in self.rows("two")]
        self.assertEqual(found, [("1", "false", ""), ("", "false", "area"), ("0", "false", ""),
                                 ("1", "false", ""), ("", "false", "area"), ("0", "true", "")])

    def test_without_packages(self):
        """A table needs nothing but Python; the other file says what is missing."""
        alone = at("alone", "tools", "export")
        shutil.copytree(os.path.dirname(TOOL), alone)
        program = ["/usr/bin/python3", os.path.join(alone, "isohead-export")]
        subprocess.run([*program, at("both.jsonl"), "--csv", at("alone.csv")], check=True, stdout=subprocess.DEVNULL)
        done = subprocess.run([*program, *mcap_arguments("both", "dots", "alone.mcap")], capture_output=True, text=True,
                              check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("tools/setup.sh export", done.stderr)
        self.assertFalse(os.path.exists(at("alone.mcap")))


class Refusals(unittest.TestCase):
    """Status 1, one line that says where, what stood under the name before is still there, nothing else."""

    def refused(self, arguments, *said, out="kept.mcap", **how):
        with open(at(out), "wb") as file:
            file.write(b"as before")
        before = sorted(os.listdir(WORK))
        done = export(*arguments, **how)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        for text in said:
            self.assertIn(text, done.stderr)
        self.assertEqual(read(at(out)), b"as before")
        self.assertEqual(sorted(os.listdir(WORK)), before)

    def spoilt_trace(self, change, *said):
        shutil.rmtree(at("spoilt"), ignore_errors=True)
        shutil.copytree(at("trace-both", "dots"), at("spoilt"))
        path = at("spoilt", "000001.json")
        text = change(read(path).decode())
        if text is None:
            os.unlink(path)
        else:
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
        self.refused(mcap_arguments("both", "dots", "kept.mcap", at("spoilt")), "spoilt/000001.json", *said)

    def spoilt_value(self, change, *said):
        def spoil(text):
            trace = json.loads(text)
            change(trace)
            return json.dumps(trace)
        self.spoilt_trace(spoil, *said)

    def test_traces(self):
        self.spoilt_trace(lambda text: None, "is not there")
        self.spoilt_trace(lambda text: text[:5000], "no JSON", "line 1 column")
        self.spoilt_trace(lambda text: "", "no JSON")
        self.spoilt_trace(lambda text: "[]", "no dots")
        self.spoilt_trace(lambda text: "[" * 100000, "no JSON")
        self.spoilt_trace(lambda text: text.replace('"valid":true', '"valid":NaN'), "no JSON")
        self.spoilt_value(lambda t: t.update(time_us=1), "not of the same run")
        self.spoilt_value(lambda t: t["dots"].update(dot_count=3), "not of the same run")
        self.spoilt_value(lambda t: t["findings"].pop(), "not of the same run")
        self.spoilt_value(lambda t: t["points"]["x_q28"].pop(), "points.x_q28", "361 integers")
        self.spoilt_value(lambda t: t["points"].update(state=[1.5] * 361), "points.state")
        self.spoilt_value(lambda t: t["points"].update(depth_mm_q8=[10**400] * 361), "points.depth_mm_q8")
        self.spoilt_value(lambda t: t["dots"]["u_px_q12"].append(0), "dots.u_px_q12")
        self.spoilt_value(lambda t: t["surface"]["depth_mm_q8"][7].pop(), "surface.depth_mm_q8", "47 rows of 47")
        self.spoilt_value(lambda t: t.pop("surface"), "no surface")
        self.spoilt_value(lambda t: t["labels"]["slot"][100].update(dot=9999), "labels.slot[100].dot")
        self.spoilt_value(lambda t: t["findings"][0].update(semi_mm_q8=[1, 2]), "findings[0].semi_mm_q8")
        self.refused(mcap_arguments("both", "dots", "kept.mcap", at("trace-both")),
                     "name one of the folders in it: dots")

    def test_traces_with_suffix(self):
        """As host_sim names them where frames differ in it alone."""
        shutil.copytree(at("trace-both", "dots"), at("suffixed"))
        os.rename(at("suffixed", "000001.json"), at("suffixed", "000001.pgm.json"))
        done = export(*mcap_arguments("both", "dots", "suffixed.mcap", at("suffixed")))
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_records(self):
        lines = read(at("both.jsonl")).splitlines()
        for spoil, said in ((lambda line: line[:100], "no JSON"),
                            (lambda line: line.replace(b'"heads":[', b'"heads":[99,'), "heads"),
                            (lambda line: line.replace(b'"centre_mm":[', b'"centre_mm":[1,'),
                             "hypotheses[0].centre_mm"),
                            (lambda line: line.replace(b'"time_us":', b'"time_us":-'), "time_us"),
                            (lambda line: line.replace(b'"file"', b'"File"'), "no file"),
                            (lambda line: b"\xff" + line, "no UTF-8"),
                            (lambda line: b"7", "no file")):
            with open(at("spoilt.jsonl"), "wb") as file:
                file.write(b"\n".join([*lines[:4], spoil(lines[4]), *lines[5:]]) + b"\n")
            self.refused([at("spoilt.jsonl"), "--csv", at("kept.csv")], "spoilt.jsonl:5: ", said, out="kept.csv")
        with open(at("spoilt.jsonl"), "wb") as file:
            file.write(b"\n".join([lines[1], lines[0]]))
        self.refused(mcap_arguments("spoilt", "dots", "kept.mcap", at("trace-both", "dots")),
                     "spoilt.jsonl:2: time_us is 0")
        with open(at("none.jsonl"), "wb") as file:
            file.write(b"\n\n")
        self.refused([at("none.jsonl"), "--csv", at("kept.csv")], "none.jsonl: no records", out="kept.csv")
        self.refused([at("nowhere.jsonl"), "--csv", at("kept.csv")], "nowhere.jsonl: No such file", out="kept.csv")
        self.refused(mcap_arguments("both", "bits10", "kept.mcap", at("trace-both", "dots")), "no records of", "dots")

    def test_frames(self):
        shutil.rmtree(at("spoilt-dots"), ignore_errors=True)
        shutil.copytree(at("dots"), at("spoilt-dots"))
        lines = [json.loads(line) for line in read(at("both.jsonl")).splitlines()]
        with open(at("nodir.jsonl"), "w", encoding="utf-8") as file:
            for record in lines:
                if record.pop("dir") == at("dots"):
                    file.write(json.dumps(record) + "\n")
        arguments = mcap_arguments("nodir", "spoilt-dots", "kept.mcap", at("trace-both", "dots"))
        rig = at("spoilt-dots", "rig.json")
        self.refused([*arguments, "--rig", at("range", "rig.json")], "000000.pgm: 752x582 pixels, the rig has 160x120")
        for said, text in (("cut off", b"P5 752 582 255\n" + bytes(1000)), ("P6", b"P6 1 1 255 "), ("empty", b"")):
            with open(at("spoilt-dots", "000002.pgm"), "wb") as file:
                file.write(text)
            self.refused(arguments, "000002.pgm: ", "expected")
        for spoil, said in ((lambda r: r.pop("near_mm"), "no near_mm"), (lambda r: r.update(far_mm=1), "far_mm"),
                            (lambda r: r["camera_matrix"].update(data=[1]), "camera_matrix.data"),
                            (lambda r: r.update(kind="laser"), "kind")):
            with open(at("dots", "rig.json"), encoding="utf-8") as file:
                value = json.load(file)
            spoil(value)
            with open(rig, "w", encoding="utf-8") as file:
                json.dump(value, file)
            self.refused(arguments, "spoilt-dots/rig.json: ", said)
        os.unlink(rig)
        self.refused(arguments, "rig.json: No such file")

    def test_outputs(self):
        self.refused([at("both.jsonl"), "--csv", at("no", "where.csv")], "where.csv: cannot be written")
        self.refused([at("both.jsonl"), "--csv", at("dots")], "not a plain file")

        def little_room():
            resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
        self.refused(mcap_arguments("both", "dots", "kept.mcap"), "kept.mcap: cannot be written",
                     preexec_fn=little_room)
        self.refused([at("both.jsonl"), "--csv", at("kept.csv")], "kept.csv: cannot be written", out="kept.csv",
                     preexec_fn=little_room)

    def test_usage(self):
        for arguments in ([], [at("both.jsonl")], [at("both.jsonl"), "--mcap", at("x.mcap")], ["--csv", at("x.csv")],
                          [at("both.jsonl"), "--csv", at("x.csv"), "--frames", at("dots")],
                          [at("both.jsonl"), "--csv", at("x.csv"), "--colour"]):
            done = export(*arguments)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertIn("isohead-export: error:", done.stderr)
        self.assertFalse(os.path.exists(at("x.mcap")) or os.path.exists(at("x.csv")))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        print("usage: export.py HOST_SIM RENDER", file=sys.stderr)
        sys.exit(2)
    HOST_SIM, RENDER = map(os.path.abspath, sys.argv[1:])
    unittest.main(argv=sys.argv[:1])
