/* cal_spot - where a dot really is on the print, and how well that is known.
 * White sends more of the laser back than dark, so a dot's picture leans towards white; and dividing by how light the
 * paper looks leans it too far to the other side, because the lens softens edges that the beam still met sharp. So the
 * dot is drawn as the camera would see it, a beam on the print, then the lens, and moved until it looks like the dot.
 * What the lens adds to a dot's width is estimated from the dots: a beam looks narrower the farther off it is, the
 * lens' part stays.
 * Model: a round beam on the print, as light as that is there, through the lens, on a level ground. What is seen differs
 * from it by the sensor's noise and by speckle: rough paper makes the beam grainy before the lens softens it, so
 * neighbouring pixels err together, most where the beam is bright. Generalised least squares models both: speckle then moves a dot
 * less than in an unweighted fit, and the covariance says how well each dot is known.
 */
#ifndef CAL_SPOT_HPP
#define CAL_SPOT_HPP

#include "cal_dots.hpp"
#include "cal_pairs.hpp"
#include "cal_sightings.hpp"

namespace cal
{
/* The surface is drawn this fine, and as far around the window as the lens' blur reaches. */
constexpr int beam_parts = 3, beam_around_px = 3;
constexpr int beam_side = beam_parts * (dot_side_px + 2 * beam_around_px);

/* From the window's middle to the middle of a fine sample. */
constexpr double beam_sample_px(int sample)
{
    return (sample + 0.5) / beam_parts - 0.5 * beam_side / beam_parts;
}

/* What is seen around a dot. */
struct BeamWindow {
    cv::Mat surface;   /* CV_64F, beam_side: how light the sheet is */
    cv::Mat rise, lit; /* CV_32F, dot_side_px: with the laser less without it; with it */
    cv::Mat noise;     /* CV_64F, dot_side_px: variance of `rise` by the sensor */
    double lens_px;    /* standard deviation of the lens' blur */
};

struct Beam {
    cv::Point2d px;  /* from the window's middle */
    double width_px; /* standard deviation of the beam on the surface */
    double sigma_px; /* standard deviation of the position, one component */
};

/* How far a beam's light is off its middle by speckle alone, one component. */
double beam_speckle_px(double width_px);

/* `beam` has a start for position and width. False: no beam fits. */
bool beam_fit(const BeamWindow &window, Beam &beam);

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
