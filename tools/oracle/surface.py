"""Float64 reference of the surface: weighted ridge regression on multiquadrics."""

import numpy as np
from scipy.linalg import cho_factor, cho_solve

import emit
from rig import to_q, from_q

MANY, FEW = 12, 8  # centres in a row: for the paper's nests, by default
GRID = 47
STEP = 10 / 11  # of the grid, in field units
CENTRES_STEPS = 48  # of the grid: all centres' steps together
OVERSHOOT_MM, DEPTH_MAX_MM = 200, 32000
SAMPLES_MIN = 16
RIDGE_Q30 = 10737
HUBER_MM = 60
MOVING = {MANY: False, FEW: True}  # samples that are too far off are moved, instead of getting less weight

GRID_LINE = (np.arange(GRID) - (GRID - 1) / 2) * STEP
GRID_POSITIONS = np.stack(np.meshgrid(GRID_LINE, GRID_LINE), axis=-1).reshape(-1, 2)


def basis(positions, centres=MANY):
    """B of every centre at every position: sqrt(dx^2 + dy^2 + 1), field units."""
    line = (np.arange(centres) - (centres - 1) / 2) * (CENTRES_STEPS / centres) * STEP
    centre_positions = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    away = positions[:, None, :] - centre_positions[None, :, :]
    return np.sqrt((away**2).sum(axis=2) + 1)


GRID_BASIS = {centres: basis(GRID_POSITIONS, centres) for centres in (MANY, FEW)}


def solve(positions, depth_mm, root_weight, mean_mm, ridge, centres):
    """Coefficients of z - mean, for rows scaled by the root weight."""
    rows = basis(positions, centres) * root_weight[:, None]
    normal = rows.T @ rows
    normal += ridge * np.diag(np.diag(normal))
    scale = 1 / np.sqrt(np.diag(normal))
    factor = cho_factor(normal * scale[:, None] * scale, lower=True)
    right = rows.T @ (root_weight * (depth_mm - mean_mm))
    return cho_solve(factor, right * scale) * scale


def on_grid(coefficients, mean_mm, depth_mm):
    """The surface on the grid, limited to OVERSHOOT_MM before the nearest sample."""
    min_mm = max(depth_mm.min() - OVERSHOOT_MM, 1)
    grid_basis = GRID_BASIS[round(len(coefficients)**0.5)]
    grid = (mean_mm + grid_basis @ coefficients).reshape(GRID, GRID)
    return np.clip(grid, min_mm, DEPTH_MAX_MM)


def residuals(positions, depth_mm, coefficients, mean_mm):
    """How far the samples are behind the surface."""
    rows = basis(positions, round(len(coefficients)**0.5))
    return depth_mm - mean_mm - rows @ coefficients


def huber(residual_mm, huber_mm):
    """Root of the weight huber / |residual| of samples that are off by more than huber."""
    off_mm = np.abs(residual_mm)
    return np.where(off_mm > huber_mm, np.sqrt(huber_mm / np.maximum(off_mm, 1e-9)), 1.0)


def fit(positions, depth_mm, root_weight, mean_mm, centres, is_moving, ridge=RIDGE_Q30 / 2**30,
        huber_mm=HUBER_MM):
    """Both passes. Returns the grid and the root weights of the second one, or with which moved samples would push as
    they do."""
    first = solve(positions, depth_mm, root_weight, mean_mm, ridge, centres)
    residual_mm = residuals(positions, depth_mm, first, mean_mm)
    final = root_weight * huber(residual_mm, huber_mm)
    if is_moving:
        moved_mm = residual_mm - np.clip(residual_mm, -huber_mm, huber_mm)
        second = solve(positions, depth_mm - moved_mm, root_weight, mean_mm, ridge, centres)
    else:
        second = solve(positions, depth_mm, final, mean_mm, ridge, centres)
    return on_grid(second, mean_mm, depth_mm), final


def mean_of(depth_mm_q8):
    """Plain mean of the samples' depths, to Q8 as the firmware keeps it."""
    return np.rint(np.mean(depth_mm_q8)) / 256


