/* cal_nominal - the lattice that the projector's maker meant: a grating sends its dots out equally spaced in direction
 * cosines, in a frame of its own. Fitted to the rays that were seen, it gives those that never were; and how far rays are
 * from it says how strongly a ray that was seen once or twice is regularised towards it.
 */
#ifndef CAL_NOMINAL_HPP
#define CAL_NOMINAL_HPP

#include "cal_rays.hpp"

namespace cal
{
struct Nominal {
    std::array<cv::Vec2d, slot_count> tangents; /* a ray is (x, y, 1) */
    double sigma = 0.0;                         /* of one component of a ray's distance from it, radians */
    double pitch_deg = 0.0, rotation_deg = 0.0; /* its step, and its rotation against the image's rows */
};

/* `sigma` where too few rays are known well enough to estimate it: rays are then hardly regularised. */
constexpr double nominal_unknown = 1.0;

/* An angle in words, of a projector's `nominal_sigma_deg`. */
std::string nominal_words(double sigma_deg);

/* By the rays that were seen (`seen`, `rays`), and how well those seen often are known (`sigma_deg`). */
Nominal nominal_fit(const Projector &projector);
} // namespace cal

#endif
