#include "peer.hpp"

#include <algorithm>
#include <cmath>
#include <queue>

namespace
{

constexpr double MEAN_SEMI_MM[3] = {78, 113, 98};
constexpr double DEEP_MM = 98;
constexpr double SPACING_MM = 80;
constexpr size_t POSITIONS_MAX = 8;
constexpr int BLOCKS = (PEER_GRID + 1) / 2; /* of two by two slots, along a side */
constexpr double CENTRE_DEPTH_MM = 30;
constexpr double CENTRE_BEHIND_MM = 108;
constexpr double FRONT_MIN_MM = 150;
constexpr double SCORE_MIN = 0.9;
constexpr double PROMISE_MIN = 1;
constexpr double APART_MM = 20;
constexpr int FIRST_LOOK_STEPS = 1;
/* Score after the first look: 45 of 100 fits end here, which costs none of 129 heads in both sequences. */
constexpr double HOPELESS = 0.4;

peer_head mean_head(double x, double y, double z)
{
    return {{x, y, z}, {MEAN_SEMI_MM[0], MEAN_SEMI_MM[1], MEAN_SEMI_MM[2]}, 0};
}

double distance_mm(const peer_head &a, const peer_head &b)
{
    return std::hypot(a.centre_mm[0] - b.centre_mm[0], a.centre_mm[1] - b.centre_mm[1],
                      a.centre_mm[2] - b.centre_mm[2]);
}

/* A mean head behind a slot's point. */
struct candidate {
    peer_head head;
    bool is_there, is_scored, is_spread;
};

struct scored {
    double score;
    int slot;
    bool operator<(const scored &other) const
    {
        return score < other.score;
    }
};

struct scanner {
    std::array<candidate, PEER_SLOTS> candidates;
    std::priority_queue<scored> best; /* of those that have a score */
};

void score_position(const peer &p, scanner &s, int slot)
{
    candidate &at = s.candidates[static_cast<size_t>(slot)];
    if (at.is_there && !at.is_scored) {
        at.is_scored = true;
        at.head.score = peer_scan_score(p, at.head);
        s.best.push({at.head.score, slot});
    }
}

/* Positions behind all points, of which the first of each block of two by two slots gets a score. */
void begin_scan(const peer &p, scanner &s)
{
    std::array<bool, BLOCKS *BLOCKS> is_begun = {};
    s.best = {};
    for (int slot = 0; slot < PEER_SLOTS; slot++) {
        const peer_ray &ray = p.rays[static_cast<size_t>(slot)];
        candidate &at = s.candidates[static_cast<size_t>(slot)];
        at.is_there = ray.state == peer_ray_state::seen;
        if (!at.is_there) {
            continue;
        }
        const double deep = DEEP_MM / std::hypot(ray.slope_x, ray.slope_y, 1.0);
        at.head = mean_head(ray.point_mm[0] + deep * ray.slope_x,
                            ray.point_mm[1] + deep * ray.slope_y, ray.point_mm[2] + deep);
        at.is_scored = at.is_spread = false;
        bool &block =
            is_begun[static_cast<size_t>(slot / PEER_GRID / 2 * BLOCKS + slot % PEER_GRID / 2)];
        if (!block) {
            block = true;
            score_position(p, s, slot);
        }
    }
}

void score_around(const peer &p, scanner &s, int slot)
{
    const int row = slot / PEER_GRID, column = slot % PEER_GRID;
    for (int y = std::max(row - 1, 0); y <= std::min(row + 1, PEER_GRID - 1); y++) {
        for (int x = std::max(column - 1, 0); x <= std::min(column + 1, PEER_GRID - 1); x++) {
            score_position(p, s, y * PEER_GRID + x);
        }
    }
}

/* The best positions: what seems best is taken when those around it have their scores too. */
void scan(const peer &p, std::vector<peer_head> &out)
{
    static scanner s;
    const size_t first = out.size();
    begin_scan(p, s);
    while (out.size() < first + POSITIONS_MAX && !s.best.empty()) {
        const scored best = s.best.top();
        candidate &at = s.candidates[static_cast<size_t>(best.slot)];
        if (at.is_there && !at.is_spread) {
            at.is_spread = true;
            score_around(p, s, best.slot);
            continue;
        }
        s.best.pop();
        if (at.is_there) {
            out.push_back(at.head);
            for (candidate &other : s.candidates) {
                other.is_there = other.is_there && distance_mm(at.head, other.head) > SPACING_MM;
            }
        }
    }
    std::sort(out.begin() + static_cast<std::ptrdiff_t>(first), out.end(),
              [](const peer_head &a, const peer_head &b) { return a.score > b.score; });
}

/* The centre of a nest: on the ray through the middle of its deeper ellipses, behind its front. */
peer_head nest_head(const peer &p, const peer_nest &nest)
{
    double sum = 0, x = 0, y = 0;
    for (size_t i = 0; i < nest.slice.size(); i++) {
        const peer_slice &slice = nest.slice[i];
        if (slice.behind_mm >= CENTRE_DEPTH_MM || i + 1 == nest.slice.size()) {
            sum += slice.area_mm2;
            x += slice.area_mm2 * slice.ellipse.x;
            y += slice.area_mm2 * slice.ellipse.y;
        }
    }
    double step = p.rig.field_unit * 10 / 11;
    double slope_x = p.rig.field_x + (x / sum - (PEER_NODES - 1) / 2.0) * step;
    double slope_y = p.rig.field_y + (y / sum - (PEER_NODES - 1) / 2.0) * step;
    double z = nest.front_mm + CENTRE_BEHIND_MM / std::hypot(slope_x, slope_y, 1.0);
    return mean_head(slope_x * z, slope_y * z, z);
}

/* Fits from a start, unless one before was as near or it does not get anywhere; keeps what is best. */
void try_start(peer &p, const peer_head &start, std::vector<peer_head> &starts)
{
    bool is_new = std::none_of(starts.begin(), starts.end(), [&start](const peer_head &other) {
        return distance_mm(start, other) < APART_MM;
    });
    if (!is_new) {
        return;
    }
    starts.push_back(start);
    peer_fit fit = peer_fit_begin(start);
    peer_fit_continue(p, FIRST_LOOK_STEPS, fit);
    double score = peer_scan_score(p, fit.head);
    if (score < HOPELESS) {
        return;
    }
    peer_fit_continue(p, PEER_FIT_STEPS, fit);
    fit.head.score = peer_scan_score(p, fit.head);
    if (fit.head.centre_mm[2] - fit.head.semi_mm[2] >= FRONT_MIN_MM &&
        fit.head.score > p.head.score) {
        p.head = fit.head;
        p.has_head = true;
    }
}

} // namespace

void peer_find_hypotheses(peer &p)
{
    static std::vector<peer_head> places, starts;
    places.clear();
    starts.clear();
    if (p.kind == peer_kind::b) {
        peer_fill_lanes(p);
    }
    for (const peer_nest &nest : p.nests) {
        if (nest.slice.empty()) {
            continue;
        }
        peer_head head = nest_head(p, nest);
        if (std::none_of(places.begin(), places.end(), [&head](const peer_head &other) {
                return distance_mm(head, other) <= SPACING_MM;
            })) {
            places.push_back(head);
        }
    }
    scan(p, places);
    const bool had_head = p.has_head;
    const peer_head last = p.head;
    p.has_head = false;
    p.head.score = SCORE_MIN;
    for (const peer_head &head : places) {
        if (peer_promise(p, head) >= PROMISE_MIN) {
            try_start(p, head, starts);
        }
    }
    if (had_head) {
        try_start(p, last, starts);
    }
}

void peer_frame(peer &p, const cv::Mat &image)
{
    p.image = image;
    peer_find_dots(p);
    peer_find_labels(p);
    peer_find_samples(p);
    peer_fit_surface(p);
    peer_find_nests(p);
    peer_find_hypotheses(p);
}
