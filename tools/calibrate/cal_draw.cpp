#include "cal_draw.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>

namespace cal
{
cv::Matx33d draw_map(const Board &board, const cv::Vec3d &rvec, const cv::Vec3d &shift)
{
    cv::Matx33d rotation;
    cv::Point2d sheet = board.sheet_origin_mm();
    double scale = draw_px_per_mm;
    cv::Rodrigues(rvec, rotation);
    cv::Matx33d from_board(rotation(0, 0), rotation(0, 1), shift[0], rotation(1, 0), rotation(1, 1), shift[1],
                           rotation(2, 0), rotation(2, 1), shift[2]);
    cv::Matx33d to_print(scale, 0.0, -scale * sheet.x - 0.5, 0.0, scale, -scale * sheet.y - 0.5, 0.0, 0.0, 1.0);
    return to_print * from_board.inv();
}

cv::Mat draw_tangents(cv::Size size, const cv::Mat &camera, const cv::Mat &distortion)
{
    cv::Mat px(size, CV_64FC2), tangents;
    for (int v = 0; v < size.height; v++) {
        for (int u = 0; u < size.width; u++)
            px.at<cv::Vec2d>(v, u) = {static_cast<double>(u), static_cast<double>(v)};
    }
    cv::undistortPoints(px.reshape(2, 1), tangents, camera, distortion, cv::noArray(), cv::noArray(),
                        {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-9});
    return tangents.reshape(2, size.height);
}

Sight draw_sight(const cv::Mat &tangents, cv::Point2d px)
{
    int u = std::clamp(cvFloor(px.x), 0, tangents.cols - 2), v = std::clamp(cvFloor(px.y), 0, tangents.rows - 2);
    cv::Vec2d here = tangents.at<cv::Vec2d>(v, u), right = tangents.at<cv::Vec2d>(v, u + 1) - here;
    cv::Vec2d down = tangents.at<cv::Vec2d>(v + 1, u) - here;
    return {here + (px.x - u) * right + (px.y - v) * down, right, down};
}

bool draw_on_sheet(const cv::Mat &print, int left, int top)
{
    return left >= 0 && top >= 0 && left + 1 < print.cols && top + 1 < print.rows;
}

double draw_sample(const cv::Mat &print, const cv::Vec3d &at)
{
    double x = at[0] / at[2], y = at[1] / at[2];
    int left = cvFloor(x), top = cvFloor(y);
    if (!draw_on_sheet(print, left, top))
        return 1.0;
    double fx = x - left, fy = y - top;
    const uchar *upper = print.ptr<uchar>(top) + left, *lower = print.ptr<uchar>(top + 1) + left;
    return ((1.0 - fy) * ((1.0 - fx) * upper[0] + fx * upper[1]) + fy * ((1.0 - fx) * lower[0] + fx * lower[1])) /
           255.0;
}
} // namespace cal
