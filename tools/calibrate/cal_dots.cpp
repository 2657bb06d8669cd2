#include "cal_dots.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "cal_pictures.hpp"

namespace cal
{
static constexpr double inner_px = 1.0, outer_px = 3.0;
static constexpr double noise_times = 5.0, peak_min_grey = 2.5;
static constexpr double sigma_min_px = 0.5, sigma_max_px = 3.2, moved_max_px = 1.5;
static constexpr int fit_steps = 20, used_min = 40;
static constexpr double damping = 1e-2;
/* Below this light a surface's lightness cannot be determined. */
static constexpr double light_min_grey = 12.0;

static double noise_of(const cv::Mat &band, const cv::Mat &where)
{
    std::vector<float> sizes;
    for (int v = 0; v < band.rows; v++) {
        for (int u = 0; u < band.cols; u++) {
            if (where.at<uchar>(v, u) != 0)
                sizes.push_back(std::abs(band.at<float>(v, u)));
        }
    }
    if (sizes.empty())
        return 1.0;
    auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    return 1.4826 * static_cast<double>(*middle);
}

/* What is lit, as it would be on a surface of even lightness. */
static cv::Mat evened(const cv::Mat &lit, const cv::Mat &dark, const cv::Mat &where)
{
    cv::Mat light = cv::max(dark - black_grey, light_min_grey), even;
    double usual = cv::mean(light, where)[0];
    cv::divide(lit - dark, light, even, usual);
    return even;
}

/* Adds a pixel to the equations of the fit. */
static void add_pixel(const cv::Matx<double, 5, 1> &p, int u, int v, double grey, cv::Matx<double, 5, 5> &normal,
                      cv::Matx<double, 5, 1> &right)
{
    double du = u - p(1), dv = v - p(2), s2 = p(3) * p(3);
    double bell = std::exp(-0.5 * (du * du + dv * dv) / s2);
    cv::Matx<double, 5, 1> slope(bell, p(0) * bell * du / s2, p(0) * bell * dv / s2,
                                 p(0) * bell * (du * du + dv * dv) / (s2 * p(3)), 1.0);
    normal += slope * slope.t();
    right += slope * (grey - p(0) * bell - p(4));
}

bool dot_fit(const cv::Mat &window, const cv::Mat &lit, Dot &dot)
{
    cv::Matx<double, 5, 1> p(static_cast<double>(window.at<float>(dot_reach_px, dot_reach_px)), 0.0, 0.0, 1.3, 0.0);
    for (int step = 0; step < fit_steps; step++) {
        cv::Matx<double, 5, 5> normal = cv::Matx<double, 5, 5>::zeros();
        cv::Matx<double, 5, 1> right = cv::Matx<double, 5, 1>::zeros(), change;
        int used = 0;
        for (int v = 0; v < window.rows; v++) {
            for (int u = 0; u < window.cols; u++) {
                if (static_cast<double>(lit.at<float>(v, u)) < saturated_grey) {
                    add_pixel(p, u - dot_reach_px, v - dot_reach_px, static_cast<double>(window.at<float>(v, u)),
                              normal, right);
                    used++;
                }
            }
        }
        for (int i = 0; i < 5; i++)
            normal(i, i) *= 1.0 + damping;
        if (used < used_min || !cv::solve(normal, right, change, cv::DECOMP_CHOLESKY))
            return false;
        p += change;
        if (!(p(3) > 0.3 && p(3) < 6.0) || std::abs(p(1)) > dot_reach_px || std::abs(p(2)) > dot_reach_px)
            return false;
    }
    dot = {{p(1), p(2)}, p(0), p(3)};
    return true;
}

/* A dot around a pixel. */
static bool find_dot(const cv::Mat &picture, const cv::Mat &lit, int u, int v, Dot &dot)
{
    cv::Rect window = dot_window({u, v});
    bool round = dot_fit(picture(window), lit(window), dot) && dot.peak_grey > peak_min_grey &&
                 dot.sigma_px >= sigma_min_px && dot.sigma_px <= sigma_max_px && std::abs(dot.px.x) < moved_max_px &&
                 std::abs(dot.px.y) < moved_max_px;
    dot.px += cv::Point2d(u, v);
    return round;
}

/* Where the surface alone is at the sensor's limit nothing can be seen on it. */
static bool is_dazzled(const cv::Mat &dark, int u, int v)
{
    double max = 0.0;
    if (!dark.empty())
        cv::minMaxLoc(dark(cv::Rect(u - 2, v - 2, 5, 5)), nullptr, &max);
    return max >= saturated_grey;
}

std::vector<Dot> dots_find(const cv::Mat &lit, const cv::Mat &dark, const cv::Mat &where)
{
    std::vector<Dot> dots;
    cv::Mat rise = dark.empty() ? lit : lit - dark, narrow, wide, band, highest;
    cv::GaussianBlur(rise, narrow, {}, inner_px);
    cv::GaussianBlur(rise, wide, {}, outer_px);
    band = narrow - wide;
    cv::dilate(band, highest, cv::Mat::ones(5, 5, CV_8U));
    double limit = std::max(noise_times * noise_of(band, where), 0.4 * peak_min_grey);
    cv::Mat fitted = dark.empty() ? lit : evened(lit, dark, where);
    for (int v = dot_reach_px + 1; v < lit.rows - dot_reach_px - 1; v++) {
        for (int u = dot_reach_px + 1; u < lit.cols - dot_reach_px - 1; u++) {
            float value = band.at<float>(v, u);
            Dot dot;
            if (where.at<uchar>(v, u) != 0 && static_cast<double>(value) > limit && value >= highest.at<float>(v, u) &&
                !is_dazzled(dark, u, v) && find_dot(fitted, lit, u, v, dot))
                dots.push_back(dot);
        }
    }
    return dots;
}
} // namespace cal
