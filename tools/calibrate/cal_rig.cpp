#include "cal_rig.hpp"

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
} // namespace cal
