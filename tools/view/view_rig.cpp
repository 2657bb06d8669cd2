#include "view_rig.hpp"

#include <opencv2/calib3d.hpp>

#include "view_error.hpp"
#include "view_node.hpp"
#include "view_trace.hpp"

namespace view
{
/* Half a frame beyond the frame's corners. */
static constexpr double reach_beyond = 1.5;

cv::Point2d Rig::pixel(cv::Point2d position) const
{
    double x = position.x, y = position.y, r2 = x * x + y * y;
    double radial = 1 + r2 * (lens[0] + r2 * (lens[1] + r2 * lens[4]));
    double u = x * radial + 2 * lens[2] * x * y + lens[3] * (r2 + 2 * x * x);
    double v = y * radial + lens[2] * (r2 + 2 * y * y) + 2 * lens[3] * x * y;
    return {camera(0, 0) * u + camera(0, 2), camera(1, 1) * v + camera(1, 2)};
}

std::vector<cv::Point2d> Rig::positions(const std::vector<cv::Point2d> &pixels) const
{
    static const cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 20, 1e-6);
    std::vector<cv::Point2d> positions;
    cv::undistortPoints(pixels, positions, camera, lens, cv::noArray(), cv::noArray(), until);
    return positions;
}

/* A dot is at ray + (O - O_z ray) / Z, normalised: so its line runs along O - O_z ray. */
cv::Point2d Rig::across(size_t slot, cv::Point2d at_pixel) const
{
    static constexpr double little = 1e-4;
    cv::Point2d at = positions({at_pixel}).front();
    cv::Vec3d ray = rays[slot] / rays[slot][2];
    cv::Point2d along(origin_mm[0] - origin_mm[2] * ray[0], origin_mm[1] - origin_mm[2] * ray[1]);
    cv::Point2d offset = pixel(at + along * (little / cv::norm(along))) - pixel(at);
    return cv::Point2d(-offset.y, offset.x) / cv::norm(offset);
}

static std::vector<double> read_matrix(const Node &node, size_t count)
{
    Node data = node["data"];
    std::vector<double> values;
    data.must_count(count);
    for (size_t i = 0; i < count; i++)
        values.push_back(data[i].number());
    return values;
}

static void read_projector(const Node &whole, Rig &rig)
{
    std::vector<double> origin = read_matrix(whole["projector_origin"], 3);
    std::vector<double> rays = read_matrix(whole["dot_rays"], 3 * slot_count);
    rig.origin_mm = {origin[0], origin[1], origin[2]};
    if (cv::norm(rig.origin_mm) == 0)
        whole["projector_origin"].complain("away from the camera's centre");
    for (size_t slot = 0; slot < slot_count; slot++) {
        rig.rays.emplace_back(rays[3 * slot], rays[3 * slot + 1], rays[3 * slot + 2]);
        if (rig.rays.back()[2] <= 0)
            whole["dot_rays"]["data"][3 * slot + 2].complain("more than 0");
    }
}

/* How far out the frame's corners are seen. */
static double corner_reach(const Rig &rig)
{
    double width = rig.size_px.width - 1, height = rig.size_px.height - 1, max = 0;
    for (cv::Point2d position : rig.positions({{0, 0}, {width, 0}, {0, height}, {width, height}}))
        max = std::max(max, cv::norm(position));
    return max * reach_beyond;
}

Rig rig_read(const std::string &path)
{
    nlohmann::json json = json_read(path);
    Node whole(json, path, "");
    Rig rig{};
    rig.range = json.contains("kind") && whole["kind"].string() == "range";
    rig.size_px.width = static_cast<int>(whole["image_width"].integer(64, 1280));
    rig.size_px.height = static_cast<int>(whole["image_height"].integer(64, 1280));
    rig.camera = cv::Matx33d(read_matrix(whole["camera_matrix"], 9).data());
    rig.lens = cv::Vec<double, 5>(read_matrix(whole["distortion_coefficients"], 5).data());
    rig.near_mm = whole["near_mm"].number();
    rig.far_mm = whole["far_mm"].number();
    if (rig.camera(0, 0) <= 0 || rig.camera(1, 1) <= 0)
        throw Error(path + ": camera_matrix: both focal lengths must be more than 0");
    if (!rig.range)
        read_projector(whole, rig);
    rig.reach = corner_reach(rig);
    return rig;
}
} // namespace view
