/* view_rig - the camera and the projector of a rig.json (docs/contract.md), as far as a picture needs them.
 */
#ifndef VIEW_RIG_HPP
#define VIEW_RIG_HPP

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace view
{
struct Rig {
    bool range; /* depth images: no projector, no labels */
    cv::Size size_px;
    cv::Matx33d camera;
    cv::Vec<double, 5> lens;
    cv::Vec3d origin_mm;
    std::vector<cv::Vec3d> rays; /* none with a range rig */
    double near_mm, far_mm;
    double reach; /* farther than this from the axis, normalised, the lens's polynomials are not valid */

    /* From normalised coordinates to the frame's pixel. */
    cv::Point2d pixel(cv::Point2d position) const;
    /* From pixels to normalised coordinates. */
    std::vector<cv::Point2d> positions(const std::vector<cv::Point2d> &pixels) const;
    /* Across the slot's epipolar line at this pixel, as a unit vector in the frame. */
    cv::Point2d across(size_t slot, cv::Point2d pixel) const;
};

Rig rig_read(const std::string &path);
} // namespace view

#endif
