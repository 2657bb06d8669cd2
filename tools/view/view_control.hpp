/* view_control - the control picture: the camera's image with what the first stages made of it.
 * A ring: a dot with a label, its slot's number beside it (row * 19 + column). A bar through it: the epipolar residual,
 * how far the dot lies beside its line, bar_times as long and across the line. A cross: a dot without a label.
 * Of a depth image: the depth, near is dark, and the points that were taken from it.
 */
#ifndef VIEW_CONTROL_HPP
#define VIEW_CONTROL_HPP

#include "view_lines.hpp"

namespace view
{
constexpr double bar_times = 40;

/* The frame's image, 8 bits, brightened so that the scene is seen behind the dots. */
cv::Mat1b control_image(const std::string &path, const Rig &rig);

/* The image and dots alone, for a small picture. */
void control_draw_small(Canvas &canvas, const Plot &plot, const cv::Mat1b &image, const Trace &trace, const Rig &rig);

/* The whole page. */
cv::Size control_page(const Rig &rig);
void control_draw(Canvas &canvas, const cv::Mat1b &image, const Trace &trace, const Rig &rig);
} // namespace view

#endif
