/* cal_trial - all pictures laid on one lattice of directions, as seen from where the projector may be.
 *
 * Every picture has a lattice of its own whose origin nobody knows. Two pictures at different distances, laid on each other
 * with some shift, give lines from dot to dot that meet nearly in one point whatever the shift is: the projector, if the
 * shift is right, else a point some centimetres beside it. Only with the right one do all other pictures fall on the same
 * lattice of directions as well; so every candidate is tried on all of them, and the one that takes in most dots wins.
 */
#ifndef CAL_TRIAL_HPP
#define CAL_TRIAL_HPP

#include <map>

#include "cal_sightings.hpp"

namespace cal
{
using Step = std::pair<int, int>; /* column, row of the common lattice */

/* A dot of the common lattice. */
struct Known {
    cv::Point2d direction; /* tangents, as seen from the projector's origin */
    int count;
};

struct Trial {
    cv::Vec3d origin_mm;
    std::map<Step, Known> known;
    std::vector<cv::Vec2i> shift; /* of each picture that is placed */
    std::vector<bool> placed;
    int dot_count = 0;
    double square_sum = 0.0; /* of the dots' distances from the lattice, steps */
};

/* The best of all positions. Pictures that are refused are not used. Throws cal::Error where there is none, or two. */
Trial trial_best(const std::vector<Lit> &pictures);
} // namespace cal

#endif
