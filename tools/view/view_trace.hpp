/* view_trace - one frame's trace as host_sim --trace writes it, checked and in mm, pixels and grid steps.
 * Whatever is missing, of the wrong kind, or points to something that is not there is an error that names the file and
 * where in it.
 */
#ifndef VIEW_TRACE_HPP
#define VIEW_TRACE_HPP

#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

namespace view
{
constexpr size_t slot_count = 361;
constexpr int grid_nodes = 47;

struct Label {
    int dot = -1; /* index into dots_px; -1: the slot has none */
    double perp_px = 0;
};

/* A position on the depth grid in steps (0 .. 46) stands at centre + (place - 23) * step, normalised, in the level frame. */
struct Surface {
    bool valid = false;
    cv::Point2d centre;
    double step = 0;
    double nearest_mm = 0;
    cv::Mat1d depth_mm; /* grid_nodes x grid_nodes */
};

/* The stretch of a contour that supports a nest: an arc, closed by its chord. */
struct Arc {
    size_t nest;
    size_t slice;
    std::vector<cv::Point2d> steps;
};

struct Contour {
    bool closed;
    std::vector<cv::Point2d> steps;
    std::vector<Arc> arcs;
};

struct Level {
    double level_mm;
    std::vector<Contour> contours;
};

/* In frame pixels. */
struct Ellipse {
    cv::Point2d centre_px;
    double a_px, b_px, angle_deg;
};

/* Counts of samples inside and around the last ellipse. */
struct Outline {
    int inside, above, above_behind, beside, beside_behind, below, below_near;
};

struct Hypothesis {
    size_t nest;
    Ellipse ellipse;
    double distance_mm, area_mm2, curvature_mm, extent_mm, upright;
    Outline outline;
    std::string rejected; /* empty: accepted */
};

struct Limits {
    double area_min_mm2, area_max_mm2, curvature_min_mm, curvature_max_mm, extent_min_mm, upright_min;
    int points_min, above_min_percent, beside_min_percent, below_min_percent;
};

struct Detection {
    Ellipse ellipse;
    cv::Point3d centre_mm;
    double distance_mm, probability;
    bool is_head, is_predicted;
};

struct Point {
    cv::Point2d position; /* normalised, camera frame */
    bool seen;
};

struct Trace {
    std::string path; /* of the trace */
    std::string file; /* of the frame, in the frames directory */
    int64_t time_us;
    cv::Matx33d level; /* from the camera frame to that of the surface */
    std::vector<cv::Point2d> dots_px;
    std::array<Label, slot_count> labels;
    std::array<Point, slot_count> points;
    double clip_mm; /* nothing farther is shown to the surface; 0: nothing was seen */
    Surface surface;
    std::vector<Level> levels;
    std::vector<std::vector<bool>> nests; /* is the slice a whole contour? */
    std::vector<Hypothesis> hypotheses;
    Limits limits;
    std::vector<Detection> detections;
    bool paper;
    std::vector<size_t> heads; /* of detections; of hypotheses with the paper's method alone */
    std::optional<size_t> selected;

    int labelled_count() const;
};

Trace trace_read(const std::string &path);

/* Normalised coordinates in the frame that the rotation leads to; nothing where they lie behind the camera. */
std::optional<cv::Point2d> rotate(const cv::Matx33d &rotation, cv::Point2d position);
} // namespace view

#endif
