"""Hands: where they go, by inverse kinematics in the chest's rest frame, and what they hold."""

import numpy

import things
from body import rotation
from hair import ball
from mesh import HELD, make
from motion import smoothstep

X, Y, Z = numpy.eye(3)
# Near the head: offset of the palm from the head's middle in its semi-axes, fingers' and palm's directions, curl.
# For the left hand; x turns with the side.
PLACES = {
    "chin": ((0.15, -0.95, 1.15), (-0.5, 0.8, -0.3), (0.0, 0.3, -1.0), 0.7),
    "cheek": ((0.75, -0.35, 0.95), (-0.1, 0.9, -0.3), (-0.8, 0.0, -0.5), 0.25),
    "mouth": ((0.2, -0.45, 1.35), (-0.9, 0.35, -0.2), (0.0, 0.0, -1.0), 0.3),
    "eyes": ((0.5, 0.1, 1.3), (-0.4, 0.9, -0.1), (0.0, 0.0, -1.0), 0.3),
    "brow": ((0.4, 0.55, 1.25), (-0.9, 0.3, -0.3), (0.0, -0.9, -0.4), 0.1),
    "ear": ((1.35, -0.1, 0.25), (0.1, 0.9, -0.1), (-1.0, 0.0, 0.0), 0.8),
    "before": ((0.4, -0.1, 3.2), (-0.2, 1.0, 0.1), (0.0, 0.0, 1.0), 0.1),
    "wave": ((2.4, 0.2, 1.0), (0.1, 1.0, 0.0), (0.0, 0.0, 1.0), 0.1),
    "top": ((0.5, 1.3, 0.4), (-0.9, -0.1, -0.2), (0.0, -1.0, 0.0), 0.3),
    "point": ((0.8, -0.8, 3.6), (-0.1, 0.2, 1.0), (0.0, -1.0, 0.0), 0.6),
}
SIDES = {"L": 1.0, "R": -1.0}


def reach(body, side, palm_mm, fingers, palm, elbow_out):
    """Directions of upper and lower arm that bring the palm there; the chest's rest frame."""
    sign = SIDES[side]
    shoulder, elbow = body.joint("upperarm01." + side), body.joint("lowerarm01." + side)
    wrist, knuckle = body.joint("wrist." + side), body.joint("finger3-1." + side)
    fingers = fingers / numpy.linalg.norm(fingers)
    target = palm_mm - 0.6 * numpy.linalg.norm(knuckle - wrist) * fingers - shoulder
    upper, lower = numpy.linalg.norm(elbow - shoulder), numpy.linalg.norm(wrist - elbow)
    length = numpy.clip(numpy.linalg.norm(target), abs(upper - lower) + 15.0, upper + lower - 3.0)
    ahead = target / numpy.linalg.norm(target)
    along = (upper ** 2 - lower ** 2 + length ** 2) / (2.0 * length)
    hint = numpy.array([sign * elbow_out, -1.0, -0.25])
    hint -= ahead * (hint @ ahead)
    hint /= numpy.linalg.norm(hint)
    bend = along * ahead + numpy.sqrt(max(0.0, upper ** 2 - along ** 2)) * hint
    return bend, length * ahead - bend, fingers, palm


def near_head(person, side, name, shift):
    """The hand at one of PLACES."""
    offset, fingers, palm, curl = PLACES[name]
    mirror = numpy.array([SIDES[side], 1.0, 1.0])
    at = person.head.centre + (numpy.array(offset) + shift) * person.head.axes_mm * mirror
    return (*reach(person.body, side, at, numpy.array(fingers) * mirror, numpy.array(palm) * mirror, 0.8), curl)


def holding(person, side, at, wide_mm):
    """The hand at a thing's side edge, palm inwards."""
    sign = SIDES[side]
    place = at + numpy.array([sign * wide_mm, 0.0, 0.0])
    return (*reach(person.body, side, place,
            numpy.array([-0.1 * sign, 0.6, 0.7]), numpy.array([-sign, 0.0, 0.0]), 0.7), 0.6)


class Gestures:
    """Hands that go to the head and back, each in its own time."""

    def __init__(self, rng, frames):
        self.events = []
        for side in SIDES:
            frame = rng.uniform(-12.0, 6.0)
            while frame < frames:
                stay = rng.uniform(5.0, 16.0)
                name = sorted(PLACES)[rng.integers(len(PLACES))]
                if rng.random() < 0.75:
                    self.events.append((side, name, frame, frame + stay, rng.normal(0.0, 0.12, 3)))
                frame += stay + rng.uniform(3.0, 12.0)

    def at(self, person, frame):
        hands, names = {}, []
        for side, name, first, end, shift in self.events:
            there = smoothstep(first - 3.0, first, frame) * smoothstep(end + 3.0, end, frame)
            if there > 0.05:
                sway = 0.06 * numpy.sin(numpy.array([1.1, 0.7, 0.9]) * frame)
                hands[side] = blend(person, side, near_head(person, side, name, shift + sway), there)
                if there > 0.6:
                    names.append(name)
        return hands, names


