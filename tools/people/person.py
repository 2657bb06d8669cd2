"""A person: body by age, sex and build, face, clothes and hair; the mesh of one posture."""

import dataclasses
import os

import numpy

import hair
import wear
from body import Body, align, macro_weights, rotation
from head import Head
from mesh import CLOTH, PERSON_STEP, SKIN, Mesh, join, vertex_normals
from noise import smooth

FEATURES = ("head", "forehead", "nose", "chin", "cheek", "eyes", "eyebrows", "mouth", "ears", "neck")
PAIRS = (("incr", "decr"), ("out", "in"), ("up", "down"), ("forward", "backward"), ("convex", "concave"),
         ("uncompress", "compress"))
HEAD_FORMS = ("oval", "round", "rectangular", "square", "triangular", "invertedtriangular", "diamond")
# Body frame (y up, z forward) to the camera's (y down, z away from the camera).
TO_CAMERA = numpy.diag([1.0, -1.0, -1.0])
# Fraction of the head's rotation in each bone of the neck.
NECK = (("neck01", 0.15), ("neck02", 0.2), ("neck03", 0.2), ("head", 0.45))
SPINE = ("spine05", "spine04", "spine03", "spine02", "spine01")
HANDS = ("wrist", "finger", "metacarpal")
X, Y, Z = numpy.eye(3)


def feature_weights(model, rng, much=0.3):
    """Faces differ: every feature moves a little, both sides alike."""
    weights = {}
    for name, path in sorted(model.paths.items()):
        folder = os.path.basename(os.path.dirname(path))
        plain = name[2:] if name.startswith("l-") else name
        if folder not in FEATURES or name.startswith(("r-", "measure-")) or "asym" in name:
            continue
        for more, fewer in PAIRS:
            if name.endswith("-" + more):
                value = float(numpy.clip(rng.normal(0.0, much), -0.9, 0.9))
                chosen = name if value > 0.0 else name[:-len(more)] + fewer
                for side in ("l-", "r-") if name != plain else ("",):
                    twin = side + (chosen[2:] if side else chosen)
                    if twin in model.paths:
                        weights[twin] = abs(value)
    weights["head-" + HEAD_FORMS[rng.integers(len(HEAD_FORMS))]] = rng.uniform(0.0, 0.7)
    return {name: value for name, value in weights.items() if not name.startswith(
        ("head-age", "head-trans", "head-angle", "neck-trans"))}


@dataclasses.dataclass
class Traits:
    sex: float
    age: float
    hair: str
    worn: tuple = ()


def draw_traits(rng):
    sex = float(rng.random() < 0.5)
    age = float(rng.choice([rng.uniform(0.19, 0.40), rng.uniform(0.45, 0.70), rng.uniform(0.70, 0.98)],
                           p=(0.15, 0.6, 0.25)))
    women = ("short", "curls", "afro", "bob", "long", "loose", "bun", "tail", "plaits", "long", "loose", "bob")
    men = ("shorn", "short", "short", "quiff", "bald crown", "curls", "afro", "tail", "bun", "long", "none", "shorn")
    names = men if sex else women
    return Traits(sex, age, names[rng.integers(len(names))], wear.draw_worn(rng, sex, age))


