"""What is worn on the head and around the neck: caps, hats, hoods, helmets, masks, beards, glasses, collars.

Body frame, mm, at rest.
"""

import numpy

from hair import ball, grid_faces, step, tube
from head import directions
from mesh import CLOTH, GEAR, HAIR, join, make
from noise import smooth

HATS = ("cap", "knitted", "brimmed", "hood")
HELMETS = ("bicycle", "hard hat", "full face")
FACE = ("mask", "beard", "glasses", "headphones")
# Hair that fits below a hat.
FLAT_HAIR = ("none", "shorn", "short", "bald crown", "long", "tail", "bob")


def patch(head, around, down, thick, albedo, tag=GEAR, fuzz_mm=0.0):
    """A surface off the bald head by `thick`; all arguments on one grid (rows, columns)."""
    points = head.origin + (head.radius(around, down) + thick)[..., None] * directions(around, down)
    return make(points.reshape(-1, 3), grid_faces(*around.shape), albedo, tag, fuzz_mm)


def grid(around_max, down_min, down_max, rows=81, columns=40):
    """Angles from -around_max to around_max, and down to a border that may depend on them."""
    around = numpy.linspace(-around_max, around_max, rows)[:, None]
    part = numpy.linspace(0.0, 1.0, columns)[None, :]
    low, high = (x(abs(around)) if callable(x) else x for x in (down_min, down_max))
    return numpy.broadcast_to(around, (rows, columns)), low + (high - low) * part + 0.0 * around


def brim(head, down, reach_mm, drop, half_round, albedo, edge_mm=3.0):
    """A plate that sticks out from the head, all around or in front."""
    around = numpy.linspace(-half_round, half_round, 49)[:, None]
    part = numpy.linspace(0.0, 1.0, 8)[None, :]
    full = half_round > 3.0
    fade = 1.0 if full else numpy.maximum(0.0, numpy.cos(0.5 * numpy.pi * around / half_round)) ** 0.5
    radius = head.radius(around[:, 0], numpy.full(len(around), down))[:, None] * numpy.sin(down)
    out = radius + 4.0 + reach_mm * fade * part
    y = head.origin[1] + (radius / numpy.tan(down)).mean() - drop * reach_mm * part * fade
    meshes = []
    for lift in (edge_mm, -edge_mm):
        points = numpy.stack([out * numpy.sin(around), y + lift + 0.0 * around,
                             head.origin[2] + out * numpy.cos(around)], -1)
        meshes.append(make(points.reshape(-1, 3), grid_faces(len(around), 8), albedo, GEAR))
    return join(meshes)


def cap(head, rng, albedo):
    off = rng.uniform(10.0, 18.0)
    around, down = grid(numpy.pi, 0.0, numpy.radians(rng.uniform(72.0, 84.0)))
    crown = patch(head, around, down, off * (1.0 + 0.2 * numpy.cos(2.0 * down)), albedo)
    peak = brim(head, numpy.radians(rng.uniform(66.0, 76.0)), rng.uniform(55.0, 80.0), rng.uniform(0.0, 0.4),
                rng.uniform(0.8, 1.1), albedo)
    return join([crown, peak])


def knitted(head, rng, albedo):
    high = rng.uniform(0.0, 45.0)
    around, down = grid(numpy.pi, 0.0, lambda a: numpy.radians(68.0 + 30.0 * step(0.8, 1.8, a)))
    thick = rng.uniform(9.0, 16.0) + high * step(0.7, 0.0, down)
    mesh = patch(head, around, down, thick + 1.5 * numpy.sin(40.0 * around), albedo, fuzz_mm=2.0)
    if rng.random() < 0.4:
        size = rng.uniform(20.0, 40.0)
        top = head.origin + [0.0, head.radius_mm[0, 0] + thick.max() + 0.6 * size, 0.0]
        mesh = join([mesh, make(*ball(top, numpy.full(3, size)), albedo, GEAR, 4.0)])
    return mesh


def brimmed(head, rng, albedo):
    high = rng.uniform(10.0, 50.0)
    around, down = grid(numpy.pi, 0.0, numpy.radians(76.0))
    crown = patch(head, around, down, 10.0 + high * step(1.0, 0.5, down), albedo)
    return join([crown, brim(head, numpy.radians(76.0), rng.uniform(
        45.0, 130.0), rng.uniform(-0.1, 0.4), numpy.pi, albedo)])


