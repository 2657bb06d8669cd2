"""Furniture and things: meshes in the level camera frame (y down), mm."""

import numpy

from body import rotation
from hair import ball, grid_faces, tube
from mesh import THING, join, make
from noise import smooth

X, Y, Z = numpy.eye(3)


def draw_albedo(rng):
    return float(rng.choice([rng.uniform(0.04, 0.12), rng.uniform(0.12, 0.4), rng.uniform(0.4, 0.85)],
                            p=(0.25, 0.4, 0.35)))


def box(centre, half, rng, yaw=0.0, tag=THING, albedo=None):
    corners = numpy.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float) * half
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6],
             [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return make(corners @ rotation(Y, yaw).T + centre, faces, draw_albedo(rng) if albedo is None else albedo, tag)


def cushion(centre, half, rng, power=4.0, yaw=0.0, tag=THING):
    """A rounded block: a superellipsoid."""
    points, faces = ball(numpy.zeros(3), numpy.ones(3), 22, 33)
    signed = numpy.sign(points) * abs(points) ** (2.0 / power)
    signed = signed / numpy.maximum((abs(signed) ** power).sum(axis=1, keepdims=True) ** (1.0 / power), 1e-9)
    signed = signed * half
    signed = signed + 0.02 * min(half) * smooth(signed, 60.0, int(rng.integers(2 ** 62)))[:, None]
    return make(signed @ rotation(Y, yaw).T + centre, faces, draw_albedo(rng), tag)


def lathe(base, profile, rng, tag=THING, sides=28):
    """Radius and height above the base, (n, 2), turned about the upright."""
    profile = numpy.asarray(profile, float)
    around = numpy.linspace(0.0, 2.0 * numpy.pi, sides + 1)
    height = numpy.broadcast_to(-profile[:, 1:], (len(profile), sides + 1))
    points = numpy.stack([profile[:, :1] * numpy.cos(around), height,
                          profile[:, :1] * numpy.sin(around)], axis=-1)
    return make(points.reshape(-1, 3) + base, grid_faces(len(profile), sides + 1), draw_albedo(rng), tag)


def wall(z_mm, slope, rng):
    """Behind everything, with some relief."""
    x, y = numpy.meshgrid(numpy.linspace(-4000, 4000, 41), numpy.linspace(-3000, 3000, 31), indexing="ij")
    z = z_mm + slope * x
    points = numpy.stack([x, y, z], -1).reshape(-1, 3)
    return make(points, grid_faces(41, 31), rng.uniform(0.2, 0.85))


def seat(head_mm, rng):
    """A chair's back behind a seated person whose head is there; sometimes with a headrest."""
    kind = rng.integers(5)
    back_z = head_mm[2] + rng.uniform(130.0, 220.0)
    top_y = head_mm[1] + (rng.uniform(-60.0, 120.0) if kind == 0 else rng.uniform(150.0, 420.0))
    half = numpy.array([rng.uniform(170.0, 300.0), 330.0, rng.uniform(15.0, 60.0)])
    centre = numpy.array([head_mm[0] + rng.normal(0.0, 40.0), top_y + half[1], back_z + half[2]])
    meshes = [cushion(centre, half, rng, rng.uniform(4.0, 9.0), rng.normal(0.0, 0.15))]
    if kind == 1:
        headrest = numpy.array([rng.uniform(90.0, 150.0), rng.uniform(60.0, 110.0), rng.uniform(35.0, 60.0)])
        middle = numpy.array([centre[0], head_mm[1] + rng.uniform(-20.0, 60.0), back_z + headrest[2]])
        meshes.append(cushion(middle, headrest, rng))
    return join(meshes)


def table(head_mm, rng):
    """Before the person, below the chest."""
    top = head_mm[1] + rng.uniform(380.0, 520.0)
    return box(numpy.array([head_mm[0] + rng.normal(0.0, 150.0), top + 20.0, head_mm[2] - rng.uniform(150.0, 350.0)]),
               numpy.array([rng.uniform(400.0, 800.0), 20.0, rng.uniform(200.0, 350.0)]), rng, rng.normal(0.0, 0.1))


def seat_with_headrest(head_mm, rng):
    """Of a car, of an office: nobody sits before it."""
    back_z = head_mm[2] + rng.uniform(130.0, 220.0)
    top_y = head_mm[1] + rng.uniform(90.0, 300.0)
    half = numpy.array([rng.uniform(170.0, 300.0), 330.0, rng.uniform(15.0, 70.0)])
    yaw = rng.normal(0.0, 0.3)
    centre = numpy.array([head_mm[0] + rng.normal(0.0, 40.0), top_y + half[1], back_z + half[2]])
    meshes = [cushion(centre, half, rng, rng.uniform(3.0, 9.0), yaw)]
    headrest = numpy.array([rng.uniform(90.0, 150.0), rng.uniform(60.0, 120.0), rng.uniform(30.0, 70.0)])
    gap = rng.choice([0.0, rng.uniform(20.0, 60.0)])
    middle = numpy.array([centre[0], top_y - gap - 0.8 * headrest[1], back_z + headrest[2] + rng.normal(0.0, 25.0)])
    meshes.append(cushion(middle, headrest, rng, rng.uniform(2.2, 6.0), yaw))
    if gap > 0.0:
        for side in (-1, 1):
            meshes.append(box(middle + [side * headrest[0] * 0.4, headrest[1] + 0.5 * gap, 0.0],
                              numpy.array([8.0, gap, 8.0]), rng))
    return join(meshes)


def chair(place, rng):
    """Stands there with its back upright; sometimes a jacket hangs over it. `place` is the seat's middle."""
    yaw = rng.uniform(-numpy.pi, numpy.pi)
    half = numpy.array([rng.uniform(190.0, 260.0), rng.uniform(200.0, 380.0), rng.uniform(12.0, 45.0)])
    rotated = rotation(Y, yaw)
    seat_half = numpy.array([half[0], rng.uniform(15.0, 60.0), half[0]])
    meshes = [cushion(numpy.zeros(3), seat_half, rng, 6.0), cushion(
        numpy.array([0.0, -half[1] - 30.0, half[0]]), half, rng, 6.0)]
    if rng.random() < 0.35:
        headrest = numpy.array([rng.uniform(90.0, 150.0), rng.uniform(50.0, 110.0), rng.uniform(30.0, 60.0)])
        meshes.append(cushion(numpy.array([0.0, -2.0 * half[1] - 30.0 - headrest[1] * 0.9, half[0]]), headrest, rng))
    if rng.random() < 0.4:
        coat = half * [1.08, 0.8, 0.0] + [0.0, 0.0, rng.uniform(50.0, 90.0)]
        shape = cushion(numpy.array([0.0, -half[1] - 60.0, half[0]]), coat, rng, 3.0)
        shape.vertices += 25.0 * smooth(shape.vertices, 120.0, int(rng.integers(2 ** 62)))[:, None] * [1.0, 0.2, 1.0]
        meshes.append(shape)
        for side in (-1.0, 1.0):
            path = [[side * coat[0], -1.5 * half[1], half[0]], [side * (coat[0] + 30.0), -half[1], half[0]],
                    [side * coat[0], -0.3 * half[1], half[0] + 20.0]]
            meshes.append(make(*tube(path, [70.0, 60.0, 45.0]), draw_albedo(rng)))
    for right in (-1.0, 1.0):
        for deep in (-1.0, 1.0):
            meshes.append(box(numpy.array([right * half[0] * 0.9, 240.0,
                          deep * half[0] * 0.9]), (18.0, 220.0, 18.0), rng))
    return join(meshes).moved(rotated, place)


def armchair(place, rng):
    half = rng.uniform(260.0, 420.0)
    high = rng.uniform(250.0, 480.0)
    side = numpy.array([rng.uniform(60.0, 110.0), rng.uniform(150.0, 230.0), half])
    meshes = [cushion(numpy.array([0.0, 60.0, 0.0]), numpy.array([half, 110.0, half]), rng, 5.0),
              cushion(numpy.array([0.0, -high + 60.0, half]),
                      numpy.array([half, high, rng.uniform(80.0, 140.0)]), rng, 4.0)]
    for sign in (-1.0, 1.0):
        meshes.append(cushion(numpy.array([sign * (half + side[0]), 0.0, 0.0]), side, rng, 4.0))
        if rng.random() < 0.3:
            wing = numpy.array([50.0, 0.5 * high, 120.0])
            meshes.append(cushion(numpy.array([sign * half, -1.5 * high + 60.0, half - 80.0]), wing, rng, 3.0))
    if rng.random() < 0.5:
        size = rng.uniform(140.0, 240.0)
        meshes.append(cushion(numpy.array([rng.normal(0.0, 80.0), -size, half - 150.0]),
                              numpy.array([size, size, 0.4 * size]), rng, 2.5))
    return join(meshes).moved(rotation(Y, rng.uniform(-0.9, 0.9)), place)


def plant(place, rng):
    """A pot and leaves."""
    pot = rng.uniform(60.0, 160.0)
    meshes = [lathe(place, [(0, 0), (0.7 * pot, 0), (pot, 1.5 * pot), (0.9 * pot, 1.5 * pot), (0, 1.3 * pot)], rng)]
    high, wide = rng.uniform(2.0, 6.0) * pot, rng.uniform(1.0, 2.5) * pot
    albedo = rng.uniform(0.2, 0.5)
    for _ in range(int(rng.integers(25, 80))):
        direction = rng.normal(0.0, 1.0, 3)
        crown = place - [0.0, 1.5 * pot + 0.5 * high, 0.0]
        tip = crown + direction / numpy.linalg.norm(direction) * [wide, 0.5 * high, wide] * (
            rng.uniform(0.3, 1.0))
        half = numpy.array([rng.uniform(12.0, 35.0), 1.5, rng.uniform(35.0, 90.0)])
        points, faces = ball(numpy.zeros(3), half, 8, 9)
        rotated = rotation(Y, rng.uniform(0, 6.28)) @ rotation(X, rng.uniform(-1.2, 1.2))
        meshes.append(make(points @ rotated.T + tip, faces, albedo))
    stem = [place + [0.0, -1.3 * pot, 0.0], place + [0.0, -1.5 * pot - \
        0.5 * high, 0.0], place + [10.0, -1.5 * pot - 0.9 * high, 0.0]]
    return join([*meshes, make(*tube(stem, [10.0, 8.0, 4.0]), 0.2)])


def lamp(place, rng):
    high = rng.uniform(250.0, 1300.0)
    meshes = [make(*tube([place, place - [0.0, 0.5 * high, 0.0], place - [0.0, high, 0.0]], [12.0, 10.0, 10.0]), 0.3),
              lathe(place, [(0, 25), (rng.uniform(60.0, 140.0), 20), (60, 0)], rng)]
    top, low = rng.uniform(40.0, 130.0), rng.uniform(90.0, 220.0)
    if rng.random() < 0.3:
        return join([*meshes, make(*ball(place - [0.0, high, 0.0], numpy.full(3, low * 0.7)), 0.8)])
    shade = lathe(place - [0.0, high - 0.5 * low, 0.0], [(low, 0), (top, rng.uniform(0.8, 1.8) * low)], rng)
    return join([*meshes, shade])


def balloons(place, rng):
    meshes = []
    for _ in range(int(rng.integers(1, 4))):
        size = rng.uniform(90.0, 150.0)
        at = place + rng.normal(0.0, 160.0, 3) * [1.0, 0.8, 0.6] - [0.0, 400.0, 0.0]
        meshes.append(
            make(*ball(at, numpy.array([size, size * rng.uniform(1.05, 1.35), size])), rng.uniform(0.2, 0.7)))
        meshes.append(
            make(*tube([at + [0.0, size, 0.0], at + [5.0, size + 150.0, 0.0], place], numpy.full(3, 2.0), 5), 0.5))
    return join(meshes)


def globe(place, rng):
    size = rng.uniform(80.0, 170.0)
    middle = place - [0.0, 1.6 * size, 0.0]
    angle = numpy.linspace(-1.2, 1.9, 15)
    ring = middle + numpy.stack([1.12 * size * numpy.cos(angle), 1.12 * size * numpy.sin(angle), 0.0 * angle], -1)
    return join([make(*ball(middle, numpy.full(3, size)), rng.uniform(0.2, 0.7)),
                 make(*tube(ring, numpy.full(15, 6.0)), 0.4),
                 lathe(place, [(0, 0), (0.7 * size, 0), (0.6 * size, 18), (12, 30), (12, 0.6 * size)], rng)])


def vessel(place, rng):
    """A bowl, a bottle, a vase, a kettle or a pot."""
    size = rng.uniform(35.0, 130.0)
    profiles = ([(0, 0), (0.4, 0), (1, 0.7), (0.95, 0.7), (0.3, 0.1)],
                [(0, 0), (0.5, 0), (0.5, 2.2), (0.18, 2.8), (0.18, 3.4), (0, 3.4)],
                [(0, 0), (0.5, 0), (0.9, 0.9), (0.8, 1.6), (0.35, 2.1), (0.5, 2.5)],
                [(0, 0), (0.9, 0), (1, 0.5), (0.85, 1.2), (0.3, 1.45), (0.12, 1.6), (0, 1.65)],
                [(0, 0), (0.8, 0), (0.8, 0.9), (0.85, 0.95), (0.7, 1.0), (0.1, 1.15), (0, 1.3)])
    profile = numpy.array(profiles[rng.integers(len(profiles))]) * size
    # Between its corners a vessel is round.
    part = numpy.linspace(0.0, len(profile) - 1.0, 4 * len(profile))
    fine = numpy.stack([numpy.interp(part, numpy.arange(len(profile)), profile[:, i]) for i in (0, 1)], -1)
    return lathe(place, fine, rng)


def jug(place, rng):
    """Milk, oil, detergent, petrol: a block with shoulders, a neck and a handle."""
    half = numpy.array([rng.uniform(55.0, 110.0), rng.uniform(80.0, 170.0), rng.uniform(55.0, 110.0)])
    yaw = rng.uniform(-numpy.pi, numpy.pi)
    middle = place - [0.0, half[1], 0.0]
    block = cushion(middle, half, rng, rng.uniform(2.3, 6.0), yaw)
    # Towards the top it narrows to the neck.
    above = numpy.clip((middle[1] - block.vertices[:, 1]) / half[1], 0.0, 1.0)
    narrow = 1.0 - rng.uniform(0.2, 0.75) * above ** rng.uniform(1.0, 3.0)
    block.vertices[:, [0, 2]] = (block.vertices[:, [0, 2]] - place[[0, 2]]) * narrow[:, None] + place[[0, 2]]
    top = place - [0.0, 2.0 * half[1] - 10.0, 0.0]
    neck = rng.uniform(12.0, 45.0)
    meshes = [block, lathe(top, [(neck, 0), (neck, rng.uniform(20.0, 70.0)), (0, rng.uniform(20.0, 70.0))], rng)]
    if rng.random() < 0.7:
        side = rotation(Y, yaw) @ X * (half[0] + 10.0)
        path = [top + 0.3 * side, top + side + [0.0, 0.3 * half[1], 0.0], middle + side, middle + 0.8 * side + 0.4 * half[1] * Y]
        meshes.append(make(*tube(path, numpy.full(4, rng.uniform(8.0, 20.0))), draw_albedo(rng)))
    return join(meshes)


def bag(place, rng):
    half = numpy.array([rng.uniform(120.0, 220.0), rng.uniform(140.0, 260.0), rng.uniform(60.0, 120.0)])
    shape = cushion(place - [0.0, half[1], 0.0], half, rng, 2.8, rng.uniform(-1.0, 1.0))
    shape.vertices += 18.0 * smooth(shape.vertices, 90.0, int(rng.integers(2 ** 62)))[:, None]
    angle = numpy.linspace(0.0, numpy.pi, 13)
    handle = place - [0.0, 2.0 * half[1] - 20.0, 0.0] + \
        numpy.stack([70.0 * numpy.cos(angle), -80.0 * numpy.sin(angle), 0.0 * angle], -1)
    return join([shape, make(*tube(handle, numpy.full(13, 8.0)), 0.15)])


def coat(place, rng):
    """On a stand or a hook, sometimes with a hat above it."""
    wide, long_mm = rng.uniform(180.0, 240.0), rng.uniform(350.0, 550.0)
    shape = cushion(place - [0.0, long_mm, 0.0], numpy.array([wide, long_mm, rng.uniform(70.0, 130.0)]), rng, 2.6)
    shape.vertices += 30.0 * smooth(shape.vertices * [1.0, 0.3, 1.0],
                                    80.0, int(rng.integers(2 ** 62)))[:, None] * [1.0, 0.1, 1.0]
    meshes = [shape]
    if rng.random() < 0.35:
        meshes.append(lathe(place - [0.0, 2.0 * long_mm + 40.0, 0.0],
                      [(160, 0), (95, 10), (90, 90), (60, 120), (0, 125)], rng))
    return join(meshes)


def screen(place, rng):
    half = numpy.array([rng.uniform(180.0, 350.0), rng.uniform(120.0, 220.0), 12.0])
    yaw = rng.uniform(-0.5, 0.5)
    return join([box(place - [0.0, half[1] + 120.0, 0.0], half, rng, yaw, albedo=0.08),
                 box(place - [0.0, 60.0, 0.0], (30.0, 60.0, 20.0), rng),
                 box(place - [0.0, 8.0, 0.0], (110.0, 8.0, 80.0), rng)])


def crate(place, rng):
    half = rng.uniform(50.0, 200.0, 3)
    return box(place - [0.0, half[1], 0.0], half, rng, rng.uniform(-0.8, 0.8))


def round_thing(place, rng):
    """A ball, a melon, a helmet that was put down, a cushion on its edge."""
    size = rng.uniform(60.0, 150.0)
    axes = size * numpy.array([1.0, rng.uniform(0.7, 1.3), rng.uniform(0.8, 1.3)])
    points, faces = ball(place - [0.0, axes[1], 0.0], axes)
    points = points + 0.04 * size * smooth(points, 0.8 * size, int(rng.integers(2 ** 62)))[:, None]
    return make(points, faces, draw_albedo(rng))


SMALL = (vessel, vessel, crate, round_thing, globe, plant, lamp, screen, bag)
# Too low to hide who sits behind.
LOW = (vessel, round_thing)
LARGE = (chair, chair, armchair, plant, lamp, bag, coat, crate, balloons)


# Stands on floors and tables that a camera looks down on.
GROUND = (jug, jug, jug, vessel, vessel, round_thing, crate, bag, plant)


def shelf(place, rng):
    """Boards with things on them; `place` is the middle of its lowest board."""
    half, deep = rng.uniform(300.0, 700.0), rng.uniform(120.0, 180.0)
    gap, boards = rng.uniform(250.0, 400.0), int(rng.integers(3, 6))
    meshes = [box(place + [0.0, -0.5 * gap * boards, deep + 8.0], (half, 0.5 * gap * boards + 20.0, 8.0), rng)]
    for side in (-1.0, 1.0):
        meshes.append(box(place + [side * half, -0.5 * gap * boards, 0.0],
                      (12.0, 0.5 * gap * boards + 20.0, deep), rng))
    for board in range(boards):
        level = place - [0.0, gap * board, 0.0]
        meshes.append(box(level, (half, 10.0, deep), rng))
        x = -half + 60.0
        while x < half - 60.0:
            if rng.random() < 0.5:
                book = numpy.array([rng.uniform(10.0, 30.0), rng.uniform(80.0, 0.4 * gap), rng.uniform(70.0, 110.0)])
                meshes.append(box(level + [x, -10.0 - book[1], 0.0], book, rng))
                x += 2.0 * book[0] + 2.0
            else:
                kind = (vessel, round_thing, crate)[rng.integers(3)]
                thing = kind(numpy.zeros(3), rng)
                size = min(1.0, 0.8 * gap / max(1.0, numpy.ptp(thing.vertices[:, 1])))
                thing.vertices *= size
                meshes.append(thing.moved(numpy.eye(3), level + [x + 70.0, -10.0, 0.0]))
                x += 170.0
    return join(meshes)


def laid_table(middle, rng, things=SMALL):
    """A table with things on it; `middle` is of its top."""
    half = numpy.array([rng.uniform(300.0, 700.0), 18.0, rng.uniform(250.0, 450.0)])
    meshes = [box(middle, half, rng, rng.normal(0.0, 0.2))]
    for _ in range(int(rng.integers(1, 7))):
        at = middle + [rng.uniform(-0.8, 0.8) * half[0], -18.0, rng.uniform(-0.8, 0.8) * half[2]]
        meshes.append(things[rng.integers(len(things))](at, rng))
    return join(meshes)


def curtain(z_mm, rng):
    x, y = numpy.meshgrid(numpy.linspace(-2500, 2500, 301), numpy.linspace(-2000, 2000, 9), indexing="ij")
    fold = rng.uniform(60.0, 200.0)
    z = z_mm + rng.uniform(15.0, 60.0) * numpy.sin(2 * numpy.pi * x / fold + 0.6 * \
                           numpy.sin(x / 170.0)) * (0.7 + 0.3 * numpy.sin(y / 700.0))
    return make(numpy.stack([x, y, z], -1).reshape(-1, 3), grid_faces(301, 9), rng.uniform(0.2, 0.7))
