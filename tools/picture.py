#!/usr/bin/env python3
"""Draw one frame and what was found in it, as in the paper's figure 1.

picture.py FRAMES_DIR TRACE.json OUT.png

Left the frame with its labelled dots, coloured by depth; right the surface as a contour plot (near =
dark) with the ellipse of every nest, those that the paper's tests accept emphasised, and the open
polygons whose elliptical part supports an accepted one, dashed. In both the heads of the whole method, as
ellipsoids with their probability. Both in the frame's pixels.
"""

import json
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Ellipse

STEP_PER_UNIT = 10 / 11  # grid steps are 10/11 field units


def read_pgm(path):
    with open(path, "rb") as file:
        data = file.read()
    fields, at = [], 0
    while len(fields) < 4:
        if data[at:at + 1] == b"#":
            at = data.index(b"\n", at)
        elif data[at:at + 1].isspace():
            at += 1
        else:
            end = at
            while not data[end:end + 1].isspace():
                end += 1
            fields.append(data[at:end])
            at = end
    width, height, maximum = map(int, fields[1:])
    kind = np.uint8 if maximum < 256 else np.dtype(">u2")
    return np.frombuffer(data, kind, width * height, at + 1).reshape(height, width), maximum


class Camera:
    """Normalised coordinates to pixels: OpenCV's model."""

    def __init__(self, rig):
        self.matrix = np.reshape(rig["camera_matrix"]["data"], (3, 3))
        self.lens = np.ravel(rig["distortion_coefficients"]["data"])

    def pixels(self, x, y):
        k1, k2, p1, p2, k3 = self.lens
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        return (self.matrix[0, 0] * u + self.matrix[0, 2], self.matrix[1, 1] * v + self.matrix[1, 2])


def grid_pixels(surface, camera, column, row):
    """Places on the depth grid, in steps, to pixels."""
    field = surface["field"]
    step = field["unit_q28"] / 2**28 * STEP_PER_UNIT
    middle = (len(surface["depth_mm_q8"]) - 1) / 2
    return camera.pixels(field["centre_x_q28"] / 2**28 + (column - middle) * step,
                         field["centre_y_q28"] / 2**28 + (row - middle) * step)


def draw_frame(axes, trace, image, maximum):
    axes.imshow((image / maximum) ** 0.6, cmap="gray", vmin=0, vmax=0.8)
    slots = [(i, s["dot"]) for i, s in enumerate(trace["labels"]["slot"]) if s is not None]
    u = np.array(trace["dots"]["u_px_q12"]) / 4096
    v = np.array(trace["dots"]["v_px_q12"]) / 4096
    dots = [dot for _, dot in slots]
    depth_mm = np.array([trace["points"]["depth_mm_q8"][slot] for slot, _ in slots]) / 256
    # equal steps of disparity, so that head and wall both show
    shown = axes.scatter(u[dots], v[dots], s=9, c=1000 / depth_mm, cmap="turbo", linewidths=0)
    axes.set_title("%d dots found, %d labelled" % (len(u), len(slots)))
    return shown


def draw_surface(axes, trace, camera, limits):
    surface = trace["surface"]
    depth_mm = np.array(surface["depth_mm_q8"]) / 256
    row, column = np.mgrid[:depth_mm.shape[0], :depth_mm.shape[1]]
    u, v = grid_pixels(surface, camera, column, row)
    nearest = depth_mm.min()
    levels = np.arange(np.floor(nearest / 20) * 20, nearest + 420, 20)
    axes.contourf(u, v, depth_mm, levels, cmap="gray", extend="max")
    axes.contour(u, v, depth_mm, levels, colors="black", linewidths=0.3)
    axes.set_xlim(limits[:2])
    axes.set_ylim(limits[2:])
    axes.set_aspect("equal")


