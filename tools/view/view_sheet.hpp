/* view_sheet - consecutive frames side by side (the paper's figure 2): the control picture above, the contour plot
 * below, and the head and its distance. The key stands after the last. And one frame's two pictures beside each other,
 * for a film.
 */
#ifndef VIEW_SHEET_HPP
#define VIEW_SHEET_HPP

#include "view_contours.hpp"

namespace view
{
struct Shown {
    Trace trace;
    cv::Mat1b image;
};

cv::Size sheet_page(size_t frame_count, const Rig &rig);
Plot sheet_plot(const Rig &rig);
void sheet_draw(Canvas &canvas, const Shader &shader, const std::vector<Shown> &frames, const Rig &rig);

cv::Size pair_page(const Rig &rig);
Plot pair_plot(const Rig &rig);
void pair_draw(Canvas &canvas, const Shader &shader, const Shown &frame, const Rig &rig);
} // namespace view

#endif
