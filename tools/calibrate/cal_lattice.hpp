/* cal_lattice - which dots of one picture are neighbours: whole numbers of steps from a dot somewhere in the middle.
 * In tangents X/Z, Y/Z a pattern that is projected on a plane is nearly regular at any distance: its steps are found as
 * the differences that most neighbours share, and it is grown from dot to dot, each predicted from those around it.
 * Columns run to the right and rows downwards: the pattern may be rotated by up to 40 degrees.
 */
#ifndef CAL_LATTICE_HPP
#define CAL_LATTICE_HPP

#include "cal_sightings.hpp"

namespace cal
{
/* Sets step and in_lattice; returns how many dots are in the lattice. Those that are not are left for nothing. */
int lattice_grow(std::vector<Sighting> &sightings);
} // namespace cal

#endif
