#include "view_lines.hpp"

#include "view_error.hpp"

namespace view
{
Stroke stroke_accepted(double much)
{
    return {black, 5 * much, {}, false, 2.2 * much};
}

Stroke stroke_rejected(double much)
{
    return {blue, 3 * much, {11 * much, 4 * much, 3 * much, 4 * much}, false, 1.8 * much};
}

Stroke stroke_head(double much)
{
    return {vermilion, 8 * much, {}, true, 1.5 * much};
}

Stroke stroke_open(double much)
{
    return {black, 2.6 * much, {13 * much, 8 * much}, false, 1.6 * much};
}

Stroke stroke_arc(double much)
{
    return {white, 2.4 * much, {}, false, 1.4 * much, black};
}

Stroke stroke_position(double much)
{
    return {blue, 2.4 * much, {}, false, 1.4 * much};
}

Stroke stroke_contour(bool closed, double much)
{
    return {black, 0.9 * much, closed ? std::vector<double>{} : std::vector<double>{5 * much, 3.5 * much}};
}

void hypothesis_draw(Canvas &canvas, const Plot &plot, const Ellipse &ellipse, const Stroke &stroke)
{
    canvas.ellipse(plot.page(ellipse.centre_px), ellipse.a_px * plot.scale, ellipse.b_px * plot.scale,
                   ellipse.angle_deg, stroke);
}

void heads_draw(Canvas &canvas, const Plot &plot, const Trace &trace, double much)
{
    if (trace.paper)
        return; /* then the accepted hypotheses are the heads */
    for (const Detection &detection : trace.detections) {
        if (detection.is_head)
            hypothesis_draw(canvas, plot, detection.ellipse, stroke_head(much));
    }
    if (trace.selected)
        canvas.cross(plot.page(trace.detections[*trace.selected].ellipse.centre_px), 14 * much,
                     {vermilion, 4 * much, {}, false, 1.5 * much}, true);
}

void up_draw(Canvas &canvas, const Plot &plot, const Trace &trace, double much)
{
    if (trace.level == cv::Matx33d::eye())
        return;
    /* the level frame's -Y in the picture; of its tilt 45 degrees are taken out at most, so it is no point there */
    cv::Point2d up(-trace.level(1, 0), -trace.level(1, 1));
    up *= 24 * much / cv::norm(up);
    cv::Point2d middle(plot.where.x + 48 * much, plot.where.br().y - 48 * much), aside(-up.y, up.x), tip = middle + up;
    Stroke stroke{sky, 3 * much, {}, false, 1.6 * much, black};
    canvas.line({middle - up, tip}, stroke);
    canvas.line({tip - up / 2 + aside / 3, tip, tip - up / 2 - aside / 3}, stroke);
    canvas.text_with_halo(tip + up / 2, "up", 15 * much, Anchor::middle, black, white);
}

void key_draw(Canvas &canvas, cv::Point2d at, int columns, cv::Size2d cell, double much, bool paper)
{
    struct Entry {
        const char *words;
        Stroke stroke;
        bool cross;
    };
    std::vector<Entry> entries = {
        {"accepted hypothesis", stroke_accepted(much), false}, {"rejected hypothesis", stroke_rejected(much), false},
        {"open polygon ..", stroke_open(much), false},         {".. its elliptical arc", stroke_arc(much), false},
        {"contour, closed", stroke_contour(true, 1), false},   {"contour, open", stroke_contour(false, 1), false},
    };
    if (!paper) {
        entries.insert(entries.begin(), {"head, whole method", stroke_head(much), false});
        entries.push_back({"other candidate, no head", stroke_position(much), true});
    }
    double sample = 2.8 * cell.height;
    for (size_t i = 0; i < entries.size(); i++) {
        int index = static_cast<int>(i);
        cv::Point2d start = at + cv::Point2d(index % columns * cell.width, (index / columns + 0.5) * cell.height);
        if (entries[i].cross)
            canvas.cross({start.x + sample / 2, start.y}, 8 * much, entries[i].stroke, false);
        else
            canvas.line({start, {start.x + sample, start.y}}, entries[i].stroke);
        canvas.text({start.x + sample + 0.5 * cell.height, start.y}, entries[i].words, 0.7 * cell.height);
    }
}

std::string head_words(const Trace &trace)
{
    if (!trace.selected)
        return trace.heads.empty() ? "no head" : text("%zu heads", trace.heads.size());
    if (trace.paper)
        return text("head at %.0f mm", trace.hypotheses[*trace.selected].distance_mm);
    const Detection &head = trace.detections[*trace.selected];
    return text("head %s %.0f mm", head.is_predicted ? "near" : "at", head.distance_mm);
}
} // namespace view
