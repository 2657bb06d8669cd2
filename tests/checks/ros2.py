#!/usr/bin/env python3
"""The programs of docs/ros2.md: the reader is run, the node too, against stand-ins for ROS 2, with records over UDP.

    ros2.py HOST_SIM FRAMES_DIR
"""

import json
import os
import re
import select
import socket
import subprocess
import sys
import types

PAGE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docs", "ros2.md")


def programs():
    with open(PAGE, encoding="utf-8") as file:
        return re.findall(r"^```python\n(.*?)^```$", file.read(), re.M | re.S)


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def greeting(track):
    """A record whose head has this track and nothing else of sense."""
    return json.dumps({"head": 0, "hypotheses": [{"track": track, "centre_mm": [0, 0, 0], "score": 1}]}).encode()


def check_reader(text, records):
    """Each head of the records, in order; after a head the next datagram is sent when it has been answered."""
    assert len(text.strip().splitlines()) <= 11 and text.count("5005") == 1
    to = ("127.0.0.1", free_port())
    with subprocess.Popen([sys.executable, "-c", text.replace("5005", str(to[1]))], stdout=subprocess.PIPE) as reader, \
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:

        def answer():
            line = reader.stdout.readline().decode()
            assert line, "the reader has ended"
            return line.split()

        try:
            # What is sent before there is a receiver is lost: again, until it answers; then until all have been answered.
            while not select.select([reader.stdout], [], [], 0.2)[0]:
                assert reader.poll() is None, "the reader has ended"
                sender.sendto(greeting("hello"), to)
            sender.sendto(greeting("ready"), to)
            while answer()[0] != "ready":
                pass
            count = 0
            for line in records:
                record = json.loads(line)
                sender.sendto(line.encode() + b"\n", to)
                if record.get("head") is not None:
                    head = record["hypotheses"][record["head"]]
                    expected = list(map(str, [head.get("track"), *head["centre_mm"], head.get("score")]))
                    said = answer()
                    assert said == expected, (said, expected)
                    count += 1
        finally:
            reader.kill()
    return count


def message(name, **fields):
    """A class that has these fields and no others; a field is a value, or a class to make one by."""

    def begin(self):
        for field, value in fields.items():
            setattr(self, field, value() if callable(value) else value)
    return type(name, (), {"__slots__": tuple(fields), "__init__": begin})


XYZ = message("Point", x=0.0, y=0.0, z=0.0)
POSE = message("Pose", position=XYZ, orientation=message("Quaternion", x=0.0, y=0.0, z=0.0, w=1.0))
WITH_COVARIANCE = message("PoseWithCovariance", pose=POSE, covariance=lambda: [0.0] * 36)
HEADER = message("Header", stamp=object, frame_id="")
RESULT = message("ObjectHypothesisWithPose", hypothesis=message("ObjectHypothesis", class_id="", score=0.0), pose=WITH_COVARIANCE)
DETECTION = message("Detection3D", header=HEADER, results=list, bbox=message("BoundingBox3D", center=POSE, size=XYZ), id="")
DETECTIONS = message("Detection3DArray", header=HEADER, detections=list)


class Logger:
    def __init__(self):
        self.texts = []

    def warning(self, text):
        self.texts.append(text)


class Clock:
    def now(self):
        return self

    def to_msg(self):
        return "a stamp"


class Publisher:
    def __init__(self):
        self.messages = []

    def publish(self, given):
        self.messages.append(given)


class Node:
    """What the node calls of rclpy.node.Node; its parameters come from the test."""

    parameters = {}
    nodes = []

    def __init__(self, name):
        assert name == "isohead"
        self.logger, self.publisher_made, self.timers = Logger(), Publisher(), []
        Node.nodes.append(self)

    def declare_parameter(self, name, default):
        return types.SimpleNamespace(value=type(default)(Node.parameters.get(name, default)))

    def create_publisher(self, kind, topic, depth):
        assert kind is DETECTIONS and topic == "heads" and depth > 0
        return self.publisher_made

    def create_timer(self, period_s, callback):
        assert 0 < period_s <= 0.02
        self.timers.append(callback)

    def get_logger(self):
        return self.logger

    def get_clock(self):
        return Clock()


def check_message(given, record):
    assert given.header.frame_id == "optical" and given.header.stamp == "a stamp"
    heads = [record["hypotheses"][index] for index in record["heads"]]
    assert len(given.detections) == len(heads)
    if record["head"] is not None:
        selected = record["hypotheses"][record["head"]]
        assert given.detections[0].results[0].pose.pose.position.x == selected["centre_mm"][0] / 1000
    for head in heads:
        found = [d for d in given.detections if d.id == str(head.get("track", "")) and
                 d.results[0].pose.pose.position.z == head["centre_mm"][2] / 1000]
        assert len(found) == 1 and found[0].header is given.header
        result = found[0].results[0]
        assert (result.hypothesis.class_id, result.hypothesis.score) == ("head", head["score"])
        assert found[0].bbox.center.position.y == head["centre_mm"][1] / 1000 and 0.1 < found[0].bbox.size.y < 0.3
        covariance = result.pose.covariance
        assert abs(covariance[0] - (head["sigma_mm"] / 1000) ** 2) < 1e-12 and covariance[7] == covariance[14] == covariance[0]
        assert covariance[21] == covariance[28] == covariance[35] == -1 and sum(map(bool, covariance)) == 6


def check_node(text, records):
    """All datagrams wait in the socket when its timer runs."""
    Node.parameters = {"port": free_port(), "frame_id": "optical"}
    lines = [b"no json", b'{"file":"x","error":"was lost"}', *(line.encode() + b"\n" for line in records)]

    def spin(node):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for line in lines:
                sender.sendto(line, ("127.0.0.1", Node.parameters["port"]))
                node.timers[0]()
        node.receiver.close()
        raise KeyboardInterrupt

    rclpy, node_module = types.ModuleType("rclpy"), types.ModuleType("rclpy.node")
    rclpy.init, rclpy.spin, node_module.Node = (lambda: None), spin, Node
    vision = types.ModuleType("vision_msgs.msg")
    vision.Detection3D, vision.Detection3DArray, vision.ObjectHypothesisWithPose = DETECTION, DETECTIONS, RESULT
    sys.modules.update({"rclpy": rclpy, "rclpy.node": node_module, "vision_msgs": types.ModuleType("vision_msgs"),
                        "vision_msgs.msg": vision})
    exec(compile(text, PAGE, "exec"), {"__name__": "__main__"})
    node, = Node.nodes
    assert len(node.logger.texts) == 2 and node.logger.texts[1] == "x: was lost", node.logger.texts
    assert len(node.publisher_made.messages) == len(records)
    for given, line in zip(node.publisher_made.messages, records):
        check_message(given, json.loads(line))


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    records = subprocess.run([sys.argv[1], "--json", sys.argv[2]], check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    reader, node = programs()
    count = check_reader(reader, records)
    assert 20 < count < len(records)  # frames with somebody, and some without
    check_node(node, records)
    print("ros2: %d heads read, %d messages" % (count, len(records)))


if __name__ == "__main__":
    main()
