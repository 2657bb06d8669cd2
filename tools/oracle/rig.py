"""Float64 reference of the rig: lens, projector rays, epipolar lines.

A rig here is made of the same integers that the firmware gets (struct ih_calibration), so that a
difference is the firmware's arithmetic and not the rounding of the calibration.
"""

import numpy as np
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

import emit

GRID = 19
SLOTS = GRID * GRID
RIG_DOTS, RIG_RANGE = 0, 1


def to_q(value, fraction_bits):
    return np.rint(np.asarray(value, dtype=float) * 2.0**fraction_bits).astype(np.int64)


def from_q(value, fraction_bits):
    return np.asarray(value, dtype=float) / 2.0**fraction_bits


class Rig:
    def __init__(self, name, size, focal, principal, lens, near_far, origin=(0, 0, 0), rays=None):
        self.name = name
        self.width, self.height = size
        self.near_mm, self.far_mm = near_far
        self.focal_q16 = to_q(focal, 16)
        self.principal_q16 = to_q(principal, 16)
        self.lens_q24 = to_q(lens, 24)
        self.origin_q16 = to_q(origin, 16)
        self.kind = RIG_RANGE if rays is None else RIG_DOTS
        self.rays_q30 = np.zeros((SLOTS, 3), np.int64) if rays is None else to_q(rays, 30)

    @property
    def focal(self):
        return from_q(self.focal_q16, 16)

    @property
    def principal(self):
        return from_q(self.principal_q16, 16)

    @property
    def lens(self):
        return from_q(self.lens_q24, 24)

    def distort(self, x, y):
        """Normalised coordinates -> frame pixels: OpenCV's model with k1 k2 p1 p2 k3."""
        k1, k2, p1, p2, k3 = self.lens
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        return self.focal[0] * xd + self.principal[0], self.focal[1] * yd + self.principal[1]

    def undistort(self, u, v):
        """Frame pixels -> normalised coordinates: the root of distort, followed outwards from the
        principal point so that it stays on the branch that the lens really has."""
        target = (np.array([u, v]) - self.principal) / self.focal
        position = np.zeros(2)
        for part in np.linspace(0, 1, 9)[1:]:
            def miss(p, goal=target * part):
                uv = np.array(self.distort(p[0], p[1]))
                return (uv - self.principal) / self.focal - goal
            position, _, found, message = fsolve(miss, position, xtol=1e-14, full_output=True)
            if found != 1 and np.abs(miss(position)).max() > 1e-12:
                raise ValueError("%s: no inverse at %g, %g: %s" % (self.name, u, v, message))
        return position

    def tangents(self):
        """x and y of every dot at infinity, and its shift times depth."""
        rays = from_q(self.rays_q30, 30)
        origin = from_q(self.origin_q16, 16)
        tangent = rays[:, :2] / rays[:, 2:]
        return tangent, origin[:2] - origin[2] * tangent

    def dot_at(self, slot, depth_mm):
        tangent, offset = self.tangents()
        return tangent[slot] + offset[slot] / np.asarray(depth_mm)[..., None]

    def lines(self):
        """infinity (u, v), direction (u, v) and length |e| of all dots, undistorted pixels."""
        tangent, offset = self.tangents()
        infinity = tangent * self.focal + self.principal
        shift = offset * self.focal
        length = np.hypot(shift[:, 0], shift[:, 1])
        return infinity, shift / length[:, None], length

    def initialiser(self):
        """The rig as the body of a struct ih_calibration."""
        kind = "IH_RIG_DOTS" if self.kind == RIG_DOTS else "IH_RIG_RANGE"
        head = [".kind = %s" % kind,
                ".width = %d, .height = %d" % (self.width, self.height),
                ".fx_px_q16 = %d, .fy_px_q16 = %d" % tuple(self.focal_q16),
                ".cx_px_q16 = %d, .cy_px_q16 = %d" % tuple(self.principal_q16),
                ".k1_q24 = %d, .k2_q24 = %d, .p1_q24 = %d, .p2_q24 = %d, .k3_q24 = %d"
                % tuple(self.lens_q24),
                ".near_mm = %d, .far_mm = %d" % (self.near_mm, self.far_mm)]
        text = ",\n     ".join(head)
        if self.kind == RIG_DOTS:
            rays = emit.wrap(["{%d, %d, %d}" % tuple(r) for r in self.rays_q30], "         ")
            text += ",\n     .origin_mm_q16 = {%d, %d, %d}" % tuple(self.origin_q16)
            text += ",\n     .ray_q30 = {\n%s     }" % rays
        return text


