#include "peer.hpp"

#include <algorithm>
#include <cmath>

namespace
{

constexpr double MEAN_SEMI_MM[3] = {78, 113, 98};
constexpr double DEEP_MM = 98;
constexpr double SPACING_MM = 80;
constexpr size_t PLACES_MAX = 8;
constexpr double CENTRE_DEPTH_MM = 30;
constexpr double CENTRE_BEHIND_MM = 108;
constexpr double FRONT_LEAST_MM = 150;
constexpr double SCORE_LEAST = 0.9;

peer_head mean_head(double x, double y, double z)
{
    return {{x, y, z}, {MEAN_SEMI_MM[0], MEAN_SEMI_MM[1], MEAN_SEMI_MM[2]}, 0};
}

double distance_mm(const peer_head &a, const peer_head &b)
{
    return std::hypot(a.centre_mm[0] - b.centre_mm[0], a.centre_mm[1] - b.centre_mm[1],
                      a.centre_mm[2] - b.centre_mm[2]);
}

/* The best places of a mean head behind each point. */
void scan(const peer &p, std::vector<peer_head> &out)
{
    static std::vector<peer_head> tried;
    tried.clear();
    for (const peer_ray &ray : p.rays) {
        if (ray.state == peer_ray_state::seen) {
            double length = std::hypot(ray.slope_x, ray.slope_y, 1.0);
            double deep = DEEP_MM / length;
            peer_head head =
                mean_head(ray.point_mm[0] + deep * ray.slope_x,
                          ray.point_mm[1] + deep * ray.slope_y, ray.point_mm[2] + deep);
            head.score = peer_scan_score(p, head);
            tried.push_back(head);
        }
    }
    std::sort(tried.begin(), tried.end(),
              [](const peer_head &a, const peer_head &b) { return a.score > b.score; });
    size_t first = out.size();
    for (const peer_head &head : tried) {
        bool is_free = std::none_of(
            out.begin() + static_cast<std::ptrdiff_t>(first), out.end(),
            [&head](const peer_head &other) { return distance_mm(head, other) <= SPACING_MM; });
        if (is_free && out.size() < first + PLACES_MAX) {
            out.push_back(head);
        }
    }
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

} // namespace

void peer_find_heads(peer &p)
{
    static std::vector<peer_head> starts;
    starts.clear();
    scan(p, starts);
    size_t scanned = starts.size();
    for (const peer_nest &nest : p.nests) {
        if (nest.slice.empty()) {
            continue;
        }
        peer_head head = nest_head(p, nest);
        bool is_free = std::none_of(
            starts.begin() + static_cast<std::ptrdiff_t>(scanned), starts.end(),
            [&head](const peer_head &other) { return distance_mm(head, other) <= SPACING_MM; });
        if (is_free) {
            starts.push_back(head);
        }
    }
    if (p.has_head) {
        starts.push_back(p.head);
    }
    p.has_head = false;
    p.head.score = SCORE_LEAST;
    for (peer_head &head : starts) {
        peer_fit_head(p, head);
        head.score = peer_scan_score(p, head);
        if (head.centre_mm[2] - head.semi_mm[2] >= FRONT_LEAST_MM && head.score > p.head.score) {
            p.head = head;
            p.has_head = true;
        }
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
    peer_find_heads(p);
}
