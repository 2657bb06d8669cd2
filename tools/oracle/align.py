"""Float64 reference of the alignment's fit: how far dots lie across their lines, explained by three rotations of the
projector, the focal length and a shift of the picture across the baseline, all in px.

Slopes are differences of the exact motion (Rodrigues), not the core's formula.
"""

import numpy as np

import emit
import rig as rigs
from rig import SLOTS, to_q

AXES = 5
# How wrong a rig may be, one standard deviation, as in docs/numerics.md: degrees, degrees, degrees, fractions of the focal length.
PRIOR = np.array([np.radians(1), np.radians(0.2), np.radians(1.2), 0.012, 0.004])
SCALES_PX = (2048 / 4096, 1229 / 4096, 819 / 4096, 819 / 4096)
NOISE_PX = 819 / 4096
HELD = 512  # weight of a number that is known
STEP = 1e-5


def rotated(vectors, rotation):
    """By Rodrigues' formula."""
    angle = np.linalg.norm(rotation)
    if angle == 0:
        return vectors
    n = rotation / angle
    return (vectors * np.cos(angle) + np.cross(n, vectors) * np.sin(angle)
            + np.outer(vectors @ n, n) * (1 - np.cos(angle)))


def positions(rig, baseline, moved):
    """Undistorted pixels of the dots at infinity; moved: angles in rad, fractions of the focal length."""
    u, v = baseline
    rotation = moved[0] * np.array([u, v, 0]) + moved[1] * np.array([-v, u, 0]) + moved[2] * np.array([0, 0, 1.0])
    rays = rotated(rigs.from_q(rig.rays_q30, 30), rotation)
    shift = moved[4] * rig.focal[0] * np.array([-v, u])
    return rays[:, :2] / rays[:, 2:] * rig.focal * (1 + moved[3]) + rig.principal + shift


def slopes(rig):
    """px across the line by px, slot by number."""
    _, direction, _ = rig.lines()
    out = np.zeros((SLOTS, AXES))
    for k in range(AXES):
        step = np.zeros(AXES)
        step[k] = STEP
        middle = direction[SLOTS // 2]
        by = (positions(rig, middle, step) - positions(rig, middle, -step)) / (2 * STEP * rig.focal[0])
        out[:, k] = by[:, 1] * direction[:, 0] - by[:, 0] * direction[:, 1]
    return out


def weights(residual, scale):
    return np.where(np.abs(residual) > 4 * scale, 0, (1 + (residual / scale) ** 2) ** -2.0)


def solve(slope, across, weight, prior, held=None):
    normal = slope.T @ (weight[:, None] * slope) + np.diag((NOISE_PX / prior) ** 2)
    right = slope.T @ (weight * across)
    if held is not None:
        normal[held[0], held[0]] += HELD
        right[held[0]] += HELD * held[1]
    return np.linalg.solve(normal, right), NOISE_PX * np.sqrt(np.diag(np.linalg.inv(normal)))


def fit(slope, across, prior, held=None):
    moved = np.zeros(AXES)
    for scale in SCALES_PX:
        weight = weights(across - slope @ moved, scale)
        moved, sigma = solve(slope, across, weight, prior)
    if held is not None:
        moved, _ = solve(slope, across, weight, prior, held)
    field = slope @ moved
    return moved, np.minimum(sigma, prior), np.sqrt((weight * field**2).sum() / weight.sum())


# Numbers in units of the prior, noise in px, fraction of slots that are seen, of outliers within 1.5 px, number that is held.
CASES = [((0.005, 0.1, 0.02, 0.05, 0.1), 0.0, 1.0, 0.0, None),
         ((0.01, -0.8, -0.05, 0.2, -0.1), 0.1, 1.0, 0.0, None),
         ((-0.02, 1.5, 0.06, -0.2, 0.2), 0.12, 0.6, 0.2, None),
         ((0.02, -1.0, 0.02, 0.1, 0.1), 0.15, 0.25, 0.1, None),
         ((0.01, 0.5, -0.03, -0.1, -0.1), 0.1, 0.8, 0.1, (1, 2.0))]


def write_vectors(directory):
    random = np.random.default_rng(67)
    inc = emit.Inc("Distances of dots across their lines, and what explains them, in float64.")
    rows = []
    for index, rig in enumerate((rigs.paper(), rigs.wide())):
        slope, prior = slopes(rig), PRIOR * rig.focal[0]
        for number, (true, noise, seen, odd, held) in enumerate(CASES):
            across = slope @ (np.array(true) * prior) + noise * random.standard_normal(SLOTS)
            is_odd = random.random(SLOTS) < odd
            across = np.where(is_odd, random.uniform(-1.5, 1.5, SLOTS), across)
            is_seen = random.random(SLOTS) < seen
            across_q12 = to_q(across, 12)
            moved, sigma, rms = fit(slope[is_seen], across_q12[is_seen] / 4096, prior, held)
            name = "vector_across_%d_%d" % (index, number)
            # What no slot has: unseen.
            inc.array("int16_t", name, np.where(is_seen, across_q12, -32768))
            rows.append("%d, %s, %d, %s, {%s}, {%s}, %s" % (
                index, name, -1 if held is None else held[0], emit.number(0 if held is None else held[1], 3),
                ", ".join(emit.numbers(moved, 6)), ", ".join(emit.numbers(sigma, 6)), emit.number(rms, 6)))
    inc.struct_array("vector_fit", "vector_fits", rows)
    return inc.write(directory, "align.inc")
