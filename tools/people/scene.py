"""Scenes: who is there, what stands around, and how they move; meshes and heads of every frame."""

import dataclasses

import numpy

import motion
import room
import wear
from body import rotation
from hands import Gestures, Holding
from mesh import PERSON_STEP, join
from person import TO_CAMERA, Person

KINDS = ("calm", "near", "hands", "turning", "leaning", "objects", "visit", "past", "two", "profile", "edge", "tilted",
         "helmet", "face", "body", "empty")
# Kinds that only some sets have. far: beyond 1.5 m.
MORE_KINDS = ("far",)
# Nobody is there; of these rooms the camera looks down on some, by up to so many degrees.
ROOMS = tuple(room.ROOMS)
LOOKS_DOWN_DEG = {"above": (5.0, 45.0), "ground": (15.0, 65.0)}
EMPTY_FRAMES, EMPTY_US = 3, 10000000
# A camera that looks down by more than this sees a floor.
STEEP_DEG = 35.0
# The second of two has a seed of its own.
SECOND_SEED = 500000
X, Y, Z = numpy.eye(3)


@dataclasses.dataclass
class HeadTruth:
    centre_mm: numpy.ndarray
    axes_mm: numpy.ndarray
    angles_deg: tuple
    number: int
    level: numpy.ndarray  # from the frame in which it stands upright to the camera's


def angles_of(rot):
    """Yaw, pitch and roll as tools/render writes them."""
    theirs = rot @ TO_CAMERA
    return (float(numpy.degrees(numpy.arctan2(theirs[0, 2], theirs[2, 2]))),
            float(numpy.degrees(numpy.arcsin(numpy.clip(-theirs[1, 2], -1.0, 1.0)))),
            float(numpy.degrees(numpy.arctan2(theirs[1, 0], theirs[1, 1]))))


def mounted(tilt_deg, roll_deg):
    """From the level frame to that of a camera that looks down by the tilt; heads' tops tip to the right by the roll."""
    return rotation(Z, numpy.radians(roll_deg)) @ rotation(X, numpy.radians(tilt_deg))


def draw_distance(kind, rig_kind, rng):
    if kind == "near":
        return rng.uniform(450.0, 720.0)
    if kind == "far":
        return rng.uniform(1500.0, 3000.0 if rig_kind == "range" else 2200.0)
    if kind in ("two", "visit", "past"):
        return rng.uniform(750.0, 1700.0)
    return rng.choice([rng.uniform(500.0, 750.0), rng.uniform(750.0, 1150.0), rng.uniform(1150.0, 1800.0)],
                      p=(0.25, 0.5, 0.25))


def draw_place(kind, rig_kind, rng):
    """Where the head is, level frame: in the field's middle part, or at its edge."""
    half = numpy.array([0.40, 0.30]) if rig_kind == "range" else numpy.array([0.255, 0.25])
    at = rng.uniform(-0.55, 0.55, 2) * half
    if kind == "edge":
        axis = rng.integers(2)
        at[axis] = rng.choice([-1.0, 1.0]) * rng.uniform(0.72, 1.05) * half[axis]
    if kind == "body":
        at[1] = -rng.uniform(1.6, 3.0) * half[1]
    return numpy.array([at[0], at[1], 1.0]) * draw_distance(kind, rig_kind, rng)


def dress(kind):
    """What the kind asks of its people: from drawn traits to those they have."""
    def change(traits, rng):
        if kind == "helmet":
            return dataclasses.replace(traits, worn=(wear.HELMETS[rng.integers(3)],) + traits.worn[1:])
        if kind == "face":
            worn = ("mask", "beard", "mask", "beard", "glasses")[rng.integers(5)]
            return dataclasses.replace(traits, worn=(worn,) + tuple(
                name for name in traits.worn if name in wear.HATS), sex=1.0)
        return traits
    return change if kind in ("helmet", "face") else None


class Actor:
    """A person with a place, a motion and something to do."""

    def __init__(self, model, kind, seed, number, head_mm, frames, rng):
        self.kind, self.head_mm = kind, head_mm
        self.person = Person(model, seed, dress(kind), number)
        self.seated = float(rng.random() < (0.2 if kind in ("body", "past", "profile") else 0.6))
        base = {"calm": motion.CALM, "near": motion.CALM, "leaning": motion.LEANING, "body": motion.CALM}.get(kind)
        self.sways = motion.Sways(rng, *((base,) if base else ()))
        self.facing = rng.normal(0.0, 0.3)
        if kind in ("profile", "body"):
            self.facing = rng.choice([-1.0, 1.0]) * rng.uniform(0.9,
                                     2.3) if rng.random() < 0.75 else rng.uniform(-3.1, 3.1)
        turning = kind == "turning" or (kind in ("helmet", "face", "tilted") and rng.random() < 0.4)
        self.spin = motion.Spin(rng, frames) if turning else None
        self.visit = motion.Visit(rng, frames, head_mm, kind) if kind in ("visit", "past") else None
        does = rng.random()
        self.gestures = self.holding = None
        if kind == "hands" or (kind not in ("calm", "objects", "body") and does < 0.2):
            self.gestures = Gestures(rng, frames)
        elif kind == "objects" or (kind not in ("calm", "body") and does < 0.3):
            self.holding = Holding(rng, self.person)
        self.origin = self.person.place(self.person.posture({"seated": self.seated}), 0.0, head_mm)

    def at(self, frame):
        """Mesh, the head's centre and rotation, what hands do by name; None where the person is elsewhere."""
        angles = self.sways.at(frame)
        yaw = self.facing if self.spin is None else self.spin.at(frame)
        shift, angles["seated"] = numpy.zeros(3), self.seated
        if self.visit:
            step = self.visit.at(frame)
            if step is None:
                return None
            shift, yaw, seated = step[0], step[1] + (1.0 - abs(step[2])) * self.facing, 1.0 - abs(step[2])
            angles["seated"] *= seated
        hands, names, thing = {}, [], None
        if self.gestures:
            hands, names = self.gestures.at(self.person, frame)
        if self.holding:
            hands, thing = self.holding.at(self.person, frame)
            names = [self.holding.name]
        local = self.person.posture(angles, hands)
        mesh, centre, rot = self.person.build(local, yaw, self.origin + shift)
        if thing is not None:
            mesh = join([mesh, self._carried(thing, local, yaw, shift)])
        return mesh, centre, rot, names

    def _carried(self, thing, local, yaw, shift):
        """From the chest's rest frame to the level frame."""
        rotations, shifts = self.person.body.forward(local)
        chest = self.person.body.index["spine01"]
        out = TO_CAMERA @ rotation(Y, yaw)
        thing = thing.moved(out @ rotations[chest], out @ shifts[chest] + self.origin + shift)
        thing.tag = thing.tag + self.person.number * PERSON_STEP
        return thing

    def note(self):
        traits = self.person.traits
        return {"sex": traits.sex, "age": round(traits.age, 2), "hair": traits.hair, "worn": list(traits.worn)}


