#include "view_contours.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "view_error.hpp"
#include "view_lines.hpp"
#include "view_trace.hpp"

namespace view
{
static std::string area_words(const Hypothesis &h, const Limits &l)
{
    return text("area %.0f cm² (%.0f to %.0f)", h.area_mm2 / 100, l.area_min_mm2 / 100, l.area_max_mm2 / 100);
}

static std::string curvature_words(const Hypothesis &h, const Limits &l)
{
    return text("curvature %.0f mm (%.0f to %.0f)", h.curvature_mm, l.curvature_min_mm, l.curvature_max_mm);
}

static std::string extent_words(const Hypothesis &h, const Limits &l)
{
    return text("extent in depth %.0f mm (%.0f or more)", h.extent_mm, l.extent_min_mm);
}

/* The core compares squares. */
static std::string shape_words(const Hypothesis &h, const Limits &l)
{
    return text("height / width %.2f (%.2f or more)", std::sqrt(std::max(0.0, h.upright)), std::sqrt(l.upright_min));
}

static std::string inside_words(const Hypothesis &h, const Limits &l)
{
    return text("dots on it %d (%d or more)", h.outline.inside, l.points_min);
}

static std::string fraction_words(const char *what, int of, int all, int min_percent)
{
    return text("%s %d of %d (%d %% or more)", what, of, all, min_percent);
}

static bool is_short(int of, int all, int min_percent)
{
    return of * 100 < all * min_percent;
}

/* Of the outline's four counts those that fail, or all. */
static std::vector<std::string> outline_lines(const Hypothesis &h, const Limits &l, bool all)
{
    const Outline &o = h.outline;
    std::vector<std::string> lines;
    if (all || o.inside < l.points_min)
        lines.push_back(inside_words(h, l));
    if (all || is_short(o.above_behind, o.above, l.above_min_percent))
        lines.push_back(fraction_words("behind it above:", o.above_behind, o.above, l.above_min_percent));
    if (all || is_short(o.beside_behind, o.beside, l.beside_min_percent))
        lines.push_back(fraction_words("behind it beside:", o.beside_behind, o.beside, l.beside_min_percent));
    if (all || is_short(o.below_near, o.below, l.below_min_percent))
        lines.push_back(fraction_words("not behind it below:", o.below_near, o.below, l.below_min_percent));
    return lines;
}

static std::vector<std::string> all_lines(const Hypothesis &h, const Limits &l)
{
    std::vector<std::string> lines = {area_words(h, l), curvature_words(h, l), extent_words(h, l), shape_words(h, l)};
    for (const std::string &line : outline_lines(h, l, true))
        lines.push_back(line);
    return lines;
}

static std::vector<std::string> failed_lines(const Hypothesis &h, const Limits &l)
{
    if (h.rejected == "area")
        return {area_words(h, l)};
    if (h.rejected == "curvature") {
        bool bent_wrong = h.curvature_mm < l.curvature_min_mm || h.curvature_mm > l.curvature_max_mm;
        return {bent_wrong ? curvature_words(h, l) : extent_words(h, l)};
    }
    if (h.rejected == "shape")
        return {shape_words(h, l)};
    if (h.rejected == "outline")
        return outline_lines(h, l, false);
    return {};
}

/* Why a hypothesis was accepted or rejected (the paper's section 3.3): the verdict, then each measured value with its
 * limits: all of an accepted one, of a rejected one those of the test that it failed. */
static std::vector<std::string> reason_lines(const Hypothesis &h, const Limits &l)
{
    bool accepted = h.rejected.empty();
    std::vector<std::string> lines = {(accepted ? "accepted" : "rejected: " + h.rejected) +
                                      text(", at %.0f mm", h.distance_mm)};
    for (const std::string &line : accepted ? all_lines(h, l) : failed_lines(h, l))
        lines.push_back(line);
    return lines;
}

/* What the whole method says: "head at 691 mm, 99.6 % sure" .. */
static std::string result_words(const Trace &trace)
{
    std::string words = head_words(trace);
    if (!trace.selected)
        return words + (trace.heads.empty() ? "" : ", none selected");
    if (trace.paper)
        return words;
    const Detection &head = trace.detections[*trace.selected];
    words += text(", %.1f %% sure", 100 * head.probability) + (head.is_predicted ? ", by its track" : "");
    return words;
}

static constexpr double margin = 20, plot_width = 820, plot_height = 820, title_height = 40;
static constexpr double gap = 24, side_width = 440, side_min = 700, row = 24, words_size = 17;
static constexpr double near_grey = 70, far_grey = 250, min_span_mm = 100;
static constexpr double key_gap = 8;
static constexpr int key_columns = 3;
static constexpr double tag_radius = 11;

Shader::Shader(const Rig &rig, const Plot &plot) : size_(cvRound(plot.where.width), cvRound(plot.where.height))
{
    std::vector<cv::Point2d> pixels;
    for (int y = 0; y < size_.height; y++) {
        for (int x = 0; x < size_.width; x++)
            pixels.emplace_back((x + 0.5) / plot.scale - 0.5, (y + 0.5) / plot.scale - 0.5);
    }
    positions_ = rig.positions(pixels);
}

double band_far_mm(const Trace &trace)
{
    return std::max(trace.clip_mm, trace.surface.nearest_mm + min_span_mm);
}

uint8_t band_grey(const Trace &trace, double depth_mm)
{
    double nearest = trace.surface.nearest_mm, span = band_far_mm(trace) - nearest;
    double middle = (std::floor((depth_mm - nearest) / band_mm) + 0.5) * band_mm;
    double arc = std::clamp(middle / span, 0.0, 1.0);
    return static_cast<uint8_t>(cvRound(near_grey + (far_grey - near_grey) * std::pow(arc, 0.8)));
}

/* Interpolated between the nodes. */
static bool depth_at(const Surface &surface, cv::Point2d position, double &depth_mm)
{
    cv::Point2d step = (position - surface.centre) / surface.step + cv::Point2d(1, 1) * (0.5 * (grid_nodes - 1));
    if (!(step.x >= 0 && step.y >= 0 && step.x <= grid_nodes - 1 && step.y <= grid_nodes - 1))
        return false;
    int x = std::min(static_cast<int>(step.x), grid_nodes - 2), y = std::min(static_cast<int>(step.y), grid_nodes - 2);
    double right = step.x - x, down = step.y - y;
    const cv::Mat1d &depth = surface.depth_mm;
    depth_mm = (depth(y, x) * (1 - right) + depth(y, x + 1) * right) * (1 - down) +
               (depth(y + 1, x) * (1 - right) + depth(y + 1, x + 1) * right) * down;
    return true;
}

cv::Mat1b Shader::shade(const Trace &trace) const
{
    cv::Mat1b grey(size_, 255);
    for (size_t i = 0; trace.surface.valid && i < positions_.size(); i++) {
        double depth_mm;
        std::optional<cv::Point2d> position = rotate(trace.level, positions_[i]);
        if (position && depth_at(trace.surface, *position, depth_mm))
            grey.data[i] = band_grey(trace, depth_mm);
    }
    return grey;
}

/* From positions on the depth grid to the page, in pieces: what the lens's polynomials do not cover is left out. */
static std::vector<std::vector<cv::Point2d>> on_page(const std::vector<cv::Point2d> &steps, const Plot &plot,
                                                     const Trace &trace, const Rig &rig)
{
    std::vector<std::vector<cv::Point2d>> pieces(1);
    for (cv::Point2d step : steps) {
        cv::Point2d from_middle = step - cv::Point2d(1, 1) * (0.5 * (grid_nodes - 1));
        std::optional<cv::Point2d> position =
            rotate(trace.level.t(), trace.surface.centre + from_middle * trace.surface.step);
        if (position && cv::norm(*position) <= rig.reach)
            pieces.back().push_back(plot.page(rig.pixel(*position)));
        else if (!pieces.back().empty())
            pieces.emplace_back();
    }
    return pieces;
}

static void draw_steps(Canvas &canvas, std::vector<cv::Point2d> steps, bool closed, const Plot &plot,
                       const Trace &trace, const Rig &rig, const Stroke &stroke)
{
    if (closed && !steps.empty())
        steps.push_back(steps.front());
    for (const auto &piece : on_page(steps, plot, trace, rig))
        canvas.line(piece, stroke);
}

/* Levels count from the nearest node: every n-th of them. */
static void draw_contours(Canvas &canvas, const Plot &plot, const Trace &trace, const Rig &rig, size_t every,
                          double much)
{
    for (size_t i = every - 1; i < trace.levels.size(); i += every) {
        for (const Contour &contour : trace.levels[i].contours)
            draw_steps(canvas, contour.steps, contour.closed, plot, trace, rig, stroke_contour(contour.closed, much));
    }
}

/* The last slice of the nest that is an arc of an open polygon: that polygon dashed, the arc solid. */
static void draw_support(Canvas &canvas, const Plot &plot, const Trace &trace, const Rig &rig, size_t nest, double much)
{
    const Contour *last = nullptr;
    const Arc *last_part = nullptr;
    for (const Level &level : trace.levels) {
        for (const Contour &contour : level.contours) {
            for (const Arc &arc : contour.arcs) {
                if (arc.nest == nest && !contour.closed && (last_part == nullptr || arc.slice > last_part->slice)) {
                    last = &contour;
                    last_part = &arc;
                }
            }
        }
    }
    if (last == nullptr)
        return; /* all its slices are closed polygons */
    draw_steps(canvas, last->steps, false, plot, trace, rig, stroke_open(much));
    draw_steps(canvas, last_part->steps, true, plot, trace, rig, stroke_arc(much));
}

static cv::Point2d on_ellipse(const Ellipse &ellipse, double phase)
{
    double angle = ellipse.angle_deg * CV_PI / 180.0;
    double x = ellipse.a_px * std::cos(phase), y = ellipse.b_px * std::sin(phase);
    return ellipse.centre_px +
           cv::Point2d(x * std::cos(angle) - y * std::sin(angle), x * std::sin(angle) + y * std::cos(angle));
}

/* The hypothesis's number on its ellipse, where it covers no other. */
static void draw_tag(Canvas &canvas, const Plot &plot, const Hypothesis &hypothesis, size_t number, double much,
                     Room &room)
{
    static constexpr int positions = 24;
    double radius = tag_radius * std::sqrt(much);
    for (int i = 0; i < positions; i++) {
        cv::Point2d at = plot.page(on_ellipse(hypothesis.ellipse, 2 * CV_PI * i / positions + 0.6));
        if (room.take({at.x - radius, at.y - radius, 2 * radius, 2 * radius})) {
            bool accepted = hypothesis.rejected.empty();
            canvas.disc(at, radius, accepted ? black : blue);
            canvas.disc(at, radius - 1.6, accepted ? black : white);
            canvas.text(at, std::to_string(number), 1.25 * radius, Anchor::middle, true, accepted ? white : blue);
            return;
        }
    }
}

static void draw_hypotheses(Canvas &canvas, const Plot &plot, const Trace &trace, const Rig &rig, double much)
{
    Room room(plot.where);
    for (const Detection &detection : trace.detections) {
        if (!detection.is_head)
            canvas.cross(plot.page(detection.ellipse.centre_px), 8 * much, stroke_position(much), false);
    }
    for (const Hypothesis &hypothesis : trace.hypotheses)
        hypothesis_draw(canvas, plot, hypothesis.ellipse,
                        hypothesis.rejected.empty() ? stroke_accepted(much) : stroke_rejected(much));
    for (const Hypothesis &hypothesis : trace.hypotheses) {
        if (hypothesis.rejected.empty())
            draw_support(canvas, plot, trace, rig, hypothesis.nest, much);
    }
    heads_draw(canvas, plot, trace, much);
    for (size_t i = 0; i < trace.hypotheses.size(); i++)
        draw_tag(canvas, plot, trace.hypotheses[i], i + 1, much, room);
}

void contours_draw_plot(Canvas &canvas, const Plot &plot, const Shader &shader, const Trace &trace, const Rig &rig,
                        size_t every, double much)
{
    canvas.image(shader.shade(trace), plot.where);
    canvas.clip(plot.where);
    if (trace.surface.valid)
        draw_contours(canvas, plot, trace, rig, every, much);
    else
        canvas.text(plot.where.tl() + cv::Point2d(plot.where.width, plot.where.height) / 2,
                    "no surface: too few points", words_size, Anchor::middle);
    draw_hypotheses(canvas, plot, trace, rig, much);
    up_draw(canvas, plot, trace, much);
    canvas.unclip();
    canvas.line(
        {plot.where.tl(), {plot.where.br().x, plot.where.y}, plot.where.br(), {plot.where.x, plot.where.br().y}},
        {black, 1, {}}, true);
}

Plot contours_plot(const Rig &rig)
{
    return plot_fit(rig.size_px, {margin, margin + title_height, plot_width, plot_height});
}

cv::Size contours_page(const Rig &rig)
{
    Plot plot = contours_plot(rig);
    double key_bottom = plot.where.br().y + key_gap + row * std::ceil(1.0 * key_entries / key_columns);
    return {cvRound(margin + plot_width + gap + side_width + margin),
            cvRound(std::max(key_bottom, title_height + margin + side_min) + margin)};
}

/* A bar of all bands with some of their depths; returns where it ends. */
static double draw_depths(Canvas &canvas, cv::Point2d at, const Trace &trace)
{
    static constexpr double bar = 22;
    if (!trace.surface.valid)
        return at.y;
    double nearest = trace.surface.nearest_mm, span = band_far_mm(trace) - nearest;
    int bands = cvCeil(span / band_mm);
    double width = (side_width - 30) / bands;
    for (int band = 0; band < bands; band++) {
        double grey = band_grey(trace, nearest + (band + 0.5) * band_mm) / 255.0;
        canvas.fill({at.x + band * width, at.y, width + 0.5, bar}, {grey, grey, grey});
    }
    canvas.line({at, {at.x + bands * width, at.y}, {at.x + bands * width, at.y + bar}, {at.x, at.y + bar}},
                {black, 1, {}}, true);
    int step = span > 300 ? 100 : 50, last_mm = cvFloor(nearest + bands * band_mm);
    for (int mm = cvCeil(nearest / step) * step; mm <= last_mm; mm += step) {
        double x = at.x + (mm - nearest) / band_mm * width;
        canvas.line({{x, at.y + bar}, {x, at.y + bar + 6}}, {black, 1.4, {}});
        if (mm % (2 * step) == 0)
            canvas.text({x, at.y + bar + 17}, std::to_string(mm), words_size, Anchor::middle);
    }
    canvas.text({at.x, at.y + bar + 39}, text("mm of depth; a band and a contour are %.0f mm", band_mm), words_size);
    return at.y + bar + 68;
}

/* One after the other while there is room; how many find none is said. */
static void draw_reasons(Canvas &canvas, cv::Point2d at, double bottom, const Trace &trace)
{
    double indent = 2 * tag_radius + 10;
    for (size_t i = 0; i < trace.hypotheses.size(); i++) {
        std::vector<std::string> lines = reason_lines(trace.hypotheses[i], trace.limits);
        bool last = i + 1 == trace.hypotheses.size();
        if (at.y + row * static_cast<double>(lines.size() + (last ? 0 : 1)) > bottom) {
            canvas.text({at.x, at.y + row / 2},
                        text("and %zu more for which there is no room", trace.hypotheses.size() - i), words_size);
            return;
        }
        bool accepted = trace.hypotheses[i].rejected.empty();
        cv::Point2d tag(at.x + tag_radius, at.y + row / 2);
        canvas.disc(tag, tag_radius, accepted ? black : blue);
        canvas.disc(tag, tag_radius - 1.6, accepted ? black : white);
        canvas.text(tag, std::to_string(i + 1), 1.25 * tag_radius, Anchor::middle, true, accepted ? white : blue);
        for (const std::string &line : lines) {
            canvas.text({at.x + indent, at.y + row / 2}, line, words_size, Anchor::left, &line == &lines.front());
            at.y += row;
        }
    }
}

void contours_draw(Canvas &canvas, const Shader &shader, const Trace &trace, const Rig &rig)
{
    Plot plot = contours_plot(rig);
    double bottom = contours_page(rig).height - margin;
    canvas.text({margin, margin + title_height / 2 - 6},
                trace.file + text(", %.2f s", 1e-6 * static_cast<double>(trace.time_us)), 1.3 * words_size,
                Anchor::left, true);
    contours_draw_plot(canvas, plot, shader, trace, rig, contours_all, 1);
    key_draw(canvas, {margin, plot.where.br().y + key_gap}, key_columns, {plot_width / key_columns, row}, 1,
             trace.paper);
    cv::Point2d at(margin + plot_width + gap, margin);
    canvas.text({at.x, margin + title_height / 2 - 6}, result_words(trace), 1.15 * words_size, Anchor::left, true);
    at.y = draw_depths(canvas, {at.x, margin + title_height}, trace);
    canvas.text({at.x, at.y + row / 2},
                trace.hypotheses.empty() ? "no hypotheses" : "hypotheses: what was measured (limits)", words_size,
                Anchor::left, true);
    draw_reasons(canvas, {at.x, at.y + 1.3 * row}, bottom, trace);
}
} // namespace view
