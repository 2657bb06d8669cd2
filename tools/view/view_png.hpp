/* view_png - a picture as a PNG with a palette: a third of the size that OpenCV's encoder needs for line art.
 * 40 greys, and 216 bins of colours, each as the mean of the pixels in it: lines keep their colour, and what is rare is
 * off by at most 51 of 255 in a channel.
 */
#ifndef VIEW_PNG_HPP
#define VIEW_PNG_HPP

#include <opencv2/core.hpp>
#include <string>

namespace view
{
/* The file's bytes; path is for messages. */
std::string png_encode(const cv::Mat3b &picture, const std::string &path);
} // namespace view

#endif
