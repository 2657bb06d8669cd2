/* cal_rig - rig.json as docs/contract.md has it, and what the rig's geometry is worth: each dot's line in the image,
 * whether dots share lines, and the depth error that is left.
 * The file's numbers are written with 17 digits: what is read back is what was written.
 * In undistorted pixels a dot at depth Z is at infinity + move / Z: a straight line, walked in proportion to 1/Z.
 * Two dots share a line when, somewhere between the nearest and the farthest depth, they come nearer to each other than
 * two tolerances of the labels stage (0.6 px each): then a dot seen there may be either.
 */
#ifndef CAL_RIG_HPP
#define CAL_RIG_HPP

#include "cal_rays.hpp"

namespace cal
{
struct Range {
    double near_mm, far_mm;
};

/* How the camera will hang: it looks down by the tilt, and heads' tops tip to the right by the roll; or as it did when the
 * board hung plumb in this picture. */
struct Mount {
    double tilt_deg = 0.0, roll_deg = 0.0;
    std::string plumb_file; /* empty: none */
};

/* The unit vector of the camera frame that points up. */
cv::Vec3d up_of(const Mount &mount);
/* By a picture of a board that hung plumb. Throws cal::Error where the camera looked straight up or down. */
cv::Vec3d up_of(const View &plumb);

/* Throws cal::Error. */
void rig_write(const std::string &path, const Camera &camera, const Projector &projector, const Range &range,
               const cv::Vec3d &up);

constexpr double same_line_px = 1.2;

struct EpipolarLine {
    cv::Point2d infinity_px, move_px_mm;
    cv::Point2d at(double depth_mm) const
    {
        return infinity_px + move_px_mm * (1.0 / depth_mm);
    }
};

std::array<EpipolarLine, slot_count> epipolar_lines(const Camera &camera, const cv::Vec3d &origin_mm,
                                                    const std::array<cv::Vec3d, slot_count> &rays);

/* The pattern rotated about its middle ray by this angle, clockwise in the image where it is positive. */
struct Rotation {
    double deg;
    int shared;          /* pairs of dots that share a line */
    double min_apart_px; /* of all pairs */
};

Rotation epipolar_rotated(const Camera &camera, const Projector &projector, const Range &range, double deg);
/* From -5 to 5 degrees in steps of 0.1. */
std::vector<Rotation> epipolar_rotations(const Camera &camera, const Projector &projector, const Range &range);
/* The rotation to advise: the smallest one of those with the fewest shared lines. */
Rotation epipolar_best(const std::vector<Rotation> &rotations);

/* Standard deviation of a depth, mm, by a dot's error along its line, px, in one frame, and by its ray's own error. */
double depth_sigma_mm(const Camera &camera, const Projector &projector, double dot_sigma_px, double depth_mm);
} // namespace cal

#endif
