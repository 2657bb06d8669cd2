#include "peer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/calib3d.hpp>

namespace
{

constexpr double PERP_MAX_PX = 0.6;
constexpr double RANGE_MARGIN_PX = 0.5;
constexpr double SEED_MAX_PX = 1.0;
constexpr double SEED_MARGIN_PX = 0.5;
constexpr double EPSILON_MIN_PX = 1.5;
constexpr double EPSILON_MAX_PX = 8;
constexpr int FEW_ASSIGNED = 5;

struct candidate {
    int dot;
    double inverse_depth, perp_px;
};

/* Something that may be labelled: a rectangle of slots from its first corner, or one slot. */
struct offer {
    double error_px;
    int slot;
    int choice[4];
};

struct table {
    std::vector<cv::Point2d> position; /* undistorted pixels, sorted by v */
    std::vector<int> order;            /* dots by v */
    std::vector<candidate> candidates[PEER_SLOTS];
    int choice[PEER_SLOTS];  /* -1: open */
    std::vector<bool> taken; /* by dot */
};

void undistort(const peer &p, table &t)
{
    std::vector<cv::Point2d> raw(p.dots.size());
    if (!raw.empty()) {
        cv::undistortPoints(p.dots, raw, p.rig.camera, p.rig.distortion, cv::noArray(),
                            p.rig.camera);
    }
    t.order.resize(raw.size());
    for (size_t i = 0; i < raw.size(); i++) {
        t.order[i] = static_cast<int>(i);
    }
    std::sort(t.order.begin(), t.order.end(), [&raw](int a, int b) {
        return raw[static_cast<size_t>(a)].y < raw[static_cast<size_t>(b)].y;
    });
    t.position = std::move(raw);
    t.taken.assign(t.position.size(), false);
}

void find_candidates(const peer_line &line, table &t, std::vector<candidate> &out)
{
    double v_far = line.infinity_v + line.t_far_px * line.dir_v;
    double v_near = line.infinity_v + line.t_near_px * line.dir_v;
    double margin = PERP_MAX_PX + RANGE_MARGIN_PX;
    auto from = std::lower_bound(
        t.order.begin(), t.order.end(), std::min(v_far, v_near) - margin,
        [&t](int dot, double v) { return t.position[static_cast<size_t>(dot)].y < v; });
    double v_last = std::max(v_far, v_near) + margin;
    for (; from != t.order.end() && t.position[static_cast<size_t>(*from)].y <= v_last; ++from) {
        cv::Point2d position = t.position[static_cast<size_t>(*from)];
        double du = position.x - line.infinity_u, dv = position.y - line.infinity_v;
        double along = du * line.dir_u + dv * line.dir_v;
        double perp = dv * line.dir_u - du * line.dir_v;
        if (std::abs(perp) <= PERP_MAX_PX && along >= line.t_far_px - RANGE_MARGIN_PX &&
            along <= line.t_near_px + RANGE_MARGIN_PX && along > 0) {
            out.push_back({*from, along / line.length_px_mm, perp});
        }
    }
}

double rectangle_error2(const table &t, const candidate *const corner[4])
{
    cv::Point2d second = t.position[static_cast<size_t>(corner[0]->dot)] -
                         t.position[static_cast<size_t>(corner[1]->dot)] -
                         t.position[static_cast<size_t>(corner[2]->dot)] +
                         t.position[static_cast<size_t>(corner[3]->dot)];
    double perp2 = 0;
    for (int i = 0; i < 4; i++) {
        perp2 += corner[i]->perp_px * corner[i]->perp_px;
    }
    return (second.dot(second) + 9 * perp2) / 4;
}

/* The best choice of candidates for a rectangle; false when there is none, or no clear one. */
bool find_seed(const table &t, const int slot[4], offer &out)
{
    double best2 = std::numeric_limits<double>::max(), second2 = best2;
    const std::vector<candidate> *c[4];
    for (int i = 0; i < 4; i++) {
        c[i] = &t.candidates[slot[i]];
    }
    const candidate *corner[4];
    for (const candidate &c0 : *c[0]) {
        corner[0] = &c0;
        for (const candidate &c1 : *c[1]) {
            corner[1] = &c1;
            for (const candidate &c2 : *c[2]) {
                corner[2] = &c2;
                for (const candidate &c3 : *c[3]) {
                    corner[3] = &c3;
                    double error2 = rectangle_error2(t, corner);
                    if (error2 < best2) {
                        second2 = best2;
                        best2 = error2;
                        for (int i = 0; i < 4; i++) {
                            out.choice[i] = static_cast<int>(corner[i] - c[i]->data());
                        }
                    } else if (error2 < second2) {
                        second2 = error2;
                    }
                }
            }
        }
    }
    out.error_px = std::sqrt(best2);
    return out.error_px < SEED_MAX_PX && std::sqrt(second2) - out.error_px > SEED_MARGIN_PX;
}

int dot_of(const table &t, int slot, int choice)
{
    return t.candidates[slot][static_cast<size_t>(choice)].dot;
}

bool can_take(const table &t, int slot, int choice)
{
    return t.choice[slot] >= 0 ? t.choice[slot] == choice
                               : !t.taken[static_cast<size_t>(dot_of(t, slot, choice))];
}

void take(table &t, int slot, int choice)
{
    t.choice[slot] = choice;
    t.taken[static_cast<size_t>(dot_of(t, slot, choice))] = true;
}

void sort_offers(std::vector<offer> &offers)
{
    std::sort(offers.begin(), offers.end(),
              [](const offer &a, const offer &b) { return a.error_px < b.error_px; });
}

void seed(table &t, std::vector<offer> &offers)
{
    offers.clear();
    for (int first = 0; first < PEER_SLOTS - PEER_GRID - 1; first++) {
        const int slot[4] = {first, first + 1, first + PEER_GRID, first + PEER_GRID + 1};
        offer found = {0, first, {0, 0, 0, 0}};
        if (first % PEER_GRID != PEER_GRID - 1 && find_seed(t, slot, found)) {
            offers.push_back(found);
        }
    }
    sort_offers(offers);
    for (const offer &o : offers) {
        const int slot[4] = {o.slot, o.slot + 1, o.slot + PEER_GRID, o.slot + PEER_GRID + 1};
        bool possible = true;
        for (int i = 0; i < 4; i++) {
            possible = possible && can_take(t, slot[i], o.choice[i]);
        }
        for (int i = 0; possible && i < 4; i++) {
            take(t, slot[i], o.choice[i]);
        }
    }
}

/* Inverse depths that the labelled ones of the 8 neighbours expect here, and their mean. */
int expected_inverse_depths(const table &t, int slot, double expected[9])
{
    int row = slot / PEER_GRID, column = slot % PEER_GRID, count = 0;
    double sum = 0;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, PEER_GRID - 1); r++) {
        for (int c = std::max(column - 1, 0); c <= std::min(column + 1, PEER_GRID - 1); c++) {
            int other = r * PEER_GRID + c;
            if (other != slot && t.choice[other] >= 0) {
                expected[count] =
                    t.candidates[other][static_cast<size_t>(t.choice[other])].inverse_depth;
                sum += expected[count++];
            }
        }
    }
    if (count > 0) {
        expected[count] = sum / count;
        count++;
    }
    return count;
}

