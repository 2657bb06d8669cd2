/* cal_solve - all steps: pictures, camera, projector, rig.json, report.
 */
#ifndef CAL_SOLVE_HPP
#define CAL_SOLVE_HPP

#include "cal_options.hpp"

namespace cal
{
/* Everything that a calibration came to. */
struct Result {
    Board board;
    std::vector<View> views; /* by picture; a laser-on one whose laser-off picture is used is in `lit` only */
    std::vector<Lit> lit;
    Camera camera;
    Projector projector;
    Range range{};
    cv::Vec3d up;
};

/* Prints what it finds on standard output. Throws cal::Error. */
void solve_run(const Options &options);
} // namespace cal

#endif
