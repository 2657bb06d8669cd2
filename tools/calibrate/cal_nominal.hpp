/* cal_nominal - the lattice that the projector's maker meant: a grating sends its dots out equally spaced in direction
 * cosines, in a frame of its own. Fitted to the rays that were seen, it gives those that never were;
 * and a ray that was seen once or twice leans on it, by as much as its own error is larger than what the well-known rays
 * differ from the lattice.
 */
#ifndef CAL_NOMINAL_HPP
#define CAL_NOMINAL_HPP

#include "cal_rays.hpp"

namespace cal
{
/* Fills the rays of dots that were not seen, and what the projector says of its lattice. */
void nominal_fill(Projector &projector);
} // namespace cal

#endif
