#!/usr/bin/env python3
"""Heads of tools/people as the core sees them, without pictures: cast.py LIBRARY OUT --seeds A-B

What learn_pose.py learns from. A picture takes 0.2 s and one posture; here dots are cast on a posture from many sides, are
missing or beside their places as often as in rendered pictures, and the core goes on from there (cast_points.c). Each
person has three postures; each is seen four times by the paper's rig and by the wide one, seen from all around or about
ahead. OUT: npz, a row for each head that was found within 100 mm: points_mm, seen, centre_mm, semi_mm, length_px_mm of the
middle dot's line, unit of the field, yaw_deg and pitch_deg as docs/contract.md has them, person.
"""

import argparse
import ctypes
import dataclasses
import os
import sys

import numpy

import mesh
import rig as rigs
import room
from body import Model, rotation
from scene import X, Y, Actor, draw_place

KINDS = ("calm", "hands", "leaning", "objects", "turning", "face", "near", "profile", "tilted", "turning", "calm", "helmet")
RIGS = ("wide", "paper")
POSTURES, VIEWS, FRAMES = 3, 4, 24
DETECTIONS_MAX, FIELDS = 16, 7
NEAR_MM = 100.0
BODY_MM = 900.0
UNIT = 0.0160


def numbers(rig):
    """As struct ih_calibration has them."""
    def fixed(value, bits):
        return int(round(float(value) * 2 ** bits))

    return numpy.array(
        [0, rig.width, rig.height, *(fixed(v, 16) for v in (*rig.focal_px, *rig.centre_px)),
         *(fixed(v, 24) for v in rig.lens), int(rig.near_mm), int(rig.far_mm),
         *(fixed(v, 16) for v in rig.projector_mm), *(fixed(v, 30) for v in rig.dot_rays.ravel()), 0, 0, 0], numpy.int32)


def angles(rot):
    """Yaw and pitch of the contract; rot: from the body's frame to the camera's."""
    face = rot[:, 2]
    return numpy.degrees(numpy.arctan2(face[0], -face[2])), numpy.degrees(numpy.arcsin(numpy.clip(-face[1], -1.0, 1.0)))


class Core:
    def __init__(self, path):
        self.library = ctypes.CDLL(os.path.abspath(path))

    def start(self, rig):
        given = numbers(rig)
        return self.library.cast_init(given.ctypes.data_as(ctypes.c_void_p)) == 0

    def find(self, *columns):
        points = numpy.zeros((rigs.DOTS, 3), numpy.float32)
        seen, found = numpy.zeros(rigs.DOTS, numpy.uint8), numpy.zeros((DETECTIONS_MAX, FIELDS))
        given = [numpy.ascontiguousarray(column, float) for column in columns]
        count = self.library.cast_find(*(array.ctypes.data_as(ctypes.c_void_p) for array in (*given, points, seen, found)))
        return points, seen, found[:count]


@dataclasses.dataclass
class Scene:
    """A posture and its room, each with the frame in which it was made; the head is to be at `place`."""
    body: mesh.Caster
    centre: numpy.ndarray
    room: mesh.Caster
    rotated: numpy.ndarray
    tilted: numpy.ndarray
    place: numpy.ndarray

    def body_cast(self, origin, rays):
        return self.body.cast(self.rotated.T @ (origin - self.place) + self.centre, rays @ self.rotated)

    def cast(self, origin, rays):
        hits = self.body_cast(origin, rays)
        if self.room is None:
            return hits
        return mesh.nearest(self.room.cast(self.tilted.T @ (origin - self.place) + self.place, rays @ self.tilted), hits)


