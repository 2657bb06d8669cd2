"""Float64 reference of the search for windows, a second and plain implementation.

Scenes are ellipsoids before a plane; the test draws them with the same formula. Every place is
scored, the best is taken and everything near it struck out, until nothing is left."""

import numpy as np

import emit

NEAR_MM, FAR_MM = 400, 8000
PLANE_OFF_MM = 40
LARGE_FROM = 500  # of the seeds of Noise
CELLS_MAX, POSITIONS_APART_MM, WINDOWS_MAX = 19200, 200, 8
SCORE_MIN, SCORE_BEHIND_MAX, CELLS_MIN = 720, 130, 2.5
INSIDE = [(0, 0), (-35, 0), (35, 0), (0, -45), (0, 45), (-40, -45), (40, 45), (-40, 45), (40, -45),
          (-58, 0), (58, 0), (0, -80), (0, 80)]
AROUND = [(s * x, y) for s in (-1, 1) for x, y in
          ((135, 50), (135, 0), (135, -50), (120, -100), (80, -145), (40, -165))] + [(0, -170)]
BELOW = [(0, 150), (0, 200), (-60, 230), (60, 230), (0, 260), (-150, 260), (150, 260)]
BESIDE = [(x, y) for x in (-135, 135) for y in (50, 0, -50, -100)]


class Scene:
    """ellipsoids: middle and semi-axes, mm; plane: its inverse depth on the optical axis and how
    much that grows per unit of y, 1/m; every: only every so many columns and rows are measured."""

    def __init__(self, name, size, focal, plane, ellipsoids, every=1):
        self.name, self.size, self.focal, self.plane = name, size, focal, plane
        self.ellipsoids, self.every = ellipsoids, every

    def draw(self):
        width, height = self.size
        v, u = np.mgrid[:height, :width].astype(float)
        x, y = (u - (width - 1) / 2) / self.focal, (v - (height - 1) / 2) / self.focal
        inverse = (self.plane[0] + self.plane[1] * y) / 1000
        depth = np.where(inverse > 1 / 16000, 1 / np.maximum(inverse, 1e-9), np.inf)
        for middle, axes in self.ellipsoids:
            ray = np.array([x, y, np.ones_like(x)])
            a2 = np.array(axes, float)[:, None, None]**2
            m = np.array(middle, float)[:, None, None]
            a, b, c = (ray * ray / a2).sum(0), (ray * m / a2).sum(0), (m * m / a2).sum(0) - 1
            root = b * b - a * c
            depth = np.minimum(depth, np.where(root > 0, (b - np.sqrt(np.abs(root))) / a, np.inf))
        depth = np.where(depth < 16000, np.floor(np.minimum(depth, 16000) + 0.5), 0)
        depth[(u % self.every > 0) | (v % self.every > 0)] = 0
        return np.where((depth >= NEAR_MM) & (depth <= FAR_MM), depth, 0)


