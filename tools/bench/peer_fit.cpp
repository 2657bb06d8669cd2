#include "peer.hpp"

#include <algorithm>
#include <cmath>

namespace
{

constexpr double MEAN_SEMI_MM[3] = {78, 113, 98};
constexpr double REACH = 8; /* semi-axes */
constexpr int STEPS = 6;
constexpr double ROBUST_MM[STEPS] = {24, 16, 8, 8, 8, 8};
constexpr double RADIUS_LEAST = 0.05;
constexpr double SEE_THROUGH_MM = 60;
constexpr double PUSH_MAX_MM = 30;
constexpr double PUSH_WEIGHT = 0.5;
constexpr double PRIOR_CENTRE = 36.0 / 3600; /* (6 mm)^2 over the priors' variances */
constexpr double PRIOR_LN = 36.0 / (0.09 * 0.09);
constexpr double LN_MAX = 0.35;

using vector6 = Eigen::Matrix<double, 6, 1>;
using matrix6 = Eigen::Matrix<double, 6, 6>;

/* How a ray meets the ellipsoid, in whose units it is the unit sphere. */
struct crossing {
    double nearest[3];
    double radius2, entry_mm;
};

bool cross(const peer &p, const peer_head &head, const peer_ray &ray, crossing &out)
{
    double depth = head.centre_mm[2] - p.rig.origin_mm[2];
    double ex = (p.rig.origin_mm[0] + depth * ray.slope_x - head.centre_mm[0]) / head.semi_mm[0];
    double ey = (p.rig.origin_mm[1] + depth * ray.slope_y - head.centre_mm[1]) / head.semi_mm[1];
    if (std::abs(ex) > REACH || std::abs(ey) > REACH) {
        return false;
    }
    double gx = ray.slope_x * head.semi_mm[2] / head.semi_mm[0];
    double gy = ray.slope_y * head.semi_mm[2] / head.semi_mm[1];
    double gg = 1 + gx * gx + gy * gy, eg = ex * gx + ey * gy;
    double tau = -eg / gg;
    out.nearest[0] = ex + gx * tau;
    out.nearest[1] = ey + gy * tau;
    out.nearest[2] = tau;
    out.radius2 = std::max(ex * ex + ey * ey + eg * tau, 0.0);
    double enter = out.radius2 < 1 ? tau - std::sqrt((1 - out.radius2) / gg) : tau;
    out.entry_mm = head.centre_mm[2] + enter * head.semi_mm[2];
    return true;
}

double inside_value(const peer_ray &ray, const crossing &c)
{
    if (ray.state != peer_ray_state::seen) {
        return ray.state == peer_ray_state::empty ? -0.6 : -0.15;
    }
    double behind = ray.point_mm[2] - c.entry_mm;
    return std::abs(behind) < 28 ? 1 : behind < 0 ? -0.15 : -std::min(behind / 60, 1.0);
}

double ring_value(const peer_ray &ray, double centre_mm)
{
    if (ray.state != peer_ray_state::seen) {
        return ray.state == peer_ray_state::empty ? 0.7 : 0;
    }
    return ray.point_mm[2] > centre_mm + 60 ? 1 : -0.6;
}

/* Distance to first order at a place in the ellipsoid's units, and its derivatives by centre and
 * logarithms of the semi-axes. */
bool distance_row(const peer_head &head, const double place[3], double &residual_mm, vector6 &row)
{
    double f2 = 0, length2 = 0, g[3];
    for (int axis = 0; axis < 3; axis++) {
        g[axis] = place[axis] / head.semi_mm[axis];
        f2 += place[axis] * place[axis];
        length2 += g[axis] * g[axis];
    }
    double f = std::sqrt(f2), length = std::sqrt(length2);
    if (f < RADIUS_LEAST) {
        return false;
    }
    residual_mm = (f - 1) * f / length;
    for (int axis = 0; axis < 3; axis++) {
        row[axis] = -g[axis] / length;
        row[3 + axis] = -place[axis] * place[axis] / length;
    }
    return true;
}

struct normal_equations {
    matrix6 normal;
    vector6 right;

