/* cal_pairs - laser-on/laser-off pairs: two pictures of the board in the same position.
 */
#ifndef CAL_PAIRS_HPP
#define CAL_PAIRS_HPP

#include "cal_camera.hpp"
#include "cal_pictures.hpp"

namespace cal
{
/* Index of each laser-on picture's laser-off one: the picture before or after it, if the board has not moved;
 * -1: there is none, or it is refused. */
std::vector<int> pairs_find(const std::vector<Picture> &pictures, const std::vector<View> &views);

/* The picture without the laser, with less noise: the mean of both where the laser lit nothing. CV_32F. */
cv::Mat pairs_mean(const cv::Mat &dark, const cv::Mat &lit);

/* Variance of a pixel by the sensor, grey values squared: grows with the light. The values are typical ones, for when there are no pairs. */
struct Noise {
    double dark = 2.0, by_light = 0.05;

    double at(double grey) const
    {
        return dark + by_light * grey;
    }
};
Noise pairs_noise(const std::vector<Picture> &pictures, const std::vector<int> &dark_of);
} // namespace cal

#endif
