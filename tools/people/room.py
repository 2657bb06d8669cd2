"""Rooms: what stands behind, beside and before people, and rooms without people."""

import numpy

import things
from hair import grid_faces
from mesh import join, make

SEATED_MM, STANDING_MM = 1230.0, 1620.0


def floor(y_mm, rng):
    x, z = numpy.meshgrid(numpy.linspace(-4000, 4000, 9), numpy.linspace(200, 7000, 9), indexing="ij")
    return make(numpy.stack([x, numpy.full_like(x, y_mm), z], -1).reshape(-1, 3),
                grid_faces(9, 9), rng.uniform(0.15, 0.6))


def backdrop(z_mm, rng):
    """A wall, a curtain, or things before a wall; or nothing."""
    kind = rng.random()
    if kind < 0.12:
        return []
    if kind < 0.22:
        return [things.curtain(z_mm, rng)]
    meshes = [things.wall(z_mm, rng.normal(0.0, 0.15), rng)]
    if rng.random() < 0.5:
        for _ in range(int(rng.integers(1, 4))):
            half = numpy.array([rng.uniform(100.0, 400.0), rng.uniform(100.0, 400.0), rng.uniform(8.0, 40.0)])
            meshes.append(things.box(numpy.array(
                [rng.uniform(-900, 900), rng.uniform(-600, 400), z_mm - 20.0]), half, rng))
    if rng.random() < 0.2:
        meshes.append(things.box(numpy.array([rng.choice([-1, 1]) * rng.uniform(500, 1200), 0.0, z_mm - 400.0]),
                                 numpy.array([30.0, 2000.0, 900.0]), rng))
    return meshes


def around(heads_mm, seated, turning, deep_mm, rng, has_floor=False):
    """A room for people whose heads are there; somebody comes from `deep_mm` behind them."""
    middle = numpy.mean(heads_mm, axis=0)
    depth = max(head[2] for head in heads_mm)
    behind = rng.choice([rng.uniform(280.0, 600.0), rng.uniform(600.0, 2500.0)])
    behind = max(behind, deep_mm)
    meshes = backdrop(depth + behind, rng)
    floor_y = middle[1] + (SEATED_MM if seated else STANDING_MM)
    if rng.random() < 0.5 or has_floor:
        meshes.append(floor(floor_y, rng))
    for head in heads_mm:
        if seated and rng.random() < (0.25 if turning else 0.75):
            meshes.append(things.seat(head, rng))
    if seated and rng.random() < 0.35:
        meshes.append(things.laid_table(middle + [rng.normal(0.0, 200.0), rng.uniform(420.0, 520.0),
                                                  -rng.uniform(300.0, 500.0)], rng, things.LOW)
                      if depth > 900.0 else things.table(middle, rng))
    if behind > 450.0:
        meshes += beside(middle, depth, behind, floor_y, rng)
    return join(meshes) if meshes else None


def beside(middle, depth, behind, floor_y, rng):
    """Furniture to the sides and behind."""
    meshes = []
    for _ in range(int(rng.integers(0, 5))):
        side = rng.choice([-1.0, 1.0])
        place = numpy.array([middle[0] + side * rng.uniform(380.0, 1000.0),
                            floor_y, depth + rng.uniform(0.1, 0.9) * behind])
        if rng.random() < 0.25:
            meshes.append(things.shelf(place - [0.0, 300.0, 0.0], rng))
        else:
            thing = things.LARGE[rng.integers(len(things.LARGE))]
            lift = rng.choice([0.0, rng.uniform(300.0, 1300.0)])
            meshes.append(
                thing(place - [0.0, lift + (430.0 if thing in (things.chair, things.armchair) else 0.0), 0.0], rng))
    return meshes


