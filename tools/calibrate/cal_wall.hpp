/* cal_wall - what stands still behind the board, if it is a wall: one more plane that the rays meet.
 * Dots that miss the board land there in every picture, so the mean of all pictures shows them with little noise, and
 * the grains of a beam are finest where it is far away. A picture in which a dot is missing, or something else is in its place,
 * has no part in that dot's mean. Where the wall is, nobody measured: it is laid through the places
 * that the rays tell, each time they are known better. How even it is, is told by how well it fits; what is not on it is
 * left out.
 * A dot behind the board is told by its epipolar line alone, so this is for projectors near the camera: beside a wide
 * baseline the lines of neighbours lie upon each other, and such dots are not used.
 */
#ifndef CAL_WALL_HPP
#define CAL_WALL_HPP

#include "cal_rays.hpp"
#include "cal_twins.hpp"

namespace cal
{
/* The dots of all twins that are not on the board; as of one more picture, whose pose is not known. */
Lit wall_find(const Board &board, const Camera &camera, const std::vector<Picture> &pictures,
              const std::vector<int> &twins, const std::vector<Lit> &lit, const Noise &noise, double lens_px);

/* Which dots they are, and where the wall is: sets pose, slots and places. False: there is none. */
bool wall_lay(const Camera &camera, const Projector &projector, Lit &wall);
} // namespace cal

#endif
