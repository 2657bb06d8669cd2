#include "cal_sightings.hpp"

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
} // namespace cal
