/* peer - isohead's method as a competent engineer writes it with OpenCV and Eigen, to compare with.
 *
 * Two of them:
 *   A  what is written first: a difference of Gaussians in float by two GaussianBlur (sigma 1.0 and
 *      2.5), connectedComponentsWithStats, weighted centres; the surface in double; whole contours by
 *      fitEllipseDirect.
 *   B  the fastest composition of library calls that was found: an 8-bit Gaussian 3x3 less an 8-bit
 *      box 13x13, findContours, weighted centres; the surface's normal equations and their factor in float,
 *      with two solutions for each robust pass of what is left in double (without the second one its worst node is
 *      6 to 14 mm off in frames, as the condition number is beyond 10^6; with it 0.14 mm at most);
 *      whole contours by their moments; arcs of as many steps side by side, in vectors of double, and
 *      only what passes without a root is looked at closely; scan and fits in vectors of float over all
 *      rays that matter (with gcc -O3, v3, 0.4 of what A's cost, ray by ray and in double).
 *
 * What both do, as isohead does it in its default mode and with the same numbers: dots of the whole
 * frame; undistortPoints; candidates on the 361 lines, seeds by affine rectangles, growing; points;
 * samples (clip, isolated points, missing dots filled in); 64 multiquadrics, weighted least squares
 * with a ridge, one Huber step that moves samples, Eigen's LLT; 47x47 nodes from a table of the basis that is filled
 * once; contours by marching squares every 20 mm at levels that a nest waits for; nests, from minima that are
 * free on three sides, of ellipses, whole or cut by the best of all chords between 32 points, where a contour
 * is studied once for all the nests that it surrounds, when the first one asks, and a tip's may have any shape;
 * nests with one ellipse merged; the scan of a mean head behind one point of four, and behind those around
 * whatever seems best; of nests and places of the scan, in this
 * order, those that a glance promises something; starts 20 mm apart, and last frame's head; a Gauss-Newton
 * step of an ellipsoid and its score, then five more steps and a score for what is not hopeless.
 * What isohead does and here brings nothing: asking only samples that were far off for their new weight
 * (A works out what samples are off for that alone, a hundredth of the surface, and B has it from its
 * corrections). Places are ranked by the template and the pre-filter that isohead had before a learnt map did it (E034).
 * What they do not do, which is in their favour: a threshold that follows the local noise (one
 * for the frame instead), tests for edges and hot pixels, over-exposed plateaus, the paper's tests of
 * heads (area, curvature, shape, outline), evidence, learnt score, tracks: the scan's own score after a step
 * says what is hopeless, and the best of the fitted places by it is the head.
 *
 * mm, pixels, field units (half a dot pitch); floating point. Nothing is allocated here that could be
 * kept from frame to frame; what OpenCV and Eigen allocate they do as always.
 */
#ifndef PEER_HPP
#define PEER_HPP

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Dense>
#include <opencv2/core.hpp>

constexpr int PEER_GRID = 19; /* dots in a row of the pattern */
constexpr int PEER_SLOTS = PEER_GRID * PEER_GRID;
constexpr int PEER_CENTRES = 8; /* of the surface, in a row */
constexpr int PEER_TERMS = PEER_CENTRES * PEER_CENTRES;
constexpr int PEER_NODES = 47; /* of the surface's grid, in a row */

enum class peer_kind { a, b };

/* One dot's epipolar line in undistorted pixels: position = infinity + t dir, t = length / Z. */
struct peer_line {
    double infinity_u, infinity_v, dir_u, dir_v, length_px_mm, t_far_px, t_near_px;
};

struct peer_rig {
    int width, height;
    cv::Matx33d camera;
    cv::Mat distortion;
    double origin_mm[3];
    double slope[PEER_SLOTS][2]; /* of each dot's ray */
    double near_mm, far_mm;
    double field_x, field_y, field_unit; /* the surface's field, normalised coordinates */
    std::array<peer_line, PEER_SLOTS> line;
};

/* A slot's dot. */
struct peer_point {
    bool seen;
    int dot;
    double x, y; /* normalised */
    double depth_mm;
};

struct peer_sample {
    double x, y; /* field units */
    double depth_mm, root_weight;
};

enum class peer_ray_state { unknown, seen, empty };
struct peer_ray {
    double slope_x, slope_y;
    double point_mm[3];
    peer_ray_state state;
};

/* Position of node 0, .. and of a row of centres, field units. */
double peer_node_position(int node);
double peer_centre_position(int centre);

struct peer_contour {
    std::vector<cv::Point2f> vertex; /* grid steps; runs with what is nearer on its right */
    bool closed;
};

