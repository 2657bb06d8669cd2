"""Hair: shells over the scalp that fall straight down where they are long, and what is tied of them.

Body frame, mm, at rest. Twelve kinds.
"""

import numpy

from head import directions
from mesh import HAIR, join, make
from noise import smooth

AROUND, ALONG = 96, 64
# thickness on top and at the sides, lowest front (angle from the crown), length below the chin (None: ends at the
# nape), half the face's opening (radians), waviness, fuzz
KINDS = {
    "shorn": dict(top=(1, 3), side=(1, 2), front=(50, 60), length=None, opening=(1.0, 1.2), rough=0.1, fuzz=(0.5, 1)),
    "short": dict(top=(8, 18), side=(4, 9), front=(50, 62), length=None, opening=(1.0, 1.25), rough=0.4, fuzz=(2, 4)),
    "quiff": dict(top=(25, 42), side=(3, 8), front=(42, 52), length=None, opening=(1.0, 1.2), rough=0.5, fuzz=(2, 4)),
    "bald crown": dict(top=(-9, -9), side=(5, 12), front=(70, 80), length=None, opening=(1.0, 1.2), rough=0.4,
                       fuzz=(1, 3)),
    "curls": dict(top=(18, 36), side=(15, 30), front=(48, 62), length=None, opening=(0.9, 1.15), rough=0.9,
                  fuzz=(4, 7)),
    "afro": dict(top=(45, 80), side=(45, 80), front=(42, 56), length=None, opening=(1.0, 1.3), rough=0.25, fuzz=(5, 9),
                 ending=0.7),
    "bob": dict(top=(14, 26), side=(18, 34), front=(48, 75), length=(-30, 15), opening=(0.7, 1.0), rough=0.3,
                fuzz=(3, 5)),
    "long": dict(top=(10, 20), side=(10, 22), front=(45, 60), length=(80, 260), opening=(0.75, 1.15), rough=0.25,
                 fuzz=(3, 5)),
    "loose": dict(top=(18, 34), side=(22, 42), front=(48, 75), length=(90, 300), opening=(0.45, 0.8), rough=0.7,
                  fuzz=(4, 7)),
    "bun": dict(top=(6, 12), side=(4, 10), front=(42, 55), length=None, opening=(1.0, 1.25), rough=0.2, fuzz=(2, 3)),
    "tail": dict(top=(6, 12), side=(4, 10), front=(42, 55), length=None, opening=(1.0, 1.25), rough=0.2, fuzz=(2, 3)),
    "plaits": dict(top=(6, 14), side=(6, 12), front=(45, 72), length=None, opening=(0.9, 1.2), rough=0.2, fuzz=(2, 4)),
}


def step(low, high, x):
    t = numpy.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def grid_faces(rows, columns):
    """Triangles of a grid of vertices, row by row."""
    index = numpy.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    return numpy.concatenate([numpy.stack([a, b, c], -1).reshape(-1, 3), numpy.stack([a, c, d], -1).reshape(-1, 3)])


def tube(path, radii, sides=12):
    """A closed tube along points (n, 3)."""
    path, radii = numpy.asarray(path, float), numpy.asarray(radii, float)
    along = numpy.gradient(path, axis=0)
    along /= numpy.linalg.norm(along, axis=1, keepdims=True)
    across = numpy.cross(along, [0.31, 0.17, 0.93])
    across /= numpy.linalg.norm(across, axis=1, keepdims=True)
    other = numpy.cross(along, across)
    angle = numpy.linspace(0.0, 2.0 * numpy.pi, sides + 1)
    ring = (across[:, None] * numpy.cos(angle)[None, :, None] + other[:, None] * numpy.sin(angle)[None, :, None])
    points = path[:, None] + ring * radii[:, None, None]
    return points.reshape(-1, 3), grid_faces(len(path), sides + 1)


def ball(centre, axes, rows=18, columns=25):
    down, around = numpy.meshgrid(numpy.linspace(0, numpy.pi, rows), numpy.linspace(0, 2 * numpy.pi, columns),
                                  indexing="ij")
    return numpy.asarray(centre) + (directions(around, down) * axes).reshape(-1, 3), grid_faces(rows, columns)


