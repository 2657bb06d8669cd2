#include "cal_report.hpp"

#include <algorithm>
#include <sstream>

#include "cal_chart.hpp"
#include "cal_epipolar.hpp"
#include "cal_error.hpp"
#include "cal_nominal.hpp"
#include "tool_file.hpp"
#include "detect/ih_score_weights.h"

namespace cal
{
static const char *const red = "#c03028", *const blue = "#2858a8", *const grey = "#888";

/* Residuals of all dots that fit, turned: x along the epipolar line towards near, y across it. */
struct Residuals {
    std::vector<cv::Point2d> along_across, by_depth; /* by_depth: depth, across */
    double along_rms_px = 0.0, across_rms_px = 0.0;
};

static std::string escaped(const std::string &words)
{
    std::string out;
    for (char c : words)
        out += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
    return out;
}

static Residuals turn_residuals(const Result &result)
{
    Residuals residuals;
    auto lines = epipolar_lines(result.camera, result.projector.origin_mm, result.projector.rays);
    for (const Lit &lit : result.lit) {
        for (const Sighting &sighting : lit.sightings) {
            if (sighting.slot == no_slot || !sighting.fits)
                continue;
            cv::Point2d way = lines[static_cast<size_t>(sighting.slot)].move_px_mm;
            way *= 1.0 / cv::norm(way);
            cv::Point2d turned(sighting.residual_px.ddot(way), sighting.residual_px.cross(way));
            residuals.along_across.push_back(turned);
            residuals.by_depth.emplace_back(sighting.place_mm[2], turned.y);
            residuals.along_rms_px += turned.x * turned.x;
            residuals.across_rms_px += turned.y * turned.y;
        }
    }
    double count = std::max<double>(1.0, static_cast<double>(residuals.along_across.size()));
    residuals.along_rms_px = std::sqrt(residuals.along_rms_px / count);
    residuals.across_rms_px = std::sqrt(residuals.across_rms_px / count);
    return residuals;
}

static std::string corner_chart(const Result &result)
{
    Chart chart(
        "Where the board's corners were", "u, px", "v, px",
        {0.0, 0.0, static_cast<double>(result.camera.size.width), static_cast<double>(result.camera.size.height)},
        true);
    for (const View &view : result.views) {
        if (view.good())
            chart.points({view.corners.px.begin(), view.corners.px.end()}, blue, 1.5);
    }
    return chart.svg();
}

static std::string across_chart(const Residuals &residuals, double limit)
{
    double nearest = 1e9, farthest = 0.0;
    for (const cv::Point2d &dot : residuals.by_depth) {
        nearest = std::min(nearest, dot.x);
        farthest = std::max(farthest, dot.x);
    }
    Chart chart("Across the line, by distance", "distance, mm", "across, px",
                {0.95 * nearest, -limit, 1.05 * farthest - 0.95 * nearest, 2.0 * limit});
    chart.points(residuals.by_depth, blue, 1.3);
    return chart.svg();
}

static std::string seen_chart(const Result &result)
{
    Chart chart("How often each dot was seen (red: never)", "column", "row",
                {-1.0, -1.0, pattern_side + 1.0, pattern_side + 1.0}, true);
    for (int slot = 0; slot < slot_count; slot++) {
        cv::Point2d place(slot % pattern_side, slot / pattern_side);
        int seen = result.projector.seen[static_cast<size_t>(slot)];
        if (seen == 0)
            chart.points({place}, red, 4.0);
        else
            chart.points({place}, blue, 1.0 + 0.5 * std::min(seen, 10));
    }
    return chart.svg();
}

static std::string depth_chart(const Result &result, double dot_sigma_px)
{
    std::vector<cv::Point2d> curve;
    constexpr int steps = 60;
    for (int i = 0; i <= steps; i++) {
        double depth_mm = result.range.near_mm + (result.range.far_mm - result.range.near_mm) * i / steps;
        curve.emplace_back(depth_mm, depth_sigma_mm(result.camera, result.projector, dot_sigma_px, depth_mm));
    }
    Chart chart("Expected depth error of one dot", "distance, mm", "standard deviation, mm",
                {result.range.near_mm, 0.0, result.range.far_mm - result.range.near_mm, 1.05 * curve.back().y});
    chart.line(curve, blue);
    return chart.svg();
}

static void tell_now(Chart &chart, double max)
{
    chart.line({{0.0, 0.0}, {0.0, max}}, grey);
    chart.words({0.08, 0.94 * max}, "now");
}

static std::string turn_chart(const std::vector<Turn> &turns)
{
    std::vector<cv::Point2d> curve;
    double max = 5.0; /* pairs come whole: so do the axis' ticks */
    for (const Turn &turn : turns) {
        curve.emplace_back(turn.deg, turn.shared);
        max = std::max(max, static_cast<double>(turn.shared));
    }
    Chart chart("Pairs of dots that share a line", "pattern turned by, degrees", "pairs",
                {turns.front().deg, 0.0, turns.back().deg - turns.front().deg, 1.05 * max});
    chart.line(curve, blue);
    tell_now(chart, max);
    return chart.svg();
}

static std::string apart_chart(const std::vector<Turn> &turns)
{
    std::vector<cv::Point2d> curve;
    double max = share_px;
    for (const Turn &turn : turns) {
        curve.emplace_back(turn.deg, turn.min_apart_px);
        max = std::max(max, turn.min_apart_px);
    }
    Chart chart("The two nearest lines", "pattern turned by, degrees", "apart, px",
                {turns.front().deg, 0.0, turns.back().deg - turns.front().deg, 1.05 * max});
    chart.line(curve, blue);
    chart.line({{turns.front().deg, share_px}, {turns.back().deg, share_px}}, red);
    chart.words({turns.front().deg + 0.2, share_px + 0.02 * max}, "shared below this");
    tell_now(chart, max);
    return chart.svg();
}

static std::string picture_rows(const Result &result)
{
    std::string rows;
    for (const View &view : result.views) {
        if (view.good())
            rows += text("<tr><td>%s<td>%zu<td>%d<td>%.3f<td>%.0f<td>%.0f<td>%.1f</tr>\n", escaped(view.file).c_str(),
                         view.corners.ids.size(), view.left_out, view.rms_px, view.shift[2], view.tilt_deg(),
                         view.corners.edge_px);
        else
            rows += "<tr class='bad'><td>" + escaped(view.file) +
                    "<td colspan='6'>not used: " + escaped(view.corners.refused) + "</tr>\n";
    }
    return rows;
}

static std::string lit_rows(const Result &result)
{
    std::string rows;
    for (const Lit &lit : result.lit) {
        int used = 0, out = 0;
        double sum = 0.0;
        for (const Sighting &sighting : lit.sightings) {
            used += sighting.slot != no_slot && sighting.fits;
            out += sighting.slot == no_slot || !sighting.fits;
            sum += sighting.slot != no_slot && sighting.fits ? sighting.residual_px.ddot(sighting.residual_px) : 0.0;
        }
        rows += lit.refused.empty() ? text("<tr><td>%s<td>%s<td>%d<td>%d<td>%.3f</tr>\n", escaped(lit.file).c_str(),
                                           lit.twin.empty() ? "alone" : escaped(lit.twin).c_str(), used, out,
                                           std::sqrt(sum / std::max(1, used)))
                                    : "<tr class='bad'><td>" + escaped(lit.file) +
                                          "<td colspan='4'>not used: " + escaped(lit.refused) + "</tr>\n";
    }
    return rows;
}

/* -0.0002 would be printed as -0.000. */
static double no_minus(double px)
{
    return std::abs(px) < 0.0005 ? 0.0 : px;
}

static std::string region_table(const Camera &camera)
{
    std::string table = "<table>";
    for (int row = 0; row < region_rows; row++) {
        table += "<tr>";
        for (int column = 0; column < region_columns; column++) {
            const Region &region = camera.regions[static_cast<size_t>(row * region_columns + column)];
            table += text("<td>%d corners<br>rms %.3f px<br>mean (%+.3f, %+.3f)", region.corner_count, region.rms_px,
                          no_minus(region.mean_px.x), no_minus(region.mean_px.y));
        }
        table += "</tr>\n";
    }
    return table + "</table>";
}

static std::string camera_table(const Camera &camera)
{
    static const char *const names[9] = {"fx, px", "fy, px", "cx, px", "cy, px", "k1", "k2", "p1", "p2", "k3"};
    double values[4] = {camera.matrix.at<double>(0, 0), camera.matrix.at<double>(1, 1), camera.matrix.at<double>(0, 2),
                        camera.matrix.at<double>(1, 2)};
    std::string table = "<table><tr><th><th>value<th>standard deviation</tr>";
    for (size_t i = 0; i < 4; i++)
        table += text("<tr><td>%s<td>%.3f<td>%.3f</tr>", names[i], values[i], camera.sigma_px[i]);
    for (size_t i = 0; i < 5; i++) {
        if (i == 4 && !camera.third_radial)
            table += "<tr><td>k3<td>0<td>held: not three standard deviations away from 0</tr>";
        else
            table += text("<tr><td>%s<td>%.6f<td>%.6f</tr>", names[4 + i],
                          camera.distortion.at<double>(static_cast<int>(i)), camera.lens_sigma[i]);
    }
    return table + "</table>";
}

static std::string projector_words(const Projector &projector)
{
    std::string filled;
    int seen = 0;
    for (int slot = 0; slot < slot_count; slot++) {
        if (projector.seen[static_cast<size_t>(slot)] > 0)
            seen++;
        else
            filled += text(" %d", slot);
    }
    const cv::Vec3d &o = projector.origin_mm, &s = projector.origin_sigma_mm;
    std::string words =
        text("<p>Origin (%.2f, %.2f, %.2f) mm in the camera's frame, standard deviations (%.2f, %.2f, %.2f). "
             "%d sightings with an rms of %.3f px (under 0.4 px is good), %d further ones did not fit. The lattice's "
             "step is %.3f "
             "degrees, its rows are turned by %.2f degrees; rays differ from it by %s (each "
             "component).</p><p>%d of %d dots were seen (over 350 is good).",
             o[0], o[1], o[2], s[0], s[1], s[2], projector.sighting_count - projector.outlier_count, projector.rms_px,
             projector.outlier_count, projector.pitch_deg, projector.turn_deg,
             nominal_words(projector.nominal_sigma_deg).c_str(), seen, slot_count);
    return words + (filled.empty() ? "</p>" : " By the lattice alone:" + filled + ".</p>");
}

static std::string turn_words(const std::vector<Turn> &turns, const Turn &now, const Range &range)
{
    Turn best = epipolar_best(turns);
    std::string words =
        text("<p>Between %.0f and %.0f mm, <b>%d pairs of dots share an epipolar line</b> (come nearer than "
             "%.1f px); the nearest are %.2f px apart. ",
             range.near_mm, range.far_mm, now.shared, share_px, now.min_apart_px);
    if (now.shared == 0)
        return words + "The pattern's turn is good as it is.</p>";
    if (best.shared >= now.shared)
        return words + "No turn of the pattern within 5 degrees makes it better.</p>";
    return words +
           text("<b>A pattern turned by %.1f degrees more, %s in the image, would have %d</b>: the least turn with "
                "so few.</p>",
                std::abs(best.deg), best.deg > 0.0 ? "clockwise" : "anticlockwise", best.shared);
}

static const char *const head =
    "<!DOCTYPE html>\n<html lang='en'><meta charset='utf-8'><title>isohead: "
    "calibration</title>\n<style>body{font-family:"
    "sans-serif;max-width:980px;margin:1em "
    "auto;line-height:1.4}table{border-collapse:collapse;font-size:90%}td,th{border:"
    "1px solid #bbb;padding:2px 8px;text-align:left}.bad{color:#c03028}svg{margin:4px}</style>\n<h1>Calibration</h1>\n";

void report_write(const std::string &path, const Result &result)
{
    Residuals residuals = turn_residuals(result);
    std::vector<Turn> turns = epipolar_turns(result.camera, result.projector, result.range);
    Turn now = epipolar_turned(result.camera, result.projector, result.range, 0.0);
    double limit = 4.0 * std::max(residuals.along_rms_px, residuals.across_rms_px);
    Chart scatter("Dots: seen less expected", "along the epipolar line, px", "across it, px",
                  {-limit, -limit, 2.0 * limit, 2.0 * limit});
    scatter.points(residuals.along_across, blue, 1.3);
    std::ostringstream file;
    file << head << "<p>Board " << escaped(result.board.name) << ", frames of " << result.camera.size.width << "x"
         << result.camera.size.height
         << " pixels. What the figures mean, and what to do about those that are not good: docs/calibration.md, step 4."
         << "</p>\n<h2>Camera</h2>\n"
         << text("<p>Corners: rms %.3f px; of a real print, under 0.3 px is good.</p>", result.camera.rms_px)
         << camera_table(result.camera) << "<h3>Residuals by part of the frame</h3>" << region_table(result.camera)
         << corner_chart(result) << "\n<h2>Projector</h2>\n"
         << projector_words(result.projector) << seen_chart(result) << scatter.svg() << across_chart(residuals, limit)
         << text("<p>Residuals of the dots: %.3f px along their epipolar lines, %.3f px across (rms). Across tells how "
                 "well "
                 "the rig fits: along, a dot may be anywhere.</p>",
                 residuals.along_rms_px, residuals.across_rms_px)
         << "\n<h2>What to expect</h2>\n"
         << depth_chart(result, residuals.along_rms_px) << turn_chart(turns) << apart_chart(turns)
         << turn_words(turns, now, result.range)
         << "\n<h2>Pictures of the board</h2>\n<table><tr><th>picture<th>corners<th>left out<th>rms, px<th>distance, "
            "mm<th>tilt, "
            "degrees<th>edges, px</tr>"
         << picture_rows(result)
         << "</table>\n<h2>Pictures with the laser</h2>\n<table><tr><th>picture<th>twin without laser<th>dots "
            "used<th>not "
            "used<th>rms, px</tr>"
         << lit_rows(result) << "</table></html>\n";
    tool::file_write(path, file.str());
}
} // namespace cal
