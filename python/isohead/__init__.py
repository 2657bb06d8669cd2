"""Find a person's head in 3-D from one picture of laser dots, or a depth image.

    rig = isohead.load_rig("rig.json")
    detector = isohead.Detector(rig)
    result = detector.process(image, time_us=0)
    if result.head:
        print(result.head.centre_mm)

The camera frame is OpenCV's: X right, Y down, Z forward, mm. Numbers are those of host_sim's records before they are
rounded; docs/contract.md says what each means.
"""

import json
import math
import os
import struct
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from . import _core
from ._core import Error

__all__ = ["Alignment", "Detector", "Error", "Hypothesis", "Result", "Rig", "depth_rig", "load_rig", "parse_rig"]
__version__: str = _core.VERSION

Vector = tuple[float, float, float]
Pixel = tuple[float, float]

_DROPPED = ("dots", "candidates", "minima", "contours", "places", "findings")
_SCALE_ONE = 1 << 20
# Of a blob (ih_rig_blob.h): from its kind on, and what stands before its CRC.
_RIG_NUMBERS = struct.Struct("<14i")
_RIG_UP, _RIG_UP_AT = struct.Struct("<3i"), 4412


class Rig(NamedTuple):
    """A calibrated camera, with the laser's dots or for depth images; checked by load_rig, parse_rig or depth_rig."""

    blob: bytes
    """The whole rig as bytes, which boards read too."""
    depth_scale: float = 1.0
    """mm per unit of a depth image, 0.01 to 1000."""

    def _numbers(self) -> tuple[int, ...]:
        return _RIG_NUMBERS.unpack_from(self.blob, 12)

    @property
    def kind(self) -> str:
        """"dots" for pictures of laser dots, "range" for depth images."""
        return "range" if self._numbers()[0] else "dots"

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of an image, px."""
        return self._numbers()[1:3]  # type: ignore[return-value]

    @property
    def camera_matrix(self) -> tuple[Vector, Vector, Vector]:
        """As OpenCV has it."""
        fx, fy, cx, cy = (number / 65536 for number in self._numbers()[3:7])
        return (fx, 0.0, cx), (0.0, fy, cy), (0.0, 0.0, 1.0)

    @property
    def distortion(self) -> tuple[float, ...]:
        """OpenCV's k1, k2, p1, p2, k3."""
        return tuple(number / (1 << 24) for number in self._numbers()[7:12])

    @property
    def range_mm(self) -> tuple[int, int]:
        """Nearest and farthest Z."""
        return self._numbers()[12:14]  # type: ignore[return-value]

    @property
    def up(self) -> Vector:
        """Unit vector of the camera frame that points up; (0, -1, 0) of a level camera."""
        x, y, z = (number / (1 << 30) for number in _RIG_UP.unpack_from(self.blob, _RIG_UP_AT))
        return x, y, z

    def __repr__(self) -> str:
        return "<isohead.Rig %s %dx%d, %d to %d mm>" % (self.kind, *self.size, *self.range_mm)


class Hypothesis(NamedTuple):
    """What may be a head, and an ellipse around it in the image."""

    centre_mm: Vector
    """Centre of the head's volume."""
    pixel: Pixel
    """Centre of the ellipse."""
    axes_px: Pixel
    """Its semi-axes, the longer one first."""
    angle_deg: float
    """Of the longer axis, from +u towards +v, 0 to 180."""
    distance_mm: float
    """From the camera to the surface at the ellipse's centre."""
    rejected: str | None
    """None for a head, else why it is none."""
    score: float | None
    """Probability that it is a head, by all frames so far; None with the paper's method alone."""
    frame_score: float | None
    """The same by this frame alone; None for a predicted one."""
    track: int | None
    """The same person's number from frame to frame."""
    sigma_mm: float | None
    """One standard deviation of the centre along each axis; with a track."""
    predicted: bool
    """Not seen in this frame, but carried through it by its track."""


class Alignment(NamedTuple):
    """How the rig has moved against its file (docs/health.md)."""

    state: str
    """"fits", "moved", "lost" or "unknown"."""
    across_px: float | None
    """Mean distance of the labelled dots from their lines."""
    rotation_deg: Vector
    sigma_deg: Vector
    focal_percent: float
    shift_px: Pixel
    depth_known: bool


class Result(NamedTuple):
    """What one frame shows."""

    time_us: int
    hypotheses: tuple[Hypothesis, ...]
    heads: tuple[Hypothesis, ...]
    """The accepted ones, best first."""
    head: Hypothesis | None
    """The selected one."""
    dots: int
    """Detected laser dots."""
    labelled: int
    """Those of them of which is known which of the 361 they are."""
    points: int | None
    """Measured points; range rigs only."""
    rig: Alignment | None
    """Dot rigs only, and not with the paper's method alone."""
    dropped: dict[str, int]
    """What did not fit into a full table, by kind."""


