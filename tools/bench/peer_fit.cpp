#include "peer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace
{

constexpr double MEAN_SEMI_MM[3] = {78, 113, 98};
constexpr double REACH = 8; /* semi-axes */
constexpr double ROBUST_MM[PEER_FIT_STEPS] = {24, 16, 8, 8, 8, 8};
constexpr double RADIUS_MIN = 0.05;
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

/* Distance to first order at a position in the ellipsoid's units, and its derivatives by centre and
 * logarithms of the semi-axes. */
bool distance_row(const peer_head &head, const double position[3], double &residual_mm,
                  vector6 &row)
{
    double f2 = 0, length2 = 0, g[3];
    for (int axis = 0; axis < 3; axis++) {
        g[axis] = position[axis] / head.semi_mm[axis];
        f2 += position[axis] * position[axis];
        length2 += g[axis] * g[axis];
    }
    double f = std::sqrt(f2), length = std::sqrt(length2);
    if (f < RADIUS_MIN) {
        return false;
    }
    residual_mm = (f - 1) * f / length;
    for (int axis = 0; axis < 3; axis++) {
        row[axis] = -g[axis] / length;
        row[3 + axis] = -position[axis] * position[axis] / length;
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
    double position[3], residual;
    vector6 row;
    for (int axis = 0; axis < 3; axis++) {
        position[axis] = (ray.point_mm[axis] - head.centre_mm[axis]) / head.semi_mm[axis];
        if (std::abs(position[axis]) > REACH) {
            return;
        }
    }
    if (!distance_row(head, position, residual, row) || std::abs(residual) > 8 * scale_mm) {
        return;
    }
    double sum = 1 + residual * residual / (scale_mm * scale_mm);
    double low = 1 - 0.5 * std::min(std::max((position[1] - 0.5) / 0.3, 0.0), 1.0);
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

/* The points' part of a step, ray by ray. */
void add_rays(const peer &p, const peer_head &head, double scale_mm, normal_equations &out)
{
    for (const peer_ray &ray : p.rays) {
        if (ray.state == peer_ray_state::seen) {
            add_point(head, ray, scale_mm, out);
            add_push(p, head, ray, out);
        }
    }
}

/* Peer B's vectors. Eigen has no vectors of comparisons: 1 where a number is clearly positive, 0 where it is not. */
template <typename T> auto above_0(const T &value)
{
    return (value * 1e6F).max(0.0F).min(1.0F);
}

/* Some of them. */
using some_lanes = Eigen::Array<float, Eigen::Dynamic, 1, 0, peer_lanes::SizeAtCompileTime, 1>;

struct span {
    Eigen::Index first, count;
};

/* How rays meet the ellipsoid. */
struct crossings {
    some_lanes nearest[3], radius2, entry_mm;
};

void cross_some(const peer &p, const peer_head &head, span of, crossings &c)
{
    const double *centre = head.centre_mm, *semi = head.semi_mm, *origin = p.rig.origin_mm;
    const float depth = static_cast<float>(centre[2] - origin[2]);
    const float deep = static_cast<float>(semi[2]);
    some_lanes e[2], g[2];
    for (int axis = 0; axis < 2; axis++) {
        const float scale = static_cast<float>(1 / semi[axis]);
        const float off = static_cast<float>((origin[axis] - centre[axis]) / semi[axis]);
        const auto slope = p.lanes.slope[axis].segment(of.first, of.count);
        e[axis] = slope * (depth * scale) + off;
        g[axis] = slope * (deep * scale);
    }
    const some_lanes inverse = (1 + g[0].square() + g[1].square()).inverse();
    const some_lanes eg = e[0] * g[0] + e[1] * g[1];
    c.nearest[2] = -eg * inverse;
    for (int axis = 0; axis < 2; axis++) {
        c.nearest[axis] = e[axis] + g[axis] * c.nearest[2];
    }
    c.radius2 = e[0].square() + e[1].square() + eg * c.nearest[2];
    c.entry_mm = (c.nearest[2] - ((1 - c.radius2).max(0.0F) * inverse).sqrt()) * deep +
                 static_cast<float>(centre[2]);
}

/* The rows of the pattern that may pass the head within 1.9 semi-axes. */
span rows_around(const peer &p, const peer_head &head)
{
    const double up = 1.9 * head.semi_mm[1], deep = 1.9 * head.semi_mm[2];
    const double y = head.centre_mm[1] - p.rig.origin_mm[1];
    const double z = head.centre_mm[2] - p.rig.origin_mm[2];
    const double nearest = std::max(z - deep, 1.0), farthest = z + deep;
    const double min = std::min((y - up) / nearest, (y - up) / farthest);
    const double max = std::max((y + up) / nearest, (y + up) / farthest);
    int first = 0, last = PEER_GRID - 1;
    while (first < last && static_cast<double>(p.lanes.max_y[first]) < min) {
        first++;
    }
    while (last > first && static_cast<double>(p.lanes.min_y[last]) > max) {
        last--;
    }
    const Eigen::Index from = first * PEER_GRID / 8 * 8;
    return {from, ((last + 1) * PEER_GRID + 7) / 8 * 8 - from};
}

double scan_score_lanes(const peer &p, const peer_head &head)
{
    const span of = rows_around(p, head);
    const auto seen = p.lanes.seen.segment(of.first, of.count);
    const auto z = p.lanes.point_mm[2].segment(of.first, of.count);
    crossings c;
    cross_some(p, head, of, c);
    const some_lanes is_inside = above_0(1 - c.radius2);
    const some_lanes behind = z - c.entry_mm;
    const some_lanes on = above_0(28 - behind.abs());
    const auto off = above_0(-behind) * 0.15F + (behind * (1 / 60.0F)).max(0.0F).min(1.0F);
    const float across = static_cast<float>(head.semi_mm[0]);
    const float up = static_cast<float>(head.semi_mm[1]);
    const some_lanes is_ring =
        above_0((c.radius2 - 1.3F * 1.3F)
                    .min(1.9F * 1.9F - c.radius2)
                    .min(c.nearest[0].abs() * across - c.nearest[1] * up + 1e-5F));
    const float open_mm = static_cast<float>(head.centre_mm[2] + 60);
    const auto ring = above_0(z - open_mm) * 1.6F - 0.6F;
    const auto inside_else = p.lanes.inside.segment(of.first, of.count);
    const auto ring_else = p.lanes.ring.segment(of.first, of.count);
    const float inside_sum = (is_inside * (inside_else + seen * (on - (1 - on) * off))).sum();
    const float ring_sum = (is_ring * (ring_else + seen * ring)).sum();
    return static_cast<double>(inside_sum / std::max(is_inside.sum(), 8.0F) +
                               0.6F * ring_sum / std::max(is_ring.sum(), 8.0F));
}

using rows = Eigen::Matrix<float, peer_lanes::SizeAtCompileTime, 6>;

/* Residuals and derivatives of all rays at their positions, in whose units the ellipsoid is a sphere. */
template <typename T>
void distance_rows(const peer_head &head, const T position[3], peer_lanes &radius,
                   peer_lanes &residual, rows &row)
{
    peer_lanes gradient[3];
    for (int axis = 0; axis < 3; axis++) {
        gradient[axis] = position[axis] * static_cast<float>(1 / head.semi_mm[axis]);
    }
    const peer_lanes inverse =
        (gradient[0].square() + gradient[1].square() + gradient[2].square()).max(1e-9F).rsqrt();
    radius = (position[0].square() + position[1].square() + position[2].square()).sqrt();
    residual = (radius - 1) * radius * inverse;
    for (int axis = 0; axis < 3; axis++) {
        row.col(axis) = -gradient[axis] * inverse;
        row.col(3 + axis) = -position[axis].square() * inverse;
    }
}

void add_rows(const rows &row, const peer_lanes &residual, const peer_lanes &weight,
              normal_equations &out)
{
    /* Products of columns: a product of matrices is packed first, which costs more where one is so narrow. */
    for (int i = 0; i < 6; i++) {
        const peer_lanes weighted = row.col(i).array() * weight;
        for (int j = 0; j <= i; j++) {
            out.normal(i, j) += static_cast<double>(weighted.matrix().dot(row.col(j)));
        }
        out.right[i] -= static_cast<double>(weighted.matrix().dot(residual.matrix()));
    }
}

/* The same for all rays at once. */
void add_rays_lanes(const peer &p, const peer_head &head, double scale_mm, normal_equations &out)
{
    const peer_ray_lanes &rays = p.lanes;
    peer_lanes position[3], radius, residual;
    rows row;
    for (int axis = 0; axis < 3; axis++) {
        const float scale = static_cast<float>(1 / head.semi_mm[axis]);
        position[axis] = (rays.point_mm[axis] - static_cast<float>(head.centre_mm[axis])) * scale;
    }
    distance_rows(head, position, radius, residual, row);
    const float scale = static_cast<float>(scale_mm);
    const peer_lanes reach =
        static_cast<float>(REACH) - position[0].abs().max(position[1].abs()).max(position[2].abs());
    const peer_lanes valid =
        rays.seen *
        above_0(reach.min(8 * scale - residual.abs()).min(radius - static_cast<float>(RADIUS_MIN)));
    const peer_lanes low = 1 - ((position[1] - 0.5F) * (0.5F / 0.3F)).max(0.0F).min(0.5F);
    const peer_lanes robust = ((residual * (1 / scale)).square() + 1).inverse();
    add_rows(row, residual, valid * low * robust.square(), out);

    crossings c;
    cross_some(p, head, {0, peer_lanes::SizeAtCompileTime}, c);
    const float see_through = static_cast<float>(SEE_THROUGH_MM);
    const peer_lanes pushes =
        rays.seen * above_0((1 - c.radius2).min(rays.point_mm[2] - c.entry_mm - see_through));
    if (pushes.maxCoeff() > 0) {
        distance_rows(head, c.nearest, radius, residual, row);
        add_rows(row, residual.max(static_cast<float>(-PUSH_MAX_MM)),
                 pushes * above_0(radius - static_cast<float>(RADIUS_MIN)) *
                     static_cast<float>(PUSH_WEIGHT),
                 out);
    }
}

double scan_score_rays(const peer &p, const peer_head &head)
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

} // namespace

void peer_fill_lanes(peer &p)
{
    peer_ray_lanes &lanes = p.lanes;
    lanes.slope[0].setConstant(10); /* far from all heads */
    lanes.slope[1].setZero();
    for (peer_lanes &axis : lanes.point_mm) {
        axis.setZero();
    }
    lanes.seen.setZero();
    lanes.inside.setZero();
    lanes.ring.setZero();
    for (int row = 0; row < PEER_GRID; row++) {
        lanes.min_y[row] = std::numeric_limits<float>::max();
        lanes.max_y[row] = std::numeric_limits<float>::lowest();
    }
    for (int slot = 0; slot < PEER_SLOTS; slot++) {
        const peer_ray &ray = p.rays[static_cast<size_t>(slot)];
        float &min_y = lanes.min_y[slot / PEER_GRID], &max_y = lanes.max_y[slot / PEER_GRID];
        min_y = std::min(min_y, static_cast<float>(ray.slope_y));
        max_y = std::max(max_y, static_cast<float>(ray.slope_y));
        lanes.slope[0][slot] = static_cast<float>(ray.slope_x);
        lanes.slope[1][slot] = static_cast<float>(ray.slope_y);
        if (ray.state == peer_ray_state::seen) {
            for (int axis = 0; axis < 3; axis++) {
                lanes.point_mm[axis][slot] = static_cast<float>(ray.point_mm[axis]);
            }
            lanes.seen[slot] = 1;
        } else {
            lanes.inside[slot] = ray.state == peer_ray_state::empty ? -0.6F : -0.15F;
            lanes.ring[slot] = ray.state == peer_ray_state::empty ? 0.7F : 0;
        }
    }
}

double peer_scan_score(const peer &p, const peer_head &head)
{
    return p.kind == peer_kind::a ? scan_score_rays(p, head) : scan_score_lanes(p, head);
}

/* Of the rays that say something: how many are open above the head, meet a body below it, meet something beside
 * it as deep as its centre. */
double peer_promise(const peer &p, const peer_head &head)
{
    const double *centre = head.centre_mm;
    int high = 0, high_all = 0, body = 0, body_all = 0, level = 0, level_all = 0;
    for (const peer_ray &ray : p.rays) {
        if (ray.state == peer_ray_state::unknown) {
            continue;
        }
        const double depth = centre[2] - p.rig.origin_mm[2];
        const double x = std::abs(p.rig.origin_mm[0] + depth * ray.slope_x - centre[0]);
        const double y = p.rig.origin_mm[1] + depth * ray.slope_y - centre[1];
        const bool seen = ray.state == peer_ray_state::seen;
        const double behind = ray.point_mm[2] - centre[2];
        if (y < -215 && x < 125) {
            high_all++;
            high += !seen || behind > 60;
        } else if (y > 153 && y < 373 && x < 180) {
            body_all++;
            body += seen && std::abs(behind + 10) < 210;
        } else if (std::abs(y) < 113 && x >= 170 && x < 330) {
            level_all++;
            level += seen && std::abs(behind) < 150;
        }
    }
    return 2 * (high + 0.5) / (high_all + 1) + 3.0 * body / std::max(body_all, 3) -
           4.0 * level / std::max(level_all, 3);
}

peer_fit peer_fit_begin(const peer_head &start)
{
    peer_fit fit = {start, start, {0, 0, 0}, 0};
    for (int axis = 0; axis < 3; axis++) {
        fit.ln[axis] = std::log(start.semi_mm[axis] / MEAN_SEMI_MM[axis]);
    }
    return fit;
}

void peer_fit_continue(const peer &p, int steps, peer_fit &fit)
{
    for (; fit.step < steps; fit.step++) {
        peer_head &head = fit.head;
        normal_equations system = {matrix6::Zero(), vector6::Zero()};
        (p.kind == peer_kind::a ? add_rays : add_rays_lanes)(p, head, ROBUST_MM[fit.step], system);
        for (int axis = 0; axis < 3; axis++) {
            system.normal(axis, axis) += PRIOR_CENTRE;
            system.right[axis] -= PRIOR_CENTRE * (head.centre_mm[axis] - fit.start.centre_mm[axis]);
            system.normal(3 + axis, 3 + axis) += PRIOR_LN;
            system.right[3 + axis] -= PRIOR_LN * fit.ln[axis];
        }
        vector6 step = system.normal.llt().solve(system.right);
        for (int axis = 0; axis < 3; axis++) {
            double &ln = fit.ln[axis];
            head.centre_mm[axis] += std::min(std::max(step[axis], -40.0), 40.0);
            ln += std::min(std::max(step[3 + axis], -0.15), 0.15);
            ln = std::min(std::max(ln, -LN_MAX), LN_MAX);
            head.semi_mm[axis] = MEAN_SEMI_MM[axis] * std::exp(ln);
        }
    }
}