def hood(head, rng, albedo):
    opening = rng.uniform(0.75, 1.15)
    off = rng.uniform(18.0, 50.0)

    def border(around):
        return numpy.radians(40.0) + numpy.radians(110.0) * step(opening * 0.6, opening, around)
    around, down = grid(numpy.pi, 0.0, border, columns=56)
    seed = int(rng.integers(2 ** 62))
    points = directions(around, down) * 100.0
    thick = off * (1.0 + 0.25 * smooth(points, 60.0, seed)) + 25.0 * step(1.6, 2.4, down)
    return patch(head, around, down, thick, albedo, fuzz_mm=1.0)


def bicycle(head, rng, albedo):
    around, down = grid(numpy.pi, 0.0, lambda a: numpy.radians(64.0 + 18.0 * step(0.7, 2.6, a)), columns=48)
    ridges = rng.uniform(2.0, 9.0) * numpy.cos(rng.integers(5, 9) * around) * numpy.sin(down)
    length = rng.uniform(0.0, 25.0) * numpy.maximum(0.0, -numpy.cos(around)) * numpy.sin(down)
    shell = patch(head, around, down, rng.uniform(24.0, 36.0) * step(1.7, 1.1, down) + 12.0 + ridges + length, albedo)
    straps = []
    for side in (-1.0, 1.0):
        start = head.origin + [side * head.axes_mm[0] * 1.05, 20.0, 5.0]
        end = numpy.array([0.0, head.chin_mm - 6.0, head.origin[2] + 45.0])
        part = numpy.linspace(0.0, 1.0, 10)[:, None]
        path = start + (end - start) * part + [side * 10.0, 0.0, 0.0] * numpy.sin(numpy.pi * part)
        straps.append(make(*tube(path, numpy.full(10, 5.0)), 0.08, GEAR))
    return join([shell, *straps])


def hard_hat(head, rng, albedo):
    around, down = grid(numpy.pi, 0.0, numpy.radians(78.0))
    shell = patch(head, around, down, rng.uniform(26.0, 40.0) + 3.0 * (abs(around) < 0.2), albedo)
    reach = rng.uniform(20.0, 35.0)
    return join([shell, brim(head, numpy.radians(78.0), 25.0 + reach, 0.25, numpy.pi, albedo),
                 brim(head, numpy.radians(76.0), 35.0 + reach + rng.uniform(0.0, 25.0), 0.3, 1.1, albedo)])


def full_face(head, rng, albedo):
    off = rng.uniform(34.0, 48.0)
    closed = rng.random() < 0.5
    around, down = grid(numpy.pi, 0.0, lambda a: numpy.radians(128.0 + 8.0 * numpy.cos(a)), columns=64)
    ways = directions(around, down)
    # A smooth shell: an ellipsoid about the head, with a chin bar.
    axes = head.axes_mm + off
    radius = 1.0 / numpy.linalg.norm(ways / axes, axis=-1)
    chin = rng.uniform(15.0, 45.0) * numpy.exp(-(around / 0.7) ** 2) * step(1.6, 2.1, down)
    points = head.centre + ways * (radius + chin)[..., None]
    faces = grid_faces(*around.shape)
    if not closed:
        # The opening before the eyes.
        middle_around, middle_down = around.ravel()[faces].mean(axis=1), down.ravel()[faces].mean(axis=1)
        faces = faces[~((abs(middle_around) < 1.0) & (middle_down > 1.2) & (middle_down < 1.8))]
    return make(points.reshape(-1, 3), faces, albedo, GEAR)


def mask(head, rng, albedo):
    around, down = grid(rng.uniform(0.85, 1.15), lambda a: 1.72 + 0.1 * a, lambda a: 2.35 - 0.25 * a, 41, 20)
    puff = rng.uniform(4.0, 18.0) * numpy.cos(0.5 * numpy.pi * around / abs(around).max())
    return patch(head, around, down, 3.0 + puff, 0.75 * rng.uniform(0.7, 1.1), CLOTH)


def beard(head, rng, albedo):
    long_mm = rng.choice([rng.uniform(4.0, 12.0), rng.uniform(12.0, 60.0)], p=(0.6, 0.4))
    around, down = grid(1.25, lambda a: 1.93 - 0.30 * step(0.35, 1.2, a), lambda a: 2.5 - 0.25 * a, 61, 30)
    part = (down - down[:, :1]) / (down[:, -1:] - down[:, :1])
    seed = int(rng.integers(2 ** 62))
    thick = long_mm * numpy.sin(numpy.pi * numpy.clip(0.15 + 0.75 * part, 0.0, 1.0)) * step(1.25, 0.9, abs(around))
    thick = thick * (1.0 + 0.5 * smooth(directions(around, down) * 100.0, 12.0, seed)) + 1.0
    mesh = patch(head, around, down, thick, rng.choice([0.06, 0.12, 0.25, 0.5]), HAIR, rng.uniform(2.0, 5.0))
    mesh.vertices[:, 1] -= 0.8 * (thick * part ** 2).ravel() * (long_mm > 12.0)
    return mesh


