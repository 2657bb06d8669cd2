/* cal_spot - where a dot really is on the print, and how well that is known.
 * White sends more of the laser back than dark, so a dot's picture leans towards white; and dividing by how light the
 * paper looks leans it too far to the other side, because the lens softens edges that the beam still met sharp. So the
 * dot is drawn as the camera would see it, a beam on the print, then the lens, and moved until it looks like the dot
 * (cal_beam). What the lens adds to a dot's width is estimated from the dots: a beam looks narrower the farther off it is, the
 * lens' part stays.
 */
#ifndef CAL_SPOT_HPP
#define CAL_SPOT_HPP

#include "cal_sightings.hpp"
#include "cal_pairs.hpp"

namespace cal
{
/* Standard deviation of the lens' blur, from all sightings. */
double spot_lens_px(const std::vector<Lit> &pictures);

/* What of the print and of the camera is the same in all pictures. */
struct Spots {
    const Board &board;
    const Camera &camera;
    cv::Mat print, tangents;       /* board_picture with draw_px_per_mm; draw_tangents */
    double lens_px, dark_fraction; /* how light the print's dark is, white is 1 */
    Noise noise;
};

/* Sets the positions of a picture's sightings again; `dark` is its laser-off picture. Those that no dot fits keep theirs. */
void spots_refine(const Spots &spots, const cv::Mat &grey, const cv::Mat &dark, Lit &lit);
} // namespace cal

#endif
