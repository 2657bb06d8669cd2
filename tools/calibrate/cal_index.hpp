/* cal_index - which dot is which of the 361, in all pictures at once, without help.
 *
 * Every picture has a lattice of its own whose origin nobody knows. Two pictures at different distances, laid on each other
 * with some shift, give lines from dot to dot that meet nearly in one point whatever the shift is: the projector, if the
 * shift is right, else a place some centimetres beside it. Only with the right one do all other pictures fall on the same
 * lattice of directions as well; so every candidate is tried on all of them, and the one that takes in most dots wins.
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

/* Sets every sighting's slot, and refuses pictures whose dots fit into no place. Returns the projector's origin, roughly.
 * Throws cal::Error where that cannot be told, with what to add. */
cv::Vec3d index_assign(const Board &board, const Camera &camera, std::vector<Lit> &pictures, const MiddleDot &middle);
} // namespace cal

#endif