/* One pass over the open slots; how many were labelled. */
int grow_once(const peer_rig &rig, table &t, double epsilon_px, std::vector<offer> &offers)
{
    offers.clear();
    for (int slot = 0; slot < PEER_SLOTS; slot++) {
        double expected[9];
        if (t.choice[slot] >= 0 || t.candidates[slot].empty()) {
            continue;
        }
        int count = expected_inverse_depths(t, slot, expected);
        offer best = {epsilon_px, slot, {-1, 0, 0, 0}};
        for (size_t i = 0; i < t.candidates[slot].size(); i++) {
            const candidate &c = t.candidates[slot][i];
            if (t.taken[static_cast<size_t>(c.dot)]) {
                continue;
            }
            for (int k = 0; k < count; k++) {
                double along = (c.inverse_depth - expected[k]) *
                               rig.line[static_cast<size_t>(slot)].length_px_mm;
                double error = std::sqrt(along * along + 36 * c.perp_px * c.perp_px);
                if (error < best.error_px) {
                    best.error_px = error;
                    best.choice[0] = static_cast<int>(i);
                }
            }
        }
        if (best.choice[0] >= 0) {
            offers.push_back(best);
        }
    }
    sort_offers(offers);
    int assigned = 0;
    for (const offer &o : offers) {
        if (can_take(t, o.slot, o.choice[0])) {
            take(t, o.slot, o.choice[0]);
            assigned++;
        }
    }
    return assigned;
}

void write_points(peer &p, const table &t)
{
    for (int slot = 0; slot < PEER_SLOTS; slot++) {
        peer_point &point = p.points[static_cast<size_t>(slot)];
        const peer_line &line = p.rig.line[static_cast<size_t>(slot)];
        point.seen = t.choice[slot] >= 0;
        if (!point.seen) {
            continue;
        }
        const candidate &c = t.candidates[slot][static_cast<size_t>(t.choice[slot])];
        double along = c.inverse_depth * line.length_px_mm;
        point.dot = c.dot;
        point.depth_mm = std::min(1 / c.inverse_depth, p.rig.far_mm);
        point.x = (line.infinity_u + along * line.dir_u - p.rig.camera(0, 2)) / p.rig.camera(0, 0);
        point.y = (line.infinity_v + along * line.dir_v - p.rig.camera(1, 2)) / p.rig.camera(1, 1);
    }
}

} // namespace

void peer_find_labels(peer &p)
{
    table t;
    std::vector<offer> offers;
    undistort(p, t);
    for (int slot = 0; slot < PEER_SLOTS; slot++) {
        find_candidates(p.rig.line[static_cast<size_t>(slot)], t, t.candidates[slot]);
        t.choice[slot] = -1;
    }
    seed(t, offers);
    for (double epsilon = EPSILON_MIN_PX; epsilon <= EPSILON_MAX_PX;) {
        if (grow_once(p.rig, t, epsilon, offers) < FEW_ASSIGNED) {
            epsilon *= 1.5;
        }
    }
    write_points(p, t);
}
