#include "cal_refine.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace cal
{
/* Half side of the patch in squares and its bounds; sub-samples of a pixel along each side. */
static constexpr double patch_share = 0.48;
static constexpr int patch_min_px = 4, patch_max_px = 16, sub_samples = 3, blur_reach_px = 3;
static constexpr int steps = 4;
static constexpr double moved_max_px = 2.5;
/* What is left may be this part of the contrast. */
static constexpr double miss_max = 0.12, contrast_min_grey = 12.0;
/* Pixels at the sensor's limit do not count: lamps and dots. So much of the patch must be left. */
static constexpr double saturated_grey = 248.0, used_share = 0.7;
/* An edge's rise over its steepest slope is this many standard deviations of its blur. */
static constexpr double edge_sigmas = 2.5066, pixel_sigma_px = 0.29, blur_min_px = 0.4;

using Unknowns = cv::Matx<double, 6, 1>; /* gain, ground, its slopes, shift */

/* Where a place of the frame lies on the print, near one corner. */
static cv::Matx33d local_map(const Board &board, int id, const cv::Vec3d &turn, const cv::Vec3d &shift,
                             const cv::Mat &camera, const cv::Mat &distortion, cv::Point2d &corner_px)
{
    cv::Point3d middle = board.corner_mm(id);
    cv::Point2d sheet = board.sheet_origin_mm();
    double half = 0.5 * board.square_mm;
    std::vector<cv::Point3d> places{middle, middle + cv::Point3d(-half, -half, 0.0),
                                    middle + cv::Point3d(half, -half, 0.0), middle + cv::Point3d(half, half, 0.0),
                                    middle + cv::Point3d(-half, half, 0.0)};
    std::vector<cv::Point2d> seen;
    cv::projectPoints(places, turn, shift, camera, distortion, seen);
    corner_px = seen[0];
    cv::Point2f from[4], to[4];
    for (size_t i = 0; i < 4; i++) {
        from[i] = seen[i + 1] - seen[0];
        to[i] = {static_cast<float>((places[i + 1].x - sheet.x) * refine_px_per_mm - 0.5),
                 static_cast<float>((places[i + 1].y - sheet.y) * refine_px_per_mm - 0.5)};
    }
    cv::Matx33d map = cv::getPerspectiveTransform(from, to);
    /* The lens bends what lies between: the corner itself must be exact. */
    cv::Vec3d at = map * cv::Vec3d(0.0, 0.0, 1.0);
    double off_x = (middle.x - sheet.x) * refine_px_per_mm - 0.5 - at[0] / at[2];
    double off_y = (middle.y - sheet.y) * refine_px_per_mm - 0.5 - at[1] / at[2];
    return cv::Matx33d(1.0, 0.0, off_x, 0.0, 1.0, off_y, 0.0, 0.0, 1.0) * map;
}

static double sample(const cv::Mat &print, double x, double y)
{
    int left = cvFloor(x), top = cvFloor(y);
    if (left < 0 || top < 0 || left + 1 >= print.cols || top + 1 >= print.rows)
        return 1.0;
    double fx = x - left, fy = y - top;
    const uchar *upper = print.ptr<uchar>(top) + left, *lower = print.ptr<uchar>(top + 1) + left;
    return ((1.0 - fy) * ((1.0 - fx) * upper[0] + fx * upper[1]) + fy * ((1.0 - fx) * lower[0] + fx * lower[1])) /
           255.0;
}

/* The print as the camera sees it, 0 dark to 1 white: pixels from -half to half around `middle_px`, with the corner at
 * `corner_px`. */
static cv::Mat draw_patch(const cv::Mat &print, const cv::Matx33d &map, cv::Point middle_px, cv::Point2d corner_px,
                          int half, double blur_px)
{
    int side = 2 * (half + blur_reach_px) + 1;
    cv::Mat drawn(side, side, CV_64F), soft;
    for (int row = 0; row < side; row++) {
        for (int column = 0; column < side; column++) {
            double sum = 0.0;
            for (int i = 0; i < sub_samples * sub_samples; i++) {
                double u = middle_px.x + column - half - blur_reach_px + (i % sub_samples + 0.5) / sub_samples - 0.5;
                double v = middle_px.y + row - half - blur_reach_px + (i / sub_samples + 0.5) / sub_samples - 0.5;
                cv::Vec3d at = map * cv::Vec3d(u - corner_px.x, v - corner_px.y, 1.0);
                sum += sample(print, at[0] / at[2], at[1] / at[2]);
            }
            drawn.at<double>(row, column) = sum / (sub_samples * sub_samples);
        }
    }
    cv::GaussianBlur(drawn, soft, {2 * blur_reach_px + 1, 2 * blur_reach_px + 1}, blur_px);
    return soft;
}

/* One step of least squares; returns gain, ground and how far the corner is from where it was drawn. */
static bool match(const cv::Mat &grey8, const cv::Mat &drawn, cv::Point middle_px, int half, Unknowns &found,
                  double &miss)
{
    cv::Matx<double, 6, 6> normal = cv::Matx<double, 6, 6>::zeros();
    Unknowns right = Unknowns::zeros();
    double square_sum = 0.0;
    int used = 0;
    for (int pass = 0; pass < 2; pass++) {
        double gain = pass == 0 ? 1.0 : found(0);
        normal = cv::Matx<double, 6, 6>::zeros();
        right = Unknowns::zeros();
        square_sum = 0.0;
        used = 0;
        for (int dv = -half; dv <= half; dv++) {
            for (int du = -half; du <= half; du++) {
                int row = dv + half + blur_reach_px, column = du + half + blur_reach_px;
                double slope_u = 0.5 * (drawn.at<double>(row, column + 1) - drawn.at<double>(row, column - 1));
                double slope_v = 0.5 * (drawn.at<double>(row + 1, column) - drawn.at<double>(row - 1, column));
                double grey = grey8.at<uchar>(middle_px.y + dv, middle_px.x + du);
                if (grey >= saturated_grey)
                    continue;
                Unknowns terms(drawn.at<double>(row, column), 1.0, du, dv, -gain * slope_u, -gain * slope_v);
                used++;
                normal += terms * terms.t();
                right += terms * grey;
                square_sum += grey * grey;
            }
        }
        if (used < used_share * (2 * half + 1) * (2 * half + 1) ||
            !cv::solve(normal, right, found, cv::DECOMP_CHOLESKY))
            return false;
    }
    double rest = square_sum - (right.t() * found)(0);
    miss = std::sqrt(std::max(0.0, rest) / used) / std::max(1.0, found(0));
    return found(0) >= contrast_min_grey;
}

static bool refine_one(const cv::Mat &print, const cv::Mat &grey8, const cv::Matx33d &map, int half, double blur_px,
                       cv::Point2d &corner_px)
{
    cv::Point2d start = corner_px;
    double miss = 1.0;
    for (int step = 0; step < steps; step++) {
        cv::Point middle(cvRound(corner_px.x), cvRound(corner_px.y));
        if (middle.x < half || middle.y < half || middle.x >= grey8.cols - half || middle.y >= grey8.rows - half)
            return false;
        Unknowns found;
        if (!match(grey8, draw_patch(print, map, middle, corner_px, half, blur_px), middle, half, found, miss))
            return false;
        cv::Point2d move(found(4), found(5));
        corner_px += move * std::min(1.0, 1.0 / std::max(1e-9, cv::norm(move)));
        if (cv::norm(corner_px - start) > moved_max_px)
            return false;
        if (cv::norm(move) < 0.003)
            break;
    }
    return miss < miss_max;
}

void corners_refine(const Board &board, const cv::Mat &print, const cv::Mat &grey8, const cv::Mat &camera,
                    const cv::Mat &distortion, Corners &corners)
{
    cv::Vec3d turn, shift;
    Corners refined;
    refined.edge_px = corners.edge_px;
    if (!cv::solvePnP(corners.places_mm(board), corners.px, camera, distortion, turn, shift))
        return;
    double edge_sigma_px = corners.edge_px / edge_sigmas;
    double blur_px =
        std::sqrt(std::max(blur_min_px * blur_min_px, edge_sigma_px * edge_sigma_px - pixel_sigma_px * pixel_sigma_px));
    for (int id = 0; id < board.corner_count(); id++) {
        cv::Point2d corner_px;
        cv::Matx33d map = local_map(board, id, turn, shift, camera, distortion, corner_px);
        cv::Vec2d across(map(0, 0) / map(2, 2), map(1, 0) / map(2, 2)),
            down(map(0, 1) / map(2, 2), map(1, 1) / map(2, 2));
        double mm_per_px = std::max(cv::norm(across), cv::norm(down)) / refine_px_per_mm;
        int half = std::clamp(cvRound(patch_share * board.square_mm / mm_per_px), patch_min_px, patch_max_px);
        if (refine_one(print, grey8, map, half, blur_px, corner_px)) {
            refined.ids.push_back(id);
            refined.px.emplace_back(corner_px);
        }
    }
    corners = refined;
}
} // namespace cal