def load_rig(path: str | os.PathLike[str]) -> Rig:
    """The rig of a file, rig.json. An Error says which field is wrong, and what was expected."""
    return _rig(_core.load_rig(path))


def parse_rig(rig: str | Mapping[str, Any]) -> Rig:
    """The same of JSON text, or of a mapping with its fields."""
    return _rig(_core.parse_rig(rig if isinstance(rig, str) else json.dumps(rig)))


def depth_rig(width: int, height: int, fx: float, fy: float, cx: float, cy: float, *,
              distortion: Sequence[float] = (0, 0, 0, 0, 0), near_mm: float = 400, far_mm: float = 4000,
              depth_scale: float = 1, up: Sequence[float] = (0, -1, 0)) -> Rig:
    """The rig of a depth camera by what its maker's software says of it: focal lengths and principal point in pixels.

    depth_scale: mm per unit of its images. up: the unit vector of the camera frame that points up, where it is not level.
    """
    width, height, fx, fy, cx, cy, near_mm, far_mm, depth_scale = map(_finite, (
        "width", "height", "fx", "fy", "cx", "cy", "near_mm", "far_mm", "depth_scale"), (
        width, height, fx, fy, cx, cy, near_mm, far_mm, depth_scale))
    return parse_rig({
        "kind": "range", "image_width": width, "image_height": height, "near_mm": near_mm, "far_mm": far_mm,
        "depth_scale": depth_scale, "camera_matrix": [[fx, 0, cx], [0, fy, cy], [0, 0, 1]],
        "distortion_coefficients": [_finite("distortion", number) for number in distortion],
        "up": [_finite("up", number) for number in up]})


def _finite(name: str, value: Any) -> float:
    """Of Python's or NumPy's kinds of numbers."""
    try:
        number = math.nan if isinstance(value, (str, bytes)) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise Error("%s: %.60r, expected a finite number" % (name, value))
    return number


def _rig(raw: tuple[bytes, int]) -> Rig:
    return Rig(raw[0], raw[1] / _SCALE_ONE)


class Detector:
    """Finds heads in the frames of one camera, one after the other. Each thread needs its own.

    paper: the paper's method alone, each frame on its own.
    """

    def __init__(self, rig: Rig, *, paper: bool = False) -> None:
        self.rig = rig
        self._core = _core.Detector(rig.blob, rig.depth_scale, paper)

    def process(self, image: Any, *, time_us: int, ambient: Any = None, maximum: int = 0) -> Result:
        """Find the heads in a frame.

        image: height x width, uint8 or uint16, a NumPy array or another buffer; it is looked at where it is, slices too,
            and not copied. For a range rig uint16: Z depth, 0 where nothing was measured, in mm or in the rig's unit; depths
            in another unit are converted by each call.
        time_us: when it was taken, from any origin. It tells how far somebody may have moved since the frame before.
        ambient: the last picture with the laser off, not older than 0.2 s, of the same size and type.
        maximum: the grey value of full scale: 1023 for a 10-bit sensor. 0: what the type of image can hold, which is the most.
        """
        return _result(self._core.frame(image, ambient, time_us, maximum), time_us)

    def process_points(self, points_mm: Any, *, time_us: int) -> Result:
        """The same with N points x, y, z in the camera frame, float32 or float64, for a range rig: a few hundred do.
        Points with a number that is not finite are left out.
        """
        return _result(self._core.cloud(points_mm, time_us), time_us)

    def points_mm(self) -> "memoryview[float]":
        """The points of the last frame, 19 x 19 x 3, NaN where there is none; numpy.asarray takes it as it is.

        Of a dot rig by dot, of a range rig a lattice around the likeliest place of a head.
        """
        return memoryview(self._core.points()).cast("d", (19, 19, 3))

    def record(self, file: str = "") -> str:
        """The last frame's record as host_sim --json prints it for a file of this name, to the last byte."""
        return self._core.record(file)  # type: ignore[no-any-return]


def _result(raw: tuple[Any, ...], time_us: int) -> Result:
    found, heads, selected, dots, labelled, points, alignment, dropped = raw
    hypotheses = tuple(map(Hypothesis._make, found))
    return Result(time_us, hypotheses, tuple([hypotheses[index] for index in heads]),
                  None if selected is None else hypotheses[selected], dots, labelled, points,
                  None if alignment is None else Alignment._make(alignment),
                  {kind: count for kind, count in zip(_DROPPED, dropped) if count} if any(dropped) else {})
