#include "cal_camera.hpp"

#include <algorithm>
#include <numeric>
#include <opencv2/calib3d.hpp>

#include "cal_bundle.hpp"
#include "cal_coverage.hpp"
#include "cal_error.hpp"
#include "cal_refine.hpp"

namespace cal
{
/* A corner does not fit from this many times the usual residual on. */
static constexpr double corner_sigmas = 4.5;
/* Residuals that are good whatever the others are; rough: before the corners are refined. */
static constexpr double rough_px = 3.0, fine_px = 0.06;
static constexpr double kept_fraction = 0.6;
static constexpr double rayleigh_median = 1.1774; /* in standard deviations of one component */
static constexpr int rounds = 4;
static constexpr int corners_min = 8;
static constexpr double lens_sigmas = 3.0;
/* What the parameters' standard deviations may be at most. */
static constexpr double focal_sigma_max = 0.003, centre_sigma_max_px = 3.0;

cv::Vec3d View::in_camera(cv::Point3d position_mm) const
{
    cv::Matx33d rotation;
    cv::Rodrigues(rvec, rotation);
    return rotation * cv::Vec3d(position_mm.x, position_mm.y, position_mm.z) + shift;
}

cv::Point2d View::on_board(const cv::Vec3d &position_mm) const
{
    cv::Matx33d rotation;
    cv::Rodrigues(rvec, rotation);
    cv::Vec3d position = rotation.t() * (position_mm - shift);
    return {position[0], position[1]};
}

cv::Vec3d View::normal() const
{
    return in_camera({0.0, 0.0, 1.0}) - shift;
}

double View::tilt_deg() const
{
    return std::acos(std::clamp(std::abs(normal()[2]), 0.0, 1.0)) * 180.0 / CV_PI;
}

std::vector<cv::Point2d> Camera::tangents(const std::vector<cv::Point2d> &px) const
{
    std::vector<cv::Point2d> out;
    if (!px.empty())
        cv::undistortPoints(px, out, matrix, distortion, cv::noArray(), cv::noArray(),
                            {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-12});
    return out;
}

cv::Point2d Camera::undistorted_px(cv::Point2d tangent) const
{
    return {matrix.at<double>(0, 0) * tangent.x + matrix.at<double>(0, 2),
            matrix.at<double>(1, 1) * tangent.y + matrix.at<double>(1, 2)};
}

void camera_pose(const Camera &camera, const Board &board, View &view)
{
    cv::solvePnP(view.corners.positions_mm(board), view.corners.px, camera.matrix, camera.distortion, view.rvec,
                 view.shift);
}

static std::vector<cv::Point2d> residuals_of(const Camera &camera, const Board &board, const View &view)
{
    std::vector<cv::Point2f> expected;
    std::vector<cv::Point2d> residuals;
    cv::projectPoints(view.corners.positions_mm(board), view.rvec, view.shift, camera.matrix, camera.distortion,
                      expected);
    for (size_t i = 0; i < expected.size(); i++)
        residuals.emplace_back(view.corners.px[i] - expected[i]);
    return residuals;
}

static double rms_of(const std::vector<cv::Point2d> &residuals)
{
    double sum = 0.0;
    for (const cv::Point2d &residual : residuals)
        sum += residual.ddot(residual);
    return residuals.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(residuals.size()));
}

