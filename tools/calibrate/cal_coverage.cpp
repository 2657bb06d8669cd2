#include "cal_coverage.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>

#include "cal_error.hpp"

namespace cal
{
static constexpr double tilted_deg = 20.0;
/* Field of view of a camera that nobody knows yet: focal length in widths. */
static constexpr double guessed_focal = 1.2;
static constexpr size_t views_for_guess = 5;
static constexpr int regions = region_columns * region_rows;
/* When more than these lack corners, all parts are as good to name. */
static constexpr int regions_named_max = regions / 2;

const char *const coverage_region_names[region_columns * region_rows] = {
    "top left",    "top, left of the middle",    "top, right of the middle",    "top right",
    "left",        "middle, a little left",      "middle, a little right",      "right",
    "bottom left", "bottom, left of the middle", "bottom, right of the middle", "bottom right"};

/* What to do about parts of the frame without corners; empty: nothing. */
static std::string missing_regions(const std::vector<View> &views, cv::Size size, const CoverageLimits &limits)
{
    int counts[regions] = {};
    std::string names;
    for (const View &view : views) {
        for (const cv::Point2f &px : view.corners.px) {
            int column = std::clamp(static_cast<int>(px.x) * region_columns / size.width, 0, region_columns - 1);
            int row = std::clamp(static_cast<int>(px.y) * region_rows / size.height, 0, region_rows - 1);
            counts[row * region_columns + column] += view.good();
        }
    }
    int without = 0;
    for (int i = 0; i < regions; i++) {
        if (counts[i] < limits.region_corners) {
            names += (names.empty() ? "" : "; ") +
                     text("%s (%d corners of %d)", coverage_region_names[i], counts[i], limits.region_corners);
            without++;
        }
    }
    if (without <= limits.regions_without)
        return "";
    if (without > regions_named_max)
        return text("the board in all parts of the frame: %d of %d have enough corners", regions - without, regions);
    return "the board in these parts of the frame: " + names;
}

std::vector<std::string> coverage_missing(const std::vector<View> &views, cv::Size size, const CoverageLimits &limits)
{
    std::vector<std::string> missing;
    int good = 0, sideways = 0, upwards = 0;
    double nearest = 1e9, farthest = 0.0;
    for (const View &view : views) {
        if (!view.good())
            continue;
        cv::Vec3d normal = view.normal();
        bool tilted = view.tilt_deg() >= tilted_deg;
        good++;
        sideways += tilted && std::abs(normal[0]) >= 0.7 * std::abs(normal[1]);
        upwards += tilted && std::abs(normal[1]) >= 0.7 * std::abs(normal[0]);
        nearest = std::min(nearest, view.shift[2]);
        farthest = std::max(farthest, view.shift[2]);
    }
    if (good < limits.pictures)
        missing.push_back(text("%d more pictures of the board, sharp and held still: there are %d of %d",
                               limits.pictures - good, good, limits.pictures));
    if (sideways < limits.tilted)
        missing.push_back(
            text("the board turned 20 to 45 degrees to the left and to the right: %d of %d", sideways, limits.tilted));
    if (upwards < limits.tilted)
        missing.push_back(
            text("the board leaning 20 to 45 degrees backwards and forwards: %d of %d", upwards, limits.tilted));
    if (good > 0 && farthest < limits.distance_ratio * nearest)
        missing.push_back(
            text("other distances: the boards are %.0f to %.0f mm away, the farthest should be %.1f times "
                 "as far as the nearest",
                 nearest, farthest, limits.distance_ratio));
    std::string lacking = missing_regions(views, size, limits);
    if (good == 0)
        missing.push_back("the board in all parts of the frame");
    else if (!lacking.empty())
        missing.push_back(lacking);
    return missing;
}

void coverage_guess_poses(const Board &board, cv::Size size, std::vector<View> &views)
{
    Camera guess;
    std::vector<std::vector<cv::Point3f>> positions;
    std::vector<std::vector<cv::Point2f>> seen;
    for (const View &view : views) {
        if (view.good()) {
            positions.push_back(view.corners.positions_mm(board));
            seen.push_back(view.corners.px);
        }
    }
    double focal = guessed_focal * size.width;
    guess.matrix =
        (cv::Mat_<double>(3, 3) << focal, 0.0, 0.5 * size.width, 0.0, focal, 0.5 * size.height, 0.0, 0.0, 1.0);
    guess.distortion = cv::Mat::zeros(1, 5, CV_64F);
    if (positions.size() >= views_for_guess) {
        cv::Mat rvecs, shifts, matrix = guess.matrix.clone(), distortion = guess.distortion.clone();
        cv::calibrateCamera(positions, seen, size, matrix, distortion, rvecs, shifts,
                            cv::CALIB_USE_INTRINSIC_GUESS | cv::CALIB_FIX_PRINCIPAL_POINT |
                                cv::CALIB_ZERO_TANGENT_DIST | cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3);
        double found = matrix.at<double>(0, 0);
        if (found > 0.4 * focal && found < 2.5 * focal) {
            guess.matrix = matrix;
            guess.distortion = distortion;
        }
    }
    for (View &view : views) {
        if (view.good())
            camera_pose(guess, board, view);
    }
}
} // namespace cal
