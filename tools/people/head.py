"""The head of a body at rest: the truth's ellipsoid, and its radius in every direction for what is worn on it."""

import numpy

from mesh import Caster, make

OUTSIDE_MM = 400.0
INSIDE_MM = 40.0
# Directions of the radius table: the angle round the head (0 is the face) and from the crown down.
ROUND, DOWN = 72, 46
DOWN_MAX = numpy.radians(150.0)


def ear_vertices(model):
    rows = [model.target(side + "-ear-" + name)[0] for side in "lr" for name in
            ("flap-incr", "lobe-incr", "wing-incr", "scale-incr", "scale-vert-incr")]
    return numpy.unique(numpy.concatenate(rows))


def directions(around, down):
    """Unit vectors of the body frame."""
    return numpy.stack([numpy.sin(down) * numpy.sin(around), numpy.cos(down), numpy.sin(down) * numpy.cos(around)],
                       axis=-1)


class Head:
    """Rest frame of the body."""

    def __init__(self, body):
        model = body.model
        carried = model.weights[:, [model.bones.index("head"), model.bones.index("jaw")]].sum(axis=1)
        joint = body.joint("head")
        own = numpy.flatnonzero(carried[:13380] > 0.5)
        top_mm = body.neutral[own, 1].max()
        front = own[(body.neutral[own, 2] > joint[2] + 0.3 * (top_mm - joint[1]))
                     & (abs(body.neutral[own, 0]) < 15.0)]
        self.chin_mm = body.neutral[front, 1].min()
        self.height_mm = top_mm - self.chin_mm
        self.origin = joint + numpy.array([0.0, 0.16 * self.height_mm, 0.0])
        ears = numpy.zeros(len(body.neutral), bool)
        ears[ear_vertices(model)] = True
        faces = model.faces[~ears[model.faces].any(axis=1)]
        faces = faces[carried[faces].min(axis=1) > 0.3]
        self._measure(Caster(make(body.neutral, faces, 1.0)))

    def _cast(self, caster, around, down):
        ways = directions(around, down)
        hits = caster.cast(self.origin + OUTSIDE_MM * ways, -ways)
        # A ray through an ear's gap meets the far side from within.
        return numpy.where(hits.t < OUTSIDE_MM - INSIDE_MM, OUTSIDE_MM - hits.t, numpy.nan)

    def _measure(self, caster):
        self.around = numpy.linspace(-numpy.pi, numpy.pi, ROUND + 1)
        self.down = numpy.linspace(0.0, DOWN_MAX, DOWN)
        around, down = numpy.meshgrid(self.around, self.down, indexing="ij")
        radius = self._cast(caster, around.ravel(), down.ravel()).reshape(around.shape)
        points = self.origin + radius[..., None] * directions(around, down)
        self._fit(points, self._areas(points))
        for row in radius:
            known = numpy.isfinite(row)
            row[~known] = numpy.interp(self.down[~known], self.down[known], row[known])
        # What is left of the ears would be taken for skull.
        ways = directions(around, down) / self.axes_mm
        beside = (abs(around) > 0.8) & (abs(around) < 2.5)
        self.radius_mm = numpy.where(beside, numpy.minimum(radius, 1.02 / numpy.linalg.norm(ways, axis=-1)), radius)

    @staticmethod
    def _areas(points):
        """Of the surface that each point of the table stands for."""
        across, along = numpy.gradient(points, axis=(0, 1))
        return numpy.nan_to_num(numpy.linalg.norm(numpy.cross(across, along), axis=-1))

    def _fit(self, points, weight):
        """Least squares of an ellipsoid with upright axes on skull and face above the line from chin to nape."""
        height, front = points[..., 1] - self.origin[1], points[..., 2] - self.origin[2]
        border = -0.50 * self.height_mm + (0.36 * self.height_mm - front) * 0.47
        use = (height > border) & numpy.isfinite(height)
        used, root = points[use], numpy.sqrt(weight[use] / weight[use].mean())
        centre, axes = self.origin.copy(), numpy.array([75.0, 112.0, 97.0])
        for _ in range(12):
            offset = (used - centre) / axes
            length = numpy.linalg.norm(offset, axis=1, keepdims=True)
            away = length[:, 0] - 1.0
            scale = (axes / numpy.maximum(length, 0.1)).min(axis=1)
            slope = numpy.concatenate([-offset / length / axes, -offset ** 2 / length / axes], axis=1)
            step = numpy.linalg.lstsq(slope * (root * scale)[:, None], -away * root * scale, rcond=None)[0]
            centre = centre + step[:3]
            axes = axes + step[3:]
        self.centre, self.axes_mm = centre, axes

    def radius(self, around, down):
        """Bilinear from the table."""
        around = (around + numpy.pi) % (2.0 * numpy.pi) / (2.0 * numpy.pi) * ROUND
        down = numpy.clip(down / DOWN_MAX * (DOWN - 1), 0.0, DOWN - 1.001)
        i, j = numpy.minimum(around.astype(int), ROUND - 1), down.astype(int)
        a, b = around - i, down - j
        table = self.radius_mm
        return ((1 - a) * ((1 - b) * table[i, j] + b * table[i, j + 1]) +
                a * ((1 - b) * table[i + 1, j] + b * table[i + 1, j + 1]))
