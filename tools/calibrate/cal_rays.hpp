/* cal_rays - the projector: one origin and a ray for each dot, by least squares.
 * What is made small is where the camera sees the dots: each ray meets the board's plane, and the distance in undistorted
 * pixels between that position and the dot is minimised; large ones weigh less (Huber), and those beyond 4.5 times the usual
 * size not at all. All rays are solved together with the origin that they share and, once it is known how far rays are from it, with the
 * grating's lattice (cal_nominal).
 */
#ifndef CAL_RAYS_HPP
#define CAL_RAYS_HPP

#include <array>

#include "cal_sightings.hpp"

namespace cal
{
struct Projector {
    cv::Vec3d origin_mm, origin_sigma_mm;
    std::array<cv::Vec3d, slot_count> rays;     /* unit */
    std::array<int, slot_count> seen{};         /* sightings that a ray rests on; 0: by the nominal lattice */
    std::array<double, slot_count> sigma_deg{}; /* standard deviation of one component */
    int sighting_count = 0, outlier_count = 0;
    double rms_px = 0.0;
    double scale = 1.0;             /* how much larger residuals are than the sightings' sigmas */
    double nominal_sigma_deg = 0.0; /* how far rays are from the nominal lattice, one component; 0: not known */
    double pitch_deg = 0.0,
           rotation_deg = 0.0; /* of the nominal lattice: its step, and its rotation against the image's rows */
};

/* Sets the residuals and `fits` of the sightings. Throws cal::Error where they do not support an origin. */
Projector rays_solve(const Camera &camera, std::vector<Lit> &pictures, const cv::Vec3d &origin_mm);

/* Gives slots to dots that have none: one without neighbours is in no lattice, but its ray says where it is. A picture
 * that was refused as its dots are few is used if most of them are where rays are. Returns how many dots. */
int rays_join(const Camera &camera, const Projector &projector, std::vector<Lit> &pictures);
} // namespace cal

#endif