class Noise:
    """160 x 120 cells of depths whose differences are the template's limits, and holes between them:
    wherever a probe is a cell off, or a limit a millimetre, some score is another."""
    size = (160, 120)
    OFFSETS = [0, -40, -41, 110, 111, -100, -101, 89, 90, 149, 150, -149, -150, 400]

    def __init__(self, seed):
        self.seed, self.depth = seed, 450 + seed * 31 % 400
        self.focal = np.full(2, 50 + seed * 7 % 60)
        if seed >= LARGE_FROM:  # probes a mm apart are other cells in x, or in y
            self.focal[seed % 2] = 280 + seed * 13 % 200

    def hash(self, number):
        h = (number * 2654435761 + self.seed * 40503) % 2**32
        h = (h ^ h >> 15) * 1103515245 % 2**32
        return h ^ h >> 13

    def draw(self):
        v, u = np.mgrid[:120, :160]
        depth = self.depth + np.array(self.OFFSETS)[self.hash(v * 160 + u) % len(self.OFFSETS)]
        depth[self.hash(10**6 + v // 4 * 160 + u // 4) % 6 == 0] = 0
        return np.where(depth >= NEAR_MM, depth, 0).astype(float)

    def score(self):
        """Of the position in the middle; None where a probe is too near to a cell's border, or the
        bulge is not a limit's."""
        positions, focal, scores = Positions(self), self.focal, []
        for stretch in (1 - 2e-4, 1 + 2e-5, 1):
            self.focal = focal * stretch
            scores.append(positions.score(60, 80))
        self.focal = focal
        inside = positions.seen(60, 80, INSIDE)
        behind = inside - positions.depth[60, 80]
        hit = (inside > 0) & (behind >= -40) & (behind <= 110)
        bulge = 99
        if hit[:5].any() and hit[5:].sum() >= 3:
            bulge = inside[5:][hit[5:]].mean() - inside[:5][hit[:5]].mean()
        is_clear = np.ptp(scores) < 0.1 and not -2 < bulge < 17 and scores[-1] > 0
        return scores[-1] if is_clear else None


class Tilted(Noise):
    """A tilted plane from which some cells are off, by less than the 40 mm that may be, or by more."""
    OFF_MM = [0] * 21 + [36, -36, 36, -36, 60, -60, 60, -60, 60, -60, 60]

    def draw(self):
        v, u = np.mgrid[:120, :160]
        across, down = self.seed * 13 % 11 - 5, self.seed * 17 % 13 - 6
        stretch = 1 + (u - 80) * across * 0.0005 + (v - 60) * down * 0.0008
        off = np.array(self.OFF_MM)[self.hash(v * 160 + u) % len(self.OFF_MM)]
        depth = np.floor(self.depth / stretch + 0.5) + off
        return np.where(depth >= NEAR_MM, depth, 0)

    def on_plane(self):
        """None where a probe is too near to a cell's border, or off by nearly what may be."""
        positions, focal, answers = Positions(self), self.focal, []
        for stretch in (1 - 2e-4, 1 + 2e-5, 1):
            for limit in (38, 42, PLANE_OFF_MM):
                self.focal = focal * stretch
                answers.append(positions.on_plane(60, 80, limit))
        self.focal = focal
        return answers[-1] if len(set(answers)) == 1 else None


def survey(image, cell, reach):
    height, width = image.shape
    out = np.zeros((-(-height // cell), -(-width // cell)))
    for row, column in np.ndindex(out.shape):
        v, u = min(row * cell + cell // 2, height - 1), min(column * cell + cell // 2, width - 1)
        out[row, column] = image[v, u]
        if image[v, u] > 0:
            continue
        top, left = max(0, v - reach), max(0, u - reach)
        part = image[top:v + reach + 1, left:u + reach + 1]
        dv, du = np.nonzero(part)
        if len(dv):
            out[row, column] = part[dv, du][np.argmin((dv + top - v)**2 + (du + left - u)**2)]
    return out


def survey_frame(image):
    cell = 1
    while -(-image.shape[0] // cell) * -(-image.shape[1] // cell) > CELLS_MAX:
        cell += 1
    smallest, cells = cell, survey(image, cell, max(1, cell // 2))
    while (cells[:, 1:] > 0).any() and \
            ((cells[:, 1:] > 0) & (cells[:, :-1] > 0)).sum() < 0.7 * (cells[:, 1:] > 0).sum():
        cell *= 2
        cells = survey(image, cell, cell // 2)
    if cell == smallest:
        return cells, cell, 0
    return survey(image, cell // 2, cell // 2), cell // 2, cell


class Positions:
    def __init__(self, scene):
        self.scene = scene
        self.depth, self.cell, self.spacing = survey_frame(scene.draw())

    def seen(self, row, column, probes):
        """Depths under probes: nan beyond the edge, 0 where nothing is."""
        z = self.depth[row, column]
        at = np.floor(np.array(probes) * self.scene.focal / (z * self.cell) + 0.5).astype(int)
        c, r = column + at[:, 0], row + at[:, 1]
        inside = (c >= 0) & (r >= 0) & (c < self.depth.shape[1]) & (r < self.depth.shape[0])
        found = np.full(len(probes), np.nan)
        found[inside] = self.depth[r[inside], c[inside]]
        return found

    def score(self, row, column):
        z = self.depth[row, column]
        if z == 0 or 150 * np.ravel(self.scene.focal)[0] / (z * self.cell) < CELLS_MIN:
            return 0
        inside, around, below = (self.seen(row, column, p) for p in (INSIDE, AROUND, BELOW))
        hit = (inside > 0) & (inside - z >= -40) & (inside - z <= 110)
        fraction = np.select([np.isnan(inside), inside == 0, hit], [0.5, 0.3, 1], 0).mean() * 350
        fraction += np.select([np.isnan(around), around == 0, around - z >= 90, around - z < -100],
                           [0.5, 0.7, 1, 0.4], 0).mean() * 400
        fraction += np.select([np.isnan(below), below == 0, np.abs(below - z) < 150],
                           [0.5, 0.3, 1], 0).mean() * 150
        bulge = 7.5
        if hit[:5].any() and hit[5:].sum() >= 3:
            bulge = np.clip(inside[5:][hit[5:]].mean() - inside[:5][hit[:5]].mean(), 0, 15)
        return fraction + bulge / 15 * 100 - z * 0.02

    def on_plane(self, row, column, off_mm=PLANE_OFF_MM):
        beside, below = self.seen(row, column, BESIDE), self.seen(row, column, BELOW)
        if not (beside > 0).all():
            return False
        terms = np.column_stack([np.ones(len(BESIDE)), BESIDE])
        fit = np.linalg.lstsq(terms, 1 / beside, rcond=None)[0]
        if (np.abs(1 / (terms @ fit) - beside) > off_mm).any():
            return False
        known = below > 0
        there = 1 / (np.column_stack([np.ones(len(BELOW)), BELOW]) @ fit)[known]
        near = np.abs(there - below[known]) <= off_mm
        return known.sum() >= 2 and 3 * near.sum() >= 2 * known.sum()

    def apart(self, position, rows, columns):
        """mm from one position to others, in the image at the depth of the nearer one."""
        z = np.minimum(self.depth[position], self.depth[rows, columns])
        aside = np.hypot(rows - position[0], columns - position[1]) * self.cell * z / self.scene.focal
        return np.hypot(aside, self.depth[rows, columns] - self.depth[position])

    def window(self, scores, position):
        rows, columns = np.nonzero(scores)
        reach = np.floor(70 * self.scene.focal / (self.depth[position] * self.cell) + 0.5)
        weight = scores[rows, columns] - scores[position] + 80
        good = (np.abs(rows - position[0]) <= reach) & (np.abs(columns - position[1]) <= reach) & \
            (weight > 0) & (np.abs(self.depth[rows, columns] - self.depth[position]) <= 80)
        mean = [np.average(value[good], weights=weight[good])
                for value in (columns, rows, self.depth[rows, columns])]
        middle = (np.array(self.scene.size) - 1) / 2
        pixel = np.array(mean[:2]) * self.cell + self.cell // 2
        return [*((pixel - middle) / self.scene.focal), mean[2], scores[position]]

    def windows(self):
        scores = np.zeros_like(self.depth)
        for position in np.ndindex(scores.shape):
            scores[position] = self.score(*position)
        left, out = np.where(scores >= SCORE_MIN, scores, 0), []
        while left.any() and len(out) < WINDOWS_MAX:
            position = np.unravel_index(np.argmax(left), left.shape)
            if scores[position] < left.max() or scores[position] < scores.max() - SCORE_BEHIND_MAX:
                break
            if not self.on_plane(*position):
                out.append(self.window(scores, position))
            rows, columns = np.nonzero(left)
            near = self.apart(position, rows, columns) < POSITIONS_APART_MM
            left[rows[near], columns[near]] = 0
        return out


def person(x, y, z, size=1.0):
    """A head, a neck and a torso."""
    return [((x, y, z), (78 * size, 113 * size, 98 * size)),
            ((x, y + 120 * size, z + 25), (58 * size, 110 * size, 62 * size)),
            ((x, y + 400 * size, z + 45), (215 * size, 235 * size, 115 * size))]


WALL, NOTHING, TABLE = (0.25, 0), (0, 0), (1.1, 0.9)
SCENES = [
    Scene("before a wall", (320, 240), 280, WALL, person(60, -80, 900)),
    Scene("nothing behind", (160, 120), 140, NOTHING, person(-150, -50, 1200)),
    Scene("three", (640, 480), 525, WALL,
          person(-500, -250, 1900) + person(0, -200, 2400) + person(520, -300, 3000)),
    Scene("64 x 64", (64, 64), 56, WALL, person(0, -100, 1500)),
    Scene("1280 x 800", (1280, 800), 914, WALL, person(500, -400, 2000)),
    Scene("portrait", (120, 200), 160, WALL, person(30, -100, 800)),
    Scene("rare", (320, 240), 280, WALL, person(40, -60, 850), every=7),
    Scene("on a table", (320, 240), 280, TABLE, [((0, 0, 800), (60, 100, 60))]),
    Scene("only a wall", (320, 240), 280, WALL, []),
]


def write_vectors(directory):
    inc = emit.Inc("Scenes, and the windows that they give in float64.")
    rows = []
    for index, scene in enumerate(SCENES):
        positions = Positions(scene)
        found = positions.windows()
        inc.raw("\nstatic const struct vector_ellipsoid vector_%d_ellipsoids[] = {\n%s};\n" % (
            index, emit.wrap(["{{%s}, {%s}}" % tuple(", ".join(emit.numbers(p, 3)) for p in e)
                              for e in scene.ellipsoids or [((0, 0, 0), (1, 1, 1))]])))
        inc.raw("\nstatic const struct vector_window vector_%d_windows[] = {\n%s};\n" % (
            index, emit.wrap(["{%s}" % ", ".join(emit.numbers(w, 6))
                              for w in found or [(0, 0, 0, 0)]])))
        rows.append('"%s", %d, %d, %d, %s, %s, %d, %d, vector_%d_ellipsoids, %d, %d, %d, '
                    'vector_%d_windows' % (
                        scene.name, *scene.size, scene.focal,
                        *emit.numbers(scene.plane, 3), scene.every, len(scene.ellipsoids), index,
                        positions.cell, positions.spacing, len(found), index))
    inc.struct_array("vector_scene", "vector_scenes", rows)
    scores = ((noise, noise.score()) for noise in
              map(Noise, [*range(1, 120), *range(LARGE_FROM, LARGE_FROM + 240)]))
    inc.struct_array("vector_noise", "vector_noises",
                     ["%d, %d, %d, %d, %s" % (noise.seed, *noise.focal, noise.depth, emit.number(score, 6))
                      for noise, score in scores if score is not None])
    answers = ((tilted, tilted.on_plane()) for tilted in map(Tilted, range(1, LARGE_FROM)))
    inc.struct_array("vector_tilted", "vector_tilts",
                     ["%d, %d, %d, %d, %s" % (tilted.seed, *tilted.focal, tilted.depth, str(answer).lower())
                      for tilted, answer in answers if answer is not None])
    return inc.write(directory, "windows.inc")
