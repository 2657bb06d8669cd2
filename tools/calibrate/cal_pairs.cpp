#include "cal_pairs.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

namespace cal
{
/* Half side of what is compared around a corner, and how far it may have moved. */
static constexpr int around_corner_px = 8, moved_px = 3;
static constexpr int common_min = 6;
static constexpr double still_fraction = 0.5, same_fraction = 0.25;
/* A dot, or an edge that moved, is where the difference of the two pictures, seen through a dot's own width, is so many
 * times its noise; so is what is around. The noise is estimated from what became darker, which dots do not, for each lightness. */
static constexpr double dot_px = 1.5, noise_times = 3.5;
static constexpr int around_px = 3;
static constexpr int level_grey = 16, levels = 256 / level_grey;
static constexpr size_t level_pixels_min = 300;
/* A drop beyond this is no noise; nor is what a sensor at its limit shows. */
static constexpr double drop_max_grey = 25.0, full_grey = 240.0;
static constexpr double noise_min = 0.1; /* a sensor's steps alone make so much */

/* How much darker than in `dark` a part of the picture is in `lit` at a position beside it; the laser darkens nothing. */
static double darker(const cv::Mat &dark, const cv::Mat &lit, const cv::Rect &part, cv::Point beside)
{
    cv::Mat drop = dark(part) - lit(part + beside);
    return cv::sum(cv::max(drop, 0.0))[0];
}

/* Whether what is around a corner is where it was: beside it is much that became darker, there is little. */
static bool is_still(const cv::Mat &dark, const cv::Mat &lit, const cv::Rect &part)
{
    double here = darker(dark, lit, part, {0, 0}), sum = 0.0;
    constexpr int side = 2 * moved_px + 1;
    for (int i = 0; i < side * side; i++) {
        double there = darker(dark, lit, part, {i % side - moved_px, i / side - moved_px});
        if (there < here)
            return false;
        sum += there / (side * side);
    }
    return here < still_fraction * sum;
}

/* Whether the board that `dark` shows has not moved in `lit`. It is not searched again: on a near one, dots
 * cover its markers. They may cover what is around some corners; a board that moves takes all along. */
static bool is_board_still(const Picture &dark, const Corners &corners, const Picture &lit)
{
    int looked = 0, same = 0;
    cv::Rect frame({0, 0}, dark.grey.size());
    for (const cv::Point2f &px : corners.px) {
        cv::Rect part(cvRound(px.x) - around_corner_px, cvRound(px.y) - around_corner_px, 2 * around_corner_px + 1,
                      2 * around_corner_px + 1);
        cv::Rect around(part.tl() - cv::Point(moved_px, moved_px), part.size() + cv::Size(2 * moved_px, 2 * moved_px));
        if ((around & frame) != around)
            continue;
        looked++;
        same += is_still(dark.grey, lit.grey, part);
    }
    return same >= common_min && same >= same_fraction * looked;
}

std::vector<int> pairs_find(const std::vector<Picture> &pictures, const std::vector<View> &views)
{
    std::vector<int> dark_of(pictures.size(), -1);
    int count = static_cast<int>(pictures.size());
    for (int i = 0; i < count; i++) {
        size_t here = static_cast<size_t>(i);
        for (int other : {i + 1, i - 1}) {
            if (!pictures[here].laser || dark_of[here] >= 0 || other < 0 || other >= count)
                continue;
            size_t there = static_cast<size_t>(other);
            if (!pictures[there].laser && views[there].good() &&
                is_board_still(pictures[there], views[there].corners, pictures[here]))
                dark_of[here] = other;
        }
    }
    return dark_of;
}

static int level_of(const cv::Mat &grey, int v, int u)
{
    return std::clamp(static_cast<int>(grey.at<float>(v, u)) / level_grey, 0, levels - 1);
}

static double noise_of(std::vector<float> &drops)
{
    auto middle = drops.begin() + static_cast<std::ptrdiff_t>(drops.size() / 2);
    std::nth_element(drops.begin(), middle, drops.end());
    return 1.4826 * static_cast<double>(*middle);
}

/* What the difference may be at each lightness; a lightness that is rare gets what the next darker one has. */
static std::array<double, levels> limits_of(const cv::Mat &smooth, const cv::Mat &dark)
{
    std::array<std::vector<float>, levels> drops;
    std::array<double, levels> limits{};
    for (int v = 0; v < smooth.rows; v++) {
        for (int u = 0; u < smooth.cols; u++) {
            float difference = smooth.at<float>(v, u);
            if (difference < 0.0f)
                drops[static_cast<size_t>(level_of(dark, v, u))].push_back(-difference);
        }
    }
    double last = 0.0;
    for (size_t level = 0; level < levels; level++) {
        if (drops[level].size() >= level_pixels_min)
            last = noise_times * noise_of(drops[level]);
        limits[level] = last;
    }
    return limits;
}

cv::Mat pairs_mean(const cv::Mat &dark, const cv::Mat &lit)
{
    cv::Mat smooth, same(dark.size(), CV_8U), mean = 0.5 * (dark + lit), result = dark.clone();
    cv::GaussianBlur(lit - dark, smooth, {}, dot_px);
    std::array<double, levels> limits = limits_of(smooth, dark);
    for (int v = 0; v < smooth.rows; v++) {
        for (int u = 0; u < smooth.cols; u++) {
            double difference = std::abs(static_cast<double>(smooth.at<float>(v, u)));
            same.at<uchar>(v, u) = difference < limits[static_cast<size_t>(level_of(dark, v, u))] ? 255 : 0;
        }
    }
    cv::erode(same, same, cv::Mat::ones(2 * around_px + 1, 2 * around_px + 1, CV_8U));
    mean.copyTo(result, same);
    return result;
}

/* By what became darker, which dots do not; for each lightness, then a straight line through all. */
Noise pairs_noise(const std::vector<Picture> &pictures, const std::vector<int> &dark_of)
{
    std::array<double, levels> counts{}, squares{};
    for (size_t i = 0; i < pictures.size(); i++) {
        if (dark_of[i] < 0)
            continue;
        const cv::Mat &dark = pictures[static_cast<size_t>(dark_of[i])].grey;
        for (int v = 0; v < dark.rows; v++) {
            for (int u = 0; u < dark.cols; u++) {
                double drop = static_cast<double>(dark.at<float>(v, u) - pictures[i].grey.at<float>(v, u));
                size_t level = static_cast<size_t>(level_of(dark, v, u));
                if (drop < 0.0 || drop > drop_max_grey || static_cast<double>(dark.at<float>(v, u)) > full_grey)
                    continue;
                counts[level] += drop > 0.0 ? 1.0 : 0.5; /* half of those that are the same might be darker */
                squares[level] += drop * drop;
            }
        }
    }
    cv::Matx22d normal = cv::Matx22d::zeros();
    cv::Vec2d right(0.0, 0.0);
    for (size_t level = 0; level < levels; level++) {
        if (counts[level] < static_cast<double>(level_pixels_min))
            continue;
        cv::Vec2d terms(1.0, (static_cast<double>(level) + 0.5) * level_grey);
        normal += terms * terms.t();
        right += terms * (0.5 * squares[level] / counts[level]);
    }
    cv::Vec2d line;
    if (!cv::solve(normal, right, line, cv::DECOMP_CHOLESKY))
        return {};
    double slope = std::max(line[1], 0.0);
    return {std::max(line[0], noise_min), slope};
}
} // namespace cal