def nearest_open(trace, nest, piece):
    """The open polygon at the level of a nest's slice that passes nearest to the slice's centre."""
    level = nest["nearest_mm_q8"] + piece["behind_mm_q8"]
    cut = min(trace["cuts"], key=lambda c: abs(c["level_mm_q8"] - level))
    centre = np.array([piece["x_q16"], piece["y_q16"]]) / 65536
    polygons = [np.array(c["x_y_q9"]) / 512 for c in cut["contour"] if not c["closed"]]
    return min(polygons, key=lambda p: np.hypot(*(p - centre).T).min(), default=None)


def draw_hypotheses(axes, trace, camera):
    accepted = set(trace["heads"]["head"])
    for index, h in enumerate(trace["heads"]["hypothesis"]):
        good = index in accepted
        shape = Ellipse((h["u_px_q12"] / 4096, h["v_px_q12"] / 4096), 2 * h["a_px_q12"] / 4096,
                        2 * h["b_px_q12"] / 4096, angle=h["angle_mdeg"] / 1000, fill=False,
                        color="darkorange" if good else "deepskyblue", linewidth=2.4 if good else 1.1, zorder=3)
        axes.add_patch(shape)
        if good:
            nest = trace["hypotheses"]["nest"][h["nest"]]
            parts = [piece for piece in nest["slice"] if not piece["whole"]]
            places = nearest_open(trace, nest, parts[-1]) if parts else None
            if places is not None:
                axes.plot(*grid_pixels(trace["surface"], camera, *places.T), color="darkorange", linewidth=1,
                          linestyle="--", zorder=2)
        else:
            axes.text(*shape.center, h["rejected"], color="deepskyblue", fontsize=7, ha="center",
                      va="center", zorder=4)
    count = len(trace["heads"]["hypothesis"])
    axes.set_title("surface, %d %s, %d accepted by the paper's tests" %
                   (count, "nest" if count == 1 else "nests", len(accepted)))


def draw_heads(axes, trace, camera):
    """The fitted ellipsoids that are heads, and their centres."""
    for finding in trace["findings"]:
        if not finding["head"]:
            continue
        x, y, z = (value / 256 for value in finding["centre_mm_q8"])
        across, up, _ = (value / 256 for value in finding["semi_mm_q8"])
        turn = np.linspace(0, 2 * np.pi, 73)
        outline = camera.pixels((x + across * np.cos(turn)) / z, (y + up * np.sin(turn)) / z)
        axes.plot(*outline, color="red", linewidth=2.2, zorder=5)
        axes.plot(*camera.pixels(np.array([x / z]), np.array([y / z])), "+", color="red", zorder=5)
        axes.annotate("head at (%.0f, %.0f, %.0f) mm, %.1f %% sure" %
                      (x, y, z, 100 * finding["probability_q16"] / 65536), (0, 0), color="red",
                      xytext=(0.02, 0.03), textcoords="axes fraction", fontsize=9,
                      bbox={"facecolor": "white", "linewidth": 0, "alpha": 0.85, "pad": 2})


def main():
    if len(sys.argv) != 4:
        print("usage: picture.py FRAMES_DIR TRACE.json OUT.png", file=sys.stderr)
        return 2
    frames, trace_path, out = sys.argv[1:]
    with open(os.path.join(frames, "rig.json"), encoding="utf-8") as file:
        camera = Camera(json.load(file))
    with open(trace_path, encoding="utf-8") as file:
        trace = json.load(file)
    image, maximum = read_pgm(os.path.join(frames, trace["file"]))
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.5), dpi=80)
    draw_frame(left, trace, image, maximum)
    draw_surface(right, trace, camera, left.get_xlim() + left.get_ylim())
    draw_hypotheses(right, trace, camera)
    draw_heads(left, trace, camera)
    draw_heads(right, trace, camera)
    for axes in (left, right):
        axes.set_xticks([])
        axes.set_yticks([])
    figure.tight_layout()
    figure.savefig(out, metadata={"Software": None}, pil_kwargs={"optimize": True})
    return 0


if __name__ == "__main__":
    sys.exit(main())
