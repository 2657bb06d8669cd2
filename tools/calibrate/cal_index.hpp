/* cal_index - which dot is which of the 361, in all pictures at once, without help.
 * cal_trial lays all pictures on one lattice.
 * Then the pattern's edges say which dot is the first: all 19 lines are seen, or beyond the last one dots were looked for
 * on the board in vain. Where neither is so, the user names the middle dot in one picture.
 */
#ifndef CAL_INDEX_HPP
#define CAL_INDEX_HPP

#include "cal_sightings.hpp"

namespace cal
{
/* The middle dot, as the user points at it. */
struct MiddleDot {
    std::string file; /* empty: not named */
    cv::Point2d px;
};

/* Sets every sighting's slot, and refuses pictures whose dots fit nowhere. Returns the projector's origin, roughly.
 * Throws cal::Error where that cannot be determined, with what to add. */
cv::Vec3d index_assign(const Board &board, const Camera &camera, std::vector<Lit> &pictures, const MiddleDot &middle);
} // namespace cal

#endif
