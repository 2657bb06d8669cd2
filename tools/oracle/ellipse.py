"""Float64 reference of polygon moments and of the search for a contour's elliptical part.

Moments are taken triangle by triangle, the search tries every part of 56 or 32 points by itself:
neither uses the prefix sums of the firmware.
"""

import numpy as np

import emit

POINTS = (56, 32)  # on a contour: the paper's method alone, and as part of everything
PART_EDGES_MIN = 8
SHAPE_MAX, RATIO_PART_MAX, CHORD_MAX = 1.045, 1.75, 0.42
SHAPE_MIN = 1 - 1 / 256  # less: no simple polygon, its chord crosses its arc
GRID_END = 46
EDGE_MAX = 1.3  # grid steps between a contour's vertices


def moments(polygon):
    """Signed area, centre, central second moments per area: a fan of triangles from one corner."""
    a = polygon[0]
    b, c = polygon[1:-1], polygon[2:]
    area = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    total = area.sum()
    middle = (a + b + c) / 3
    centre = (area[:, None] * middle).sum(axis=0) / total
    # About its own centre of gravity a triangle has the covariance sum(v v^T) / 12
    second = np.zeros((2, 2))
    for weight, g, *corners in zip(area, middle, np.broadcast_to(a, b.shape), b, c):
        own = sum(np.outer(p - g, p - g) for p in corners) / 12
        second += weight * (own + np.outer(g - centre, g - centre))
    return total, centre, second / total


def shape_and_ratio(area, second):
    values = np.linalg.eigvalsh(second)
    if values[0] <= 0:
        return np.inf, np.inf
    return 4 * np.pi * np.sqrt(values[0] * values[1]) / abs(area), np.sqrt(values[1] / values[0])


def winding(polygon, position):
    """How often the polygon winds round the position, from the angles."""
    away = polygon - position
    angle = np.arctan2(away[:, 1], away[:, 0])
    phase = np.diff(np.append(angle, angle[0]))
    return int(np.rint((phase - 2 * np.pi * np.rint(phase / (2 * np.pi))).sum() / (2 * np.pi)))


def resampled(vertices, closed, count):
    """Points at equal steps of arc, and the length of the contour."""
    line = np.vstack([vertices, vertices[:1]]) if closed else vertices
    along = np.append(0, np.cumsum(np.hypot(*np.diff(line, axis=0).T)))
    target = np.linspace(0, along[-1], count, endpoint=not closed)
    return np.column_stack([np.interp(target, along, line[:, k]) for k in (0, 1)]), along[-1]


def best_part(vertices, closed, position, count):
    """(merit, area, centre) of the best elliptical part round the position, or None."""
    points, length = resampled(vertices, closed, count)
    steps = count if closed else count - 1
    best = None
    for first in range(count):
        for edges in range(PART_EDGES_MIN, count):
            if not closed and first + edges >= count:
                break
            part = points[(first + np.arange(edges + 1)) % count]
            arc = length * edges / steps
            chord = np.hypot(*(part[-1] - part[0]))
            if chord > CHORD_MAX * arc or winding(part, position) != 1:
                continue
            area, centre, second = moments(part)
            shape, ratio = shape_and_ratio(area, second)
            if area <= 0.5 or not SHAPE_MIN <= shape <= SHAPE_MAX or ratio > RATIO_PART_MAX:
                continue
            merit = arc - 1.6 * chord - 8 * (shape - 1) * arc
            if best is None or merit > best[0]:
                best = (merit, area, centre)
    return best


def finely(line, closed):
    """The same line with vertices at most EDGE_MAX apart, in Q9."""
    line = np.vstack([line, line[:1]]) if closed else np.asarray(line, float)
    out = []
    for a, b in zip(line[:-1], line[1:]):
        count = max(1, int(np.ceil(np.hypot(*(b - a)) / EDGE_MAX)))
        out += [a + (b - a) * k / count for k in range(count)]
    if not closed:
        out.append(line[-1])
    return np.rint(np.array(out) * 512).astype(int)


def ellipse_exit(angle, ellipse, origin):
    """Distance from the origin along a direction to the far side of an ellipse; 0 if missed."""
    x, y, a, b, phase = ellipse
    c, s = np.cos(phase), np.sin(phase)
    to_unit = np.array([[c / a, s / a], [-s / b, c / b]])
    o, d = to_unit @ (np.array(origin) - [x, y]), to_unit @ [np.cos(angle), np.sin(angle)]
    root = (o @ d)**2 - (d @ d) * (o @ o - 1)
    return 0.0 if root < 0 else max(0.0, (-(o @ d) + np.sqrt(root)) / (d @ d))


