/* cal_refine - corners to a fiftieth of a pixel, once it is known roughly how the camera sees the board; and the print as
 * the camera sees it: from pixels to positions on the sheet, through the lens.
 * Around each corner the print is drawn as the camera would see it, markers and all, and moved until it lies on the
 * picture, by least squares with its own gain and background: all edges near the corner are used, not only those that meet in it.
 * Dots of the laser on it are left out.
 */
#ifndef CAL_REFINE_HPP
#define CAL_REFINE_HPP

#include "cal_board.hpp"
#include "cal_find.hpp"

namespace cal
{
constexpr int draw_px_per_mm = 4; /* of the print's bitmap */

/* What the camera looks at in each pixel: X/Z, Y/Z, CV_64FC2. */
cv::Mat draw_tangents(cv::Size size, const cv::Mat &camera, const cv::Mat &distortion);

/* From tangents X/Z, Y/Z to samples of the print, for a board's pose. */
cv::Matx33d draw_map(const Board &board, const cv::Vec3d &rvec, const cv::Vec3d &shift);

/* What the camera looks at in a pixel, and how that changes to the right and downwards. */
struct Sight {
    cv::Vec2d at, right, down;

    cv::Vec3d beside(double right_px, double down_px) const
    {
        cv::Vec2d tangent = at + right_px * right + down_px * down;
        return {tangent[0], tangent[1], 1.0};
    }
};

Sight draw_sight(const cv::Mat &tangents, cv::Point2d px);

bool draw_on_sheet(const cv::Mat &print, int left, int top);

/* 0 dark to 1 white, which is also what is beyond the sheet. `at` is homogeneous. */
double draw_sample(const cv::Mat &print, const cv::Vec3d &at);

/* Sets the corners anew, all that are in the picture (CV_32F) and look as they should. `print` is board_picture with
 * draw_px_per_mm, `tangents` is draw_tangents. */
void corners_refine(const Board &board, const cv::Mat &print, const cv::Mat &tangents, const cv::Mat &grey,
                    const cv::Mat &camera, const cv::Mat &distortion, Corners &corners);
} // namespace cal

#endif
