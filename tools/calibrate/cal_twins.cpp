#include "cal_twins.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <opencv2/imgproc.hpp>

namespace cal
{
static constexpr double still_px = 0.6;
static constexpr size_t common_min = 6;
/* A dot, or an edge that moved, is where the difference of the two pictures, seen through a dot's own width, is so many
 * times its noise; so is what is around. The noise is told by what became darker, which dots do not, for each lightness. */
static constexpr double dot_px = 1.5, noise_times = 3.5;
static constexpr int around_px = 3;
static constexpr int level_grey = 16, levels = 256 / level_grey;
static constexpr size_t level_pixels_min = 300;

/* Whether two pictures show the board in the same place. */
static bool same_place(const Corners &a, const Corners &b)
{
    std::map<int, cv::Point2f> places;
    std::vector<double> apart;
    for (size_t i = 0; i < a.ids.size(); i++)
        places[a.ids[i]] = a.px[i];
    for (size_t i = 0; i < b.ids.size(); i++) {
        auto other = places.find(b.ids[i]);
        if (other != places.end())
            apart.push_back(cv::norm(other->second - b.px[i]));
    }
    if (apart.size() < common_min)
        return false;
    /* Dots on the board push some of its corners aside; a board that moves takes all along. */
    auto quarter = apart.begin() + static_cast<std::ptrdiff_t>(apart.size() / 4);
    std::nth_element(apart.begin(), quarter, apart.end());
    return *quarter < still_px;
}

std::vector<int> twins_find(const std::vector<Picture> &pictures, const std::vector<View> &views)
{
    std::vector<int> twins(pictures.size(), -1);
    int count = static_cast<int>(pictures.size());
    for (int i = 0; i < count; i++) {
        size_t here = static_cast<size_t>(i);
        for (int other : {i + 1, i - 1}) {
            if (!pictures[here].laser || twins[here] >= 0 || other < 0 || other >= count)
                continue;
            size_t there = static_cast<size_t>(other);
            if (!pictures[there].laser && same_place(views[here].corners, views[there].corners))
                twins[here] = other;
        }
    }
    return twins;
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

cv::Mat twins_mean(const cv::Mat &dark, const cv::Mat &lit)
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
} // namespace cal
