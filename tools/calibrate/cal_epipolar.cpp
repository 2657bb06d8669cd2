#include "cal_epipolar.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>

namespace cal
{
static constexpr double rotation_max_deg = 5.0, rotation_step_deg = 0.1;

std::array<EpipolarLine, slot_count> epipolar_lines(const Camera &camera, const cv::Vec3d &origin_mm,
                                                    const std::array<cv::Vec3d, slot_count> &rays)
{
    std::array<EpipolarLine, slot_count> lines;
    double fx = camera.matrix.at<double>(0, 0), fy = camera.matrix.at<double>(1, 1);
    for (size_t slot = 0; slot < slot_count; slot++) {
        double x = rays[slot][0] / rays[slot][2], y = rays[slot][1] / rays[slot][2];
        lines[slot].infinity_px = camera.undistorted_px({x, y});
        lines[slot].move_px_mm = {fx * (origin_mm[0] - origin_mm[2] * x), fy * (origin_mm[1] - origin_mm[2] * y)};
    }
    return lines;
}

static double to_segment(cv::Point2d point, cv::Point2d a, cv::Point2d b)
{
    cv::Point2d offset = b - a;
    double square = offset.ddot(offset),
           along = square > 0.0 ? std::clamp((point - a).ddot(offset) / square, 0.0, 1.0) : 0.0;
    return cv::norm(point - (a + along * offset));
}

/* Segments that do not cross are nearest at an end of one of them. */
static double apart(cv::Point2d a, cv::Point2d b, cv::Point2d c, cv::Point2d d)
{
    cv::Point2d ab = b - a, cd = d - c;
    double side_c = ab.cross(c - a), side_d = ab.cross(d - a), side_a = cd.cross(a - c), side_b = cd.cross(b - c);
    if (side_c * side_d < 0.0 && side_a * side_b < 0.0)
        return 0.0;
    return std::min(std::min(to_segment(a, c, d), to_segment(b, c, d)),
                    std::min(to_segment(c, a, b), to_segment(d, a, b)));
}

Rotation epipolar_rotated(const Camera &camera, const Projector &projector, const Range &range, double deg)
{
    cv::Matx33d rotation;
    cv::Rodrigues(projector.rays[slot_count / 2] * (deg * CV_PI / 180.0), rotation);
    std::array<cv::Vec3d, slot_count> rays;
    for (size_t slot = 0; slot < slot_count; slot++)
        rays[slot] = rotation * projector.rays[slot];
    auto lines = epipolar_lines(camera, projector.origin_mm, rays);
    std::array<cv::Point2d, slot_count> near_end, far_end;
    for (size_t slot = 0; slot < slot_count; slot++) {
        near_end[slot] = lines[slot].at(range.near_mm);
        far_end[slot] = lines[slot].at(range.far_mm);
    }
    Rotation result{deg, 0, 1e9};
    for (size_t i = 0; i < slot_count; i++) {
        for (size_t k = i + 1; k < slot_count; k++) {
            double min_px = apart(near_end[i], far_end[i], near_end[k], far_end[k]);
            result.shared += min_px < same_line_px;
            result.min_apart_px = std::min(result.min_apart_px, min_px);
        }
    }
    return result;
}

std::vector<Rotation> epipolar_rotations(const Camera &camera, const Projector &projector, const Range &range)
{
    std::vector<Rotation> rotations;
    int steps = cvRound(rotation_max_deg / rotation_step_deg);
    for (int step = -steps; step <= steps; step++)
        rotations.push_back(epipolar_rotated(camera, projector, range, step * rotation_step_deg));
    return rotations;
}

Rotation epipolar_best(const std::vector<Rotation> &rotations)
{
    return *std::min_element(rotations.begin(), rotations.end(), [](const Rotation &a, const Rotation &b) {
        return a.shared != b.shared ? a.shared < b.shared : std::abs(a.deg) < std::abs(b.deg);
    });
}

double depth_sigma_mm(const Camera &camera, const Projector &projector, double dot_sigma_px, double depth_mm)
{
    auto lines = epipolar_lines(camera, projector.origin_mm, projector.rays);
    std::vector<double> sigmas;
    for (size_t slot = 0; slot < slot_count; slot++) {
        double ray_px = projector.sigma_deg[slot] * CV_PI / 180.0 * camera.focal_px();
        sigmas.push_back(depth_mm * depth_mm * std::hypot(dot_sigma_px, ray_px) / cv::norm(lines[slot].move_px_mm));
    }
    std::nth_element(sigmas.begin(), sigmas.begin() + slot_count / 2, sigmas.end());
    return sigmas[slot_count / 2];
}
} // namespace cal