class Person:
    def __init__(self, model, seed, traits=None, number=0):
        rng = numpy.random.default_rng([seed, 1])
        drawn = draw_traits(rng)
        self.traits = traits(drawn, rng) if traits else drawn
        sex, age = self.traits.sex, self.traits.age
        races = rng.dirichlet((0.5, 0.5, 0.5))
        weights = macro_weights(model, sex, age, numpy.clip(rng.normal(0.5, 0.18), 0.05, 0.95),
                                numpy.clip(rng.normal(0.52, 0.22), 0.05, 1.0),
                                numpy.clip(rng.normal(0.53, 0.035), 0.44, 0.60), rng.uniform(0.2, 0.9),
                                rng.uniform(0.1, 0.9), races)
        for name, value in feature_weights(model, rng).items():
            weights[name] = weights.get(name, 0.0) + value
        if rng.random() < 0.12:
            weights["stomach-pregnant-incr"] = rng.uniform(0.2, 0.9)
        self.body = Body(model, weights)
        self.head = Head(self.body)
        self.number = number
        self.skin_albedo = rng.uniform(0.32, 0.72)
        self._dress(model, rng)
        self._wear(rng)

    def _dress(self, model, rng):
        """Cloth stands off the skin; where it ends the skin goes on."""
        body = self.body
        part = {name: model.weights[:, i] for i, name in enumerate(model.bones)}
        bare = sum(part[name] for name in model.bones
                   if name.startswith(HANDS) or name in ("head", "jaw", "neck02", "neck03"))
        low_neck = body.joint("neck01")[1] + rng.uniform(-60.0, 15.0)
        neck = part["neck01"] * (body.neutral[:, 1] > low_neck)
        covered = (bare + neck < 0.35) & (numpy.arange(len(bare)) < 13380)
        if rng.random() < 0.35:
            covered &= sum(part[name] for name in model.bones if name.startswith("lowerarm")) < 0.3
        off_mm = float(rng.choice([rng.uniform(3.0, 9.0), rng.uniform(9.0, 20.0), rng.uniform(20.0, 42.0)],
                                  p=(0.5, 0.3, 0.2)))
        seed = int(rng.integers(2 ** 62))
        folds = smooth(body.neutral, 110.0, seed) + 0.6 * smooth(body.neutral * [1.0, 0.5, 1.0], 45.0, seed + 1)
        thick = off_mm * (1.0 + 0.5 * folds) * covered
        body.neutral = body.neutral + thick[:, None] * vertex_normals(body.neutral, model.faces)
        cloth = covered[model.faces].all(axis=1)
        albedo = float(rng.choice([rng.uniform(0.04, 0.1), rng.uniform(0.1, 0.35), rng.uniform(0.35, 0.85)],
                                  p=(0.3, 0.3, 0.4)))
        pattern = 1.0 + rng.uniform(0.0, 0.25) * smooth(body.neutral[model.faces[:, 0]], 60.0, seed + 2)
        trousers = rng.uniform(0.05, 0.5)
        legs = body.neutral[model.faces[:, 0], 1] < body.joint("root")[1]
        self.albedo = numpy.where(cloth, numpy.where(legs, trousers, albedo * pattern), self.skin_albedo)
        self.albedo[self._paint(model)] *= 0.45
        self.tags = numpy.where(cloth, CLOTH, SKIN)
        self.fuzz_mm = numpy.where(cloth, rng.uniform(0.0, 1.5), 0.3)

    def _wear(self, rng):
        """Hair, hats and the like: rigid on the head, and below the chin with the chest."""
        kind = self.traits.hair
        if set(self.traits.worn) & set(wear.HATS + wear.HELMETS) and kind not in wear.FLAT_HAIR:
            kind = wear.FLAT_HAIR[rng.integers(len(wear.FLAT_HAIR))]
        self.worn = [hair.build(self.head, kind, rng)] if kind != "none" else []
        self.worn += [wear.build(self.head, name, rng) for name in self.traits.worn]
        if rng.random() < 0.35:
            self.worn.append(wear.collar(self.body, rng, rng.uniform(0.05, 0.7), rng.random() < 0.35))

    def _paint(self, model):
        """Eyes, brows and lips send less back."""
        middle = self.body.neutral[model.faces].mean(axis=1) - self.head.centre
        x, y, z = (middle / self.head.axes_mm).T
        front = z > 0.55
        eyes = (((abs(x) - 0.42) / 0.17) ** 2 + ((y - 0.05) / 0.07) ** 2 < 1.0)
        brows = (((abs(x) - 0.42) / 0.26) ** 2 + ((y - 0.22) / 0.05) ** 2 < 1.0)
        lips = ((x / 0.32) ** 2 + ((y + 0.55) / 0.08) ** 2 < 1.0)
        return front & (eyes | brows | lips)

    def posture(self, angles, hands=None):
        """Bones' rotations. Angles in radians, by name; hands: see arms."""
        local = {}
        lean = rotation(Z, angles.get("lean", 0.0) / 5) @ rotation(X, angles.get("bend", 0.0) / 5) @ rotation(
            Y, angles.get("twist", 0.0) / 5)
        for name in SPINE:
            local[name] = lean
        for name, fraction in NECK:
            yaw, pitch, roll = (fraction * angles.get(angle, 0.0) for angle in ("yaw", "pitch", "roll"))
            local[name] = rotation(Y, yaw) @ rotation(X, pitch) @ rotation(Z, roll)
        seated = angles.get("seated", 0.0)
        for side, sign in (("L", 1.0), ("R", -1.0)):
            local["upperleg01." + side] = rotation(X, -1.45 * seated) @ rotation(Z, sign * 0.08 * seated)
            local["lowerleg01." + side] = rotation(X, 1.4 * seated)
        self.arms(local, hands or {}, seated)
        return local

    def arms(self, local, hands, seated):
        """Upper and lower arms by direction, in the chest's frame: {side: (upper, lower, fingers, palm, curl)}."""
        for side, sign in (("L", 1.0), ("R", -1.0)):
            hanging = (numpy.array([sign * 0.2, -1.0, 0.1 + 0.15 * seated]),
                    numpy.array([-sign * 0.25 * seated, -0.95 + 0.6 * seated, 0.25 + 0.65 * seated]), None, None, 0.35)
            upper, lower, fingers, palm, curl = hands.get(side, hanging)
            joint = self.body.joint
            shoulder, elbow = joint("upperarm01." + side), joint("lowerarm01." + side)
            wrist, knuckle = joint("wrist." + side), joint("finger3-1." + side)
            first = align(elbow - shoulder, upper)
            second = align(wrist - elbow, first.T @ lower)
            local["upperarm01." + side] = first
            local["lowerarm01." + side] = second
            across = joint("finger2-1." + side) - joint("finger5-1." + side)
            neutral_palm = numpy.cross(knuckle - wrist, across) * sign
            neutral_palm /= numpy.linalg.norm(neutral_palm)
            if fingers is not None:
                wanted = align(knuckle - wrist, fingers)
                now = wanted @ neutral_palm
                ahead = fingers / numpy.linalg.norm(fingers)
                goal = palm - ahead * (palm @ ahead)
                angle = numpy.arctan2(numpy.cross(now, goal) @ ahead, now @ goal)
                local["wrist." + side] = (first @ second).T @ rotation(ahead, angle) @ wanted
            axis = numpy.cross(knuckle - wrist, neutral_palm)
            bend = rotation(axis / numpy.linalg.norm(axis), curl)
            for finger in "2345":
                for bone in "123":
                    local["finger%s-%s.%s" % (finger, bone, side)] = bend
            local["finger1-3." + side] = rotation(axis / numpy.linalg.norm(axis), 0.5 * curl)

    def place(self, local, yaw, head_mm):
        """Where the body's origin is, so that the head's middle is at a point of the level frame."""
        rotations, shifts = self.body.forward(local)
        index = self.body.index["head"]
        out = TO_CAMERA @ rotation(Y, yaw)
        return head_mm - out @ (rotations[index] @ self.head.centre + shifts[index])

    def build(self, local, yaw, origin_mm):
        """The mesh in the level frame, and the head's centre and rotation there."""
        model, body = self.body.model, self.body
        rotations, shifts = body.forward(local)
        out = TO_CAMERA @ rotation(Y, yaw)
        vertices = body.skin(rotations, shifts)
        meshes = [Mesh(vertices, model.faces, self.albedo, self.fuzz_mm, self.tags)]
        head, chest = body.index["head"], body.index["spine01"]
        for worn in self.worn:
            hangs = numpy.clip((self.head.chin_mm + 20.0 - worn.vertices[:, 1:2]) / 160.0, 0.0, 1.0)
            with_head = worn.vertices @ rotations[head].T + shifts[head]
            with_chest = worn.vertices @ rotations[chest].T + shifts[chest]
            meshes.append(dataclasses.replace(worn, vertices=with_head + hangs * (with_chest - with_head)))
        mesh = join(meshes)
        mesh.tag = mesh.tag + self.number * PERSON_STEP
        mesh.vertices = mesh.vertices @ out.T + origin_mm
        centre = out @ (rotations[head] @ self.head.centre + shifts[head]) + origin_mm
        return mesh, centre, out @ rotations[head]
