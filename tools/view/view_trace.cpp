#include "view_trace.hpp"

#include <algorithm>

#include "view_node.hpp"

namespace view
{
int Trace::labelled_count() const
{
    return static_cast<int>(std::count_if(labels.begin(), labels.end(), [](const Label &l) { return l.dot >= 0; }));
}

static size_t read_index(const Node &node, size_t end)
{
    if (end == 0)
        node.complain("left out, as there is nothing that it could name");
    return static_cast<size_t>(node.integer(0, static_cast<int64_t>(end) - 1));
}

static int read_count(const Node &node)
{
    return static_cast<int>(node.integer(0, 1000000));
}

static void read_dots(const Node &dots, Trace &trace)
{
    size_t count = dots["u_px_q12"].count();
    dots["v_px_q12"].must_count(count);
    for (size_t i = 0; i < count; i++)
        trace.dots_px.emplace_back(dots["u_px_q12"][i].fixed(12), dots["v_px_q12"][i].fixed(12));
}

static void read_labels(const Node &slots, Trace &trace)
{
    slots.must_count(slot_count);
    for (size_t i = 0; i < slot_count; i++) {
        Node slot = slots[i];
        if (!slot.is_null()) {
            size_t dot = read_index(slot["dot"], trace.dots_px.size());
            trace.labels[i] = {static_cast<int>(dot), slot["perp_px_q12"].fixed(12)};
        }
    }
}

std::optional<cv::Point2d> rotate(const cv::Matx33d &rotation, cv::Point2d position)
{
    static constexpr double depth_min = 0.05;
    cv::Vec3d direction = rotation * cv::Vec3d(position.x, position.y, 1);
    if (direction[2] < depth_min)
        return std::nullopt;
    return cv::Point2d(direction[0] / direction[2], direction[1] / direction[2]);
}

static void read_level(const Node &whole, Trace &trace)
{
    trace.level = cv::Matx33d::eye();
    if (!whole.has("level_q30"))
        return;
    whole["level_q30"].must_count(9);
    for (int i = 0; i < 9; i++)
        trace.level(i / 3, i % 3) = whole["level_q30"][static_cast<size_t>(i)].fixed(30);
}

static void read_points(const Node &points, Trace &trace)
{
    for (const char *key : {"x_q28", "y_q28", "state"})
        points[key].must_count(slot_count);
    for (size_t i = 0; i < slot_count; i++) {
        cv::Point2d position(points["x_q28"][i].fixed(28), points["y_q28"][i].fixed(28));
        std::optional<cv::Point2d> of_camera = rotate(trace.level.t(), position);
        trace.points[i] = {of_camera.value_or(cv::Point2d()),
                           points["state"][i].integer(0, 2) == 1 && of_camera.has_value()};
    }
}

static void read_surface(const Node &node, Surface &surface)
{
    static constexpr double step_per_unit = 10.0 / 11.0;
    surface.valid = node["valid"].boolean();
    if (!surface.valid)
        return;
    Node field = node["field"];
    surface.centre = {field["centre_x_q28"].fixed(28), field["centre_y_q28"].fixed(28)};
    surface.step = field["unit_q28"].fixed(28) * step_per_unit;
    if (surface.step <= 0)
        field["unit_q28"].complain("more than 0");
    surface.nearest_mm = node["nearest_mm_q8"].fixed(8);
    surface.depth_mm.create(grid_nodes, grid_nodes);
    Node rows = node["depth_mm_q8"];
    rows.must_count(grid_nodes);
    for (int y = 0; y < grid_nodes; y++) {
        Node row = rows[static_cast<size_t>(y)];
        row.must_count(grid_nodes);
        for (int x = 0; x < grid_nodes; x++)
            surface.depth_mm(y, x) = row[static_cast<size_t>(x)].fixed(8);
    }
}

static void read_nests(const Node &nests, Trace &trace)
{
    trace.nests.resize(nests.count());
    for (size_t i = 0; i < trace.nests.size(); i++) {
        Node slices = nests[i]["slice"];
        for (size_t k = 0; k < slices.count(); k++)
            trace.nests[i].push_back(slices[k]["whole"].boolean());
    }
}

static std::vector<cv::Point2d> read_positions(const Node &list)
{
    std::vector<cv::Point2d> positions;
    for (size_t i = 0; i < list.count(); i++)
        positions.emplace_back(list[i][size_t{0}].fixed(9), list[i][size_t{1}].fixed(9));
    return positions;
}

static Contour read_contour(const Node &node, const Trace &trace)
{
    Contour contour{node["closed"].boolean(), read_positions(node["x_y_q9"]), {}};
    Node arcs = node["part"];
    for (size_t i = 0; i < arcs.count(); i++) {
        size_t nest = read_index(arcs[i]["nest"], trace.nests.size());
        size_t slice = read_index(arcs[i]["slice"], trace.nests[nest].size());
        contour.arcs.push_back({nest, slice, read_positions(arcs[i]["x_y_q9"])});
    }
    return contour;
}

static void read_levels(const Node &levels, Trace &trace)
{
    for (size_t i = 0; i < levels.count(); i++) {
        Level level{levels[i]["level_mm_q8"].fixed(8), {}};
        Node contours = levels[i]["contour"];
        for (size_t k = 0; k < contours.count(); k++)
            level.contours.push_back(read_contour(contours[k], trace));
        trace.levels.push_back(std::move(level));
    }
}

static Ellipse read_ellipse(const Node &node)
{
    return {{node["u_px_q12"].fixed(12), node["v_px_q12"].fixed(12)},
            node["a_px_q12"].fixed(12),
            node["b_px_q12"].fixed(12),
            static_cast<double>(node["angle_mdeg"].integer(0, 179999)) / 1000.0};
}

static Outline read_outline(const Node &node)
{
    return {read_count(node["inside"]),    read_count(node["above"]),         read_count(node["above_behind"]),
            read_count(node["beside"]),    read_count(node["beside_behind"]), read_count(node["below"]),
            read_count(node["below_near"])};
}

static void read_hypotheses(const Node &list, Trace &trace)
{
    for (size_t i = 0; i < list.count(); i++) {
        Node node = list[i];
        Node rejected = node["rejected"];
        trace.hypotheses.push_back({read_index(node["nest"], trace.nests.size()), read_ellipse(node),
                                    node["distance_mm_q8"].fixed(8), node["area_mm2"].fixed(0),
                                    node["curvature_mm_q8"].fixed(8), node["extent_mm_q8"].fixed(8),
                                    node["upright_q16"].fixed(16), read_outline(node["outline"]),
                                    rejected.is_null() ? "" : rejected.string()});
    }
}

static Limits read_limits(const Node &node)
{
    return {node["area_min_mm2"].fixed(0),          node["area_max_mm2"].fixed(0),
            node["curvature_min_mm"].fixed(0),      node["curvature_max_mm"].fixed(0),
            node["extent_min_mm"].fixed(0),         node["upright_min_q16"].fixed(16),
            read_count(node["points_min"]),         read_count(node["above_min_percent"]),
            read_count(node["beside_min_percent"]), read_count(node["below_min_percent"])};
}

static void read_detections(const Node &list, Trace &trace)
{
    for (size_t i = 0; i < list.count(); i++) {
        Node node = list[i];
        Node centre = node["centre_mm_q8"];
        centre.must_count(3);
        trace.detections.push_back({read_ellipse(node),
                                    {centre[size_t{0}].fixed(8), centre[1].fixed(8), centre[2].fixed(8)},
                                    node["distance_mm_q8"].fixed(8),
                                    node["probability_q16"].fixed(16),
                                    node["head"].boolean(),
                                    node["predicted"].boolean()});
    }
}

static void read_result(const Node &node, Trace &trace)
{
    trace.paper = node["paper"].boolean();
    size_t end = trace.paper ? trace.hypotheses.size() : trace.detections.size();
    Node heads = node["head"];
    for (size_t i = 0; i < heads.count(); i++)
        trace.heads.push_back(read_index(heads[i], end));
    if (!node["selected"].is_null())
        trace.selected = read_index(node["selected"], end);
}

Trace trace_read(const std::string &path)
{
    nlohmann::json json = json_read(path);
    Node whole(json, path, "");
    Trace trace{};
    trace.path = path;
    trace.file = whole["file"].string();
    if (trace.file.empty() || trace.file.find('/') != std::string::npos)
        whole["file"].complain("the name of a frame");
    trace.time_us = whole["time_us"].integer(INT64_MIN, INT64_MAX);
    read_level(whole, trace);
    read_dots(whole["dots"], trace);
    read_labels(whole["labels"]["slot"], trace);
    read_points(whole["points"], trace);
    trace.clip_mm = whole["samples"]["clip_mm_q8"].fixed(8);
    read_surface(whole["surface"], trace.surface);
    read_nests(whole["hypotheses"]["nest"], trace);
    read_levels(whole["cuts"], trace);
    read_hypotheses(whole["heads"]["hypothesis"], trace);
    trace.limits = read_limits(whole["heads"]["limits"]);
    read_detections(whole["findings"], trace);
    read_result(whole["result"], trace);
    return trace;
}
} // namespace view
