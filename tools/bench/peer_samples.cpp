#include "peer.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace
{

constexpr double ISOLATED_MM = 60;
constexpr double CLIP_BEHIND_MM = 250;
constexpr double CLIP_MIN_MM = 1100;
constexpr int FILL_NEIGHBOURS = 3;
constexpr double FILL_WEIGHT = 0.3;
constexpr double REACH = 40; /* field units */
constexpr double BRIGHT_GREY = 200;
constexpr int BLOCK_PX = 8;
constexpr double PROBE_MM = 100;

struct around {
    int seen, friends;
};

around look_around(const peer &p, int slot, double clip_mm)
{
    int row = slot / PEER_GRID, column = slot % PEER_GRID;
    double own = std::min(p.points[static_cast<size_t>(slot)].depth_mm, clip_mm);
    around result = {0, 0};
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, PEER_GRID - 1); r++) {
        for (int c = std::max(column - 1, 0); c <= std::min(column + 1, PEER_GRID - 1); c++) {
            const peer_point &other = p.points[static_cast<size_t>(r * PEER_GRID + c)];
            if ((r != row || c != column) && other.seen) {
                result.seen++;
                result.friends += std::abs(std::min(other.depth_mm, clip_mm) - own) <= ISOLATED_MM;
            }
        }
    }
    return result;
}

void add_sample(peer &p, double x, double y, double depth_mm, double weight)
{
    double field_x = (x - p.rig.field_x) / p.rig.field_unit;
    double field_y = (y - p.rig.field_y) / p.rig.field_unit;
    if (std::abs(field_x) < REACH && std::abs(field_y) < REACH) {
        p.samples.push_back({field_x, field_y, depth_mm, std::sqrt(weight)});
    }
}

} // namespace

/* Within the frame, in a block that is not over-exposed. */
bool peer_is_visible(const peer &p, cv::Point2d normalised)
{
    cv::Point2d position = peer_rig_distort(p.rig, normalised);
    int u = static_cast<int>(std::floor(position.x)), v = static_cast<int>(std::floor(position.y));
    if (u < 0 || v < 0 || u >= p.rig.width || v >= p.rig.height) {
        return false;
    }
    cv::Rect block(u / BLOCK_PX * BLOCK_PX, v / BLOCK_PX * BLOCK_PX, BLOCK_PX, BLOCK_PX);
    block &= cv::Rect(0, 0, p.image.cols, p.image.rows);
    return cv::mean(p.image(block))[0] <= BRIGHT_GREY;
}

/* The 8th percentile of the seen depths; 0 without any. */
double peer_near_mm(const std::vector<peer_point> &points)
{
    std::vector<double> depth;
    depth.reserve(PEER_SLOTS);
    for (const peer_point &point : points) {
        if (point.seen) {
            depth.push_back(point.depth_mm);
        }
    }
    if (depth.empty()) {
        return 0;
    }
    auto nth = depth.begin() + static_cast<std::ptrdiff_t>(depth.size() * 8 / 100);
    std::nth_element(depth.begin(), nth, depth.end());
    return *nth;
}

/* Rays and points in space, for the scan and the fits. */
static void fill_rays(peer &p, double near_mm)
{
    for (int slot = 0; slot < PEER_SLOTS; slot++) {
        const peer_point &point = p.points[static_cast<size_t>(slot)];
        peer_ray &ray = p.rays[static_cast<size_t>(slot)];
        ray.slope_x = p.rig.slope[slot][0];
        ray.slope_y = p.rig.slope[slot][1];
        if (point.seen) {
            ray.state = peer_ray_state::seen;
            ray.point_mm[0] = point.x * point.depth_mm;
            ray.point_mm[1] = point.y * point.depth_mm;
            ray.point_mm[2] = point.depth_mm;
        } else {
            bool empty = peer_is_visible(p, peer_rig_dot_at(p.rig, slot, near_mm + PROBE_MM));
            ray.state = empty ? peer_ray_state::empty : peer_ray_state::unknown;
        }
    }
}

void peer_find_samples(peer &p)
{
    double near_mm = peer_near_mm(p.points);
    double clip_mm = std::max(near_mm + CLIP_BEHIND_MM, CLIP_MIN_MM);
    p.samples.clear();
    p.nearest_sample_mm = clip_mm;
    for (int slot = 0; slot < PEER_SLOTS; slot++) {
        const peer_point &point = p.points[static_cast<size_t>(slot)];
        around near = look_around(p, slot, clip_mm);
        if (point.seen && (near.seen < 3 || near.friends > 1)) {
            double depth_mm = std::min(point.depth_mm, clip_mm);
            add_sample(p, point.x, point.y, depth_mm, 1);
            p.nearest_sample_mm = std::min(p.nearest_sample_mm, depth_mm);
        } else if (!point.seen && near.seen < FILL_NEIGHBOURS) {
            cv::Point2d position = peer_rig_dot_at(p.rig, slot, clip_mm);
            if (peer_is_visible(p, position)) {
                add_sample(p, position.x, position.y, clip_mm, FILL_WEIGHT);
            }
        }
    }
    fill_rays(p, near_mm);
}
