/* cal_sightings - dots on the board, as points in space: each picture with the laser on gives the points where rays of
 * the projector cross a plane that is known. And which dots of one picture are neighbours: whole numbers of steps from a
 * dot somewhere in the middle.
 * In tangents X/Z, Y/Z a pattern that is projected on a plane is nearly regular at any distance: its steps are found as
 * the differences that most neighbours share, and it is grown from dot to dot, each predicted from those around it.
 * Columns run to the right and rows downwards: the pattern may be rotated by up to 40 degrees.
 */
#ifndef CAL_SIGHTINGS_HPP
#define CAL_SIGHTINGS_HPP

#include "cal_camera.hpp"
#include "cal_pictures.hpp"

namespace cal
{
constexpr int pattern_side = 19, slot_count = pattern_side * pattern_side;
constexpr int no_slot = -1;
/* Standard deviation of a position, where nothing better is known. */
constexpr double usual_sigma_px = 0.1;

struct Sighting {
    cv::Point2d px, tangent;          /* as in the frame; undistorted X/Z, Y/Z */
    double wide_px = 0.0;             /* standard deviation of the dot's light */
    double sigma_px = usual_sigma_px; /* of the position, one component; against other sightings */
    cv::Vec3d position_mm;            /* camera frame */
    cv::Vec2i step;                   /* column, row in this picture's own lattice */
    bool in_lattice = false;
    int slot = no_slot;      /* row * 19 + column */
    cv::Point2d residual_px; /* seen minus expected, undistorted pixels; set by rays_solve */
    bool fits = true;
};

/* A picture with the laser on. */
struct Lit {
    std::string file, dark_file; /* dark_file: the laser-off picture; empty: there is none */
    View view;                   /* the board's pose in it */
    std::vector<Sighting> sightings;
    std::string refused; /* why nothing of it is used; empty: it is used */
    bool sparse = false; /* it is refused for having too few dots in its lattice, no more */
};

/* Where a sighting at a pixel is: sets px, tangent and position. */
void sighting_set(const Camera &camera, const View &view, cv::Point2d px, Sighting &sighting);

/* The board's pose in `lit.view` must be known. */
void sightings_find(const Board &board, const Camera &camera, const cv::Mat &grey, const cv::Mat &dark, Lit &lit);

/* Sets step and in_lattice; returns how many dots are in the lattice. Those that are not are left for nothing. */
int lattice_grow(std::vector<Sighting> &sightings);
} // namespace cal

#endif
