#include "cal_report.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "cal_error.hpp"
#include "cal_nominal.hpp"
#include "cal_rig.hpp"
#include "tool_file.hpp"

namespace cal
{
/* A small chart as SVG. */
class Chart
{
  public:
    /* The rectangle of data that is shown; y grows upwards unless `down`. */
    Chart(const std::string &title, const std::string &x_name, const std::string &y_name, cv::Rect2d data,
          bool down = false);
    void points(const std::vector<cv::Point2d> &positions, const std::string &colour, double radius);
    void line(const std::vector<cv::Point2d> &positions, const std::string &colour);
    void words(cv::Point2d position, const std::string &words);
    std::string svg() const;

  private:
    cv::Point2d on_page(cv::Point2d position) const;
    cv::Rect2d data_;
    bool down_;
    std::string body_;
};

static constexpr double width = 460.0, height = 330.0, left = 62.0, right = 14.0, top = 28.0, bottom = 46.0;
static constexpr int ticks_about = 5;

static double tick_step(double span)
{
    double raw = span / ticks_about, scale = std::pow(10.0, std::floor(std::log10(raw))), part = raw / scale;
    return scale * (part < 1.5 ? 1.0 : part < 3.5 ? 2.0 : part < 7.5 ? 5.0 : 10.0);
}

Chart::Chart(const std::string &title, const std::string &x_name, const std::string &y_name, cv::Rect2d data, bool down)
    : data_(data), down_(down)
{
    body_ += text("<text x='%g' y='17' text-anchor='middle' font-weight='bold'>%s</text>", 0.5 * (width + left),
                  title.c_str());
    body_ += text("<text x='%g' y='%g' text-anchor='middle'>%s</text>", 0.5 * (width + left - right), height - 8.0,
                  x_name.c_str());
    body_ += text("<text transform='translate(14,%g) rotate(-90)' text-anchor='middle'>%s</text>",
                  0.5 * (height - bottom + top), y_name.c_str());
    double step = tick_step(data.width);
    for (double x = std::ceil(data.x / step - 1e-9) * step; x <= data.x + data.width + 1e-9 * step; x += step) {
        double at = on_page({x, data.y}).x;
        body_ += text("<path d='M%.1f %g V%g' stroke='#ddd'/><text x='%.1f' y='%g' text-anchor='middle'>%g</text>", at,
                      top, height - bottom, at, height - bottom + 15.0, std::abs(x) < 1e-9 * step ? 0.0 : x);
    }
    step = tick_step(data.height);
    for (double y = std::ceil(data.y / step - 1e-9) * step; y <= data.y + data.height + 1e-9 * step; y += step) {
        double at = on_page({data.x, y}).y;
        body_ += text("<path d='M%g %.1f H%g' stroke='#ddd'/><text x='%g' y='%.1f' text-anchor='end'>%g</text>", left,
                      at, width - right, left - 5.0, at + 4.0, std::abs(y) < 1e-9 * step ? 0.0 : y);
    }
}

cv::Point2d Chart::on_page(cv::Point2d position) const
{
    double x = (position.x - data_.x) / data_.width, y = (position.y - data_.y) / data_.height;
    return {left + x * (width - left - right),
            down_ ? top + y * (height - top - bottom) : height - bottom - y * (height - top - bottom)};
}

void Chart::points(const std::vector<cv::Point2d> &positions, const std::string &colour, double radius)
{
    body_ += "<g fill='" + colour + "' fill-opacity='0.6'>";
    for (const cv::Point2d &position : positions) {
        cv::Point2d at = on_page(position);
        if (at.x >= left && at.x <= width - right && at.y >= top && at.y <= height - bottom)
            body_ += text("<circle cx='%.1f' cy='%.1f' r='%.1f'/>", at.x, at.y, radius);
    }
    body_ += "</g>";
}

void Chart::line(const std::vector<cv::Point2d> &positions, const std::string &colour)
{
    body_ += "<polyline fill='none' stroke='" + colour + "' stroke-width='1.6' points='";
    for (const cv::Point2d &position : positions) {
        cv::Point2d at = on_page(position);
        body_ += text("%.1f,%.1f ", at.x, at.y);
    }
    body_ += "'/>";
}

void Chart::words(cv::Point2d position, const std::string &words)
{
    cv::Point2d at = on_page(position);
    body_ += text("<text x='%.1f' y='%.1f'>%s</text>", at.x, at.y, words.c_str());
}

std::string Chart::svg() const
{
    return text("<svg width='%g' height='%g' font-family='sans-serif' font-size='11'>", width, height) + body_ +
           text("<path d='M%g %g V%g H%g' fill='none' stroke='black'/></svg>\n", left, top, height - bottom,
                width - right);
}

static const char *const red = "#c03028", *const blue = "#2858a8", *const grey = "#888";

/* Residuals of all dots that fit, rotated: x along the epipolar line towards near, y across it. */
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

static Residuals rotation_residuals(const Result &result)
{
    Residuals residuals;
    auto lines = epipolar_lines(result.camera, result.projector.origin_mm, result.projector.rays);
    for (const Lit &lit : result.lit) {
        for (const Sighting &sighting : lit.sightings) {
            if (sighting.slot == no_slot || !sighting.fits)
                continue;
            cv::Point2d offset = lines[static_cast<size_t>(sighting.slot)].move_px_mm;
            offset *= 1.0 / cv::norm(offset);
            cv::Point2d rotated(sighting.residual_px.ddot(offset), sighting.residual_px.cross(offset));
            residuals.along_across.push_back(rotated);
            residuals.by_depth.emplace_back(sighting.position_mm[2], rotated.y);
            residuals.along_rms_px += rotated.x * rotated.x;
            residuals.across_rms_px += rotated.y * rotated.y;
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
        cv::Point2d position(slot % pattern_side, slot / pattern_side);
        int seen = result.projector.seen[static_cast<size_t>(slot)];
        if (seen == 0)
            chart.points({position}, red, 4.0);
        else
            chart.points({position}, blue, 1.0 + 0.5 * std::min(seen, 10));
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

static void report_now(Chart &chart, double max)
{
    chart.line({{0.0, 0.0}, {0.0, max}}, grey);
    chart.words({0.08, 0.94 * max}, "now");
}

static std::string rotation_chart(const std::vector<Rotation> &rotations)
{
    std::vector<cv::Point2d> curve;
    double max = 5.0; /* pairs come whole: so do the axis' ticks */
    for (const Rotation &rotation : rotations) {
        curve.emplace_back(rotation.deg, rotation.shared);
        max = std::max(max, static_cast<double>(rotation.shared));
    }
    Chart chart("Pairs of dots that share a line", "pattern rotated by, degrees", "pairs",
                {rotations.front().deg, 0.0, rotations.back().deg - rotations.front().deg, 1.05 * max});
    chart.line(curve, blue);
    report_now(chart, max);
    return chart.svg();
}

static std::string apart_chart(const std::vector<Rotation> &rotations)
{
    std::vector<cv::Point2d> curve;
    double max = same_line_px;
    for (const Rotation &rotation : rotations) {
        curve.emplace_back(rotation.deg, rotation.min_apart_px);
        max = std::max(max, rotation.min_apart_px);
    }
    Chart chart("The two nearest lines", "pattern rotated by, degrees", "apart, px",
                {rotations.front().deg, 0.0, rotations.back().deg - rotations.front().deg, 1.05 * max});
    chart.line(curve, blue);
    chart.line({{rotations.front().deg, same_line_px}, {rotations.back().deg, same_line_px}}, red);
    chart.words({rotations.front().deg + 0.2, same_line_px + 0.02 * max}, "shared below this");
    report_now(chart, max);
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
                                           lit.dark_file.empty() ? "alone" : escaped(lit.dark_file).c_str(), used, out,
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
             "degrees, its rows are rotated by %.2f degrees; rays differ from it by %s (each "
             "component).</p><p>%d of %d dots were seen (over 350 is good).",
             o[0], o[1], o[2], s[0], s[1], s[2], projector.sighting_count - projector.outlier_count, projector.rms_px,
             projector.outlier_count, projector.pitch_deg, projector.rotation_deg,
             nominal_words(projector.nominal_sigma_deg).c_str(), seen, slot_count);
    return words + (filled.empty() ? "</p>" : " By the lattice alone:" + filled + ".</p>");
}

static std::string rotation_words(const std::vector<Rotation> &rotations, const Rotation &now, const Range &range)
{
    Rotation best = epipolar_best(rotations);
    std::string words =
        text("<p>Between %.0f and %.0f mm, <b>%d pairs of dots share an epipolar line</b> (come nearer than "
             "%.1f px); the nearest are %.2f px apart. ",
             range.near_mm, range.far_mm, now.shared, same_line_px, now.min_apart_px);
    if (now.shared == 0)
        return words + "The pattern's rotation is good as it is.</p>";
    if (best.shared >= now.shared)
        return words + "No rotation of the pattern within 5 degrees makes it better.</p>";
    return words + text("<b>A pattern rotated by %.1f degrees more, %s in the image, would have %d</b>: the smallest "
                        "rotation with "
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
    Residuals residuals = rotation_residuals(result);
    std::vector<Rotation> rotations = epipolar_rotations(result.camera, result.projector, result.range);
    Rotation now = epipolar_rotated(result.camera, result.projector, result.range, 0.0);
    double limit = 4.0 * std::max(residuals.along_rms_px, residuals.across_rms_px);
    Chart scatter("Dots: seen minus expected", "along the epipolar line, px", "across it, px",
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
         << text("<p>Residuals of the dots: %.3f px along their epipolar lines, %.3f px across (rms). Across the line "
                 "they show "
                 "how well the rig fits; along it a dot may be anywhere.</p>",
                 residuals.along_rms_px, residuals.across_rms_px)
         << "\n<h2>What to expect</h2>\n"
         << depth_chart(result, residuals.along_rms_px) << rotation_chart(rotations) << apart_chart(rotations)
         << rotation_words(rotations, now, result.range)
         << "\n<h2>Pictures of the board</h2>\n<table><tr><th>picture<th>corners<th>left out<th>rms, px<th>distance, "
            "mm<th>tilt, "
            "degrees<th>edges, px</tr>"
         << picture_rows(result)
         << "</table>\n<h2>Pictures with the laser</h2>\n<table><tr><th>laser-on picture<th>laser-off picture<th>dots "
            "used<th>not "
            "used<th>rms, px</tr>"
         << lit_rows(result) << "</table></html>\n";
    tool::file_write(path, file.str());
}
} // namespace cal