def blend(person, side, goal, part):
    """Between the hand's place at rest and a goal."""
    if part >= 1.0:
        return goal
    sign = SIDES[side]
    low = (numpy.array([sign * 0.25, -1.0, 0.2]), numpy.array([-sign * 0.2, -0.2, 0.95]))
    unit = [direction / numpy.linalg.norm(direction) for direction in goal[:2]]
    upper, lower = (part * direction + (1.0 - part) * start / numpy.linalg.norm(start)
                    for direction, start in zip(unit, low))
    return upper, lower, goal[2], goal[3], goal[4]


def tilted(mesh, centre, angles):
    rotated = rotation(Y, angles[0]) @ rotation(X, angles[1]) @ rotation(Z, angles[2])
    return mesh.moved(rotated, centre)


def make_held(name, rng):
    """A thing about the origin, and how far out its edges are: half width."""
    albedo = rng.uniform(0.05, 0.85)
    origin = numpy.zeros(3)
    if name == "sheet":
        half = (rng.uniform(100.0, 150.0), rng.uniform(140.0, 210.0), 1.0)
        return things.box(origin, half, rng, 0.0, HELD, rng.uniform(0.5, 0.85)), half[0]
    if name == "book":
        half = (rng.uniform(70.0, 120.0), rng.uniform(100.0, 150.0), rng.uniform(6.0, 20.0))
        return things.box(origin, half, rng, 0.0, HELD, albedo), half[0]
    if name == "box":
        half = (rng.uniform(90.0, 200.0), rng.uniform(60.0, 170.0), rng.uniform(60.0, 150.0))
        return things.box(origin, half, rng, 0.0, HELD, albedo), half[0]
    if name == "ball":
        size = rng.uniform(60.0, 125.0)
        return make(*ball(origin, numpy.full(3, size)), albedo, HELD), size
    if name == "phone":
        return things.box(origin, (37.0, 75.0, 5.0), rng, 0.0, HELD, 0.08), 37.0
    if name == "tablet":
        return things.box(origin, (90.0, 125.0, 5.0), rng, 0.0, HELD, 0.08), 90.0
    radius, high = rng.uniform(32.0, 48.0), rng.uniform(80.0, 130.0)
    cup = things.lathe(numpy.array([0.0, 0.5 * high, 0.0]), [(0, 0), (radius * 0.8, 0), (radius, high),
                                                             (radius - 4, high),
                                                             (radius * 0.7, 8)], rng, HELD)
    cup.vertices[:, 1] *= -1.0
    return cup, radius


HELD_THINGS = ("sheet", "book", "box", "ball", "phone", "tablet", "cup")
ONE_HAND = ("phone", "cup")


class Holding:
    """A thing before chin, mouth or chest, lifted and lowered slowly."""

    def __init__(self, rng, person):
        self.name = HELD_THINGS[rng.integers(len(HELD_THINGS))]
        self.mesh, self.half_mm = make_held(self.name, rng)
        head = person.head
        height = rng.choice([rng.uniform(-0.55, -0.1), rng.uniform(-1.3, -0.55),
                            rng.uniform(-2.3, -1.3)], p=(0.2, 0.45, 0.35))
        depth = rng.uniform(1.5, 2.4) if self.name in ONE_HAND else rng.uniform(1.8, 3.4)
        self.at_mm = head.centre + head.axes_mm * [rng.normal(0.0, 0.25), height, depth]
        self.lift_mm, self.period, self.phase = rng.uniform(
    10.0, 90.0), rng.uniform(
        14.0, 45.0), rng.uniform(
            0.0, 6.28)
        self.angles = rng.normal(0.0, 0.2, 3)
        self.sides = ("L", "R")[rng.integers(2)] if self.name in ONE_HAND else "LR"

    def at(self, person, frame):
        """Hands, and the thing's mesh in the chest's rest frame."""
        wave = numpy.sin(2.0 * numpy.pi * frame / self.period + self.phase)
        at = self.at_mm + [0.0, self.lift_mm * wave, 0.2 * self.lift_mm * wave]
        hands = {side: holding(person, side, at - [0.0, 15.0, 0.0], self.half_mm + 8.0) for side in self.sides}
        return hands, tilted(self.mesh, at, self.angles)