def empty(rng, has_floor=False):
    """Nobody, but much that is as large and as round as a head, at a head's distance."""
    depth = rng.uniform(550.0, 1900.0)
    level = rng.uniform(-150.0, 350.0)
    meshes = backdrop(depth + rng.choice([rng.uniform(250.0, 600.0), rng.uniform(600.0, 2500.0)]), rng)
    kind = rng.integers(5)
    middle = numpy.array([rng.normal(0.0, 0.1) * depth, level, depth])
    if kind == 0:
        meshes.append(things.laid_table(middle + [0.0, 80.0, 0.0], rng))
    elif kind == 1:
        meshes.append(things.shelf(middle + [0.0, rng.uniform(300.0, 800.0), 0.0], rng))
    for _ in range(int(rng.integers(1, 5)) if kind > 1 else int(rng.integers(0, 3))):
        thing = (things.SMALL + things.LARGE)[rng.integers(len(things.SMALL) + len(things.LARGE))]
        place = middle + numpy.array([rng.normal(0.0, 0.25) * depth, rng.uniform(0.0, 400.0), rng.normal(0.0, 200.0)])
        place[2] = max(place[2], 520.0)
        mesh = thing(place, rng)
        if rng.random() < 0.5:
            mesh.vertices[:, 1] -= mesh.vertices[:, 1].mean() - rng.uniform(-0.15, 0.15) * depth
        mesh.vertices[:, 2] += max(0.0, 430.0 - mesh.vertices[:, 2].min())
        meshes.append(mesh)
    if kind == 2:
        meshes.append(things.seat(middle + [0.0, -rng.uniform(0.0, 200.0), 0.0], rng))
    if rng.random() < 0.4 or has_floor:
        meshes.append(floor(level + rng.uniform(350.0, 1400.0), rng))
    return join(meshes) if meshes else None


def empty_seat(rng, has_floor=False):
    """A seat with a headrest."""
    depth = rng.uniform(550.0, 1800.0)
    head = numpy.array([rng.normal(0.0, 0.1), rng.uniform(-0.2, 0.15), 1.0]) * depth
    behind = rng.choice([rng.uniform(280.0, 600.0), rng.uniform(600.0, 2500.0)])
    meshes = backdrop(depth + behind, rng)
    if rng.random() < 0.4 or has_floor:
        meshes.append(floor(head[1] + SEATED_MM, rng))
    meshes.append(things.seat_with_headrest(head, rng))
    if rng.random() < 0.3:
        meshes.append(things.table(head, rng))
    if behind > 450.0:
        meshes += beside(head, depth, behind, head[1] + SEATED_MM, rng)
    return join(meshes)


def ground(rng, has_floor=False):
    """Things that stand on a floor or a table, to be looked at from above: jugs, vessels, balls, bags."""
    level = rng.uniform(-150.0, 500.0)
    # Where the camera's axis meets the ground depends on its tilt.
    middle_z = 1000.0 + level * rng.uniform(0.4, 2.0)
    if rng.random() < 0.7 or has_floor:
        meshes = [floor(level, rng)]
        if rng.random() < 0.4:
            meshes.append(things.wall(middle_z + rng.uniform(500.0, 2000.0), rng.normal(0.0, 0.3), rng))
    else:
        meshes = [things.box(numpy.array([0.0, level + 20.0, middle_z]),
                             numpy.array([rng.uniform(400.0, 900.0), 20.0, rng.uniform(250.0, 450.0)]), rng)]
        if rng.random() < 0.5:
            meshes.append(floor(level + rng.uniform(400.0, 800.0), rng))
    for _ in range(int(rng.integers(1, 5))):
        place = numpy.array([rng.normal(0.0, 180.0), level, middle_z + rng.normal(0.0, 170.0)])
        meshes.append(things.GROUND[rng.integers(len(things.GROUND))](place, rng))
    if rng.random() < 0.2:
        place = numpy.array([rng.normal(0.0, 500.0), level - 430.0, middle_z + rng.uniform(400.0, 1000.0)])
        meshes.append(things.chair(place, rng))
    return join(meshes)


ROOMS = {"empty": empty, "above": empty, "ground": ground, "seat": empty_seat}