def lattice(random, jitter):
    """Positions of the 19x19 dots, field units."""
    line = (np.arange(19) - 9) * 2.0
    positions = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    return positions + random.uniform(-jitter, jitter, positions.shape)


def head_before_wall(positions):
    """Depth of a head and a body before a wall, mm."""
    x, y = positions[:, 0], positions[:, 1]
    head = 1 - (x / 5.5)**2 - ((y + 5) / 7.5)**2
    body = 1 - (x / 13)**2 - ((y - 12) / 9)**2
    depth = np.full(len(positions), 1180.0)
    depth = np.where(body > 0, 900 - 60 * np.sqrt(np.maximum(body, 0)), depth)
    return np.where(head > 0, 860 - 95 * np.sqrt(np.maximum(head, 0)), depth)


def sample_sets():
    """name, positions, depths in mm, root weights."""
    random = np.random.default_rng(41)
    everywhere = lattice(random, 0.3)
    ones = np.ones(len(everywhere))
    yield "head", everywhere, head_before_wall(everywhere) + random.normal(0, 4, 361), ones

    weak = np.where(random.uniform(size=361) < 0.3, 0.548, 1.0)
    yield "weak", everywhere, np.where(weak < 1, 1180, head_before_wall(everywhere)), weak

    some = random.permutation(361)[:250]
    depth = 900 + 4 * everywhere[some, 0] - 7 * everywhere[some, 1]
    depth[17] -= 600
    yield "outlier", everywhere[some], depth, ones[some]

    yield "noise", random.uniform(-18, 18, (361, 2)), random.uniform(500, 1500, 361), ones

    cluster = np.concatenate([random.normal(0, 1.5, (200, 2)), random.uniform(-18, 18, (12, 2))])
    yield "cluster", cluster, head_before_wall(cluster), np.ones(212)

    few = random.uniform(-15, 15, (SAMPLES_MIN, 2))
    yield "few", few, head_before_wall(few), np.ones(SAMPLES_MIN)

    far = random.uniform(-39.9, 39.9, (300, 2))
    yield "ends", far, np.where(far[:, 0] > 0, 16000.0, 100.0), random.uniform(0.01, 1, 300)


def write_vectors(directory):
    inc = emit.Inc("Sample sets, and their surfaces by weighted ridge regression in float64.")
    inc.raw("\n#define VECTOR_RIDGE_Q30 %d\n#define VECTOR_HUBER_MM %d\n" % (RIDGE_Q30, HUBER_MM))
    rows = []
    for name, positions, depth_mm, root_weight in sample_sets():
        positions_q16, depth_q8 = to_q(positions, 16), to_q(depth_mm, 8)
        weight_q15 = to_q(root_weight, 15)
        mean_mm = mean_of(depth_q8)
        samples = ["{%d, %d, %d, %d, %d, false}" % (x, y, d, w, i) for i, ((x, y), d, w)
                   in enumerate(zip(positions_q16, depth_q8, weight_q15))]
        inc.raw("\nstatic const struct ih_sample vector_%s_samples[] = {\n%s};\n"
                % (name, emit.wrap(samples)))
        for centres in (MANY, FEW):
            grid, final = fit(from_q(positions_q16, 16), from_q(depth_q8, 8), from_q(weight_q15, 15),
                              mean_mm, centres, MOVING[centres])
            own = "%s_%d" % (name, centres)
            inc.array("double", "vector_%s_root_weight" % own, final, 6)
            inc.array("double", "vector_%s_grid" % own, grid.ravel(), 3)
            rows.append('"%s", %d, %s, %d, %s, vector_%s_samples, vector_%s_root_weight, vector_%s_grid'
                        % (own, centres, str(MOVING[centres]).lower(), len(positions), emit.number(mean_mm, 4), name, own, own))
    inc.struct_array("vector_surface", "vector_surfaces", rows)
    return inc.write(directory, "surface.inc")
