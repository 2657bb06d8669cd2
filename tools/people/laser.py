"""Frames of a dot rig: the picture in ambient light, the dots, the sensor; tools/render's image formation."""

import dataclasses

import numpy

from noise import hash_unit
from rig import DOTS, ROWS, WIDTH

# The bundle of rays of a dot, as in tools/render/rd_dots.c.
INNER, OUTER = 6, 8
SUBS = 1 + INNER + OUTER
NOMINAL_SIGMA_PX = 1.2
REACH_PX = 7
NOWHERE_MM = 1500.0
SPECKLE_MM = 0.5
VISIBLE_GREY = 6.0
HOT_PER_PIXEL = 1.2e-4
ALBEDO_MIN = 0.01
NOMINAL_MM = 850.0


class Laser:
    def __init__(self, rng, rig):
        self.power_grey = rng.uniform(105.0, 180.0)
        self.optics_px = rng.uniform(0.80, 0.98) * max(0.9, numpy.sqrt(rig.width / WIDTH))
        self.field_blur = rng.uniform(0.05, 0.35)
        self.beam_mm = rng.uniform(0.45, 0.75)
        self.divergence = rng.uniform(1e-4, 3e-4)
        self.speckle = rng.uniform(0.15, 0.45)
        self.seed = int(rng.integers(2 ** 62))
        index = numpy.arange(DOTS)
        row, column = index // ROWS - ROWS // 2, index % ROWS - ROWS // 2
        self.gain = rng.uniform(0.85, 1.15, DOTS) * (1.0 - 0.2 * (row ** 2 + column ** 2) / 162.0)
        self.gain[DOTS // 2] *= 1.4
        self.missing, self.lit = 0.0, numpy.ones(DOTS, dtype=bool)

    def lose(self, fraction, rng):
        """So many dots are not there."""
        self.missing = fraction
        self.lit = rng.random(DOTS) >= fraction


class Sensor:
    def __init__(self, rng, rig):
        read, photon = rng.uniform(1.0, 2.0), rng.uniform(0.035, 0.065)
        self.offset_grey = rng.uniform(2.0, 6.0)
        self.noise = numpy.sqrt(read ** 2 + photon * numpy.arange(256)).astype(numpy.float32)
        count = int(HOT_PER_PIXEL * rig.width * rig.height)
        self.hot_pixels = rng.integers(rig.width * rig.height, size=count)
        self.hot_grey = 10.0 + 150.0 * rng.uniform(size=count) ** 2

    def expose(self, grey, rng):
        light = grey.astype(numpy.float32) + numpy.float32(self.offset_grey)
        noise = self.noise[numpy.clip(light, 0, 255).astype(numpy.uint8)]
        value = light + noise * rng.standard_normal(grey.shape, dtype=numpy.float32)
        samples = numpy.clip(numpy.floor(value + 0.5), 0, 255)
        flat = samples.ravel()
        flat[self.hot_pixels] = numpy.clip(numpy.floor(flat[self.hot_pixels] + self.hot_grey + 0.5), 0, 255)
        return samples.astype(numpy.uint8)


class Light:
    """Ambient light, as tools/render/rd_light.c draws it; the exposure suits what is `distance_mm` away."""

    def __init__(self, rng, distance_mm):
        kind = rng.choice(3, p=(0.40, 0.45, 0.15))
        strength = rng.uniform(*((0.3, 0.9), (1.0, 2.0), (1.6, 2.6))[kind])
        self.exposure = float(numpy.clip((distance_mm / NOMINAL_MM) ** 1.5, 0.4, 3.5))
        # Far dots need a room that is not bright.
        strength *= self.exposure * min(1.0, (NOMINAL_MM / distance_mm) ** 2.5)
        azimuth, height = rng.uniform(-1.3, 1.3), rng.uniform(0.1, 1.1)
        self.sky = strength * rng.uniform(25.0, 60.0)
        self.key = strength * rng.uniform(20.0, 70.0) * (rng.uniform(2.0, 4.0) if kind == 2 else 1.0)
        self.lamp = strength * rng.uniform(0.0, 25.0)
        self.key_dir = numpy.array([numpy.sin(azimuth) * numpy.cos(height), -numpy.sin(height),
                                    -numpy.cos(azimuth) * numpy.cos(height)])
        self.slope = numpy.array([rng.uniform(-0.5, 0.5), rng.uniform(-0.4, 0.4), rng.uniform(-0.25, 0.1)])
        self.nothing = strength * rng.uniform(0.0, 14.0)

    def grey(self, hits, rays):
        """Of the hits of rays with z = 1 from the camera."""
        t = numpy.where(numpy.isfinite(hits.t), hits.t, 1000.0)
        points = rays * t[:, None]
        normal = hits.normal
        view = rays / numpy.linalg.norm(rays, axis=1, keepdims=True)
        lamp = self.lamp * numpy.maximum(0.0, -(normal * view).sum(axis=1)) / numpy.maximum(0.3, 1e-3 * t) ** 2
        even = numpy.clip(1.0 + (1e-3 * points - [0.0, 0.0, 1.0]) @ self.slope, 0.25, 2.0)
        key = self.key * numpy.maximum(0.0, normal @ self.key_dir)
        grey = even * hits.albedo * (self.sky * (0.65 - 0.35 * normal[:, 1]) + key + lamp)
        return numpy.where(numpy.isfinite(hits.t), grey, self.nothing)


def soften(grey):
    """1-2-1 in both directions: no lens resolves single pixels."""
    for axis in (0, 1):
        padded = numpy.concatenate([grey.take([0], axis), grey, grey.take([-1], axis)], axis)
        count = grey.shape[axis]
        grey = 0.25 * (padded.take(range(count), axis) + padded.take(range(2, count + 2), axis)) + 0.5 * grey
    return grey


def sub_rays(rays, sigma):
    """(dots, SUBS, 3) unit vectors and their parts of the light."""
    inner = 2.0 * numpy.pi * numpy.arange(1, INNER + 1) / INNER
    outer = 2.0 * numpy.pi * (numpy.arange(INNER + 1, SUBS) + 0.5) / OUTER
    angle = numpy.concatenate([[0.0], inner, outer])
    away = numpy.concatenate([[0.0], numpy.full(INNER, 1.12), numpy.full(OUTER, 2.13)])
    part = numpy.concatenate([[0.20], numpy.full(INNER, 0.50 / INNER), numpy.full(OUTER, 0.30 / OUTER)])
    across = numpy.cross(rays, [0.0, 1.0, 0.0])
    across /= numpy.linalg.norm(across, axis=1, keepdims=True)
    other = numpy.cross(rays, across)
    shift = across[:, None] * (away * numpy.cos(angle))[:, None] + other[:, None] * (away * numpy.sin(angle))[:, None]
    ways = rays[:, None] + sigma[:, None, None] * shift
    return ways / numpy.linalg.norm(ways, axis=2, keepdims=True), part


@dataclasses.dataclass
class Spots:
    dot: numpy.ndarray
    u_px: numpy.ndarray
    v_px: numpy.ndarray
    sum_grey: numpy.ndarray
    sigma_px: numpy.ndarray


def add_spots(grey, spots):
    height, width = grey.shape
    reach = numpy.arange(-REACH_PX, REACH_PX + 1)
    u0, v0 = numpy.floor(spots.u_px + 0.5).astype(int), numpy.floor(spots.v_px + 0.5).astype(int)
    narrow = -0.5 / spots.sigma_px ** 2
    peak = spots.sum_grey / (2.0 * numpy.pi * spots.sigma_px ** 2)
    us, vs = u0[:, None] + reach, v0[:, None] + reach
    across = numpy.exp(narrow[:, None] * (us - spots.u_px[:, None]) ** 2) * ((us >= 0) & (us < width))
    along = peak[:, None] * numpy.exp(narrow[:, None] * (vs - spots.v_px[:, None]) ** 2) * ((vs >= 0) & (vs < height))
    places = numpy.clip(vs, 0, height - 1)[:, :, None] * width + numpy.clip(us, 0, width - 1)[:, None, :]
    values = along[:, :, None] * across[:, None, :]
    grey += numpy.bincount(places.ravel(), values.ravel(), grey.size).reshape(grey.shape)


def own_peaks(spots, count, u_px, v_px):
    """The brightest of the nine pixels around each dot's middle, of its own light."""
    u0, v0 = numpy.floor(u_px + 0.5), numpy.floor(v_px + 0.5)
    best = numpy.zeros(count)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            du, dv = u0[spots.dot] + right - spots.u_px, v0[spots.dot] + down - spots.v_px
            value = spots.sum_grey / (2.0 * numpy.pi * spots.sigma_px ** 2) * numpy.exp(
                -0.5 * (du * du + dv * dv) / spots.sigma_px ** 2)
            best = numpy.maximum(
    best,
    numpy.bincount(
        spots.dot,
        numpy.where(
            numpy.isfinite(value),
            value,
            0.0),
             count))
    return best


def cast_dots(rig, laser, exposure, cast, grey, rng):
    """Adds the dots' light to the picture. The visible dots: index, u, v, z and the tag of what they hit."""
    hits = cast(rig.projector_mm, rig.dot_rays)
    sigma = laser.beam_mm / numpy.where(numpy.isfinite(hits.t), hits.t, NOWHERE_MM) + laser.divergence
    ways, part = sub_rays(rig.dot_rays, sigma)
    ways = ways.reshape(-1, 3)
    dot, sub = numpy.repeat(numpy.arange(DOTS), SUBS), numpy.tile(numpy.arange(SUBS), DOTS)
    hits = cast(rig.projector_mm, ways)
    found = numpy.isfinite(hits.t)
    # Hair and fur let light in before they send it back: a depth of its own for every dot, and some for its rays.
    depth = rng.normal(0.0, 0.8, DOTS)[dot] + rng.normal(0.0, 0.6, len(dot))
    t = numpy.where(found, hits.t, 0.0)
    surface = rig.projector_mm + ways * t[:, None]
    points = rig.projector_mm + ways * (t + hits.fuzz_mm * abs(depth))[:, None]
    length = numpy.maximum(numpy.linalg.norm(points, axis=1), 1.0)
    cosine = -(hits.normal * points).sum(axis=1) / length
    found &= (points[:, 2] > 1.0) & (cosine > 0.02)
    to_surface = cast(numpy.zeros(3), surface)
    found &= to_surface.t > 1.0 - 1.0 / length
    safe = numpy.where(found[:, None], points, [0.0, 0.0, 1000.0])
    found &= numpy.hypot(safe[:, 0], safe[:, 1]) < 0.8 * safe[:, 2]
    u_px, v_px = rig.project(numpy.where(found[:, None], points, [0.0, 0.0, 1000.0]))
    flat = hash_unit(laser.seed, numpy.floor(points[:, 2] / SPECKLE_MM), dot, sub)
    gain = 1.0 - laser.speckle - laser.speckle * numpy.log(1.0 - flat)
    power = exposure * laser.power_grey * laser.gain[dot] * laser.lit[dot] * 2.0 * numpy.pi * NOMINAL_SIGMA_PX ** 2 * part[sub] * gain
    sum_grey = power * numpy.maximum(ALBEDO_MIN, hits.albedo) * cosine / (1e-3 * length) ** 2
    x, y = (u_px - rig.centre_px[0]) / rig.centre_px[0], (v_px - rig.centre_px[1]) / rig.centre_px[0]
    sigma_px = laser.optics_px * (1.0 + laser.field_blur * (x * x + y * y))
    inside = (u_px > -REACH_PX) & (u_px < rig.width + REACH_PX) & (v_px > -REACH_PX) & (v_px < rig.height + REACH_PX)
    middle = numpy.arange(DOTS) * SUBS
    seen = found & inside
    spots = Spots(dot[seen], u_px[seen], v_px[seen], sum_grey[seen], sigma_px[seen])
    add_spots(grey, spots)
    u, v, z = u_px[middle], v_px[middle], points[middle, 2]
    visible = found[middle] & (u >= -0.5) & (v >= -0.5) & (u <= rig.width - 0.5) & (v <= rig.height - 0.5)
    visible &= own_peaks(spots, DOTS, u, v) >= VISIBLE_GREY
    index = numpy.flatnonzero(visible)
    return index, u[index], v[index], z[index], hits.tag[middle][index]
