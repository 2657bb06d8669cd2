/* cal_bundle - camera and poses together by weighted least squares, from a good start.
 * What cv::calibrateCamera does, but that every corner counts by how well its patch fixes it, and every picture by how well
 * its corners fit: near ones are known three times as well as far ones, and the principal point rests on them.
 */
#ifndef CAL_BUNDLE_HPP
#define CAL_BUNDLE_HPP

#include "cal_camera.hpp"

namespace cal
{
/* Improves the camera and the poses of the good views, whose corners are refined; sets standard deviations and rms. The third radial term moves only
 * where camera.third_radial says so. Throws cal::Error where the pictures leave a parameter free. */
void bundle_solve(const Board &board, std::vector<View> &views, Camera &camera);
} // namespace cal

#endif
