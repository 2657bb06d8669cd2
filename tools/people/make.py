"""Makes frames directories of people: python3 make.py --rig RIG --kind KIND --seed SEED --frames N OUT."""

import argparse
import dataclasses
import json
import os

import numpy

import depth
import laser
import mesh
import rig as rigs
from body import Model
from picture import write_pgm
from scene import KINDS, MORE_KINDS, ROOMS, Scene

# A head that shows so many dots is there; below the lower number it is not; between, nothing is said.
HEAD_DOTS, NO_HEAD_DOTS = 6, 2
# Surfaces are looked at once in a square of so many pixels; dots are drawn finer.
STEP = 2
# Of a depth image every so many squares count as points.
LOOK = 4


def spread(picture):
    """Every value over its square of pixels."""
    return picture.repeat(STEP, axis=0).repeat(STEP, axis=1)


def round_list(values, digits=2):
    return [round(float(value), digits) for value in values]


def head_entry(head):
    return {"centre_mm": round_list(head.centre_mm), "semi_axes_mm": round_list(head.axes_mm),
            "angles_deg": round_list(head.angles_deg)}


def on_head(points, head, reach=1.35):
    """Points near enough to the ellipsoid to belong to skull, face or hair."""
    return numpy.linalg.norm((points - head.centre_mm) @ head.level / (head.axes_mm + 15.0), axis=1) < reach


