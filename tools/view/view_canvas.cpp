#include "view_canvas.hpp"

#include <algorithm>
#include <memory>

#include "view_error.hpp"

namespace view
{
Plot plot_fit(cv::Size frame_px, cv::Rect2d room)
{
    double scale = std::min(room.width / frame_px.width, room.height / frame_px.height);
    return {{room.x, room.y, scale * frame_px.width, scale * frame_px.height}, scale};
}

void Canvas::set(Colour colour)
{
    cairo_set_source_rgb(cairo_, colour.red, colour.green, colour.blue);
}

void Canvas::fill(cv::Rect2d where, Colour colour)
{
    set(colour);
    cairo_rectangle(cairo_, where.x, where.y, where.width, where.height);
    cairo_fill(cairo_);
}

void Canvas::disc(cv::Point2d centre, double radius, Colour colour)
{
    set(colour);
    cairo_arc(cairo_, centre.x, centre.y, radius, 0, 2 * CV_PI);
    cairo_fill(cairo_);
}

/* The current path: casing first, then the line, then the inside of a double one. */
void Canvas::trace(const Stroke &stroke)
{
    cairo_set_line_join(cairo_, CAIRO_LINE_JOIN_ROUND);
    cairo_set_dash(cairo_, nullptr, 0, 0);
    if (stroke.casing > 0) {
        set(stroke.casing_colour);
        cairo_set_line_width(cairo_, stroke.width + 2 * stroke.casing);
        cairo_stroke_preserve(cairo_);
    }
    set(stroke.colour);
    cairo_set_line_width(cairo_, stroke.width);
    cairo_set_dash(cairo_, stroke.dashes.data(), static_cast<int>(stroke.dashes.size()), 0);
    cairo_stroke_preserve(cairo_);
    if (stroke.hollow) {
        set(white);
        cairo_set_line_width(cairo_, stroke.width / 3);
        cairo_stroke_preserve(cairo_);
    }
    cairo_new_path(cairo_);
}

void Canvas::line(const std::vector<cv::Point2d> &positions, const Stroke &stroke, bool closed)
{
    for (cv::Point2d position : positions)
        cairo_line_to(cairo_, position.x, position.y);
    if (closed)
        cairo_close_path(cairo_);
    trace(stroke);
}

void Canvas::ellipse(cv::Point2d centre, double a, double b, double angle_deg, const Stroke &stroke)
{
    if (a <= 0 || b <= 0)
        return; /* nothing to be seen; cairo could not rotate it */
    cairo_save(cairo_);
    cairo_translate(cairo_, centre.x, centre.y);
    cairo_rotate(cairo_, angle_deg * CV_PI / 180.0);
    cairo_scale(cairo_, a, b);
    cairo_arc(cairo_, 0, 0, 1, 0, 2 * CV_PI);
    cairo_close_path(cairo_);
    cairo_restore(cairo_);
    trace(stroke);
}

void Canvas::cross(cv::Point2d centre, double radius, const Stroke &stroke, bool upright)
{
    cv::Point2d first = upright ? cv::Point2d(radius, 0) : cv::Point2d(radius, radius) * 0.7071;
    cv::Point2d second(-first.y, first.x);
    for (cv::Point2d offset : {first, second}) {
        cairo_move_to(cairo_, centre.x - offset.x, centre.y - offset.y);
        cairo_line_to(cairo_, centre.x + offset.x, centre.y + offset.y);
    }
    trace(stroke);
}

static void choose_font(cairo_t *cairo, double size, bool bold)
{
    cairo_select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cairo, size);
}

double Canvas::text_width(const std::string &words, double size, bool bold)
{
    cairo_text_extents_t extents;
    choose_font(cairo_, size, bold);
    cairo_text_extents(cairo_, words.c_str(), &extents);
    return extents.x_advance;
}

static cv::Point2d text_start(cv::Point2d at, double width, double size, Anchor anchor)
{
    static constexpr double middle_above_baseline = 0.36;
    double back = anchor == Anchor::left ? 0 : anchor == Anchor::middle ? width / 2 : width;
    return {at.x - back, at.y + middle_above_baseline * size};
}

void Canvas::text(cv::Point2d at, const std::string &words, double size, Anchor anchor, bool bold, Colour colour)
{
    cv::Point2d start = text_start(at, text_width(words, size, bold), size, anchor);
    set(colour);
    cairo_move_to(cairo_, start.x, start.y);
    cairo_show_text(cairo_, words.c_str());
    cairo_new_path(cairo_);
}

void Canvas::text_with_halo(cv::Point2d at, const std::string &words, double size, Anchor anchor, Colour colour,
                            Colour halo)
{
    cv::Point2d start = text_start(at, text_width(words, size), size, anchor);
    cairo_move_to(cairo_, start.x, start.y);
    cairo_text_path(cairo_, words.c_str());
    trace({halo, 0.22 * size, {}});
    text(at, words, size, anchor, false, colour);
}

void Canvas::image(const cv::Mat1b &grey, cv::Rect2d where)
{
    cv::Mat4b pixels(grey.size());
    for (int y = 0; y < grey.rows; y++) {
        for (int x = 0; x < grey.cols; x++)
            pixels(y, x) = cv::Vec4b(grey(y, x), grey(y, x), grey(y, x), 255);
    }
    std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
        cairo_image_surface_create_for_data(pixels.data, CAIRO_FORMAT_RGB24, pixels.cols, pixels.rows,
                                            static_cast<int>(pixels.step)),
        cairo_surface_destroy);
    cairo_save(cairo_);
    cairo_translate(cairo_, where.x, where.y);
    cairo_scale(cairo_, where.width / grey.cols, where.height / grey.rows);
    cairo_set_source_surface(cairo_, surface.get(), 0, 0);
    cairo_pattern_set_filter(cairo_get_source(cairo_), CAIRO_FILTER_NEAREST);
    cairo_rectangle(cairo_, 0, 0, grey.cols, grey.rows);
    cairo_fill(cairo_);
    cairo_restore(cairo_);
    /* a PDF copies the surface when it is finished: here the pixels must be done with */
    cairo_surface_finish(surface.get());
}

void Canvas::clip(cv::Rect2d where)
{
    cairo_save(cairo_);
    cairo_rectangle(cairo_, where.x, where.y, where.width, where.height);
    cairo_clip(cairo_);
}

void Canvas::unclip()
{
    cairo_restore(cairo_);
}

bool Room::take(cv::Rect2d wanted)
{
    bool inside = (wanted & page_).area() >= wanted.area() - 1e-6;
    if (!inside ||
        std::any_of(taken_.begin(), taken_.end(), [&](const cv::Rect2d &t) { return (t & wanted).area() > 0; }))
        return false;
    taken_.push_back(wanted);
    return true;
}
} // namespace view
