#include "peer.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace
{

constexpr double LEVEL_STEP_MM = 20;
constexpr int LEVELS = 35;
constexpr double BLUNT_MM2 = 2000;
constexpr double TIP_MAX_MM = 70;
constexpr double DEPTH_MAX_MM = 110;
constexpr double END_DEPTH_MM = 50;
constexpr int GAP_MAX = 2;
constexpr double FREE_MM = 200;
constexpr double FREE_BEHIND_MM = 80;
constexpr double AREA_MIN = 0.5; /* grid cells */
constexpr double SHRINK_MIN = 0.6;
constexpr double JUMP = 3.2;
constexpr double JUMP_MM2 = 2500;
constexpr double FRONT_GROWTH_MM = 565;
constexpr size_t NESTS_MAX = 16;
constexpr size_t SLICES_MAX = 16;

bool is_minimum(const peer_grid &z, int y, int x)
{
    for (int dy = -1; dy <= 1; dy++) {
        for (int dx = -1; dx <= 1; dx++) {
            bool earlier = dy < 0 || (dy == 0 && dx < 0);
            double other = z(y + dy, x + dx);
            if ((dx != 0 || dy != 0) && (earlier ? other <= z(y, x) : other < z(y, x))) {
                return false;
            }
        }
    }
    return true;
}

double step_at(const peer &p, double depth_mm)
{
    return depth_mm * p.rig.field_unit * 10 / 11;
}

/* Does the surface fall off in this direction from the node, or end, within the steps? */
bool falls_off(const peer_grid &z, int y, int x, int down, int right, int steps)
{
    const double limit = z(y, x) + FREE_BEHIND_MM;
    for (int i = 0; i < steps; i++) {
        x += right;
        y += down;
        if (x < 0 || x == PEER_NODES || y < 0 || z(y, x) > limit) {
            return true;
        }
    }
    return false;
}

/* May a head be in front here? */
bool is_free(const peer &p, int y, int x)
{
    const peer_grid &z = p.surface_mm;
    const int steps =
        static_cast<int>(std::min(FREE_MM / step_at(p, z(y, x)), static_cast<double>(PEER_NODES)));
    return falls_off(z, y, x, 0, -1, steps) && falls_off(z, y, x, 0, 1, steps) &&
           falls_off(z, y, x, -1, 0, steps);
}

void find_minima(peer &p)
{
    p.nests.clear();
    for (int y = 1; y < PEER_NODES - 1; y++) {
        for (int x = 1; x < PEER_NODES - 1; x++) {
            if (is_minimum(p.surface_mm, y, x) && is_free(p, y, x)) {
                double depth = p.surface_mm(y, x);
                p.nests.push_back({x, y, depth, depth, depth, 0, 0, false, {}});
            }
        }
    }
    std::sort(p.nests.begin(), p.nests.end(),
              [](const peer_nest &a, const peer_nest &b) { return a.nearest_mm < b.nearest_mm; });
    if (p.nests.size() > NESTS_MAX) {
        p.nests.resize(NESTS_MAX);
    }
}

/* What supports a nest at a level. */
struct support {
    bool wanted, found, whole;
    const peer_contour *contour;
    peer_ellipse ellipse;
    double merit;
};

/* What a contour is for every nest that it surrounds; computed at first use. */
struct study {
    bool done, whole, is_tip, outlined; /* a tip's contour may have any shape */
    peer_ellipse ellipse;
    peer_outline outline;
    std::vector<peer_arc> arcs;
};

/* area: of a closed contour, grid cells; step_mm: of the grid at the level. */
void study_contour(peer_kind kind, const peer_contour &contour, double area, double step_mm,
                   study &s)
{
    s.done = true;
    s.whole = contour.closed && peer_ellipse_whole(kind, contour, s.ellipse);
    s.is_tip =
        contour.closed && !s.whole && area >= AREA_MIN && area * step_mm * step_mm < BLUNT_MM2;
    if (s.is_tip) {
        s.ellipse = {area, 0, 0}; /* a tip may be anywhere */
    }
    s.outlined = !s.whole && !s.is_tip && peer_outline_make(contour, s.outline);
    s.arcs.clear();
    if (s.outlined) {
        peer_arcs(kind, s.outline, s.arcs);
    }
}

void find_supports(const peer &p, const std::vector<peer_contour> &contours, double step_mm,
                   std::vector<support> &supports)
{
    static study s;
    for (const peer_contour &contour : contours) {
        const double area = contour.closed ? cv::contourArea(contour.vertex, true) : 0;
        if (contour.closed && area <= 0) {
            continue; /* around a maximum */
        }
        const cv::Rect box = cv::boundingRect(contour.vertex);
        s.done = false;
        for (size_t i = 0; i < p.nests.size(); i++) {
            support &to = supports[i];
            const cv::Point node(p.nests[i].x, p.nests[i].y);
            if (!to.wanted || to.whole || !box.contains(node) ||
                (contour.closed && cv::pointPolygonTest(contour.vertex, node, false) <= 0)) {
                continue;
            }
            if (!s.done) {
                study_contour(p.kind, contour, area, step_mm, s);
            }
            if (s.whole || (s.is_tip && p.nests[i].slice.empty())) {
                to = {true, true, true, &contour, s.ellipse, 0};
                continue;
            }
            const peer_arc *arc = s.outlined ? peer_arc_around(s.outline, s.arcs, node) : nullptr;
            if (arc != nullptr && (!to.found || arc->merit > to.merit)) {
                to = {true, true, false, &contour, arc->ellipse, arc->merit};
            }
        }
    }
}

bool continues(const peer_nest &nest, const peer_slice &slice)
{
    if (nest.slice.empty()) {
        return true;
    }
    double last = nest.slice.back().area_mm2;
    return slice.area_mm2 >= SHRINK_MIN * last &&
           (slice.behind_mm < END_DEPTH_MM || slice.area_mm2 <= JUMP * last + JUMP_MM2);
}

void add_slice(peer_nest &nest, double level_mm, const peer_slice &found)
{
    peer_slice slice = found;
    if (nest.slice.empty()) {
        if (slice.area_mm2 < BLUNT_MM2) {
            nest.tip_level_mm = level_mm;
            nest.tip_area_mm2 = slice.area_mm2;
            nest.ended = level_mm - nest.nearest_mm > TIP_MAX_MM;
            return;
        }
        double passed = (level_mm - nest.tip_level_mm) * (BLUNT_MM2 - nest.tip_area_mm2) /
                        (slice.area_mm2 - nest.tip_area_mm2);
        nest.front_mm =
            std::max(nest.tip_level_mm + passed - BLUNT_MM2 / FRONT_GROWTH_MM, nest.nearest_mm);
    }
    slice.behind_mm = level_mm - nest.front_mm;
    if (continues(nest, slice)) {
        nest.slice.push_back(slice);
    } else {
        nest.ended = true;
    }
}

/* Is the nest still open at this level? */
bool is_open(double level_mm, peer_nest &nest)
{
    if (level_mm <= nest.nearest_mm || nest.ended) {
        return false;
    }
    nest.ended = (!nest.slice.empty() && level_mm - nest.front_mm > DEPTH_MAX_MM) ||
                 nest.slice.size() == SLICES_MAX;
    return !nest.ended;
}

void extend(const peer &p, double level_mm, const support &from, peer_nest &nest)
{
    if (!from.found) {
        nest.ended = ++nest.gap > GAP_MAX;
        return;
    }
    nest.gap = 0;
    const double step_mm = step_at(p, level_mm);
    peer_slice slice = {from.ellipse, 0, from.ellipse.area * step_mm * step_mm};
    add_slice(nest, level_mm, slice);
}

/* Of nests that have come to the same ellipse the nearest goes on. */
void merge_nests(const std::vector<support> &supports, std::vector<peer_nest> &nests)
{
    for (size_t i = 1; i < nests.size(); i++) {
        for (size_t k = 0; k < i && !nests[i].ended; k++) {
            const support &a = supports[i], &b = supports[k];
            if (!nests[k].ended && a.found && b.found && a.contour == b.contour &&
                a.ellipse.area == b.ellipse.area) {
                nests[i].ended = true;
                nests[i].slice.clear();
            }
        }
    }
}

} // namespace

void peer_find_nests(peer &p)
{
    static std::vector<peer_contour> contours;
    static std::vector<support> supports;
    p.nests.clear();
    if (!p.has_surface) {
        return;
    }
    find_minima(p);
    for (int level = 1; level <= LEVELS; level++) {
        bool alive = std::any_of(p.nests.begin(), p.nests.end(),
                                 [](const peer_nest &nest) { return !nest.ended; });
        if (!alive) {
            return;
        }
        double level_mm = p.nearest_node_mm + level * LEVEL_STEP_MM;
        bool wanted = false;
        supports.assign(p.nests.size(), support());
        for (size_t i = 0; i < p.nests.size(); i++) {
            supports[i].wanted = is_open(level_mm, p.nests[i]);
            wanted = wanted || supports[i].wanted;
        }
        if (!wanted) {
            continue; /* between two nests */
        }
        peer_contours(p.surface_mm, level_mm, contours);
        find_supports(p, contours, step_at(p, level_mm), supports);
        for (size_t i = 0; i < p.nests.size(); i++) {
            if (supports[i].wanted) {
                extend(p, level_mm, supports[i], p.nests[i]);
            }
        }
        merge_nests(supports, p.nests);
    }
}
