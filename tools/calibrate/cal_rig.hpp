/* cal_rig - rig.json as docs/contract.md has it.
 * Its numbers are written with 17 digits: what is read back is what was written.
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
} // namespace cal

#endif
