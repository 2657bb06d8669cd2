"""Records, frames and traces as one MCAP file, a time per frame."""

import os

from mcap.well_known import MessageEncoding
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema

import export_scene as scene
from export_input import Picture, Refused, trace_of

LIBRARY = "isohead-export"


class Topics:
    """Writes messages; a topic and its schema are entered with its first message."""

    def __init__(self, file):
        self.writer = Writer(file, compression=CompressionType.ZSTD)
        self.writer.start(profile="", library=LIBRARY)
        self.channels = {}
        self.schemas = {}
        self.counts = {}

    def channel(self, topic, kind):
        if topic not in self.channels:
            if kind not in self.schemas:
                self.schemas[kind] = register_schema(self.writer, kind)
            self.channels[topic] = self.writer.register_channel(
                topic=topic, message_encoding=MessageEncoding.Protobuf, schema_id=self.schemas[kind])
        return self.channels[topic]

    def write(self, topic, message, time_us):
        self.counts[topic] = self.counts.get(topic, 0) + 1
        self.writer.add_message(channel_id=self.channel(topic, type(message)), log_time=time_us * 1000,
                                publish_time=time_us * 1000, sequence=self.counts[topic],
                                data=message.SerializeToString(deterministic=True))


def frame_messages(record, rig, picture, trace):
    """(topic, message) of a frame."""
    time = scene.time_of(record.time_us)
    for transform in scene.transforms(rig, time):
        yield "/tf", transform
    yield "/camera/calibration", scene.calibration(rig, time)
    if picture is not None:
        yield "/camera/image", scene.image(picture, rig, time)
    yield "/camera/dots", scene.dots(trace, rig, time)
    yield "/camera/labels", scene.labels(trace, time)
    yield "/camera/heads", scene.outlines(record, time, True)
    yield "/camera/rejected", scene.outlines(record, time, False)
    yield "/points", scene.points(trace, time)
    yield "/surface", scene.surface(trace, rig, time)
    yield "/heads", scene.heads(record, trace, time, True)
    yield "/rejected", scene.heads(record, trace, time, False)
    found = scene.head_pose(record, time)
    if found is not None:
        yield "/head", found


def read_picture(folder, record, rig):
    """A list of points (.xyz) is no picture."""
    if os.path.splitext(record.file)[1] == ".xyz":
        return None
    return Picture(os.path.join(folder, record.file), rig)


def write(records, rig, frames, traces, file):
    """frames, traces: folders. file: binary. Returns the numbers of frames and of messages."""
    topics = Topics(file)
    time_us = 0
    frame_count = 0
    for record in records:
        if record.error is not None:
            # it has no time of its own: that of the frame before it
            topics.write("/log", scene.lost(record, scene.time_of(time_us)), time_us)
            continue
        if record.time_us < time_us:
            raise Refused("%s: time_us is %d, after %d: one run's records in their order expected" %
                          (record.where, record.time_us, time_us))
        time_us = record.time_us
        picture = read_picture(frames, record, rig)
        for topic, message in frame_messages(record, rig, picture, trace_of(traces, record)):
            topics.write(topic, message, time_us)
        frame_count += 1
    topics.writer.finish()
    return frame_count, sum(topics.counts.values())
