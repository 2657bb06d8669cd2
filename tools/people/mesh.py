"""Triangle meshes with the properties of their surface, and rays that hit them (embreex)."""

import dataclasses

import numpy

import packages  # before embreex: where it is
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene


@dataclasses.dataclass
class Mesh:
    """Camera or local frame, mm. Per triangle: albedo at the laser's colour, fuzz in mm, and a tag."""

    vertices: numpy.ndarray
    faces: numpy.ndarray
    albedo: numpy.ndarray
    fuzz_mm: numpy.ndarray
    tag: numpy.ndarray

    def moved(self, rotation, shift):
        return dataclasses.replace(self, vertices=self.vertices @ numpy.asarray(rotation).T + shift)


# Tags: what a ray has hit. A person's number times STEP is added.
THING, SKIN, CLOTH, HAIR, GEAR, HELD = range(6)
PERSON_STEP = 8
# Surfaces that meet at a larger angle have an edge.
EDGE_COSINE = 0.8


def make(vertices, faces, albedo, tag=THING, fuzz_mm=0.0):
    count = len(faces)
    return Mesh(numpy.asarray(vertices, float), numpy.asarray(faces, numpy.int32), numpy.full(count, 1.0) * albedo,
                numpy.full(count, 1.0) * fuzz_mm, numpy.full(count, tag, numpy.int32))


def join(meshes):
    starts = numpy.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    return Mesh(numpy.concatenate([mesh.vertices for mesh in meshes]),
                numpy.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts)]).astype(numpy.int32),
                numpy.concatenate([mesh.albedo for mesh in meshes]),
                numpy.concatenate([mesh.fuzz_mm for mesh in meshes]),
                numpy.concatenate([mesh.tag for mesh in meshes]))


def vertex_normals(vertices, faces):
    corners = vertices[faces]
    normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = numpy.zeros_like(vertices)
    for i in range(3):
        for axis in range(3):
            sums[:, axis] += numpy.bincount(faces[:, i], normals[:, axis], len(vertices))
    return sums / numpy.maximum(numpy.linalg.norm(sums, axis=1, keepdims=True), 1e-12)


@dataclasses.dataclass
class Hits:
    """t is the distance in lengths of the ray's direction, infinite where nothing is hit."""

    t: numpy.ndarray
    normal: numpy.ndarray
    albedo: numpy.ndarray
    fuzz_mm: numpy.ndarray
    tag: numpy.ndarray


class Caster:
    """Rays into one mesh."""

    def __init__(self, mesh):
        self.mesh = mesh
        self.scene = EmbreeScene()
        self.keep = TriangleMesh(self.scene, mesh.vertices.astype(numpy.float32), mesh.faces)
        self.normals = vertex_normals(mesh.vertices, mesh.faces).astype(numpy.float32)

    def cast(self, origins, directions):
        directions = numpy.ascontiguousarray(directions, numpy.float32)
        origins = numpy.ascontiguousarray(numpy.broadcast_to(origins, directions.shape), numpy.float32)
        answer = self.scene.run(origins, directions, output=True)
        hits = nothing(len(directions))
        found = numpy.flatnonzero(answer["primID"] >= 0)
        prim = answer["primID"][found]
        hits.t[found] = answer["tfar"][found]
        hits.normal[found] = self._normals({name: answer[name][found] for name in ("u", "v", "Ng")}, prim,
                                           directions[found])
        for name in ("albedo", "fuzz_mm", "tag"):
            getattr(hits, name)[found] = getattr(self.mesh, name)[prim]
        return hits

    def _normals(self, answer, prim, directions):
        """Smooth ones, but for edges; towards where the ray comes from."""
        flat = answer["Ng"]
        flat /= numpy.maximum(numpy.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
        corners = self.mesh.faces[prim]
        u, v = answer["u"][:, None], answer["v"][:, None]
        smooth = (1.0 - u - v) * self.normals[corners[:, 0]] + u * self.normals[corners[:, 1]] + v * self.normals[
            corners[:, 2]]
        smooth /= numpy.maximum(numpy.linalg.norm(smooth, axis=1, keepdims=True), 1e-30)
        agree = numpy.einsum("ij,ij->i", smooth, flat)
        smooth *= numpy.sign(agree)[:, None]
        normal = numpy.where((abs(agree) > EDGE_COSINE)[:, None], smooth, flat)
        flip = numpy.einsum("ij,ij->i", flat, directions) > 0.0
        return numpy.where(flip[:, None], -normal, normal)


def nearest(first, second):
    """The nearer of two casts' hits of the same rays."""
    use = second.t < first.t
    return Hits(numpy.where(use, second.t, first.t), numpy.where(use[:, None], second.normal, first.normal),
                *(numpy.where(use, getattr(second, name), getattr(first, name))
                  for name in ("albedo", "fuzz_mm", "tag")))


def nothing(count):
    """The hits of rays that meet nothing."""
    kind = numpy.float32
    return Hits(numpy.full(count, numpy.inf), numpy.zeros((count, 3), kind), numpy.zeros(count, kind),
                numpy.zeros(count, kind), numpy.full(count, -1, numpy.int32))


def cover(hits, rows, others):
    """Puts other hits of the rays `rows` over `hits` where they are nearer; the rays that changed."""
    nearer = others.t < hits.t[rows]
    changed = rows[nearer]
    for field in dataclasses.fields(Hits):
        getattr(hits, field.name)[changed] = getattr(others, field.name)[nearer]
    return changed


def part(hits, rows):
    return Hits(*(getattr(hits, field.name)[rows] for field in dataclasses.fields(Hits)))


def copy(hits):
    return Hits(*(getattr(hits, field.name).copy() for field in dataclasses.fields(Hits)))
