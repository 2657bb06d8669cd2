"""One frame as messages of Foxglove's schemas: picture, dots, points, surface, heads.

Lengths are metres, as Foxglove takes them to be; the frame "camera" is that of docs/contract.md (X right, Y
down, Z forward), "rig" the same origin with Z up, by the rig's "up", and X level and forward. Foxglove counts pixels from the corner of the
first one, the records from its centre: half a pixel is added.

Colours can be distinguished in grey and by the colour-blind: depth from dark (near) over green to yellow (far);
the head orange, other heads yellow, one that is only predicted sky blue, what was rejected grey.
"""

import math
import struct

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.KeyValuePair_pb2 import KeyValuePair
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.Point2_pb2 import Point2
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneEntityDeletion_pb2 import SceneEntityDeletion
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.TextAnnotation_pb2 import TextAnnotation
from foxglove_schemas_protobuf.TextPrimitive_pb2 import TextPrimitive
from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.duration_pb2 import Duration
from google.protobuf.timestamp_pb2 import Timestamp

CAMERA = "camera"
# Of a head that nobody measured, with --paper: the mean head of firmware/core/detect/ih_ellipsoid.c.
MEAN_SEMI_AXES_MM = (78, 113, 98)
OUTLINE_POINTS = 48
FOREVER = Duration()  # until the next scene deletes it
NO_ROTATION = Quaternion(x=0, y=0, z=0, w=1)

HEAD = (0.84, 0.37, 0.00)
OTHER_HEAD = (0.94, 0.89, 0.26)
PREDICTED = (0.34, 0.71, 0.91)
REJECTED = (0.60, 0.60, 0.60)
# Near to far: lightness rises monotonically.
DEPTH_COLOURS = ((0.27, 0.00, 0.33), (0.23, 0.32, 0.55), (0.13, 0.57, 0.55), (0.37, 0.79, 0.38), (0.99, 0.91, 0.14))


def colour(rgb, opacity=1.0):
    return Color(r=rgb[0], g=rgb[1], b=rgb[2], a=opacity)


NOTHING = colour((0, 0, 0), 0)


def depth_colour(depth_mm, trace, rig, opacity=1.0):
    """By where it lies in what the frame's surface was fitted to."""
    near_mm, far_mm = trace.depths_mm or (rig.near_mm, rig.far_mm)
    at = (depth_mm - near_mm) / (far_mm - near_mm) * (len(DEPTH_COLOURS) - 1)
    at = min(max(at, 0), len(DEPTH_COLOURS) - 1)
    first = min(int(at), len(DEPTH_COLOURS) - 2)
    fraction = at - first
    low, high = DEPTH_COLOURS[first:first + 2]
    return colour([a + (b - a) * fraction for a, b in zip(low, high)], opacity)