/* A contour at equal steps, twice round where it is closed. */
constexpr int PEER_POINTS = 32;
using peer_along = Eigen::Array<double, 2 * PEER_POINTS, 1>;
struct peer_outline {
    peer_along x, y;
    /* sums over the edges before each point, by Green's theorem: times 2, 6, 6, 12, 24, 12 */
    peer_along area2, mx, my, xx, xy, yy;
    int count;
    double step;
};

struct peer_ellipse {
    double area, x, y; /* grid steps */
};

/* An arc of an outline that is an ellipse. */
struct peer_arc {
    int from, to;
    double merit;
    peer_ellipse ellipse;
};

struct peer_slice {
    peer_ellipse ellipse;
    double behind_mm, area_mm2;
};

struct peer_nest {
    int x, y; /* the node of the minimum */
    double nearest_mm, front_mm, tip_level_mm, tip_area_mm2;
    int gap;
    bool ended;
    std::vector<peer_slice> slice;
};

struct peer_head {
    double centre_mm[3];
    double semi_mm[3]; /* across, up, deep */
    double score;
};

/* The rays as the vectors of single precision that peer B counts with; beyond the last one rays that meet nothing. */
using peer_lanes = Eigen::Array<float, (PEER_SLOTS + 7) / 8 * 8, 1>;
struct peer_ray_lanes {
    peer_lanes slope[2], point_mm[3];
    peer_lanes seen;         /* 1, 0 */
    peer_lanes inside, ring; /* what an empty or unknown ray is worth to the scan */
    float min_y[PEER_GRID], max_y[PEER_GRID]; /* slopes of a row of the pattern */
};

using peer_grid = Eigen::Matrix<double, PEER_NODES, PEER_NODES, Eigen::RowMajor>;
using peer_basis = Eigen::Matrix<double, Eigen::Dynamic, PEER_TERMS>;

/* Everything that is kept: outputs of the stages in order, tables that are filled once. */
struct peer {
    peer_kind kind;
    peer_rig rig;
    peer_basis node_basis; /* of the grid's nodes */
    cv::Mat image;         /* the frame, as a view */
    std::vector<cv::Point2d> dots;
    std::vector<peer_point> points; /* by slot */
    std::vector<peer_sample> samples;
    double nearest_sample_mm;
    bool has_surface;
    peer_grid surface_mm;
    double nearest_node_mm;
    std::vector<peer_nest> nests;
    std::array<peer_ray, PEER_SLOTS> rays;
    peer_ray_lanes lanes;
    bool has_head;
    peer_head head;
};

/* Reads rig.json; throws std::runtime_error with what is wrong. */
peer_rig peer_rig_read(const std::string &path);
/* Normalised position of a slot's dot at a depth; its frame pixel. */
cv::Point2d peer_rig_dot_at(const peer_rig &rig, int slot, double depth_mm);
cv::Point2d peer_rig_distort(const peer_rig &rig, cv::Point2d normalised);

void peer_begin(peer &p, peer_kind kind, const peer_rig &rig);

/* The stages, in order; each reads what the one before it wrote. Not inlined, so that callgrind sees
 * them. */
extern "C" {
void peer_frame(peer &p, const cv::Mat &image);
void peer_find_dots(peer &p);
void peer_find_labels(peer &p);
void peer_find_samples(peer &p);
void peer_fit_surface(peer &p);
void peer_find_nests(peer &p);
void peer_find_hypotheses(peer &p);
}

/* Parts of stages. */
void peer_contours(const peer_grid &surface_mm, double level_mm, std::vector<peer_contour> &out);
bool peer_ellipse_whole(peer_kind kind, const peer_contour &contour, peer_ellipse &out);
bool peer_outline_make(const peer_contour &contour, peer_outline &out);
/* All arcs that are ellipses, wherever the minimum is. */
void peer_arcs(peer_kind kind, const peer_outline &outline, std::vector<peer_arc> &out);
/* The best of them that winds round the position; none: nullptr. */
const peer_arc *peer_arc_around(const peer_outline &outline, const std::vector<peer_arc> &arcs,
                                cv::Point2f position);
double peer_near_mm(const std::vector<peer_point> &points);
bool peer_is_visible(const peer &p, cv::Point2d normalised);
void peer_fill_lanes(peer &p);
double peer_scan_score(const peer &p, const peer_head &head);
double peer_promise(const peer &p, const peer_head &head);

/* A fit in progress. */
struct peer_fit {
    peer_head head, start;
    double ln[3];
    int step;
};
constexpr int PEER_FIT_STEPS = 6;
peer_fit peer_fit_begin(const peer_head &start);
void peer_fit_continue(const peer &p, int steps, peer_fit &fit);

#endif