def glasses(head, rng, albedo):
    meshes = []
    half_x, half_y = rng.uniform(0.28, 0.35) * head.axes_mm[0], rng.uniform(0.19, 0.30) * head.axes_mm[0]
    apart = 0.42 * head.axes_mm[0]
    dark = rng.random() < 0.3
    front_z = head.centre[2] + head.axes_mm[2] * 0.92
    eye_y = head.centre[1] + 0.03 * head.axes_mm[1]
    angle = numpy.linspace(0.0, 2.0 * numpy.pi, 25)
    for side in (-1.0, 1.0):
        middle = numpy.array([side * apart, eye_y, front_z])
        ring = middle + numpy.stack([half_x * numpy.cos(angle), half_y * numpy.sin(angle), -0.25 * side *
                                     half_x * numpy.cos(angle)], -1)
        meshes.append(make(*tube(ring, numpy.full(25, rng.uniform(1.2, 3.0)), 8), 0.06, GEAR))
        temple = numpy.array([[side * (apart + half_x), eye_y + 4.0, front_z - 8.0],
                              [side * (head.axes_mm[0] + 6.0), eye_y + 4.0, head.centre[2]],
                              [side * (head.axes_mm[0] + 6.0), eye_y - 5.0, head.centre[2] - 30.0]])
        meshes.append(make(*tube(temple, numpy.full(3, 2.5), 8), 0.06, GEAR))
        if dark:
            meshes.append(make(*ball(middle, numpy.array([half_x, half_y, 2.0])), 0.08, GEAR))
    return join(meshes)


def headphones(head, rng, albedo):
    angle = numpy.linspace(-0.5 * numpy.pi, 0.5 * numpy.pi, 17)
    a, b = head.axes_mm[0] + 14.0, head.axes_mm[1] + 14.0
    path = head.centre + numpy.stack([a * numpy.sin(angle), b * numpy.cos(angle), 0.0 * angle], -1)
    meshes = [make(*tube(path, numpy.full(17, rng.uniform(6.0, 12.0))), 0.1, GEAR)]
    for side in (-1.0, 1.0):
        at = head.centre + [side * (head.axes_mm[0] + 18.0), -8.0, -5.0]
        meshes.append(make(*ball(at, numpy.array([18.0, 40.0, 34.0])), 0.1, GEAR))
    return join(meshes)


def collar(body, rng, albedo, scarf):
    """A ring around the neck, of a shirt, a scarf, or of a hood that lies back."""
    neck = body.joint("neck01")
    angle = numpy.linspace(0.0, 2.0 * numpy.pi, 41)
    thick = rng.uniform(16.0, 30.0) if scarf else rng.uniform(6.0, 13.0)
    wide = rng.uniform(54.0, 66.0) + 0.6 * thick
    lift = 8.0 - 22.0 * numpy.cos(angle)
    path = neck + [0.0, rng.uniform(5.0, 30.0), 12.0] + numpy.stack([wide * numpy.sin(angle), lift, wide * 0.95 *
                                                                   numpy.cos(angle)], -1)
    swell = 1.0 + (rng.uniform(0.0, 1.2) * numpy.maximum(0.0, -numpy.cos(angle)) ** 2)
    return make(*tube(path, thick * swell), albedo, CLOTH)


MAKERS = {"cap": cap, "knitted": knitted, "brimmed": brimmed, "hood": hood, "bicycle": bicycle, "hard hat": hard_hat,
          "full face": full_face, "mask": mask, "beard": beard, "glasses": glasses, "headphones": headphones}


def draw_worn(rng, sex, age):
    """Names of what a person wears."""
    worn = []
    if rng.random() < 0.22:
        worn.append(HATS[rng.integers(len(HATS))])
    if sex and age > 0.4 and rng.random() < 0.35:
        worn.append("beard")
    elif rng.random() < 0.08:
        worn.append("mask")
    if rng.random() < 0.25:
        worn.append("glasses")
    if not worn and rng.random() < 0.08:
        worn.append("headphones")
    return tuple(worn)


def build(head, name, rng):
    albedo = float(rng.choice([rng.uniform(0.05, 0.15), rng.uniform(0.15, 0.45), rng.uniform(0.45, 0.85)]))
    return MAKERS[name](head, rng, albedo)
