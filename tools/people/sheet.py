"""Contact sheets: what the camera looks at, shaded by its surfaces, with the dots and the heads of truth."""

import argparse

import numpy

import make
import mesh
from body import Model
from picture import write_png
from scene import Scene

# Few shades keep the file small.
SHADE = 5
# Colours of things, skin, cloth, hair, gear, what is held.
COLOURS = numpy.array([[150, 150, 160], [230, 190, 160], [120, 150, 200], [150, 110, 70], [200, 90, 90],
                       [120, 190, 120], [255, 255, 255], [255, 255, 255]], float)


def outline(head):
    """Points of the silhouette of the head's ellipsoid, upright axes."""
    angle = numpy.linspace(0.0, 2.0 * numpy.pi, 160)
    return head.centre_mm + numpy.stack([head.axes_mm[0] * numpy.cos(angle), head.axes_mm[1] * numpy.sin(angle),
                                         0.0 * angle], axis=1)


def shaded(studio, hits):
    rays = studio.rays.reshape(-1, 3)
    view = rays / numpy.linalg.norm(rays, axis=1, keepdims=True)
    light = numpy.array([-0.45, -0.6, -0.65])
    shade = 0.35 * numpy.maximum(0.0, -(hits.normal * view).sum(axis=1)) + \
                                 0.65 * numpy.maximum(0.0, hits.normal @ light)
    near = numpy.clip(1.35 - 0.35e-3 * numpy.where(numpy.isfinite(hits.t), hits.t, 3000.0), 0.4, 1.2)
    colour = COLOURS[numpy.where(hits.tag < 0, 0, hits.tag % mesh.PERSON_STEP)]
    picture = colour * (shade * near)[:, None]
    picture[~numpy.isfinite(hits.t)] = 12.0
    return numpy.clip(picture, 0, 255).reshape(*studio.rays.shape)


def mark(picture, u, v, colour, size=1):
    for right in range(-size, size + 1):
        for down in range(-size, size + 1):
            x, y = numpy.round(u).astype(int) + right, numpy.round(v).astype(int) + down
            good = (x >= 0) & (y >= 0) & (x < picture.shape[1]) & (y < picture.shape[0])
            picture[y[good], x[good]] = colour


def tile(model, rig_kind, scene_kind, seed, frames, index, every=2):
    scene = Scene(model, scene_kind, seed, frames, rig_kind)
    studio = make.Studio(rig_kind, seed, scene.head_mm[2])
    studio.set_still(scene.still_at(index)[1])
    moving, heads, extra = scene.frame(index)
    samples, _, dots, hits = studio.shoot(moving, numpy.random.default_rng([seed, 4, index]))
    if studio.is_range:
        fade = numpy.where(samples > 0, 255.0 - 220.0 * numpy.clip((samples - 400.0) / 2600.0, 0, 1), 0.0)
        picture = numpy.concatenate([make.spread(shaded(studio, hits)),
                                    numpy.repeat(fade[..., None], 3, axis=2)], axis=1)
    else:
        picture = make.spread(shaded(studio, hits))
        mark(picture, dots[1], dots[2], (255, 60, 40))
    for head in heads:
        points = outline(head)
        if points[:, 2].min() > 50.0:
            mark(picture, *studio.rig.project(points), (60, 255, 60), 0)
    return picture[::every, ::every]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rig", default="paper")
    parser.add_argument("--every", type=int, default=3)
    parser.add_argument("--columns", type=int, default=5)
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("out")
    parser.add_argument("what", nargs="+", help="KIND:SEED:FRAME")
    options = parser.parse_args()
    model, tiles = Model(), []
    for what in options.what:
        kind, seed, index = what.split(":")
        tiles.append(tile(model, options.rig, kind, int(seed), options.frames, int(index), options.every))
    height, width = max(t.shape[0] for t in tiles), max(t.shape[1] for t in tiles)
    rows = -(-len(tiles) // options.columns)
    page = numpy.zeros((rows * (height + 4), options.columns * (width + 4), 3))
    for i, picture in enumerate(tiles):
        y, x = i // options.columns * (height + 4), i % options.columns * (width + 4)
        page[y:y + picture.shape[0], x:x + picture.shape[1]] = picture
    write_png(options.out, page // SHADE * SHADE)


if __name__ == "__main__":
    main()
