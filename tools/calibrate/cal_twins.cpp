#include "cal_twins.hpp"

#include <algorithm>
#include <map>
#include <opencv2/imgproc.hpp>

namespace cal
{
static constexpr double still_px = 0.6;
static constexpr size_t common_min = 6;
/* Pixels of the two pictures that differ by this, the mean of 3x3, show a dot or an edge that moved; so do those around. */
static constexpr double same_grey = 2.5;
static constexpr int around_px = 3;

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

cv::Mat twins_mean(const cv::Mat &dark, const cv::Mat &lit)
{
    cv::Mat smooth, same, mean = 0.5 * (dark + lit), result = dark.clone();
    cv::blur(lit - dark, smooth, {3, 3});
    same = cv::abs(smooth) < same_grey;
    cv::erode(same, same, cv::Mat::ones(2 * around_px + 1, 2 * around_px + 1, CV_8U));
    mean.copyTo(result, same);
    return result;
}
} // namespace cal
