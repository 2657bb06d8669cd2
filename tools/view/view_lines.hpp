/* view_lines - how what was found is drawn, the same in every picture, and the key that explains it.
 */
#ifndef VIEW_LINES_HPP
#define VIEW_LINES_HPP

#include "view_canvas.hpp"
#include "view_rig.hpp"
#include "view_trace.hpp"

namespace view
{
/* `much` is 1 in a large picture, less in a small one. */
Stroke stroke_accepted(double much);
Stroke stroke_rejected(double much);
Stroke stroke_head(double much);
Stroke stroke_open(double much);     /* an open polygon that supports a hypothesis */
Stroke stroke_arc(double much);      /* its elliptical arc */
Stroke stroke_position(double much); /* a candidate that was tried and has no score */
Stroke stroke_contour(bool closed, double much);

void hypothesis_draw(Canvas &canvas, const Plot &plot, const Ellipse &ellipse, const Stroke &stroke);

/* The heads of the whole method: their outlines, the selected one with a cross. None with the paper's method alone. */
void heads_draw(Canvas &canvas, const Plot &plot, const Trace &trace, double much);

/* An arrow in the lower left corner to where is up, where the camera does not hang level. */
void up_draw(Canvas &canvas, const Plot &plot, const Trace &trace, double much);

/* What the lines mean, row by row in columns of this width, rows of this height, from `at` on. With the paper's method
 * alone without what only the whole method has. */
void key_draw(Canvas &canvas, cv::Point2d at, int columns, cv::Size2d cell, double much, bool paper);
/* How many rows that makes at most. */
constexpr int key_entries = 8;

/* "head at 691 mm"; "head near 691 mm" when it is not seen, but its track says that it is there; "no head"; "2 heads",
 * none of them selected. */
std::string head_words(const Trace &trace);
} // namespace view

#endif