def time_of(time_us):
    return Timestamp(seconds=time_us // 1000000, nanos=time_us % 1000000 * 1000)


def metres(position_mm):
    return [float(value) / 1000 for value in position_mm]


def pose(position_mm, orientation=NO_ROTATION):
    x, y, z = metres(position_mm)
    return Pose(position=Vector3(x=x, y=y, z=z), orientation=orientation)


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def rotation(rows):
    """The matrix as a quaternion, by whichever of its parts is large."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rows
    x, y, z, w = max(((1 + xx - yy - zz, xy + yx, xz + zx, zy - yz), (xy + yx, 1 - xx + yy - zz, yz + zy, xz - zx),
                      (xz + zx, yz + zy, 1 - xx - yy + zz, yx - xy), (zy - yz, xz - zx, yx - xy, 1 + xx + yy + zz)),
                     key=lambda q: sum(part * part for part in q))
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return Quaternion(x=x / length, y=y / length, z=z / length, w=w / length)


def upright(rig):
    """Turns the camera's axes to those that have Z up, X level and as far forward as that allows."""
    length = math.sqrt(sum(float(value) ** 2 for value in rig.up)) or 1.0
    up = [float(value) / length for value in rig.up]
    forward = [-up[2] * up[0], -up[2] * up[1], 1 - up[2] * up[2]]
    length = math.sqrt(sum(value * value for value in forward)) or 1.0
    forward = [value / length for value in forward]
    return rotation([forward, cross(up, forward), up])


def looking(pose_deg):
    """What turns the x axis, along which players draw a pose's arrow, to where the face looks; without roll."""
    if pose_deg is None:
        return NO_ROTATION
    yaw, pitch = (math.radians(float(angle)) for angle in pose_deg)
    # About Y (down) by the angle from +X to the face, then up about what is then the y axis's neighbour, Z.
    about_y, about_z = 0.5 * (0.5 * math.pi - yaw), -0.5 * pitch
    return Quaternion(x=math.sin(about_y) * math.sin(about_z), y=math.sin(about_y) * math.cos(about_z),
                      z=math.cos(about_y) * math.sin(about_z), w=math.cos(about_y) * math.cos(about_z))


def pixel(u_px, v_px):
    return Point2(x=float(u_px) + 0.5, y=float(v_px) + 0.5)


# ---------------------------------------------------------------- the camera

def transforms(rig, time):
    found = [FrameTransform(timestamp=time, parent_frame_id="rig", child_frame_id=CAMERA,
                            translation=Vector3(), rotation=upright(rig))]
    if rig.projector_mm is not None:
        x, y, z = metres(rig.projector_mm)
        found.append(FrameTransform(timestamp=time, parent_frame_id=CAMERA, child_frame_id="projector",
                                    translation=Vector3(x=x, y=y, z=z), rotation=NO_ROTATION))
    return found


def calibration(rig, time):
    k = [float(value) for value in rig.matrix]
    return CameraCalibration(
        timestamp=time, frame_id=CAMERA, width=rig.width, height=rig.height, distortion_model="plumb_bob",
        D=[float(value) for value in rig.lens], K=k, R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
        P=[*k[0:3], 0, *k[3:6], 0, *k[6:9], 0])


def image(picture, rig, time):
    encoding = "mono8" if picture.bytes_per_pixel == 1 else "16UC1" if rig.is_range else "mono16"
    return RawImage(timestamp=time, frame_id=CAMERA, width=picture.width, height=picture.height,
                    encoding=encoding, step=picture.width * picture.bytes_per_pixel, data=picture.data)


# ---------------------------------------------------------------- in the picture

def dots(trace, rig, time):
    """Every dot: a labelled one by its depth, another one grey."""
    depth_of_slot = {slot: trace.depth(position) for slot, *position in trace.points_mm}
    slot_of_dot = {dot: slot for slot, dot in trace.dot_of_slot.items()}
    depths = [depth_of_slot.get(slot_of_dot.get(dot)) for dot in range(len(trace.dots_px))]
    colours = [colour(REJECTED) if depth is None else depth_colour(depth, trace, rig) for depth in depths]
    points = PointsAnnotation(timestamp=time, type=PointsAnnotation.POINTS, thickness=4,
                              points=[pixel(u, v) for u, v in trace.dots_px], outline_color=colour(REJECTED),
                              outline_colors=colours, fill_color=NOTHING)
    return ImageAnnotations(timestamp=time, points=[points] if trace.dots_px else [])


def labels(trace, time):
    """The slot's number, row * 19 + column, beside each labelled dot."""
    return ImageAnnotations(timestamp=time, texts=[
        TextAnnotation(timestamp=time, position=pixel(*trace.dots_px[dot]), text=str(slot), font_size=8,
                       text_color=colour((1, 1, 1)), background_color=colour((0, 0, 0), 0.4))
        for slot, dot in sorted(trace.dot_of_slot.items())])


def look(record, index):
    """Colour of a hypothesis, and whether it is a head."""
    if index not in record.heads:
        return REJECTED, False
    if record.hypotheses[index].get("predicted"):
        return PREDICTED, True
    return (HEAD if index == record.head else OTHER_HEAD), True


def words(record, index):
    """The label of a hypothesis: its distance and who it is, or why it was rejected."""
    h = record.hypotheses[index]
    score = "score %s" % h["score"] if "score" in h else None
    if index not in record.heads:
        reason = h["rejected"] or "not a head"
        return score if score and reason == "score" else ", ".join(filter(None, (reason, score)))
    track = "track %d" % h["track"] if "track" in h else None
    return ", ".join(filter(None, ("%s mm" % h["distance_mm"], track, score, h.get("predicted") and "predicted")))


def outline(h):
    angle = math.radians(h["angle_deg"])
    a, b = map(float, h["axes_px"])
    u, v = map(float, h["pixel"])
    turns = [2 * math.pi * i / OUTLINE_POINTS for i in range(OUTLINE_POINTS)]
    return [pixel(u + a * math.cos(t) * math.cos(angle) - b * math.sin(t) * math.sin(angle),
                  v + a * math.cos(t) * math.sin(angle) + b * math.sin(t) * math.cos(angle)) for t in turns]


def outlines(record, time, wanted_heads):
    """The ellipses of the heads, or of the rejected hypotheses, in the picture."""
    found = ImageAnnotations(timestamp=time)
    for index, h in enumerate(record.hypotheses):
        rgb, is_head = look(record, index)
        if is_head != wanted_heads:
            continue
        found.points.append(PointsAnnotation(
            timestamp=time, type=PointsAnnotation.LINE_LOOP, points=outline(h), outline_color=colour(rgb),
            fill_color=NOTHING, thickness=3 if index == record.head else 1))
        found.texts.append(TextAnnotation(
            timestamp=time, position=pixel(*h["pixel"]), text=words(record, index),
            font_size=14 if is_head else 10, text_color=colour(rgb), background_color=colour((0, 0, 0), 0.5)))
    return found


# ---------------------------------------------------------------- in space

def points(trace, time):
    kind = PackedElementField
    fields = [kind(name=name, offset=4 * i, type=kind.FLOAT32) for i, name in enumerate("xyz")]
    fields.append(kind(name="slot", offset=12, type=kind.UINT32))
    data = b"".join(struct.pack("<fffI", *metres(position), slot) for slot, *position in trace.points_mm)
    return PointCloud(timestamp=time, frame_id=CAMERA, pose=pose((0, 0, 0)), point_stride=16, fields=fields, data=data)


def fresh_scene(time):
    """A scene without what the one before it showed."""
    return SceneUpdate(deletions=[SceneEntityDeletion(timestamp=time, type=SceneEntityDeletion.ALL)])


def triangles(size):
    """Two for each square of a grid of size x size nodes."""
    found = []
    for row in range(size - 1):
        for column in range(size - 1):
            corner = row * size + column
            found += [corner, corner + 1, corner + size, corner + 1, corner + size + 1, corner + size]
    return found


def surface(trace, rig, time):
    scene = fresh_scene(time)
    if trace.surface_mm is None:
        return scene
    nodes = [position for row in trace.surface_mm for position in row]
    shape = TriangleListPrimitive(
        pose=pose((0, 0, 0)), points=[Point3(x=x, y=y, z=z) for x, y, z in map(metres, nodes)],
        color=colour(REJECTED), colors=[depth_colour(trace.depth(position), trace, rig, 0.7) for position in nodes],
        indices=triangles(len(trace.surface_mm)))
    scene.entities.append(SceneEntity(timestamp=time, frame_id=CAMERA, id="surface", lifetime=FOREVER,
                                      triangles=[shape]))
    return scene


def facts(record, index):
    h = record.hypotheses[index]
    keys = ("distance_mm", "score", "frame_score", "track", "sigma_mm", "pose_deg", "pose_sigma_deg", "predicted", "rejected")
    pairs = [(key, h[key]) for key in keys if h.get(key) is not None]
    if index == record.head:
        pairs.append(("selected", True))
    return [KeyValuePair(key=key, value=", ".join(map(str, value)) if isinstance(value, list) else str(value).lower())
            for key, value in pairs]


def head(record, index, semi_axes_mm, level, time):
    h = record.hypotheses[index]
    rgb, is_head = look(record, index)
    x, y, z = metres(semi_axes_mm)
    above = [float(value) - down * (float(semi_axes_mm[1]) + 30) for value, down in zip(h["centre_mm"], level[1])]
    return SceneEntity(
        timestamp=time, frame_id=CAMERA, id=str(index), lifetime=FOREVER, metadata=facts(record, index),
        spheres=[SpherePrimitive(pose=pose(h["centre_mm"], rotation(list(zip(*level)))), size=Vector3(x=2 * x, y=2 * y, z=2 * z),
                                 color=colour(rgb, 0.6 if is_head else 0.15))],
        texts=[TextPrimitive(pose=pose(above), billboard=True, font_size=0.03, color=colour(rgb),
                             text=words(record, index))])


def heads(record, trace, time, wanted_heads):
    """The heads, or the rejected hypotheses, as ellipsoids, which stand upright."""
    scene = fresh_scene(time)
    for index in range(len(record.hypotheses)):
        if look(record, index)[1] == wanted_heads:
            axes = MEAN_SEMI_AXES_MM if trace.semi_axes_mm is None else trace.semi_axes_mm[index]
            scene.entities.append(head(record, index, axes, trace.level, time))
    return scene


def head_pose(record, time):
    """Where the head is; None where there is none."""
    if record.head is None:
        return None
    h = record.hypotheses[record.head]
    return PoseInFrame(timestamp=time, frame_id=CAMERA, pose=pose(h["centre_mm"], looking(h.get("pose_deg"))))


def lost(record, time):
    return Log(timestamp=time, level=Log.ERROR, name="host_sim", file=record.file, message=record.error)
