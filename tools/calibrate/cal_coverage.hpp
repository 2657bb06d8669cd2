/* cal_coverage - what a set of pictures lacks: how many there are, where in the frame, how the board is tilted, how far
 * away it is. The same rules guide somebody who takes pictures and refuse a calibration; only the limits differ.
 */
#ifndef CAL_COVERAGE_HPP
#define CAL_COVERAGE_HPP

#include "cal_camera.hpp"

namespace cal
{
struct CoverageLimits {
    int pictures;       /* with the board found and sharp */
    int region_corners; /* corners in each of 4x3 parts of the frame */
    int tilted;         /* pictures tilted by 20 degrees or more about the vertical, and as many about the horizontal */
    int regions_without;   /* parts of the frame that may have fewer */
    double distance_ratio; /* farthest to nearest board */
};

constexpr CoverageLimits coverage_wanted{20, 12, 4, 0, 2.0}, coverage_min{10, 4, 2, 2, 1.4};

/* Of the 4x3 parts, row by row. */
extern const char *const coverage_region_names[region_columns * region_rows];

/* Sentences that say what to add, the most urgent first; empty: nothing. The views' poses must be known, roughly. */
std::vector<std::string> coverage_missing(const std::vector<View> &views, cv::Size size, const CoverageLimits &limits);

/* Poses from a camera that is only guessed: good enough for coverage_missing. */
void coverage_guess_poses(const Board &board, cv::Size size, std::vector<View> &views);
} // namespace cal

#endif
