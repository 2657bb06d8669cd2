"""Sheets of failures: every frame where the full method was not right, twelve to a page.

Labelled dots are red near and blue far. The true head is a green ellipse, accepted heads are red and
thick where selected, the other hypotheses thin and pale; each with its score.
"""

import concurrent.futures
import glob
import json
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Ellipse

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import picture

COLUMNS, ROWS = 4, 3
SEEN = 1  # a point's state
HYPOTHESES_SHOWN = 6


def draw_image(axes, path):
    image, maximum = picture.read_pgm(path)
    if maximum > 255:  # a depth image: near is light, nothing is black
        shown = np.where(image > 0, 1 - np.clip(image / 4000, 0, 0.95), 0)
    else:
        shown = (image / maximum) ** 0.6
    step = max(1, image.shape[1] // 400)
    axes.imshow(shown[::step, ::step], cmap="gray", vmin=0, vmax=0.9,
                extent=(-0.5, image.shape[1] - 0.5, image.shape[0] - 0.5, -0.5))
    return axes.get_xlim() + axes.get_ylim()


def draw_points(axes, trace, camera):
    points = trace["points"]
    seen = np.array(points["state"]) == SEEN
    if not seen.any():
        return
    x, y = (np.array(points[key])[seen] / 2**28 for key in ("x_q28", "y_q28"))
    u, v = camera.pixels(x, y)
    depth_mm = np.array(points["depth_mm_q8"])[seen] / 256
    axes.scatter(u, v, s=5, c=1000 / depth_mm, cmap="turbo", linewidths=0)


def draw_truth(axes, head, camera):
    x, y, z = head["centre_mm"]
    if z <= 0:
        return
    u, v = camera.pixels(x / z, y / z)
    width, height = (2 * head["semi_axes_mm"][i] * camera.matrix[i, i] / z for i in (0, 1))
    axes.add_patch(Ellipse((u, v), width, height, fill=False, color="lime", linewidth=1.6, zorder=4))


def draw_hypotheses(axes, record):
    accepted = set(record["heads"])
    shown = list(record["heads"]) + [i for i in range(len(record["hypotheses"])) if i not in accepted]
    for index in shown[:HYPOTHESES_SHOWN]:
        h = record["hypotheses"][index]
        color = "red" if index in accepted else "cyan"
        width = 2.0 if index == record["head"] else 0.8
        (a, b), (u, v) = h["axes_px"], h["pixel"]
        axes.add_patch(Ellipse((u, v), 2 * a, 2 * b, angle=h["angle_deg"], fill=False, color=color,
                               linewidth=width, linestyle=":" if h.get("predicted") else "-", zorder=3))
        if "score" in h:
            axes.text(u, v - (a if h["angle_deg"] > 45 else b), "%.2f" % h["score"], color=color, fontsize=6,
                      ha="center", va="bottom", zorder=5, clip_on=True,
                      bbox={"facecolor": "black", "linewidth": 0, "alpha": 0.6, "pad": 0.5})


def draw_failure(axes, failure):
    with open(os.path.join(failure.directory, "rig.json"), encoding="utf-8") as file:
        camera = picture.Camera(json.load(file))
    path = os.path.join(failure.directory, failure.file)
    if path.endswith(".pgm"):
        limits = draw_image(axes, path)
    else:
        limits = (-0.5, 2 * camera.matrix[0, 2], 2 * camera.matrix[1, 2], -0.5)
    if failure.trace:
        with open(failure.trace, encoding="utf-8") as file:
            draw_points(axes, json.load(file), camera)
    draw_hypotheses(axes, failure.record)
    head = failure.truth["head"]
    for other in failure.truth.get("heads", [head] if head else []):
        draw_truth(axes, other, camera)
    axes.set_xlim(limits[:2])
    axes.set_ylim(limits[2:])
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title("%s %s\n%s" % (failure.scene.name, os.path.splitext(failure.file)[0], failure.what),
                   fontsize=7)


def draw_page(failures, title, path):
    figure, grid = plt.subplots(ROWS, COLUMNS, figsize=(13, 9), dpi=90)
    for axes in grid.flat:
        axes.axis("off")
    for axes, failure in zip(grid.flat, failures):
        axes.axis("on")
        draw_failure(axes, failure)
    figure.suptitle(title, fontsize=10)
    figure.tight_layout(rect=(0, 0, 1, 0.98))
    figure.savefig(path, metadata={"Software": None})
    plt.close(figure)


def pages(results):
    """(failures, title, file name) of every page."""
    by_kind = {}
    for scene, result in results.items():
        by_kind.setdefault(scene.kind, []).extend(result.failures)
    for kind, failures in by_kind.items():
        name = "-".join("".join(c if c.isalnum() else " " for c in kind).split())
        size = COLUMNS * ROWS
        for first in range(0, len(failures), size):
            title = "%s: failures %d to %d of %d" % (kind, first + 1, min(first + size, len(failures)),
                                                     len(failures))
            yield failures[first:first + size], title, "failures-%s-%d.png" % (name, first // size + 1)


def draw_all(results, work, jobs):
    for old in glob.glob(os.path.join(work, "failures-*.png")):
        os.remove(old)
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        drawn = [pool.submit(draw_page, failures, title, os.path.join(work, name))
                 for failures, title, name in pages(results)]
        for one in drawn:
            one.result()
    return len(drawn)
