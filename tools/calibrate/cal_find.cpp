#include "cal_find.hpp"

#include <algorithm>
#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "cal_error.hpp"

namespace cal
{
static constexpr int corners_min = 8;
static constexpr double edge_max_px = 3.5;
/* A marker may lie off the board's plane by this fraction of a square: lenses bend. */
static constexpr double marker_slack = 0.4;
static constexpr double marker_good_fraction = 0.5;
/* Small pictures of markers are looked at larger. */
static constexpr double enlarge = 1.5, enlarge_more = 3.0, enough_fraction = 0.5;
static constexpr size_t markers_min = 3;
static constexpr int few_corners = 12;
/* Windows of the search for a corner: this fraction of a square, within bounds. */
static constexpr double window_fraction = 0.2;
static constexpr int window_min_px = 3, window_max_px = 9;
static constexpr double moved_max_px = 3.0;

std::vector<cv::Point3f> Corners::positions_mm(const Board &board) const
{
    std::vector<cv::Point3f> positions;
    for (int id : ids)
        positions.emplace_back(board.corner_mm(id));
    return positions;
}

static double median(std::vector<double> values)
{
    if (values.empty())
        return 0.0;
    auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/* Pairs of corners that are a square apart: indices into ids. */
static std::vector<std::pair<size_t, size_t>> neighbours(const Board &board, const std::vector<int> &ids)
{
    std::map<int, size_t> index;
    std::vector<std::pair<size_t, size_t>> pairs;
    for (size_t i = 0; i < ids.size(); i++)
        index[ids[i]] = i;
    for (size_t i = 0; i < ids.size(); i++) {
        int side = board.columns - 1;
        if (ids[i] % side != side - 1 && index.count(ids[i] + 1))
            pairs.emplace_back(i, index[ids[i] + 1]);
        if (index.count(ids[i] + side))
            pairs.emplace_back(i, index[ids[i] + side]);
    }
    return pairs;
}

static double bilinear(const cv::Mat &grey8, cv::Point2d position)
{
    int x = static_cast<int>(position.x), y = static_cast<int>(position.y);
    if (position.x < 0.0 || position.y < 0.0 || x + 1 >= grey8.cols || y + 1 >= grey8.rows)
        return -1.0;
    double fx = position.x - x, fy = position.y - y;
    double upper = (1.0 - fx) * grey8.at<uchar>(y, x) + fx * grey8.at<uchar>(y, x + 1);
    double lower = (1.0 - fx) * grey8.at<uchar>(y + 1, x) + fx * grey8.at<uchar>(y + 1, x + 1);
    return (1.0 - fy) * upper + fy * lower;
}

/* The width of the edge between two corners, across its middle; negative: it cannot be determined. */
static double edge_width(const cv::Mat &grey8, cv::Point2d a, cv::Point2d b)
{
    constexpr double step_px = 0.5;
    double length = cv::norm(b - a), reach = std::min(7.0, 0.3 * length), steepest = 0.0, low = 255.0, high = 0.0;
    cv::Point2d across((b.y - a.y) / length, -(b.x - a.x) / length), middle = 0.5 * (a + b);
    for (double along = -reach; along <= reach; along += step_px) {
        double before = bilinear(grey8, middle + (along - 0.5) * across);
        double after = bilinear(grey8, middle + (along + 0.5) * across);
        if (before < 0.0 || after < 0.0)
            return -1.0;
        steepest = std::max(steepest, std::abs(after - before));
        low = std::min(low, std::min(before, after));
        high = std::max(high, std::max(before, after));
    }
    return high - low < 15.0 ? -1.0 : (high - low) / steepest;
}

static double edge_median(const Board &board, const cv::Mat &grey8, const Corners &corners)
{
    std::vector<double> widths;
    for (auto [a, b] : neighbours(board, corners.ids)) {
        double width = edge_width(grey8, corners.px[a], corners.px[b]);
        if (width > 0.0)
            widths.push_back(width);
    }
    return median(widths);
}

static double square_px(const Board &board, const Corners &corners)
{
    std::vector<double> sides;
    for (auto [a, b] : neighbours(board, corners.ids))
        sides.push_back(cv::norm(corners.px[a] - corners.px[b]));
    return sides.empty() ? 20.0 : *std::min_element(sides.begin(), sides.end());
}

/* Every corner anew in windows of one size; those that run away or lie at the border are dropped. */
static void refine(const Board &board, const cv::Mat &grey8, Corners &corners)
{
    if (corners.ids.empty())
        return;
    int window = std::clamp(cvRound(window_fraction * square_px(board, corners)), window_min_px, window_max_px);
    std::vector<cv::Point2f> start = corners.px;
    Corners kept;
    cv::cornerSubPix(grey8, corners.px, {window, window}, {-1, -1},
                     {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 0.002});
    for (size_t i = 0; i < start.size(); i++) {
        cv::Point2f px = corners.px[i];
        float border = static_cast<float>(window) + 1.0f;
        bool inside = px.x >= border && px.y >= border && px.x < static_cast<float>(grey8.cols) - border &&
                      px.y < static_cast<float>(grey8.rows) - border;
        if (inside && cv::norm(px - start[i]) <= moved_max_px) {
            kept.ids.push_back(corners.ids[i]);
            kept.px.push_back(px);
        }
    }
    corners.ids = kept.ids;
    corners.px = kept.px;
}

/* Keeps the markers that lie to each other as on this board; false: they are another board's. */
static bool keep_as_printed(const Board &board, std::vector<std::vector<cv::Point2f>> &markers, std::vector<int> &ids)
{
    std::vector<cv::Point2f> printed, seen;
    for (size_t i = 0; i < ids.size(); i++) {
        const auto &positions = board.markers->objPoints[static_cast<size_t>(ids[i])];
        for (size_t k = 0; k < 4; k++) {
            printed.emplace_back(positions[k].x, positions[k].y);
            seen.push_back(markers[i][k]);
        }
    }
    std::vector<uchar> fits;
    if (cv::findHomography(seen, printed, cv::RANSAC, marker_slack * board.square_mm, fits).empty())
        return false;
    size_t kept = 0;
    for (size_t i = 0; i < ids.size(); i++) {
        if (fits[4 * i] && fits[4 * i + 1] && fits[4 * i + 2] && fits[4 * i + 3]) {
            ids[kept] = ids[i];
            markers[kept++] = markers[i];
        }
    }
    bool ours = static_cast<double>(kept) >= marker_good_fraction * static_cast<double>(ids.size());
    ids.resize(kept);
    markers.resize(kept);
    return ours;
}

static void find_markers_at(const Board &board, const cv::Mat &grey8, double scale,
                            const cv::Ptr<cv::aruco::DetectorParameters> &settings,
                            std::vector<std::vector<cv::Point2f>> &markers, std::vector<int> &ids)
{
    cv::Mat larger;
    settings->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
    cv::resize(grey8, larger, {}, scale, scale, cv::INTER_CUBIC);
    cv::aruco::detectMarkers(larger, board.markers->dictionary, markers, ids, settings);
    for (auto &marker : markers) {
        /* Pixel centres are whole numbers in both sizes. */
        for (auto &px : marker)
            px = (px + cv::Point2f(0.5f, 0.5f)) / scale - cv::Point2f(0.5f, 0.5f);
    }
}

/* Small markers in a soft picture, modules of 2 pixels, take ten times as long: only where it must be. */
static void find_markers(const Board &board, const cv::Mat &grey8, std::vector<std::vector<cv::Point2f>> &markers,
                         std::vector<int> &ids)
{
    find_markers_at(board, grey8, enlarge, cv::aruco::DetectorParameters::create(), markers, ids);
    if (static_cast<double>(ids.size()) >= enough_fraction * static_cast<double>(board.markers->ids.size()))
        return;
    auto settings = cv::aruco::DetectorParameters::create();
    settings->adaptiveThreshWinSizeStep = 10;
    settings->adaptiveThreshWinSizeMax = 43;
    settings->adaptiveThreshConstant = 3.0;
    settings->polygonalApproxAccuracyRate = 0.05;
    settings->perspectiveRemovePixelPerCell = 8;
    settings->perspectiveRemoveIgnoredMarginPerCell = 0.25;
    settings->maxErroneousBitsInBorderRate = 0.5;
    find_markers_at(board, grey8, enlarge_more, settings, markers, ids);
}

/* All inner corners, by the markers as a whole: where too few stand beside each other. */
static void predict_corners(const Board &board, const cv::Mat &grey8,
                            const std::vector<std::vector<cv::Point2f>> &markers, const std::vector<int> &ids,
                            Corners &corners)
{
    std::vector<cv::Point2f> printed, seen, all, expected;
    for (size_t i = 0; i < ids.size(); i++) {
        for (size_t k = 0; k < 4; k++) {
            cv::Point3f position = board.markers->objPoints[static_cast<size_t>(ids[i])][k];
            printed.emplace_back(position.x, position.y);
            seen.push_back(markers[i][k]);
        }
    }
    for (int id = 0; id < board.corner_count(); id++)
        all.emplace_back(static_cast<float>(board.corner_mm(id).x), static_cast<float>(board.corner_mm(id).y));
    cv::Mat map = cv::findHomography(printed, seen);
    if (map.empty())
        return;
    cv::perspectiveTransform(all, expected, map);
    corners.ids.clear();
    corners.px.clear();
    cv::Rect2f inside(1.0f, 1.0f, static_cast<float>(grey8.cols) - 3.0f, static_cast<float>(grey8.rows) - 3.0f);
    for (int id = 0; id < board.corner_count(); id++) {
        if (inside.contains(expected[static_cast<size_t>(id)])) {
            corners.ids.push_back(id);
            corners.px.push_back(expected[static_cast<size_t>(id)]);
        }
    }
}

static void find_charuco(const Board &board, const cv::Mat &grey8, Corners &corners)
{
    std::vector<std::vector<cv::Point2f>> markers;
    std::vector<int> ids;
    find_markers(board, grey8, markers, ids);
    if (ids.size() < markers_min) {
        corners.refused = ids.empty() ? "no board found" : text("no board found, but %zu of its markers", ids.size());
        return;
    }
    if (!keep_as_printed(board, markers, ids)) {
        corners.refused = "another board than " + board.name + ": its markers are not where they should be";
        return;
    }
    cv::Mat found_px, found_ids;
    cv::aruco::interpolateCornersCharuco(markers, ids, grey8, board.markers, found_px, found_ids);
    for (int i = 0; i < found_ids.rows; i++) {
        corners.ids.push_back(found_ids.at<int>(i));
        corners.px.push_back(found_px.at<cv::Point2f>(i));
    }
    if (found_ids.rows < few_corners)
        predict_corners(board, grey8, markers, ids, corners);
}

static void find_chessboard(const Board &board, const cv::Mat &grey8, Corners &corners)
{
    std::vector<cv::Point2f> px;
    if (!cv::findChessboardCorners(grey8, {board.columns - 1, board.rows - 1}, px,
                                   cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE)) {
        corners.refused = "no board found; a chessboard must be seen whole";
        return;
    }
    for (int i = 0; i < board.corner_count(); i++)
        corners.ids.push_back(i);
    corners.px = px;
}

Corners corners_find(const Board &board, const cv::Mat &grey8)
{
    Corners corners;
    if (board.charuco)
        find_charuco(board, grey8, corners);
    else
        find_chessboard(board, grey8, corners);
    refine(board, grey8, corners);
    corners.edge_px = edge_median(board, grey8, corners);
    if (!corners.refused.empty())
        return corners;
    if (corners.edge_px > edge_max_px)
        corners.refused = text("blurred: edges are %.1f px wide, %.1f are allowed", corners.edge_px, edge_max_px);
    else if (static_cast<int>(corners.ids.size()) < corners_min)
        corners.refused =
            text("only %zu corners of the board are seen, %d are needed", corners.ids.size(), corners_min);
    return corners;
}

} // namespace cal
