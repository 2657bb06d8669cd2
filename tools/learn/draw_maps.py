"""draw_maps.py OUT: the learnt maps of ih_surroundings as a picture, the mean of several ranges of depth in each row."""

import os
import re
import sys

import numpy

import ray_map

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
HEADER = os.path.join(ROOT, "firmware/core/detect/ih_surroundings_map.h")
SHOWN = (("96 mm and more before", (0, 1)), ("at the head's depth", (2, 3)), ("behind, 40 to 200 mm", (4, 5)), ("farther behind, or nothing", (6, 7)))
CELL, GAP, LEFT, TOP = 5, 8, 170, 8
BANDS = 4  # maps below each other
LEVELS = 6
HEAD_MM, CELL_MM = (78, 113), 64


def read():
    """Rows, columns, depths, maps."""
    with open(HEADER, encoding="utf-8") as file:
        words = [int(word, 16) for word in re.findall(r"0x[0-9a-f]{8}", file.read())]
    words = numpy.array(words).reshape(ray_map.PLACES, -1)
    return ray_map.unpacked(words).reshape(ray_map.ROWS, ray_map.COLUMNS, ray_map.DEPTHS, ray_map.MAPS)


def colour(level):
    """Blue above zero, orange below."""
    dark = (0, 114, 178) if level > 0 else (213, 94, 0)
    part = abs(level) / LEVELS
    return "#%02x%02x%02x" % tuple(round(255 + (value - 255) * part) for value in dark)


def cells_of(values, at):
    """One path for all cells of a colour; left and right alike."""
    levels = numpy.rint(values * LEVELS / ray_map.ZERO).astype(int)
    for level in sorted(set(levels.ravel()) - {0}):
        path = ""
        for row, column in zip(*numpy.nonzero(levels == level)):
            first, last = (numpy.searchsorted(ray_map.ROW_OF_CELL, row, side=side) for side in ("left", "right"))
            width = ray_map.ASIDE_CELLS - column if column == ray_map.COLUMNS - 1 else 1
            for side in (column, -width - column):
                path += "M%d %dh%dv%dh-%dz" % (at[0] + (ray_map.ASIDE_CELLS + side) * CELL, at[1] + first * CELL, width * CELL,
                                               (last - first) * CELL, width * CELL)
        yield '<path fill="%s" d="%s"/>' % (colour(level), path)


def draw():
    maps = read()
    wide, high = 2 * ray_map.ASIDE_CELLS * CELL, len(ray_map.ROW_OF_CELL) * CELL
    in_band = ray_map.MAPS // BANDS
    band = len(SHOWN) * (high + 2) + 26
    size = LEFT + in_band * (wide + GAP), TOP + BANDS * band
    yield '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 %d %d" width="%d" height="%d" font-family="sans-serif" font-size="12">' % (*size, *size)
    yield "<title>What each learnt map says of a ray, by where it passes the head and how deep its point lies</title>"
    yield '<rect width="%d" height="%d" fill="#fff"/>' % size
    for map_index in range(ray_map.MAPS):
        left, top = LEFT + map_index % in_band * (wide + GAP), TOP + map_index // in_band * band
        yield '<text x="%d" y="%d" text-anchor="middle">%d</text>' % (left + wide // 2, top + 12, map_index)
        for row, (label, depths) in enumerate(SHOWN):
            at = top + 18 + row * (high + 2)
            if map_index % in_band == 0:
                yield '<text x="8" y="%d">%s</text>' % (at + high // 2, label)
            yield from cells_of(maps[:, :, depths, map_index].mean(axis=2), (left, at))
            yield '<rect x="%d" y="%d" width="%d" height="%d" fill="none" stroke="#bbb"/>' % (left, at, wide, high)
            radii = tuple(CELL * length / CELL_MM for length in HEAD_MM)
            yield '<ellipse cx="%d" cy="%d" rx="%.1f" ry="%.1f" fill="none" stroke="#000"/>' % (left + wide // 2, at + 6 * CELL, *radii)
    yield "</svg>"


def text():
    return "\n".join(draw()) + "\n"


if __name__ == "__main__":
    with open(sys.argv[1], "w", encoding="utf-8") as OUT:
        OUT.write(text())
