/* cal_find - the board in a picture: its inner corners, to a small part of a pixel, and how sharp it is.
 */
#ifndef CAL_FIND_HPP
#define CAL_FIND_HPP

#include <string>
#include <vector>

#include "cal_board.hpp"

namespace cal
{
struct Corners {
    std::vector<int> ids;
    std::vector<cv::Point2f> px;
    std::vector<double> sigma_px;      /* standard deviation of one component; empty until corners_refine */
    std::vector<double> dark_fraction; /* how light the print's dark is, white is 1; empty until then */
    /* Width of the board's edges (their rise from dark to white over their steepest slope), median, px. A camera in focus
     * has 2 to 3. */
    double edge_px = 0.0;
    std::string refused; /* why the picture is no good; empty: it is */

    std::vector<cv::Point3f> positions_mm(const Board &board) const;
};

/* A picture whose board is not found, is another one, shows too little of itself or is blurred is refused in `refused`;
 * corners that were found are kept. */
Corners corners_find(const Board &board, const cv::Mat &grey8);
} // namespace cal

#endif
