"""Depth images as a sensor of structured light gives them: shadow, steps, noise, holes and false edges."""

import numpy

DISPARITY_STEPS = 8.0  # a pixel of the whole image


class Sensor:
    def __init__(self, rng, rig, step):
        self.baseline_mm = rng.uniform(55.0, 80.0)
        self.side = float(rng.choice([-1.0, 1.0]))
        self.noise_px = rng.uniform(0.05, 0.14) / step
        self.dark_loss = rng.uniform(0.3, 1.0)
        self.edge_px = int(rng.integers(1, 3))
        self.smooth_px = int(rng.integers(0, 2))
        self.near_mm = rng.uniform(400.0, 520.0)
        self.far_mm = rng.uniform(4000.0, 9000.0)
        self.steps = DISPARITY_STEPS * step
        self.focal_px = rig.focal_px[0] / step


def box_mean(image, reach, axis):
    """The mean over 2 * reach + 1 pixels along an axis."""
    padded = numpy.concatenate([image.take([0] * (reach + 1), axis), image, image.take([-1] * reach, axis)], axis)
    total = padded.cumsum(axis)
    count = image.shape[axis]
    high = total.take(range(2 * reach + 1, 2 * reach + 1 + count), axis)
    return (high - total.take(range(count), axis)) / (2 * reach + 1)


def coarse_noise(rng, shape, reach):
    """Noise of unit variance that neighbours share."""
    noise = rng.standard_normal(shape, dtype=numpy.float32)
    for axis in (0, 1):
        noise = box_mean(noise, reach, axis)
    return noise * (2 * reach + 1)


def in_shadow(disparity, side):
    """The projector does not see it: something nearer covers its column of the projector's picture."""
    columns = numpy.arange(disparity.shape[1], dtype=numpy.float32)
    place = columns + side * disparity
    if side > 0:
        return place < numpy.maximum.accumulate(place, axis=1) - 1.0
    return place > numpy.minimum.accumulate(place[:, ::-1], axis=1)[:, ::-1] + 1.0


def measure(sensor, hits, shape, rng):
    """Depths in whole mm, 0 where none is known, of the hits of all pixels' rays (z = 1)."""
    depth = numpy.where(numpy.isfinite(hits.t), hits.t, 1e6).reshape(shape).astype(numpy.float32)
    fuzz = hits.fuzz_mm.reshape(shape).astype(numpy.float32)
    depth = depth + fuzz * abs(coarse_noise(rng, shape, 2)) * 0.8
    product = sensor.focal_px * sensor.baseline_mm
    disparity = product / depth
    hole = in_shadow(disparity, sensor.side)
    # Matching takes one window for all: near an edge the nearer depth spreads, or nothing is known.
    spread = disparity
    for _ in range(sensor.edge_px):
        spread = numpy.maximum(spread, numpy.maximum(numpy.roll(spread, 1, 1), numpy.roll(spread, -1, 1)))
    edge = spread - disparity > 1.5
    takes = coarse_noise(rng, shape, 3) > 0.3
    disparity = numpy.where(edge & takes, spread, disparity)
    hole |= edge & ~takes & (coarse_noise(rng, shape, 1) > -0.5)
    for axis in (0, 1) if sensor.smooth_px else ():
        disparity = numpy.where(edge, disparity, box_mean(disparity, sensor.smooth_px, axis))
    disparity = disparity + sensor.noise_px * coarse_noise(rng, shape, 2)
    disparity = numpy.round(disparity * sensor.steps) / sensor.steps
    measured = product / numpy.maximum(disparity, 1e-3)
    cosine = abs(hits.normal[:, 2]).reshape(shape)
    light = numpy.minimum(1.0, hits.albedo.reshape(shape) / 0.06) * \
                          cosine * (1200.0 / numpy.maximum(depth, 500.0)) ** 1
    weak = light < sensor.dark_loss * (0.22 + 0.12 * coarse_noise(rng, shape, 4))
    far = (measured < sensor.near_mm) | (measured > sensor.far_mm) | ~numpy.isfinite(hits.t).reshape(shape)
    hole |= weak | far
    return numpy.where(hole, 0, numpy.clip(numpy.round(measured), 0, 65535)).astype(numpy.uint16)