def pattern(step=0.02967, rotation_deg=3.0128, toe_in_rad=0.0156, tip_rad=0.0):
    """Rays of a beam splitter: direction cosines on a square lattice that is rotated in its plane,
    then seen in the camera's frame."""
    index = np.arange(SLOTS)
    column, row = index % GRID - GRID // 2, index // GRID - GRID // 2
    c, s = np.cos(np.radians(rotation_deg)), np.sin(np.radians(rotation_deg))
    x, y = step * (c * column - s * row), step * (s * column + c * row)
    rays = np.stack([x, y, np.sqrt(1 - x * x - y * y)], axis=1)
    c, s = np.cos(toe_in_rad), np.sin(toe_in_rad)
    about_y = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    c, s = np.cos(tip_rad), np.sin(tip_rad)
    about_x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return rays @ about_y.T @ about_x.T


def paper():
    return Rig("paper", (752, 582), (920.8, 943.8), (375.5, 290.5),
               (-0.17847, 0.06336, 0.000524, -0.000353, 0), (400, 2600),
               (12.49847, 0, 0.19529), pattern())


def wide():
    return Rig("wide", (752, 582), (920.8, 943.8), (375.5, 290.5),
               (-0.14791, 0.04788, 0.000135, -0.000493, 0), (400, 2600),
               (123.5015, 0, 19.29711), pattern(toe_in_rad=0.155))


def dot_rigs():
    """Paper and wide first; then rigs chosen to be unlike them and unlike each other."""
    return [
        paper(),
        wide(),
        Rig("no distortion, least frame", (320, 240), (300, 310), (161.25, 118.75), (0,) * 5,
            (100, 16000), (-60, 2.5, -8), pattern(toe_in_rad=-0.05)),
        Rig("barrel with k3, largest frame", (1280, 800), (760, 757), (655.3, 391.1),
            (-0.30, 0.12, 0.0007, -0.0009, -0.02), (300, 6000), (30, -20, 4), pattern()),
        Rig("pincushion, tangential", (640, 480), (520, 530), (310, 250),
            (0.25, 0.05, 0.004, -0.003, 0.01), (250, 4000), (0, 75, 0),
            pattern(rotation_deg=-20, toe_in_rad=0, tip_rad=0.1)),
        Rig("principal point off centre", (800, 600), (1400, 1380), (150, 520),
            (-0.1, 0, 0, 0, 0), (500, 3000), (-20, -20, 10),
            pattern(step=0.012, rotation_deg=87, toe_in_rad=-0.1)),
        Rig("barrel near its fold", (1280, 800), (1000, 1000), (639.5, 399.5),
            (-0.25, 0, 0, 0, 0), (400, 2600), (50, 0, 0), pattern()),
    ]


PROBE_SLOTS = [0, 18, 342, 360] + list(range(7, SLOTS, 29))


def probe_positions(rig, random):
    """Corners, a lattice and random positions of the frame, Q12."""
    u = np.linspace(0, rig.width - 1, 7)
    v = np.linspace(0, rig.height - 1, 5)
    lattice = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    free = random.uniform(0, 1, (25, 2)) * [rig.width - 1, rig.height - 1]
    return to_q(np.concatenate([lattice, free]), 12)


# (rig, tilt, roll): the camera looks down by the tilt; heads' tops tip to the right by the roll, degrees.
MOUNTS = [(0, 0, 90), (0, 0, 180), (1, 30, 0), (1, -20, -90), (2, 45, 15), (3, 44.9, 200), (4, 60, -120), (5, -70, 45),
          (6, 45.1, -1)]
TILT_MAX_DEG = 45
TAN_MAX = 2.0


class Level:
    """The level frame of a camera, by Euler angles; up is rounded as the firmware gets it."""

    def __init__(self, rig, tilt_deg, roll_deg):
        exact = Rotation.from_euler("xz", [tilt_deg, roll_deg], degrees=True).apply([0.0, -1.0, 0.0])
        self.rig, self.up_q30 = rig, to_q(exact, 30)
        taken = min(max(tilt_deg, -TILT_MAX_DEG), TILT_MAX_DEG)
        self.to_camera = Rotation.from_euler("xz", [taken, roll_deg], degrees=True)

    def point(self, x, y):
        """The direction in the level frame, and a depth of 1 there; None out of view."""
        right, down, forward = self.to_camera.inv().apply([x, y, 1.0])
        is_seen = forward > 0.125 and max(abs(right), abs(down)) <= TAN_MAX * forward
        return (right / forward, down / forward, forward) if is_seen else None

    def project(self, point):
        """Undistorted pixels of a point of the level frame."""
        x, y, z = self.to_camera.apply(point)
        return self.rig.focal * np.array([x, y]) / z + self.rig.principal

    def ellipse(self, centre, covariance):
        """Semi-axes and angle of a point's spread in the picture, to first order."""
        step = 1e-3
        slopes = np.array([(self.project(centre + step * e) - self.project(centre - step * e)) / (2 * step)
                           for e in np.eye(3)])
        values, vectors = np.linalg.eigh(slopes.T @ covariance @ slopes)
        angle = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])) % 180
        return 2 * np.sqrt(values[1]), 2 * np.sqrt(values[0]), angle


