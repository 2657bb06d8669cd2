"""The rigs: camera, lens, projector, laser and sensor, as tools/render draws them by seed."""

import dataclasses
import json
import os

import numpy

ROWS = 19
DOTS = ROWS * ROWS
MEET_MM = 800.0
# The pictures of the paper's camera, in pixels.
WIDTH, HEIGHT = 752, 582
UNDISTORT_STEPS = 12
# The nearest surface that is measured: the nose of a head whose middle is at 450 mm.
NEAR_MM = 320.0
# name: baseline, projector's direction from the camera (degrees: 0 right, 90 above), pitch of the dots in degrees
KINDS = {
    "paper": (12.5, 0.0, 1.7),
    "wide": (125.0, 0.0, 1.7),
    "b40": (40.0, 0.0, 1.7),
    "b60": (60.0, 0.0, 1.7),
    "b250": (250.0, 0.0, 1.7),
    "above": (60.0, 90.0, 1.7),
    "p12": (12.5, 0.0, 1.2),
    "p25": (12.5, 0.0, 2.5),
}


@dataclasses.dataclass
class Rig:
    width: int
    height: int
    focal_px: tuple
    centre_px: tuple
    lens: tuple
    near_mm: float
    far_mm: float
    projector_mm: numpy.ndarray = None
    dot_rays: numpy.ndarray = None
    up: numpy.ndarray = None

    def distort(self, x, y):
        k1, k2, p1, p2, k3 = self.lens
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        return (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y)

    def project(self, points):
        """Pixels of points (n, 3) with z > 0."""
        x, y = self.distort(points[:, 0] / points[:, 2], points[:, 1] / points[:, 2])
        return self.focal_px[0] * x + self.centre_px[0], self.focal_px[1] * y + self.centre_px[1]

    def pixel_rays(self, step=1):
        """(height / step, width / step, 3) through the middles of squares of `step` pixels, with z = 1."""
        middle = 0.5 * (step - 1)
        u, v = numpy.meshgrid(numpy.arange(0, self.width, step) + middle, numpy.arange(0, self.height, step) + middle)
        xd, yd = (u - self.centre_px[0]) / self.focal_px[0], (v - self.centre_px[1]) / self.focal_px[1]
        x, y = xd.copy(), yd.copy()
        for _ in range(UNDISTORT_STEPS):
            bent_x, bent_y = self.distort(x, y)
            x += xd - bent_x
            y += yd - bent_y
        return numpy.stack([x, y, numpy.ones_like(x)], axis=-1)

    def pattern_place(self, point_mm):
        """Row and column of a point in the pattern, 0 in the middle."""
        middle = DOTS // 2
        across = 0.5 * (self.dot_rays[middle + 1] - self.dot_rays[middle - 1])
        down = 0.5 * (self.dot_rays[middle + ROWS] - self.dot_rays[middle - ROWS])
        direction = point_mm - self.projector_mm
        direction = direction / numpy.linalg.norm(direction)
        return direction @ down / (down @ down), direction @ across / (across @ across)


def dots_rig(kind, rng, width):
    baseline_mm, direction_deg, pitch_deg = KINDS[kind]
    lens = (rng.uniform(-0.18, -0.14), rng.uniform(0.045, 0.08), rng.uniform(-5.5e-4, 5.5e-4),
            rng.uniform(-5.5e-4, 5.5e-4), 0.0)
    toe_in = numpy.arctan(baseline_mm / MEET_MM)
    across = numpy.radians(pitch_deg) / numpy.sqrt(1.0 + (1.0 / ROWS) ** 2)
    down = across / ROWS
    index = numpy.arange(DOTS)
    row, column = index // ROWS - ROWS // 2, index % ROWS - ROWS // 2
    x, y = column * across - row * down, column * down + row * across
    rays = numpy.stack([x, y, numpy.sqrt(1.0 - x * x - y * y)], axis=1)
    # Towards the camera's axis: about the axis across the baseline.
    angle = numpy.radians(direction_deg)
    beside = numpy.array([numpy.cos(angle), -numpy.sin(angle), 0.0])
    forward = numpy.array([0.0, 0.0, 1.0])
    other = numpy.cross(forward, beside)
    cosine, sine = numpy.cos(toe_in), numpy.sin(toe_in)
    towards = (numpy.outer(cosine * beside + sine * forward, beside) + numpy.outer(other, other) +
               numpy.outer(cosine * forward - sine * beside, forward))
    projector = baseline_mm * (cosine * beside + sine * forward)
    zoom, height = width / WIDTH, round(width * HEIGHT / WIDTH)
    return Rig(width, height, (920.8 * zoom, 943.8 * zoom), (0.5 * (width - 1), 0.5 * (height - 1)), lens,
               NEAR_MM, 2600.0, projector, rays @ towards.T)


def range_rig(rng):
    """Sensors of structured light in one of three usual forms."""
    width, height, focal = ((640, 480, 525.0), (640, 480, 575.0), (640, 480, 390.0))[rng.choice(3, p=(0.7, 0.2, 0.1))]
    centre = (0.5 * (width - 1) + rng.uniform(-6.0, 6.0), 0.5 * (height - 1) + rng.uniform(-6.0, 6.0))
    return Rig(width, height, (focal, focal), centre, (0.0,) * 5, 400.0, 10000.0)


def matrix(rows, columns, values):
    return {"type_id": "opencv-matrix", "rows": rows, "cols": columns, "dt": "d",
            "data": [float(value) for value in numpy.ravel(values)]}


def write(rig, directory):
    (fx, fy), (cx, cy) = rig.focal_px, rig.centre_px
    fields = {
        "kind": "range" if rig.dot_rays is None else "dots",
        "image_width": rig.width,
        "image_height": rig.height,
        "camera_matrix": matrix(3, 3, [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]),
        "distortion_coefficients": matrix(1, 5, rig.lens),
    }
    if rig.dot_rays is not None:
        fields["projector_origin"] = matrix(3, 1, rig.projector_mm)
        fields["dot_rays"] = matrix(DOTS, 3, rig.dot_rays)
    fields.update(near_mm=rig.near_mm, far_mm=rig.far_mm)
    if rig.up is not None:
        fields["up"] = [float(value) for value in rig.up]
    with open(os.path.join(directory, "rig.json"), "w", encoding="utf-8") as file:
        json.dump(fields, file)
        file.write("\n")