static double median_of(std::vector<double> values)
{
    auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

static void refuse(const std::vector<std::string> &missing)
{
    std::string message = "the pictures cannot support a calibration. Add:";
    for (const std::string &sentence : missing)
        message += "\n  - " + sentence;
    throw Error(message);
}

/* A start: every corner counts the same, and the lens has no third radial term. */
static void fit(const Board &board, std::vector<View> &views, Camera &camera)
{
    std::vector<std::vector<cv::Point3f>> positions;
    std::vector<std::vector<cv::Point2f>> seen;
    std::vector<View *> used;
    for (View &view : views) {
        if (view.good()) {
            positions.push_back(view.corners.positions_mm(board));
            seen.push_back(view.corners.px);
            used.push_back(&view);
        }
    }
    if (used.empty()) /* each has been refused meanwhile */
        refuse(coverage_missing(views, camera.size, coverage_min));
    std::vector<cv::Mat> rvecs, shifts;
    camera.distortion = cv::Mat::zeros(1, 5, CV_64F);
    cv::calibrateCamera(positions, seen, camera.size, camera.matrix, camera.distortion, rvecs, shifts,
                        cv::CALIB_FIX_K3);
    camera.distortion = camera.distortion.reshape(1, 1).colRange(0, 5).clone();
    for (size_t i = 0; i < used.size(); i++) {
        used[i]->rvec = rvecs[i];
        used[i]->shift = shifts[i];
        used[i]->rms_px = rms_of(residuals_of(camera, board, *used[i]));
    }
}

/* Leaves out what does not fit; false: nothing. A picture is refused when most of it would have to be left out. */
static bool clean(const Board &board, const Camera &camera, std::vector<View> &views, double slack_px)
{
    std::vector<double> sizes;
    bool changed = false;
    for (const View &view : views) {
        for (const cv::Point2d &residual : view.good() ? residuals_of(camera, board, view) : std::vector<cv::Point2d>())
            sizes.push_back(cv::norm(residual));
    }
    if (sizes.empty())
        return false;
    double usual_px = median_of(sizes), limit_px = std::max(corner_sigmas * usual_px / rayleigh_median, slack_px);
    for (View &view : views) {
        if (!view.good())
            continue;
        std::vector<cv::Point2d> residuals = residuals_of(camera, board, view);
        Corners kept;
        kept.edge_px = view.corners.edge_px;
        for (size_t i = 0; i < residuals.size(); i++) {
            if (cv::norm(residuals[i]) <= limit_px) {
                kept.ids.push_back(view.corners.ids[i]);
                kept.px.push_back(view.corners.px[i]);
                if (!view.corners.sigma_px.empty()) {
                    kept.sigma_px.push_back(view.corners.sigma_px[i]);
                    kept.dark_fraction.push_back(view.corners.dark_fraction[i]);
                }
            }
        }
        size_t dropped = residuals.size() - kept.ids.size();
        changed = changed || dropped > 0;
        view.left_out += static_cast<int>(dropped);
        view.corners = kept;
        if (static_cast<int>(kept.ids.size()) < corners_min ||
            static_cast<double>(kept.ids.size()) < kept_fraction * static_cast<double>(residuals.size()))
            view.corners.refused =
                text("%zu of its %zu corners do not fit the camera that the others give (rms %.2f px, "
                     "usual is %.2f): another board, bent, or moved?",
                     dropped, residuals.size(), view.rms_px, usual_px);
    }
    return changed;
}

static void fill_regions(const Board &board, const std::vector<View> &views, Camera &camera)
{
    for (const View &view : views) {
        if (!view.good())
            continue;
        std::vector<cv::Point2d> residuals = residuals_of(camera, board, view);
        for (size_t i = 0; i < residuals.size(); i++) {
            cv::Point2f px = view.corners.px[i];
            int column = std::clamp(static_cast<int>(px.x) * region_columns / camera.size.width, 0, region_columns - 1);
            int row = std::clamp(static_cast<int>(px.y) * region_rows / camera.size.height, 0, region_rows - 1);
            Region &region = camera.regions[static_cast<size_t>(row * region_columns + column)];
            region.corner_count++;
            region.mean_px += residuals[i];
            region.rms_px += residuals[i].ddot(residuals[i]);
        }
    }
    for (Region &region : camera.regions) {
        if (region.corner_count > 0) {
            region.mean_px /= region.corner_count;
            region.rms_px = std::sqrt(region.rms_px / region.corner_count);
        }
    }
}

static void check_trust(const Camera &camera)
{
    std::vector<std::string> missing;
    double focal = std::max(camera.sigma_px[0] / camera.matrix.at<double>(0, 0),
                            camera.sigma_px[1] / camera.matrix.at<double>(1, 1));
    double centre_px = std::max(camera.sigma_px[2], camera.sigma_px[3]);
    if (focal > focal_sigma_max)
        missing.push_back(
            text("pictures with the board tilted by 30 to 45 degrees in all directions: the focal length is "
                 "only known to %.2f %% (one standard deviation; %.2f is allowed)",
                 100.0 * focal, 100.0 * focal_sigma_max));
    if (centre_px > centre_sigma_max_px)
        missing.push_back(
            text("pictures with the board tilted, near, and turned on its side: the principal point is only "
                 "known to %.1f px (%.1f is allowed)",
                 centre_px, centre_sigma_max_px));
    if (!missing.empty())
        refuse(missing);
}

/* All corners anew, by the camera as it is known now. */
static void refine(const Board &board, const Camera &camera, std::vector<View> &views)
{
    cv::Mat print = board_picture(board, draw_px_per_mm);
    cv::Mat tangents = draw_tangents(camera.size, camera.matrix, camera.distortion);
    for (View &view : views) {
        view.left_out = 0;
        if (!view.good())
            continue;
        corners_refine(board, print, tangents, view.grey, camera.matrix, camera.distortion, view.corners);
        if (static_cast<int>(view.corners.ids.size()) < corners_min)
            view.corners.refused =
                text("only %zu of its corners look as printed, %d are needed", view.corners.ids.size(), corners_min);
    }
}

Camera camera_solve(const Board &board, cv::Size size, std::vector<View> &views)
{
    Camera camera;
    camera.size = size;
    coverage_guess_poses(board, size, views);
    std::vector<std::string> missing = coverage_missing(views, size, coverage_min);
    if (!missing.empty())
        refuse(missing);
    fit(board, views, camera);
    clean(board, camera, views, rough_px);
    fit(board, views, camera);
    refine(board, camera, views);
    fit(board, views, camera);
    clean(board, camera, views, fine_px);
    fit(board, views, camera);
    refine(board, camera, views);
    for (int round = 0; round < rounds; round++) {
        fit(board, views, camera);
        if (!clean(board, camera, views, fine_px))
            break;
    }
    camera.third_radial = true;
    bundle_solve(board, views, camera);
    camera.third_radial = std::abs(camera.distortion.at<double>(4)) > lens_sigmas * camera.lens_sigma[4];
    if (!camera.third_radial) {
        fit(board, views, camera);
        bundle_solve(board, views, camera);
    }
    missing = coverage_missing(views, size, coverage_min);
    if (!missing.empty())
        refuse(missing);
    check_trust(camera);
    fill_regions(board, views, camera);
    return camera;
}
} // namespace cal
