/* cal_refine - corners to a fiftieth of a pixel, once it is known roughly how the camera sees the board.
 * Around each corner the print is drawn as the camera would see it, markers and all, and moved until it lies on the
 * picture, by least squares with its own gain and background: all edges near the corner are used, not only those that meet in it.
 * Dots of the laser on it are left out.
 */
#ifndef CAL_REFINE_HPP
#define CAL_REFINE_HPP

#include "cal_draw.hpp"
#include "cal_find.hpp"

namespace cal
{
/* Sets the corners anew, all that are in the picture (CV_32F) and look as they should. `print` is board_picture with
 * draw_px_per_mm, `tangents` is draw_tangents. */
void corners_refine(const Board &board, const cv::Mat &print, const cv::Mat &tangents, const cv::Mat &grey,
                    const cv::Mat &camera, const cv::Mat &distortion, Corners &corners);
} // namespace cal

#endif