def shell(head, kind, rng):
    """The part on the head and what falls from it."""
    side_mm, top_mm = rng.uniform(*kind["side"]), rng.uniform(*kind["top"])
    front, opening = numpy.radians(rng.uniform(*kind["front"])), rng.uniform(*kind["opening"])
    parting = rng.uniform(-0.5, 0.5)
    long_mm = None if kind["length"] is None else rng.uniform(*kind["length"])
    seed = int(rng.integers(2 ** 62))
    around = numpy.linspace(-numpy.pi, numpy.pi, AROUND + 1)
    beside = step(opening * 0.8, opening * 1.15, abs(around))
    # The border of short hair falls from the forehead over the temples to the nape.
    nape = numpy.radians(92.0) + numpy.radians(26.0) * step(1.75, 2.6, abs(around))
    ends = front + (nape - front) * beside
    part = numpy.linspace(0.0, 1.0, ALONG)
    if long_mm is None:
        down = ends[:, None] * part
        points = _over_head(head, around, down)
    else:
        points, down = _falling(head, around, front, beside, part, long_mm)
    outward = points - head.origin
    outward[..., 1] *= 1.0 - 0.65 * step(1.1, 1.7, down)
    outward /= numpy.linalg.norm(outward, axis=-1, keepdims=True)
    on_top = step(1.25, 0.55, down)
    thick = side_mm + (top_mm - side_mm) * on_top
    thick = thick * (1.0 - 0.25 * numpy.exp(-((points[..., 0] - 30.0 * parting) / 12.0) ** 2) * on_top)
    ending = step(1.0, kind.get("ending", 0.84), part)[None, :]
    taper = ending if long_mm is None else 1.0 - (1.0 - ending) * (1.0 - beside[:, None])
    waves = smooth(points, 45.0, seed) + 0.7 * smooth(points, 20.0, seed + 1) + 0.4 * smooth(points, 9.0, seed + 2)
    thick = thick * taper * (1.0 + 0.55 * kind["rough"] * waves)
    if kind["top"][0] < 0:
        # Below the skin, on top and before.
        thick = numpy.where((on_top > 0.3) | (beside[:, None] < 0.5), -6.0, thick)
    points = points + outward * (thick + 0.5)[..., None]
    return make(points.reshape(-1, 3), grid_faces(AROUND + 1, ALONG), 1.0, HAIR)


def _over_head(head, around, down):
    grid = numpy.broadcast_to(around[:, None], down.shape)
    return head.origin + head.radius(grid, down)[..., None] * directions(grid, down)


def _falling(head, around, front, beside, part, long_mm):
    """Along the scalp to where the head is widest, then straight down; before the face it ends at the forehead."""
    end_mm = head.chin_mm - long_mm
    scalp = numpy.radians(95.0)
    down = numpy.minimum(1.0, part / 0.55)[None, :] * (front + (scalp - front) * beside)[:, None]
    points = _over_head(head, around, down)
    fall = numpy.maximum(0.0, part - 0.55) / 0.45
    lowest = points[:, -1, 1]
    drop = (lowest - end_mm)[:, None] * fall * beside[:, None]
    points[..., 1] -= drop
    behind = numpy.clip(-numpy.cos(around), 0.0, 1.0)
    points[..., 2] -= (drop * 0.12 * behind[:, None])
    return points, down + numpy.where(fall > 0.0, 0.6, 0.0)


def build(head, name, rng):
    """A mesh of the named kind; its albedo and fuzz are of the hair."""
    kind = KINDS[name]
    meshes = [shell(head, kind, rng)]
    a, b, c = head.axes_mm
    seed = int(rng.integers(2 ** 62))
    if name == "bun":
        angle = rng.uniform(-0.1, 1.3)
        size = rng.uniform(26.0, 44.0)
        at = head.centre + numpy.array([0.0, b * numpy.sin(angle), -c * numpy.cos(angle)]
                                       ) * (1.0 + 0.5 * size / 100.0)
        meshes.append(make(*ball(at, numpy.array([size, size * 0.9, size])), 1.0, HAIR))
    if name == "tail":
        high = rng.uniform(0.1, 0.8)
        start = head.centre + numpy.array([0.0, b * high, -c * numpy.sqrt(1.0 - high * high) - 6.0])
        length = rng.uniform(120.0, 330.0)
        part = numpy.linspace(0.0, 1.0, 14)
        lift = 25.0 * numpy.sin(numpy.pi * numpy.minimum(1, 4 * part))
        path = start + numpy.stack([8.0 * numpy.sin(5.0 * part), lift -
                                    length * part, -35.0 * numpy.minimum(1.0, 3.0 * part) + 10 * part], -1)
        meshes.append(make(*tube(path, 24.0 * numpy.sin(numpy.pi * (0.15 + 0.75 * part)) + 4.0), 1.0, HAIR))
    if name == "plaits":
        length = rng.uniform(120.0, 300.0)
        forward = rng.uniform(-20.0, 40.0)
        part = numpy.linspace(0.0, 1.0, 22)
        for side in (-1.0, 1.0):
            start = head.centre + numpy.array([side * a * 0.95, -0.25 * b, -0.35 * c])
            path = start + numpy.stack([side * 14.0 * numpy.sin(2.0 * part), -length * part, forward * part], -1)
            meshes.append(make(*tube(path, 14.0 + 4.0 * numpy.sin(40.0 * part) - 6.0 * part), 1.0, HAIR))
    mesh = join(meshes)
    mesh.albedo = numpy.full(len(mesh.faces), rng.choice([0.05, 0.08, 0.13, 0.22, 0.35, 0.55]))
    mesh.fuzz_mm = numpy.full(len(mesh.faces), rng.uniform(*kind["fuzz"]))
    mesh.vertices = mesh.vertices + 1.5 * smooth(mesh.vertices, 7.0, seed)[:, None]
    return mesh