def cast_dots(scene, rig, far_mm, rng):
    """By slot: depth, how far beside its place, place."""
    hits = scene.cast(rig.projector_mm, rig.dot_rays)
    there = numpy.isfinite(hits.t)
    t = numpy.where(there, hits.t, 0.0)
    surface = rig.projector_mm + rig.dot_rays * t[:, None]
    points = rig.projector_mm + rig.dot_rays * (t + hits.fuzz_mm * abs(rng.normal(0.0, 0.9, rigs.DOTS)))[:, None]
    length = numpy.maximum(numpy.linalg.norm(points, axis=1), 1.0)
    there &= (scene.cast(numpy.zeros(3), surface).t > 1.0 - 2.0 / length) & (points[:, 2] > 100.0)
    own = numpy.isclose(scene.body_cast(rig.projector_mm, rig.dot_rays).t, hits.t)
    normal = numpy.where(own[:, None], hits.normal @ scene.rotated.T, hits.normal @ scene.tilted.T)
    cosine = -(normal * points).sum(axis=1) / length
    there &= cosine > 0.03
    u, v = rig.project(numpy.where(there[:, None], points, [0.0, 0.0, 1000.0]))
    there &= (u > 2.0) & (v > 2.0) & (u < rig.width - 3.0) & (v < rig.height - 3.0)
    bright = (hits.albedo * numpy.maximum(cosine, 0.0) * (1e3 / length) ** 2 * rng.uniform(0.85, 1.15, rigs.DOTS) *
              numpy.exp(rng.normal(0.0, rng.uniform(0.1, 0.3), rigs.DOTS)))
    there &= bright * rng.uniform(0.7, 1.5) * (far_mm / 850.0) ** 1.5 > 0.035
    there &= rng.random(rigs.DOTS) > rng.uniform(0.02, 0.12)
    sigma = rng.uniform(0.09, 0.18) * numpy.where(cosine < 0.35, 1.7, 1.0)
    beside = rng.normal(0.0, 1.0, rigs.DOTS) * sigma * numpy.where(rng.random(rigs.DOTS) < 0.02, 8.0, 1.0)
    return numpy.where(there, points[:, 2], 0.0), beside, u, v


def draw_view(posture, room_caster, place, kind, rng):
    """The rotation of the head, and the scene."""
    body, centre, rot = posture
    yaw = rng.uniform(-180.0, 180.0) if rng.random() < 0.6 else rng.normal(0.0, 35.0)
    tilt = rng.uniform(-8.0, 15.0) if rng.random() < 0.3 else (rng.uniform(-30.0, 30.0) if kind == "tilted" else 0.0)
    tilted = rotation(X, numpy.radians(-tilt))
    rotated = tilted @ rotation(Y, -numpy.radians(yaw - angles(rot)[0]))
    return rotated @ rot, Scene(body, centre, room_caster, rotated, tilted, place + rng.uniform(-60.0, 60.0, 3))


def draw_posture(actor, rng):
    step = actor.at(int(rng.integers(FRAMES)))
    if step is None:
        return None
    whole, centre, rot, _ = step
    near = (abs(whole.vertices - centre).max(axis=1) < BODY_MM)[whole.faces].any(axis=1)
    part = dataclasses.replace(whole, faces=whole.faces[near], albedo=whole.albedo[near], fuzz_mm=whole.fuzz_mm[near],
                               tag=whole.tag[near])
    return mesh.Caster(part), centre, rot


def person(core, model, seed):
    """Rows of the output."""
    rng, kind = numpy.random.default_rng([seed, 77]), KINDS[seed % len(KINDS)]
    place = draw_place(kind, "paper", rng)
    actor = Actor(model, kind, seed, 0, place, FRAMES, rng)
    still = room.around([place], actor.seated, True, 0.0, rng)
    room_caster = mesh.Caster(still) if still is not None else None
    for _ in range(POSTURES):
        posture = draw_posture(actor, rng)
        if posture is None:
            continue
        for rig_kind in RIGS:
            for _ in range(VIEWS):
                rig = rigs.dots_rig(rig_kind, rng, rigs.WIDTH)
                if not core.start(rig):
                    continue
                rot, scene = draw_view(posture, room_caster, place, kind, rng)
                points, seen, found = core.find(*cast_dots(scene, rig, place[2], rng))
                near = found[numpy.linalg.norm(found[:, :3] - scene.place, axis=1) < NEAR_MM]
                if len(near):
                    best = near[near[:, 6].argmax()]
                    yaw, pitch = angles(rot)
                    yield {"points_mm": points, "seen": seen, "centre_mm": best[:3], "semi_mm": best[3:6], "unit": UNIT,
                           "length_px_mm": rig.focal_px[0] * numpy.hypot(*rig.projector_mm[:2]), "yaw_deg": yaw,
                           "pitch_deg": pitch, "person": seed}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("library")
    parser.add_argument("out")
    parser.add_argument("--seeds", default="410000-410399", metavar="A-B")
    options = parser.parse_args()
    first, last = map(int, options.seeds.split("-"))
    core, model, rows = Core(options.library), Model(), []
    for seed in range(first, last + 1):
        rows += person(core, model, seed)
        print("\r%d of %d people, %d heads" % (seed - first + 1, last - first + 1, len(rows)), end="", file=sys.stderr)
    print(file=sys.stderr)
    numpy.savez(options.out, **{key: numpy.array([row[key] for row in rows]) for key in rows[0]})


if __name__ == "__main__":
    main()