class Scene:
    """A level frame with the camera at its origin; tilted at the end.

    With `mount`, tilt and roll, the camera is turned about the head in this way, and in no other.
    """

    def __init__(self, model, kind, seed, frames, rig_kind, mount=None):
        rng = numpy.random.default_rng([seed, 2])
        self.kind, self.seed = kind, seed
        self.head_mm = draw_place(kind, rig_kind, rng)
        places = [self.head_mm] if kind not in ROOMS else []
        if kind == "two":
            places = self._pair(rng)
        self.actors = [Actor(model, kind, seed + SECOND_SEED * i, i, place, frames, rng)
                       for i, place in enumerate(places)]
        self._tilt(rng, mount)
        self.still = None
        if kind not in ROOMS:
            visit = self.actors[0].visit
            self.still = room.around(places, self.actors[0].seated, kind in ("turning", "visit", "past"),
                                     visit.deepest_mm() if visit else 0.0, rng, self.is_steep)

    def _pair(self, rng):
        apart = rng.uniform(400.0, 900.0)
        behind = rng.uniform(-0.6, 0.6) * apart
        side = rng.choice([-1.0, 1.0])
        between = numpy.array([side * numpy.sqrt(apart ** 2 - behind ** 2), rng.uniform(-60.0, 60.0), behind])
        first = self.head_mm - rng.uniform(0.2, 0.6) * between
        second = first + between
        nearer = min(first[2], second[2])
        lift = max(0.0, 650.0 - nearer) * Z
        self.head_mm = first + lift
        return [first + lift, second + lift]

    def _tilt(self, rng, mount):
        """The camera looks up by so many degrees, or down."""
        degrees = 0.0
        if self.kind == "tilted":
            degrees = rng.choice([-1.0, 1.0]) * rng.uniform(8.0, 30.0)
        elif rng.random() < 0.25:
            degrees = rng.uniform(-8.0, 15.0)
        self.tilt, self.tilt_deg, self.level = rotation(X, numpy.radians(-degrees)), degrees, numpy.eye(3)
        if self.kind in LOOKS_DOWN_DEG:
            degrees = -numpy.random.default_rng([self.seed, 9]).uniform(*LOOKS_DOWN_DEG[self.kind])
            self.tilt, self.tilt_deg = rotation(X, numpy.radians(-degrees)), degrees
        middle = self.head_mm if self.kind not in ROOMS else numpy.array([0.0, 0.0, 1000.0])
        if mount is not None:
            self.tilt = self.level = mounted(*mount)
            self.tilt_deg = -mount[0]
        about = middle if mount is None else mounted(0.0, mount[1]) @ middle
        self.tilt_shift = about - self.tilt @ middle
        self.is_steep = mount is not None and mount[0] > STEEP_DEG

    def still_at(self, index):
        """A key that changes with what stands still, and its mesh."""
        if self.kind not in ROOMS:
            return 0, self._tilted(self.still)
        key = index // EMPTY_FRAMES
        return key, self._tilted(room.ROOMS[self.kind](numpy.random.default_rng([self.seed, 5, key]), self.is_steep))

    def _tilted(self, mesh):
        return mesh.moved(self.tilt, self.tilt_shift) if mesh is not None else None

    def time_us(self, index):
        return index * motion.FRAME_US + (index // EMPTY_FRAMES * EMPTY_US if self.kind in ROOMS else 0)

    def frame(self, index):
        """The mesh of what moves, heads, and what else the frame shows."""
        meshes, heads, held = [], [], []
        for actor in self.actors:
            step = actor.at(index)
            if step is None:
                continue
            mesh, centre, rot, names = step
            meshes.append(mesh)
            held += names
            heads.append(HeadTruth(self.tilt @ centre + self.tilt_shift, actor.person.head.axes_mm,
                                   angles_of(self.tilt @ rot), actor.person.number, self.level))
        moving = self._tilted(join(meshes)) if meshes else None
        return moving, heads, {"held": held, "tilt_deg": round(self.tilt_deg, 1)}
