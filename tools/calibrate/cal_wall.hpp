/* cal_wall - what stands still behind the board, if it is a wall: one more plane that the rays meet.
 * Dots that miss the board land there in every picture, so the mean of all pictures shows them with little noise, and
 * a beam's speckle is finest where it is far away. A picture in which a dot is missing or covered
 * is left out of that dot's mean. Where the wall is, nobody measured: it is fitted to the points
 * that the rays give, again each time they are known better. How even it is follows from its residuals; what is not on it is
 * left out.
 * A dot behind the board is identified by its epipolar line alone, so this is for projectors near the camera: beside a wide
 * baseline the lines of neighbours lie upon each other, and such dots are not used.
 */
#ifndef CAL_WALL_HPP
#define CAL_WALL_HPP

#include "cal_rays.hpp"
#include "cal_pairs.hpp"

namespace cal
{
/* The dots of all pairs that are not on the board; as of one more picture, whose pose is not known. */
Lit wall_find(const Board &board, const Camera &camera, const std::vector<Picture> &pictures,
              const std::vector<int> &dark_of, const std::vector<Lit> &lit, const Noise &noise, double lens_px);

/* Which dots they are, and where the wall is: sets pose, slots and positions. False: there is none. */
bool wall_lay(const Camera &camera, const Projector &projector, Lit &wall);
} // namespace cal

#endif
