/* cal_rig - rig.json as docs/contract.md has it.
 * Its numbers are written with 17 digits: what is read back is what was written.
 */
#ifndef CAL_RIG_HPP
#define CAL_RIG_HPP

#include "cal_rays.hpp"

namespace cal
{
struct Range {
    double near_mm, far_mm;
};

/* Throws cal::Error. */
void rig_write(const std::string &path, const Camera &camera, const Projector &projector, const Range &range);
} // namespace cal

#endif
