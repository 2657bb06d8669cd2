#include "cal_sightings.hpp"

#include <algorithm>
#include <deque>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "cal_dots.hpp"

namespace cal
{
static constexpr int bitmap_px_per_mm = 2;
/* Without a laser-off picture a dot must be this far from every edge of the print, else the edge is measured with it. */
static constexpr double edge_apart_px = 2.0;
static constexpr double border_mm = 3.0;

/* The part of the frame that the sheet covers, a little less. */
static cv::Mat sheet_mask(const Camera &camera, const Board &board, const View &view)
{
    cv::Point2d origin = board.sheet_origin_mm();
    double left = origin.x + border_mm, top = origin.y + border_mm;
    double right = origin.x + sheet_width_mm - border_mm, bottom = origin.y + sheet_height_mm - border_mm;
    std::vector<cv::Point3d> outline;
    constexpr int parts = 12;
    for (int i = 0; i < parts; i++)
        outline.emplace_back(left + (right - left) * i / parts, top, 0.0);
    for (int i = 0; i < parts; i++)
        outline.emplace_back(right, top + (bottom - top) * i / parts, 0.0);
    for (int i = 0; i < parts; i++)
        outline.emplace_back(right - (right - left) * i / parts, bottom, 0.0);
    for (int i = 0; i < parts; i++)
        outline.emplace_back(left, bottom - (bottom - top) * i / parts, 0.0);
    std::vector<cv::Point2d> seen;
    std::vector<cv::Point> whole;
    cv::projectPoints(outline, view.rvec, view.shift, camera.matrix, camera.distortion, seen);
    for (const cv::Point2d &px : seen)
        whole.emplace_back(cvRound(px.x), cvRound(px.y));
    cv::Mat mask = cv::Mat::zeros(camera.size, CV_8U);
    cv::fillPoly(mask, std::vector<std::vector<cv::Point>>{whole}, cv::Scalar(255));
    return mask;
}

/* How far each point of the sheet is from the next edge of the print, in samples. */
static cv::Mat edge_distances(const Board &board)
{
    cv::Mat sheet = board_bitmap(board, bitmap_px_per_mm), wide, narrow, distances;
    cv::dilate(sheet, wide, cv::Mat::ones(3, 3, CV_8U));
    cv::erode(sheet, narrow, cv::Mat::ones(3, 3, CV_8U));
    cv::distanceTransform(wide == narrow, distances, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    return distances;
}

static bool clear_of_edges(const Camera &camera, const Board &board, const cv::Mat &distances, const View &view,
                           const Sighting &sighting)
{
    cv::Point2d sheet = (view.on_board(sighting.position_mm) - board.sheet_origin_mm()) * bitmap_px_per_mm;
    int x = cvFloor(sheet.x), y = cvFloor(sheet.y);
    if (x < 0 || y < 0 || x >= distances.cols || y >= distances.rows)
        return false;
    double mm = static_cast<double>(distances.at<float>(y, x)) / bitmap_px_per_mm;
    double px_per_mm = camera.focal_px() / sighting.position_mm[2] * std::abs(view.normal()[2]);
    return mm * px_per_mm >= edge_apart_px;
}

void sighting_set(const Camera &camera, const View &view, cv::Point2d px, Sighting &sighting)
{
    cv::Vec3d normal = view.normal();
    sighting.px = px;
    sighting.tangent = camera.tangents({px}).front();
    cv::Vec3d sight(sighting.tangent.x, sighting.tangent.y, 1.0);
    sighting.position_mm = sight * (normal.dot(view.shift) / normal.dot(sight));
}

void sightings_find(const Board &board, const Camera &camera, const cv::Mat &grey, const cv::Mat &dark, Lit &lit)
{
    cv::Mat distances = edge_distances(board);
    for (const Dot &dot : dots_find(grey, dark, sheet_mask(camera, board, lit.view))) {
        Sighting sighting;
        sighting.wide_px = dot.sigma_px;
        sighting_set(camera, lit.view, dot.px, sighting);
        if (!dark.empty() || clear_of_edges(camera, board, distances, lit.view, sighting))
            lit.sightings.push_back(sighting);
    }
}

static constexpr size_t dots_min = 6;
static constexpr size_t near_count = 8;
/* Differences agree within this fraction of their length; a dot may be this fraction of a step from where it is expected. */
static constexpr double same_fraction = 0.15, reach_fraction = 0.25;
static constexpr int local_steps = 3;

using Grid = std::map<std::pair<int, int>, size_t>;

/* Differences between near dots, folded to the right or downwards. */
static void collect_steps(const std::vector<Sighting> &dots, std::vector<cv::Point2d> &across,
                          std::vector<cv::Point2d> &down)
{
    for (size_t i = 0; i < dots.size(); i++) {
        std::vector<cv::Point2d> offsets;
        for (size_t k = 0; k < dots.size(); k++) {
            if (k != i)
                offsets.push_back(dots[k].tangent - dots[i].tangent);
        }
        size_t kept = std::min(near_count, offsets.size());
        std::partial_sort(offsets.begin(), offsets.begin() + static_cast<std::ptrdiff_t>(kept), offsets.end(),
                          [](cv::Point2d a, cv::Point2d b) { return a.ddot(a) < b.ddot(b); });
        offsets.resize(kept);
        for (cv::Point2d offset : offsets) {
            if (std::abs(offset.x) >= std::abs(offset.y))
                across.push_back(offset.x > 0.0 ? offset : -offset);
            else
                down.push_back(offset.y > 0.0 ? offset : -offset);
        }
    }
}

/* The difference that most others agree with; of nearly as good ones the shortest. */
static cv::Point2d usual_step(const std::vector<cv::Point2d> &offsets)
{
    std::vector<int> votes;
    for (const cv::Point2d &offset : offsets)
        votes.push_back(static_cast<int>(std::count_if(offsets.begin(), offsets.end(), [&](const cv::Point2d &other) {
            return cv::norm(other - offset) < same_fraction * cv::norm(offset);
        })));
    if (offsets.empty())
        return {};
    int max = *std::max_element(votes.begin(), votes.end());
    cv::Point2d best;
    for (size_t i = 0; i < offsets.size(); i++) {
        if (votes[i] * 2 >= max && (best == cv::Point2d() || cv::norm(offsets[i]) < 0.75 * cv::norm(best) ||
                                    (votes[i] == max && cv::norm(offsets[i]) < 1.3 * cv::norm(best))))
            best = offsets[i];
    }
    return best;
}

struct Frame {
    cv::Point2d position, across, down;
};

/* The lattice around a dot: an affine map to the dots that are known near it, held to the usual steps. */
static Frame local_frame(const std::vector<Sighting> &dots, const Grid &grid, cv::Vec2i at, const Frame &usual)
{
    cv::Matx33d normal = cv::Matx33d::zeros();
    cv::Matx<double, 3, 2> right = cv::Matx<double, 3, 2>::zeros();
    constexpr double prior = 0.5;
    for (int row = -local_steps; row <= local_steps; row++) {
        for (int column = -local_steps; column <= local_steps; column++) {
            auto known = grid.find({at[0] + column, at[1] + row});
            if (known == grid.end())
                continue;
            double weight = 1.0 / (1.0 + column * column + row * row);
            cv::Point2d position = dots[known->second].tangent;
            cv::Matx31d terms(1.0, column, row);
            normal += weight * (terms * terms.t());
            right += weight * (terms * cv::Matx12d(position.x, position.y));
        }
    }
    for (int axis = 0; axis < 2; axis++) {
        cv::Point2d step = axis == 0 ? usual.across : usual.down;
        normal(axis + 1, axis + 1) += prior;
        right(axis + 1, 0) += prior * step.x;
        right(axis + 1, 1) += prior * step.y;
    }
    cv::Matx<double, 3, 2> found = normal.inv() * right;
    return {{found(0, 0), found(0, 1)}, {found(1, 0), found(1, 1)}, {found(2, 0), found(2, 1)}};
}

static int nearest_free(const std::vector<Sighting> &dots, cv::Point2d position, double reach)
{
    int best = -1;
    for (size_t i = 0; i < dots.size(); i++) {
        double away = cv::norm(dots[i].tangent - position);
        if (!dots[i].in_lattice && away < reach) {
            best = static_cast<int>(i);
            reach = away;
        }
    }
    return best;
}

static void take(std::vector<Sighting> &dots, size_t index, cv::Vec2i step, Grid &grid, std::deque<cv::Vec2i> &open)
{
    dots[index].in_lattice = true;
    dots[index].step = step;
    grid[{step[0], step[1]}] = index;
    open.push_back(step);
}

static int grow_from(std::vector<Sighting> &dots, size_t start, const Frame &usual)
{
    Grid grid;
    std::deque<cv::Vec2i> open;
    take(dots, start, {0, 0}, grid, open);
    while (!open.empty()) {
        cv::Vec2i at = open.front();
        open.pop_front();
        Frame frame = local_frame(dots, grid, at, usual);
        double reach = reach_fraction * std::min(cv::norm(frame.across), cv::norm(frame.down));
        for (int row = -2; row <= 2; row++) {
            for (int column = -2; column <= 2; column++) {
                cv::Vec2i step(at[0] + column, at[1] + row);
                if (grid.count({step[0], step[1]}))
                    continue;
                int found = nearest_free(dots, frame.position + column * frame.across + row * frame.down, reach);
                if (found >= 0)
                    take(dots, static_cast<size_t>(found), step, grid, open);
            }
        }
    }
    return static_cast<int>(grid.size());
}

/* The dot whose four neighbours are most nearly where the usual steps say. */
static size_t best_start(const std::vector<Sighting> &dots, const Frame &usual)
{
    size_t best = 0;
    double min = 1e9;
    for (size_t i = 0; i < dots.size(); i++) {
        double sum = 0.0;
        for (cv::Point2d step : {usual.across, -usual.across, usual.down, -usual.down}) {
            double away = 1.0;
            for (const Sighting &other : dots)
                away = std::min(away, cv::norm(other.tangent - dots[i].tangent - step) / cv::norm(step));
            sum += away;
        }
        if (sum < min) {
            min = sum;
            best = i;
        }
    }
    return best;
}

int lattice_grow(std::vector<Sighting> &sightings)
{
    std::vector<cv::Point2d> across, down;
    for (Sighting &sighting : sightings)
        sighting.in_lattice = false;
    if (sightings.size() < dots_min)
        return 0;
    collect_steps(sightings, across, down);
    Frame usual{{}, usual_step(across), usual_step(down)};
    if (cv::norm(usual.across) == 0.0 || cv::norm(usual.down) == 0.0)
        return 0;
    return grow_from(sightings, best_start(sightings, usual), usual);
}
} // namespace cal