    void add(const vector6 &row, double residual_mm, double weight)
    {
        normal.noalias() += weight * row * row.transpose();
        right.noalias() -= weight * residual_mm * row;
    }
};

void add_point(const peer_head &head, const peer_ray &ray, double scale_mm, normal_equations &out)
{
    double place[3], residual;
    vector6 row;
    for (int axis = 0; axis < 3; axis++) {
        place[axis] = (ray.point_mm[axis] - head.centre_mm[axis]) / head.semi_mm[axis];
        if (std::abs(place[axis]) > REACH) {
            return;
        }
    }
    if (!distance_row(head, place, residual, row) || std::abs(residual) > 8 * scale_mm) {
        return;
    }
    double sum = 1 + residual * residual / (scale_mm * scale_mm);
    double low = 1 - 0.5 * std::min(std::max((place[1] - 0.5) / 0.3, 0.0), 1.0);
    out.add(row, residual, low / (sum * sum));
}

void add_push(const peer &p, const peer_head &head, const peer_ray &ray, normal_equations &out)
{
    crossing c;
    vector6 row;
    double residual;
    if (cross(p, head, ray, c) && c.radius2 < 1 && ray.point_mm[2] > c.entry_mm + SEE_THROUGH_MM &&
        distance_row(head, c.nearest, residual, row)) {
        out.add(row, std::max(residual, -PUSH_MAX_MM), PUSH_WEIGHT);
    }
}

} // namespace

double peer_scan_score(const peer &p, const peer_head &head)
{
    double inside = 0, ring = 0;
    int inside_count = 0, ring_count = 0;
    for (const peer_ray &ray : p.rays) {
        crossing c;
        if (!cross(p, head, ray, c)) {
            continue;
        }
        if (c.radius2 < 1) {
            inside += inside_value(ray, c);
            inside_count++;
        } else if (c.radius2 > 1.3 * 1.3 && c.radius2 < 1.9 * 1.9 &&
                   c.nearest[1] * head.semi_mm[1] <= std::abs(c.nearest[0] * head.semi_mm[0])) {
            ring += ring_value(ray, head.centre_mm[2]);
            ring_count++;
        }
    }
    return inside / std::max(inside_count, 8) + 0.6 * ring / std::max(ring_count, 8);
}

void peer_fit_head(const peer &p, peer_head &head)
{
    const peer_head start = head;
    double ln[3];
    for (int axis = 0; axis < 3; axis++) {
        ln[axis] = std::log(head.semi_mm[axis] / MEAN_SEMI_MM[axis]);
    }
    for (double scale_mm : ROBUST_MM) {
        normal_equations system = {matrix6::Zero(), vector6::Zero()};
        for (const peer_ray &ray : p.rays) {
            if (ray.state == peer_ray_state::seen) {
                add_point(head, ray, scale_mm, system);
                add_push(p, head, ray, system);
            }
        }
        for (int axis = 0; axis < 3; axis++) {
            system.normal(axis, axis) += PRIOR_CENTRE;
            system.right[axis] -= PRIOR_CENTRE * (head.centre_mm[axis] - start.centre_mm[axis]);
            system.normal(3 + axis, 3 + axis) += PRIOR_LN;
            system.right[3 + axis] -= PRIOR_LN * ln[axis];
        }
        vector6 step = system.normal.llt().solve(system.right);
        for (int axis = 0; axis < 3; axis++) {
            head.centre_mm[axis] += std::min(std::max(step[axis], -40.0), 40.0);
            ln[axis] += std::min(std::max(step[3 + axis], -0.15), 0.15);
            ln[axis] = std::min(std::max(ln[axis], -LN_MAX), LN_MAX);
            head.semi_mm[axis] = MEAN_SEMI_MM[axis] * std::exp(ln[axis]);
        }
    }
}