def union(ellipses, count=180):
    """Outline of overlapping ellipses as seen from the first one's middle."""
    angles = np.arange(count) * 2 * np.pi / count
    middle = ellipses[0][:2]
    reach = np.array([max(ellipse_exit(t, e, middle) for e in ellipses) for t in angles])
    return np.column_stack([middle[0] + reach * np.cos(angles),
                            middle[1] + reach * np.sin(angles)])


def arc(x, y, a, b, first_deg, last_deg, count=60):
    angles = np.radians(np.linspace(first_deg, last_deg, count))
    return np.column_stack([x + a * np.cos(angles), y + b * np.sin(angles)])


def contours():
    """name, closed, vertices, position. Minima run clockwise on the screen: area positive."""
    yield "head", True, union([(22, 20, 6, 8, 0.1)]), (22, 20)
    yield "head_hand", True, union([(20, 20, 6, 8, 0), (27.5, 25, 4, 2.5, 0.4)]), (20, 19)
    yield "head_two_hands", True, union([(23, 18, 6, 7.5, 0), (31, 22, 5, 2.5, 0.3),
                                         (15, 23, 5, 2.5, -0.5)]), (23, 18)
    yield "head_shoulder", True, union([(22, 14, 5.5, 7, 0), (22, 28, 14, 8, 0)]), (22, 13)
    # up the left shoulder, round the head, down the right one, to the borders
    yield "bust", False, np.vstack([[(0, 40), (12, 37), (18, 33), (19.5, 29)],
                                    arc(23, 20, 6, 8.5, 125, 415), [(26.5, 29), (28, 33), (34, 37),
                                                                    (46, 41)]]), (23, 20)
    yield "at_border", False, arc(4, 20, 6, 8, -130, 130), (4, 20)
    yield "shallow", False, np.array([(0, 30), (20, 25), (30, 25), (46, 30)]), (25, 26)
    yield "square", True, np.array([(14, 14), (30, 14), (30, 30), (14, 30)], float), (22, 22)
    yield "maximum", True, union([(22, 20, 6, 8, 0.1)])[::-1], (22, 20)
    yield "beside", True, union([(22, 20, 6, 8, 0.1)]), (36, 30)
    yield "long", True, union([(22, 22, 20, 6, 0.3)]), (22, 22)
    yield "small", True, union([(22, 22, 2.2, 2.9, 0.3), (24.5, 23, 1.5, 0.8, 0)]), (22, 22)


def polygons(random):
    yield "rectangle", np.array([(10, 12), (26, 12), (26, 20), (10, 20)], float)
    yield "triangle", np.array([(3, 40), (40, 43), (20, 5)], float)
    yield "reversed", np.array([(20, 5), (40, 43), (3, 40)], float)
    yield "ellipse", union([(25, 18, 11, 5, 0.7)], 100)
    yield "round", union([(23, 23, 20, 20, 0)], 300)
    yield "corner", np.array([(0, 0), (46, 0), (46, 46), (0, 46)], float)
    yield "thin", np.array([(2, 3), (44, 40), (44, 40.2), (2, 3.2)])
    for index in range(5):
        angles = np.sort(random.uniform(0, 2 * np.pi, 30))
        reach = random.uniform(3, 18, 30)
        yield "star_%d" % index, np.column_stack([23 + reach * np.cos(angles),
                                                  23 + reach * np.sin(angles)])


def vertices_text(inc, name, vertices_q9):
    inc.raw("\nstatic const struct ih_vertex vector_%s[] = {\n%s};\n" % (
        name, emit.wrap(["{%d, %d}" % tuple(v) for v in vertices_q9])))


def write_vectors(directory):
    random = np.random.default_rng(81)
    inc = emit.Inc("Polygons with their moments, contours with their best elliptical part.")
    rows = []
    for name, vertices in polygons(random):
        q9 = finely(vertices, True)
        area, centre, second = moments(q9 / 512)
        shape, ratio = shape_and_ratio(area, second)
        vertices_text(inc, name, q9)
        rows.append('"%s", %d, vector_%s, %s' % (name, len(q9), name, ", ".join(emit.numbers(
            (area, *centre, second[0, 0], second[0, 1], second[1, 1], shape, ratio), 6))))
    inc.struct_array("vector_polygon", "vector_polygons", rows)
    rows = []
    for name, closed, vertices, position in contours():
        q9 = finely(vertices, closed)
        vertices_text(inc, "part_" + name, q9)
        for count in POINTS:
            best = best_part(q9 / 512, closed, np.array(position, float), count)
            found = best if best else (0, 0, (0, 0))
            rows.append('"%s", %d, %d, %d, vector_part_%s, {%d, %d}, %d, %s' % (
                name, count, closed, len(q9), name, position[0] * 512, position[1] * 512, best is not None,
                ", ".join(emit.numbers((found[0], found[1], *found[2]), 4))))
    inc.struct_array("vector_part", "vector_parts", rows)
    return inc.write(directory, "ellipse.inc")
