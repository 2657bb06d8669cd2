/* view_contours - the contour plot (the paper's figure 1): the surface in bands of grey, near is dark; contours, the
 * open ones dashed; the ellipse of every hypothesis with its number; of each the open polygon that supports it last,
 * dashed, and its elliptical arc.
 * The plot covers the frame: a position in it is a position in the frame.
 */
#ifndef VIEW_CONTOURS_HPP
#define VIEW_CONTOURS_HPP

#include "view_lines.hpp"

namespace view
{
/* The depth that each pixel of a plot shows, kept from frame to frame of a rig. */
class Shader
{
  public:
    Shader(const Rig &rig, const Plot &plot);
    /* White where the surface does not reach. */
    cv::Mat1b shade(const Trace &trace) const;

  private:
    cv::Size size_;
    std::vector<cv::Point2d> positions_; /* normalised, row by row */
};

/* Depth bands and thin contours are this far apart. */
constexpr double band_mm = 20;
/* The grey of a depth: 0 black .. 255 white. */
uint8_t band_grey(const Trace &trace, double depth_mm);
/* What is shown as white, and beyond. */
double band_far_mm(const Trace &trace);

/* Every how many levels a contour is drawn. */
constexpr size_t contours_all = 2, contours_few = 4;

void contours_draw_plot(Canvas &canvas, const Plot &plot, const Shader &shader, const Trace &trace, const Rig &rig,
                        size_t every, double much);

/* The whole page, with the depths' key and every hypothesis's values beside their limits. */
cv::Size contours_page(const Rig &rig);
Plot contours_plot(const Rig &rig);
void contours_draw(Canvas &canvas, const Shader &shader, const Trace &trace, const Rig &rig);
} // namespace view

#endif