class Studio:
    """What a sequence has in common."""

    def __init__(self, rig_kind, seed, distance_mm, width=rigs.WIDTH):
        rng = numpy.random.default_rng([seed, 3])
        self.kind = rig_kind
        self.is_range = rig_kind == "range"
        self.rig = rigs.range_rig(rng) if self.is_range else rigs.dots_rig(rig_kind, rng, width)
        self.rays = self.rig.pixel_rays(STEP).astype(numpy.float32)
        self.laser = laser.Laser(rng, self.rig)
        self.light = laser.Light(rng, distance_mm)
        self.sensor = depth.Sensor(rng, self.rig, STEP) if self.is_range else laser.Sensor(rng, self.rig)
        self.set_still(None)

    def set_still(self, still):
        """What stands still is looked at only once."""
        flat = self.rays.reshape(-1, 3)
        self.still = mesh.Caster(still) if still is not None else None
        self.still_hits = mesh.nothing(len(flat)) if still is None else self.still.cast(numpy.zeros(3), flat)
        self.still_grey = self.light.grey(self.still_hits, flat)

    def _window(self, moving):
        """Pixels in the rectangle that holds the mesh."""
        points = moving.vertices[moving.vertices[:, 2] > 50.0]
        if len(points) < len(moving.vertices):
            return numpy.arange(self.rays.shape[0] * self.rays.shape[1])
        u, v = (pixels // STEP for pixels in self.rig.project(points))
        us = numpy.arange(max(0, int(u.min()) - 3), min(self.rays.shape[1], int(u.max()) + 4))
        vs = numpy.arange(max(0, int(v.min()) - 3), min(self.rays.shape[0], int(v.max()) + 4))
        return (vs[:, None] * self.rays.shape[1] + us[None, :]).ravel()

    def _seen(self, moving):
        """Without the triangles that no ray of camera or projector can meet."""
        z = numpy.maximum(moving.vertices[:, 2], 1.0)
        wide = numpy.hypot(self.rig.width, 2.0 * self.rig.centre_px[0]) / self.rig.focal_px[0] * 0.55
        beside = abs(moving.vertices[:, :2]).max(axis=1) > 300.0 + wide * z
        keep = ~beside[moving.faces].all(axis=1)
        return dataclasses.replace(moving, faces=moving.faces[keep], albedo=moving.albedo[keep],
                                   fuzz_mm=moving.fuzz_mm[keep], tag=moving.tag[keep])

    def shoot(self, moving, rng):
        """The frame's samples, its maximum, and visible dots: index, u, v, z, tag; and the pixels' hits."""
        caster = mesh.Caster(self._seen(moving)) if moving is not None else None
        flat = self.rays.reshape(-1, 3)
        hits, grey = mesh.copy(self.still_hits), self.still_grey.copy()
        if caster is not None:
            rows = self._window(moving)
            changed = mesh.cover(hits, rows, caster.cast(numpy.zeros(3), flat[rows]))
            grey[changed] = self.light.grey(mesh.part(hits, changed), flat[changed])
        shape = self.rays.shape[:2]
        if self.is_range:
            return spread(depth.measure(self.sensor, hits, shape, rng)), 65535, None, hits
        grey = laser.soften(spread(grey.reshape(shape))[:self.rig.height, :self.rig.width])

        def cast(origins, directions):
            found = [one.cast(origins, directions) for one in (self.still, caster) if one is not None]
            if not found:
                return mesh.nothing(len(directions))
            return found[0] if len(found) == 1 else mesh.nearest(*found)

        dots = laser.cast_dots(self.rig, self.laser, self.light.exposure, cast, grey, rng)
        return self.sensor.expose(grey, rng), 255, dots, hits

    def visible_points(self, samples, dots, hits):
        """What is measured, in mm, and the tags; of a depth image some."""
        if self.is_range:
            tags = hits.tag.reshape(self.rays.shape[:2])[::LOOK, ::LOOK]
            z = samples[::STEP * LOOK, ::STEP * LOOK].astype(float)
            return (self.rays[::LOOK, ::LOOK] * z[..., None])[z > 0], tags[z > 0]
        measured = (dots[3] >= self.rig.near_mm) & (dots[3] <= self.rig.far_mm)
        _, u, v, z, tag = (column[measured] for column in dots)
        pixels = self.rays[numpy.clip(v // STEP, 0, self.rays.shape[0] - 1).astype(int),
                           numpy.clip(u // STEP, 0, self.rays.shape[1] - 1).astype(int)]
        return pixels * z[:, None], tag

    def rays_at(self, head):
        """How many dots, or looks at a depth image, the head would get if nothing hid it."""
        if self.is_range:
            origin, rays = numpy.zeros(3), self.rays[::LOOK, ::LOOK].reshape(-1, 3)
        else:
            origin, rays = self.rig.projector_mm, self.rig.dot_rays
        # In units of the semi-axes the head is a ball of radius 1.
        path, rays = (head.centre_mm - origin) @ head.level / head.axes_mm, rays @ head.level / head.axes_mm
        along = rays @ path
        return int(numpy.count_nonzero((along > 0.0) & (path @ path - along ** 2 / (rays ** 2).sum(axis=1) < 1.0)))

    def in_field(self, point_mm):
        """Within the picture and, with dots, the pattern."""
        if point_mm[2] <= 0.0:
            return False
        u, v = self.rig.project(point_mm[None])
        inside = 0 <= u[0] < self.rig.width and 0 <= v[0] < self.rig.height
        return bool(inside and (self.is_range or max(map(abs, self.rig.pattern_place(point_mm))) <= rigs.ROWS // 2))


def describe(studio, scene, heads, extra, samples, dots, hits):
    """Truth's fields for the heads, and what the frame's line of scene.jsonl says."""
    points, tags = studio.visible_points(samples, dots, hits)
    there, unclear, notes = [], [], []
    for head in heads:
        own = (tags >= 0) & (tags // mesh.PERSON_STEP == head.number)
        near = on_head(points, head) & own & numpy.isin(tags % mesh.PERSON_STEP, (mesh.SKIN, mesh.HAIR, mesh.GEAR))
        count, field = int(near.sum()), studio.in_field(head.centre_mm)
        needed = HEAD_DOTS if not studio.is_range else 2 * HEAD_DOTS
        if field and count >= needed:
            there.append(head)
        elif count > NO_HEAD_DOTS or field:
            unclear.append(head)
        notes.append({"centre_mm": round_list(head.centre_mm), "points": count, "in_field": field,
                      "visible": round(min(1.0, count / max(1, studio.rays_at(head))), 2),
                      "angles_deg": round_list(head.angles_deg), "number": head.number})
    there.sort(key=lambda head: numpy.linalg.norm(head.centre_mm))
    fields = {}
    if there or not unclear:
        fields["head"] = head_entry(there[0]) if there else None
    if len(heads) > 1 or not fields:
        fields["heads"] = [head_entry(head) for head in there or unclear]
    if unclear:
        fields["unclear"] = [head_entry(head) for head in unclear]
    return fields, {"kind": scene.kind, "people": notes, **extra, "missing": round(studio.laser.missing, 2),
                    "wear": [actor.note() for actor in scene.actors]}


def make(model, out, rig_kind, scene_kind, seed, frames, width=rigs.WIDTH, mount=None, step=1, missing=0.0):
    """Of the frames every step-th, each at its own time; so many dots are missing, others in each frame."""
    os.makedirs(out, exist_ok=True)
    scene = Scene(model, scene_kind, seed, frames, rig_kind, mount)
    studio = Studio(rig_kind, seed, scene.head_mm[2], width)
    key_before = None
    with open(os.path.join(out, "frames.jsonl"), "w", encoding="utf-8") as frames_file, \
            open(os.path.join(out, "truth.jsonl"), "w", encoding="utf-8") as truth_file, \
            open(os.path.join(out, "scene.jsonl"), "w", encoding="utf-8") as scene_file:
        for index in range(seed % step, frames, step):
            name = "%06d.pgm" % index
            rng = numpy.random.default_rng([seed, 4, index])
            key, still = scene.still_at(index)
            if key != key_before:
                studio.set_still(still)
                key_before = key
            moving, heads, extra = scene.frame(index)
            studio.laser.lose(missing, numpy.random.default_rng([seed, 6, index]))
            samples, max_value, dots, hits = studio.shoot(moving, rng)
            write_pgm(os.path.join(out, name), samples, max_value)
            fields, note = describe(studio, scene, heads, extra, samples, dots, hits)
            truth = {"file": name, **fields}
            if dots is not None:
                truth["dots"] = [[int(i), round(float(u), 3), round(float(v), 3), round(float(z), 2)]
                                 for i, u, v, z, _ in zip(*dots)]
            frames_file.write(json.dumps({"file": name, "time_us": scene.time_us(index), "laser": True}) + "\n")
            truth_file.write(json.dumps(truth) + "\n")
            scene_file.write(json.dumps({"file": name, **note}) + "\n")
    if mount is not None:
        studio.rig.up = scene.level @ (0.0, -1.0, 0.0)
    rigs.write(studio.rig, out)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rig", default="paper", choices=[*rigs.KINDS, "range"])
    parser.add_argument("--kind", default="calm", choices=[*KINDS, *MORE_KINDS, *ROOMS[1:]])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--width", type=int, default=rigs.WIDTH, help="of dot rigs' pictures, pixels")
    parser.add_argument("--tilt", type=float, help="degrees by which the camera looks down: rig.json says where up is")
    parser.add_argument("--roll", type=float, help="degrees by which heads' tops tip to the right, 180: upside down")
    parser.add_argument("--missing", type=float, default=0.0, help="so many dots are not there, others in each frame: 0 to 0.9")
    parser.add_argument("out")
    options = parser.parse_args()
    if not 0.0 <= options.missing <= 0.9:
        parser.error("--missing %g: from 0 to 0.9" % options.missing)
    if options.missing and options.rig == "range":
        parser.error("--missing: depth images have no dots")
    make(Model(), options.out, options.rig, options.kind, options.seed, options.frames, options.width,
         None if options.tilt is None and options.roll is None else (options.tilt or 0.0, options.roll or 0.0),
         missing=options.missing)


if __name__ == "__main__":
    main()
