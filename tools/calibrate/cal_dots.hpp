/* cal_dots - the laser's dots in one picture, their centres in floating point; independent of the firmware.
 * Method: subtract the laser-off picture, if there is one; band-pass; isolated local maxima above the noise; to each fit a
 *        round Gaussian on a level background by least squares. With a laser-off picture the difference is divided by the
 *        surface's lightness, else a dot half on a dark square would be pushed out of it.
 */
#ifndef CAL_DOTS_HPP
#define CAL_DOTS_HPP

#include <opencv2/core.hpp>
#include <vector>

namespace cal
{
struct Dot {
    cv::Point2d px;
    double peak_grey = 0.0, sigma_px = 0.0;
};

/* From this lightness on a pixel is saturated or nearly so: it is not used. */
constexpr double saturated_grey = 250.0;

/* A dot is fitted in this many pixels to each side. */
constexpr int dot_reach_px = 5, dot_side_px = 2 * dot_reach_px + 1;

inline cv::Rect dot_window(cv::Point middle_px)
{
    return {middle_px.x - dot_reach_px, middle_px.y - dot_reach_px, dot_side_px, dot_side_px};
}

/* Peak, position from the window's middle, width and background of a Gaussian, by damped Gauss-Newton over a window (CV_32F);
 * pixels of `lit` that are at the sensor's limit are not used. False: there is none. */
bool dot_fit(const cv::Mat &window, const cv::Mat &lit, Dot &dot);

/* `dark` is the laser-off picture, or empty. `where` (CV_8U, not 0) says where dots are looked for. */
std::vector<Dot> dots_find(const cv::Mat &lit, const cv::Mat &dark, const cv::Mat &where);
} // namespace cal

#endif
