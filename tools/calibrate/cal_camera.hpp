/* cal_camera - the camera's matrix and lens from pictures of the board, by cv::calibrateCamera and cal_bundle, and how far to
 * trust it.
 * Corners that do not fit are left out, pictures that do not fit as a whole are refused by name. The third radial term
 * is kept only where it is three of its standard deviations away from 0.
 */
#ifndef CAL_CAMERA_HPP
#define CAL_CAMERA_HPP

#include <array>

#include "cal_find.hpp"

namespace cal
{
/* A picture of the board. */
struct View {
    std::string file;
    cv::Mat grey8, grey; /* as taken, CV_8U; CV_32F, which corners are refined in: needed by camera_solve only */
    Corners corners;
    cv::Vec3d rvec, shift; /* board to camera: Rodrigues' vector; mm */
    double rms_px = 0.0;
    int left_out = 0; /* corners that did not fit */

    bool good() const
    {
        return corners.refused.empty();
    }
    /* A point of the board in the camera's frame. */
    cv::Vec3d in_camera(cv::Point3d position_mm) const;
    cv::Point2d on_board(const cv::Vec3d &position_mm) const; /* and back */
    /* The board's own Z in the camera's frame, and its angle against the camera's. */
    cv::Vec3d normal() const;
    double tilt_deg() const;
};

constexpr int region_columns = 4, region_rows = 3;

/* Corners in one part of the frame. */
struct Region {
    int corner_count = 0;
    double rms_px = 0.0;
    cv::Point2d mean_px; /* of the residuals */
};

struct Camera {
    cv::Size size;
    cv::Mat matrix, distortion;       /* 3x3, 1x5: k1 k2 p1 p2 k3 */
    std::array<double, 4> sigma_px{}; /* standard deviations: fx fy cx cy */
    std::array<double, 5> lens_sigma{};
    double rms_px = 0.0;
    bool third_radial = false;
    std::array<Region, region_columns * region_rows> regions{};

    double focal_px() const
    {
        return matrix.at<double>(0, 0);
    }
    /* Undistorted tangents X/Z, Y/Z of a pixel, and back to undistorted pixels. */
    std::vector<cv::Point2d> tangents(const std::vector<cv::Point2d> &px) const;
    cv::Point2d undistorted_px(cv::Point2d tangent) const;
};

/* Sets poses and residuals of the good views, refuses those that do not fit. Throws cal::Error with what to add where
 * the views cannot support a camera. */
Camera camera_solve(const Board &board, cv::Size size, std::vector<View> &views);

/* The pose of a board from its corners. */
void camera_pose(const Camera &camera, const Board &board, View &view);
} // namespace cal

#endif
