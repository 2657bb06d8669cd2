/* cal_twins - pictures of the board in one place, without the laser and with it.
 */
#ifndef CAL_TWINS_HPP
#define CAL_TWINS_HPP

#include "cal_camera.hpp"
#include "cal_pictures.hpp"

namespace cal
{
/* Index of each laser-on picture's twin among the pictures: the one before or after it, where the board has not moved;
 * -1: it has none, or one that is no good. */
std::vector<int> twins_find(const std::vector<Picture> &pictures, const std::vector<View> &views);

/* The picture without the laser, with less noise: the mean of both where the laser lit nothing. CV_32F. */
cv::Mat twins_mean(const cv::Mat &dark, const cv::Mat &lit);

/* Variance of a pixel by the sensor, grey values squared: grows with the light. What it is without twins is usual. */
struct Noise {
    double dark = 2.0, by_light = 0.05;

    double at(double grey) const
    {
        return dark + by_light * grey;
    }
};
Noise twins_noise(const std::vector<Picture> &pictures, const std::vector<int> &twins);
} // namespace cal

#endif
