#include "cal_rig.hpp"

#include <cmath>
#include <sstream>

#include "cal_error.hpp"
#include "tool_file.hpp"

namespace cal
{
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

/* The unit vector of the camera frame that points up. */
static cv::Vec3d up_of(const Mount &mount)
{
    double tilt = mount.tilt_deg * CV_PI / 180.0, roll = mount.roll_deg * CV_PI / 180.0;
    return {std::cos(tilt) * std::sin(roll), -std::cos(tilt) * std::cos(roll), -std::sin(tilt)};
}

void rig_write(const std::string &path, const Camera &camera, const Projector &projector, const Range &range,
               const Mount &mount)
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
    if (mount.tilt_deg != 0.0 || mount.roll_deg != 0.0) {
        cv::Vec3d up = up_of(mount);
        file << "  \"up\":[" << number(up[0]) << "," << number(up[1]) << "," << number(up[2]) << "],\n";
    }
    file << "  \"near_mm\":" << number(range.near_mm) << ",\n  \"far_mm\":" << number(range.far_mm) << "\n}\n";
    tool::file_write(path, file.str());
}
} // namespace cal
