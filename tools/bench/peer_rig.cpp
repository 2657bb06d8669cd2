#include "peer.hpp"

#include <cmath>
#include <stdexcept>

#include <opencv2/core/persistence.hpp>

namespace
{

constexpr double FIELD_DEPTH_MM = 900;

cv::Mat read_matrix(const cv::FileStorage &file, const std::string &path, const char *name,
                    int count)
{
    cv::Mat matrix;
    file[name] >> matrix;
    if (matrix.total() != static_cast<size_t>(count) || matrix.type() != CV_64F) {
        throw std::runtime_error(path + ": " + name + ": expected " + std::to_string(count) +
                                 " numbers");
    }
    return matrix;
}

peer_line line_of(const peer_rig &rig, int slot)
{
    double fx = rig.camera(0, 0), fy = rig.camera(1, 1);
    const double *slope = rig.slope[slot];
    double e_u = fx * (rig.origin_mm[0] - rig.origin_mm[2] * slope[0]);
    double e_v = fy * (rig.origin_mm[1] - rig.origin_mm[2] * slope[1]);
    double length = std::hypot(e_u, e_v);
    return {fx * slope[0] + rig.camera(0, 2),
            fy * slope[1] + rig.camera(1, 2),
            e_u / length,
            e_v / length,
            length,
            length / rig.far_mm,
            length / rig.near_mm};
}

/* Centre: the middle dot at 900 mm; unit: half the mean pitch there. */
void set_field(peer_rig &rig)
{
    double depth = std::min(std::max(FIELD_DEPTH_MM, rig.near_mm), rig.far_mm);
    const int ends[4][2] = {{0, PEER_GRID - 1},
                            {PEER_SLOTS - PEER_GRID, PEER_SLOTS - 1},
                            {0, PEER_SLOTS - PEER_GRID},
                            {PEER_GRID - 1, PEER_SLOTS - 1}};
    double sum = 0;
    for (const auto &end : ends) {
        cv::Point2d side =
            peer_rig_dot_at(rig, end[1], depth) - peer_rig_dot_at(rig, end[0], depth);
        sum += std::hypot(side.x, side.y);
    }
    cv::Point2d middle = peer_rig_dot_at(rig, PEER_SLOTS / 2, depth);
    rig.field_x = middle.x;
    rig.field_y = middle.y;
    rig.field_unit = sum / (4 * (PEER_GRID - 1) * 2);
}

} // namespace

cv::Point2d peer_rig_dot_at(const peer_rig &rig, int slot, double depth_mm)
{
    const double *slope = rig.slope[slot];
    return {slope[0] + (rig.origin_mm[0] - rig.origin_mm[2] * slope[0]) / depth_mm,
            slope[1] + (rig.origin_mm[1] - rig.origin_mm[2] * slope[1]) / depth_mm};
}

/* OpenCV's lens model, for one point. */
cv::Point2d peer_rig_distort(const peer_rig &rig, cv::Point2d n)
{
    const double *k = rig.distortion.ptr<double>();
    double r2 = n.x * n.x + n.y * n.y;
    double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    double x = n.x * radial + 2 * k[2] * n.x * n.y + k[3] * (r2 + 2 * n.x * n.x);
    double y = n.y * radial + k[2] * (r2 + 2 * n.y * n.y) + 2 * k[3] * n.x * n.y;
    return {rig.camera(0, 0) * x + rig.camera(0, 2), rig.camera(1, 1) * y + rig.camera(1, 2)};
}

peer_rig peer_rig_read(const std::string &path)
{
    cv::FileStorage file(path, cv::FileStorage::READ);
    if (!file.isOpened()) {
        throw std::runtime_error(path + ": cannot be read");
    }
    peer_rig rig;
    rig.width = static_cast<int>(file["image_width"]);
    rig.height = static_cast<int>(file["image_height"]);
    rig.near_mm = static_cast<double>(file["near_mm"]);
    rig.far_mm = static_cast<double>(file["far_mm"]);
    cv::Mat camera = read_matrix(file, path, "camera_matrix", 9);
    rig.camera = cv::Matx33d(camera.ptr<double>());
    rig.distortion = read_matrix(file, path, "distortion_coefficients", 5).clone();
    cv::Mat origin = read_matrix(file, path, "projector_origin", 3);
    cv::Mat rays = read_matrix(file, path, "dot_rays", 3 * PEER_SLOTS);
    for (int axis = 0; axis < 3; axis++) {
        rig.origin_mm[axis] = origin.ptr<double>()[axis];
    }
    for (int slot = 0; slot < PEER_SLOTS; slot++) {
        const double *ray = rays.ptr<double>() + 3 * slot;
        rig.slope[slot][0] = ray[0] / ray[2];
        rig.slope[slot][1] = ray[1] / ray[2];
        rig.line[static_cast<size_t>(slot)] = line_of(rig, slot);
    }
    set_field(rig);
    return rig;
}
