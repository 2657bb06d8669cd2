#include "peer.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace
{

constexpr double LEVEL_STEP_MM = 10;
constexpr int LEVELS = 70;
constexpr double BLUNT_MM2 = 2000;
constexpr double TIP_MAX_MM = 70;
constexpr double DEPTH_MAX_MM = 110;
constexpr double END_DEPTH_MM = 50;
constexpr int GAP_MAX = 8;
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

void find_minima(peer &p)
{
    p.nests.clear();
    for (int y = 1; y < PEER_NODES - 1; y++) {
        for (int x = 1; x < PEER_NODES - 1; x++) {
            if (is_minimum(p.surface_mm, y, x)) {
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

bool find_support(const peer &p, const peer_nest &nest, const std::vector<peer_contour> &contours,
                  peer_ellipse &out)
{
    cv::Point2f place(static_cast<float>(nest.x), static_cast<float>(nest.y));
    bool found = false;
    double best = 0;
    for (const peer_contour &contour : contours) {
        peer_ellipse ellipse;
        double merit;
        if (contour.closed) {
            if (cv::pointPolygonTest(contour.vertex, place, false) <= 0 ||
                cv::contourArea(contour.vertex, true) <= 0) {
                continue;
            }
            if (peer_ellipse_whole(p.kind, contour, place, ellipse)) {
                out = ellipse;
                return true;
            }
        }
        if (peer_ellipse_part(p.kind, contour, place, ellipse, merit) && (!found || merit > best)) {
            out = ellipse;
            best = merit;
            found = true;
        }
    }
    return found;
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

void extend(const peer &p, double level_mm, const std::vector<peer_contour> &contours,
            peer_nest &nest)
{
    if (level_mm <= nest.nearest_mm || nest.ended) {
        return;
    }
    if ((!nest.slice.empty() && level_mm - nest.front_mm > DEPTH_MAX_MM) ||
        nest.slice.size() == SLICES_MAX) {
        nest.ended = true;
        return;
    }
    peer_slice slice;
    if (!find_support(p, nest, contours, slice.ellipse)) {
        nest.ended = ++nest.gap > GAP_MAX;
        return;
    }
    nest.gap = 0;
    double step_mm = level_mm * p.rig.field_unit * 10 / 11;
    slice.area_mm2 = slice.ellipse.area * step_mm * step_mm;
    add_slice(nest, level_mm, slice);
}

} // namespace

void peer_find_nests(peer &p)
{
    static std::vector<peer_contour> contours;
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
        peer_cut(p.surface_mm, level_mm, contours);
        for (peer_nest &nest : p.nests) {
            extend(p, level_mm, contours, nest);
        }
    }
}
