#include "cal_rig.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <sstream>

#include "cal_error.hpp"
#include "tool_file.hpp"

namespace cal
{
/* Nearer to the optical axis the core takes no up: the sine of 10 degrees. */
static constexpr double aside_min = 0.17365;

static std::string number(double value)
{
    std::string digits = text("%.17g", value);
    /* OpenCV's reader would take a bare 0 for an integer. */
    return digits.find_first_of(".en") == std::string::npos ? digits + ".0" : digits;
}

static void write_matrix(std::ostream &file, const char *name, int rows, int columns, const std::vector<double> &values)
{
    file << "  \"" << name << "\":{\"type_id\":\"opencv-matrix\",\"rows\":" << rows << ",\"cols\":" << columns
         << ",\"dt\":\"d\",\"data\":[";
    for (size_t i = 0; i < values.size(); i++)
        file << (i > 0 ? "," : "") << number(values[i]);
    file << "]},\n";
}

static std::vector<double> values_of(const cv::Mat &matrix)
{
    return {matrix.begin<double>(), matrix.end<double>()};
}

cv::Vec3d up_of(const Mount &mount)
{
    double tilt = mount.tilt_deg * CV_PI / 180.0, roll = mount.roll_deg * CV_PI / 180.0;
    return {std::cos(tilt) * std::sin(roll), -std::cos(tilt) * std::cos(roll), -std::sin(tilt)};
}

cv::Vec3d up_of(const View &plumb)
{
    cv::Matx33d rotation;
    cv::Rodrigues(plumb.rvec, rotation);
    cv::Vec3d up = rotation * cv::Vec3d(0, -1, 0); /* the board's Y runs down */
    if (std::hypot(up[0], up[1]) < aside_min)
        throw Error(plumb.file +
                    ": by this board the camera looks straight up or down, so that no side of its picture is "
                    "up: name a picture in which it hung plumb");
    return up;
}

void rig_write(const std::string &path, const Camera &camera, const Projector &projector, const Range &range,
               const cv::Vec3d &up)
{
    std::vector<double> rays;
    for (const cv::Vec3d &ray : projector.rays)
        rays.insert(rays.end(), {ray[0], ray[1], ray[2]});
    std::ostringstream file;
    file << "{\n  \"kind\":\"dots\",\n  \"image_width\":" << camera.size.width
         << ",\n  \"image_height\":" << camera.size.height << ",\n";
    write_matrix(file, "camera_matrix", 3, 3, values_of(camera.matrix));
    write_matrix(file, "distortion_coefficients", 1, 5, values_of(camera.distortion));
    write_matrix(file, "projector_origin", 3, 1,
                 {projector.origin_mm[0], projector.origin_mm[1], projector.origin_mm[2]});
    write_matrix(file, "dot_rays", slot_count, 3, rays);
    file << "  \"dot_sightings\":[";
    for (size_t slot = 0; slot < slot_count; slot++)
        file << (slot > 0 ? "," : "") << projector.seen[slot];
    file << "],\n";
    if (up != cv::Vec3d(0, -1, 0))
        file << "  \"up\":[" << number(up[0]) << "," << number(up[1]) << "," << number(up[2]) << "],\n";
    file << "  \"near_mm\":" << number(range.near_mm) << ",\n  \"far_mm\":" << number(range.far_mm) << "\n}\n";
    tool::file_write(path, file.str());
}

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
