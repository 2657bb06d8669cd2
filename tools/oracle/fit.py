"""Float64 reference of the fit of an ellipsoid: Gauss-Newton, each step with numpy.linalg.solve.

Where little but the prior holds an ellipsoid, or a point more or less decides, the firmware's
rounding is multiplied: by how much is found out by fits whose right sides are rounded like its own,
at random, and is each fit's slack."""

import numpy as np

import ellipsoid
import emit
import scenes
from ellipsoid import MEAN_SEMI_MM
from rig import from_q, to_q

ROBUST_MM = (24, 16, 8, 8, 8, 8)
ROBUST_REACH = 5
RADIUS_MIN = 0.05
LOW_FROM, LOW_TO, LOW_WEIGHT = 0.5, 0.8, 0.5
SEE_THROUGH_MM, PUSH_MAX_MM, PUSH_WEIGHT = 60, 30, 0.5
POINT_MM, PRIOR_CENTRE_MM, PRIOR_LN = 6, 60, 0.09
STEP_MAX_MM, STEP_MAX_LN, LN_MAX = 40, 0.15, 0.35
ROUNDING_MM = 1 / 1024  # of the right side, half a step


def rows(position, semi):
    """Residuals and their derivatives by centre and ln semi-axes, of positions, one a row."""
    f = np.linalg.norm(position, axis=1)
    steep = position / semi  # f times the gradient of f
    length = np.linalg.norm(steep, axis=1)
    residual = (f - 1) * f / length
    return residual, np.hstack([-steep, -position**2]) / length[:, None]


def observations(ray_table, centre, semi, robust_mm):
    """Residuals, derivatives and weights of all points and pushes."""
    seen = ray_table.state == scenes.SEEN
    slope, point = ray_table.slope[seen], ray_table.point[seen]
    with np.errstate(invalid="ignore", divide="ignore"):
        position = ellipsoid.position(centre, semi, point)
        residual, derivative = rows(position, semi)
        weight = (1 + (residual / robust_mm)**2)**-2
        weight *= np.interp(position[:, 1], (LOW_FROM, LOW_TO), (1, LOW_WEIGHT))
        weight[(np.abs(position) > ellipsoid.REACH).any(axis=1)
               | (np.linalg.norm(position, axis=1) < RADIUS_MIN)
               | (np.abs(residual) > ROBUST_REACH * robust_mm)] = 0
        _, nearest, radius2, entry, near = ellipsoid.cross(centre, semi, ray_table.origin, slope)
        pushes = near & (radius2 < 1) & (point[:, 2] > entry + SEE_THROUGH_MM) \
            & (radius2 >= RADIUS_MIN**2)
        push_residual, push_derivative = rows(nearest, semi)
    used = weight > 0
    return (np.append(residual[used], np.maximum(push_residual[pushes], -PUSH_MAX_MM)),
            np.vstack([derivative[used], push_derivative[pushes]]),
            np.append(weight[used], np.full(pushes.sum(), PUSH_WEIGHT)))


def fit(ray_table, start_centre, start_semi, rounding=lambda: 0):
    """Centre and semi-axes. rounding: what is added to the right sides."""
    start = np.concatenate([start_centre, np.log(np.divide(start_semi, MEAN_SEMI_MM))])
    prior_mean = np.append(start[:3], np.zeros(3))
    prior = POINT_MM**2 / np.repeat([PRIOR_CENTRE_MM, PRIOR_LN], 3)**2.0
    state = start.copy()
    for robust_mm in ROBUST_MM:
        semi = MEAN_SEMI_MM * np.exp(state[3:])
        residual, derivative, weight = observations(ray_table, state[:3], semi, robust_mm)
        normal = derivative.T @ (weight[:, None] * derivative) + np.diag(prior)
        right = -derivative.T @ (weight * residual) - prior * (state - prior_mean)
        right += rounding()
        limit = np.repeat([STEP_MAX_MM, STEP_MAX_LN], 3)
        state += np.clip(np.linalg.solve(normal, right), -limit, limit)
        state[3:] = np.clip(state[3:], -LN_MAX, LN_MAX)
    return state[:3], MEAN_SEMI_MM * np.exp(state[3:])


def slack_of(random, ray_table, centre, semi):
    """What rounding can make of a fit, mm."""
    def rounding():  # derivatives by ln are a hundred times those by its hundredths
        return random.uniform(-ROUNDING_MM, ROUNDING_MM, 6) * np.repeat([1, 100], 3)
    exact = np.concatenate(fit(ray_table, centre, semi))
    off = [np.concatenate(fit(ray_table, centre, semi, rounding)) - exact for _ in range(12)]
    return 8 * np.abs(off).max()  # positions and sums are rounded too


def starts(random, scene):
    """Integers: a mean head some distance off, and one of another size."""
    centre = np.array([0, 0, 1400]) if scene.centre is None else scene.centre
    for spread in (0.05, 0.3):
        semi = MEAN_SEMI_MM * np.exp(random.uniform(-spread, spread, 3))
        off = random.normal(0, 20, 3)
        yield to_q(centre + off, 8), to_q(MEAN_SEMI_MM if spread < 0.1 else semi, 8)


def distances(random):
    """Positions in an ellipsoid's units, and their distances to first order."""
    for _ in range(40):
        semi = to_q(MEAN_SEMI_MM * np.exp(random.uniform(-LN_MAX, LN_MAX, 3)), 8)
        direction = random.normal(0, 1, 3)
        position = to_q(direction / np.linalg.norm(direction) * random.uniform(0.06, 4), 14)
        residual, _ = rows(from_q(position[None], 14), from_q(semi, 8))
        yield position, semi, residual[0]


def write_vectors(directory):
    random = np.random.default_rng(321)
    inc = emit.Inc("Distances from ellipsoids, and ellipsoids fitted to the scenes in scenes.inc, in\n"
                   " * float64.")
    inc.raw("\n#define VECTOR_SEE_THROUGH_MM %d\n#define VECTOR_LN_MAX %s\n"
            % (SEE_THROUGH_MM, emit.number(LN_MAX, 4)))
    inc.struct_array("vector_distance", "vector_distances", [
        "{%d, %d, %d}, {%d, %d, %d}, %s" % (*position, *semi, emit.number(distance, 5))
        for position, semi, distance in distances(random)])
    lines = []
    for index, (scene, ray_table, _) in enumerate(scenes.spaces()):
        for centre_q8, semi_q8 in starts(random, scene):
            centre, semi = fit(ray_table, from_q(centre_q8, 8), from_q(semi_q8, 8))
            slack = slack_of(random, ray_table, from_q(centre_q8, 8), from_q(semi_q8, 8))
            lines.append("%d, {{%d, %d, %d}, {%d, %d, %d}}, {%s}, {%s}, %s" % (
                index, *centre_q8, *semi_q8, ", ".join(emit.numbers(centre, 4)),
                ", ".join(emit.numbers(semi, 4)), emit.number(slack, 4)))
    inc.struct_array("vector_fit", "vector_fits", lines)
    return inc.write(directory, "fit.inc")
