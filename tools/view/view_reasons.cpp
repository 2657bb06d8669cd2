#include "view_reasons.hpp"

#include <cmath>

#include "view_error.hpp"
#include "view_lines.hpp"

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

std::vector<std::string> reason_lines(const Hypothesis &h, const Limits &l)
{
    bool accepted = h.rejected.empty();
    std::vector<std::string> lines = {(accepted ? "accepted" : "rejected: " + h.rejected) +
                                      text(", at %.0f mm", h.distance_mm)};
    for (const std::string &line : accepted ? all_lines(h, l) : failed_lines(h, l))
        lines.push_back(line);
    return lines;
}

std::string result_words(const Trace &trace)
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
} // namespace view