def write_level(directory):
    random = np.random.default_rng(22)
    inc = emit.Inc("Cameras that do not hang level, in float64.")
    mounts, rotated, dots, ellipses = [], [], [], []
    for index, (number, tilt, roll) in enumerate(MOUNTS):
        rig = dot_rigs()[number]
        level = Level(rig, tilt, roll)
        rows = level.to_camera.inv().as_matrix()
        origin = level.to_camera.inv().apply(from_q(rig.origin_q16, 16))
        mounts.append("%d, {%s}, {%s}, {%s}" % (
            number, ", ".join(emit.numbers(level.up_q30)), ", ".join(emit.numbers(rows.ravel(), 10)),
            ", ".join(emit.numbers(origin, 6))))
        for x, y in to_q(random.uniform(-1.2, 1.2, (12, 2)), 28):
            found = level.point(from_q(x, 28), from_q(y, 28))
            rotated.append("%d, %d, %d, %d, %s" % (index, x, y, found is not None,
                                                  ", ".join(emit.numbers(found or (0, 0, 0), 10))))
        for slot in PROBE_SLOTS:
            depth_mm = random.uniform(rig.near_mm, rig.far_mm)
            ray, centre = from_q(rig.rays_q30[slot], 30), from_q(rig.origin_q16, 16)
            ray, centre = level.to_camera.inv().apply(ray), level.to_camera.inv().apply(centre)
            place = (centre + ray * (depth_mm - centre[2]) / ray[2])[:2] / depth_mm if ray[2] > 0.3 else [9, 9]
            if max(abs(place)) < TAN_MAX and max(abs(ray[:2])) < TAN_MAX * ray[2]:
                pixel = level.to_camera.apply([place[0], place[1], 1.0])
                pixel = rig.distort(*(pixel[:2] / pixel[2]))
                dots.append("%d, %d, %d, %s" % (index, slot, to_q(depth_mm, 8), ", ".join(
                    emit.numbers(ray[:2] / ray[2], 8) + emit.numbers(place, 8) + emit.numbers(pixel, 4))))
        for _ in range(4):
            depth_mm, axes_mm = random.uniform(500, 2000), random.uniform(70, 130, 3)
            x, y = random.uniform(-0.2, 0.2, 2)
            right, down, _ = level.to_camera.inv().apply([x, y, 1.0]) / level.to_camera.inv().apply([x, y, 1.0])[2]
            centre = np.array([right, down, 1.0]) * depth_mm
            found = level.ellipse(centre, np.diag(axes_mm ** 2) / 4)
            ellipses.append("%d, {%s}, {%s}, %s" % (
                index, ", ".join(emit.numbers(centre, 4)), ", ".join(emit.numbers(axes_mm, 4)),
                ", ".join(emit.numbers(found, 5))))
    inc.struct_array("vector_mount", "vector_mounts", mounts)
    inc.struct_array("vector_rotated", "vector_rotated", rotated)
    inc.struct_array("vector_level_dot", "vector_level_dots", dots)
    inc.struct_array("vector_level_ellipse", "vector_level_ellipses", ellipses)
    return inc.write(directory, "level.inc")


def write_vectors(directory):
    random = np.random.default_rng(21)
    inc = emit.Inc("Calibrations, and their lines and lens in float64.")
    inc.struct_array("ih_calibration", "vector_rigs", [r.initialiser() for r in dot_rigs()])
    size = inc.write(directory, "rigs.inc")

    inc = emit.Inc("Lines and lens of the rigs in rigs.inc, in float64.")
    lines, lens = [], []
    for index, rig in enumerate(dot_rigs()):
        infinity, direction, length = rig.lines()
        far = [rig.distort(*p) for p in rig.dot_at(np.arange(SLOTS), np.full(SLOTS, rig.far_mm))]
        near = [rig.distort(*p) for p in rig.dot_at(np.arange(SLOTS), np.full(SLOTS, rig.near_mm))]
        for slot in PROBE_SLOTS:
            lines.append("%d, %d, %s" % (index, slot, ", ".join(
                emit.numbers(infinity[slot], 6) + emit.numbers(direction[slot], 10)
                + [emit.number(length[slot], 5)] + emit.numbers(far[slot], 6)
                + emit.numbers(near[slot], 6))))
        for u, v in probe_positions(rig, random):
            x, y = rig.undistort(from_q(u, 12), from_q(v, 12))
            lens.append("%d, %d, %d, %s" % (index, u, v, ", ".join(emit.numbers((x, y), 11))))
    inc.struct_array("vector_line", "vector_lines", lines)
    inc.struct_array("vector_lens", "vector_lens", lens)
    return size + inc.write(directory, "rig.inc") + write_level(directory)
