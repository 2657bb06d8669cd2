#include "cal_spot.hpp"

#include <algorithm>
#include <array>

#include "cal_dots.hpp"
#include "cal_draw.hpp"

namespace cal
{
/* The surface is drawn this fine, and as far around the window as the lens' blur reaches. */
static constexpr int parts = 3, around_px = 3;
static constexpr int fine_side = parts * (dot_side_px + 2 * around_px);
static constexpr int rounds = 4;
static constexpr double lens_min_px = 0.4, beam_min_px = 0.35, moved_max_px = 1.0;
static constexpr int line_rounds = 10;
static constexpr double huber_sigmas = 1.5;

static double median_of(std::vector<double> values)
{
    auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/* A straight line through squares of widths over squares of nearness, with Huber's weights; where it begins. Dots that are
 * all as far off do not tell it: but the lens does not make more than all of their width. */
double spot_lens_px(const std::vector<Lit> &pictures)
{
    std::vector<cv::Vec2d> points;
    std::vector<double> squares;
    for (const Lit &lit : pictures) {
        for (const Sighting &sighting : lit.sightings) {
            squares.push_back(sighting.wide_px * sighting.wide_px);
            points.emplace_back(1e6 / (sighting.place_mm[2] * sighting.place_mm[2]), squares.back());
        }
    }
    if (points.empty())
        return lens_min_px;
    cv::Vec2d line(0.0, 0.0);
    double limit = 1e9;
    for (int round = 0; round < line_rounds; round++) {
        cv::Matx22d normal = cv::Matx22d::zeros();
        cv::Vec2d right(0.0, 0.0);
        std::vector<double> sizes;
        for (const cv::Vec2d &point : points) {
            double miss = std::abs(point[1] - line[0] - line[1] * point[0]);
            double weight = round == 0 || miss <= limit ? 1.0 : limit / miss;
            cv::Vec2d terms(1.0, point[0]);
            normal += weight * (terms * terms.t());
            right += terms * (weight * point[1]);
        }
        line = normal.inv() * right;
        for (const cv::Vec2d &point : points)
            sizes.push_back(std::abs(point[1] - line[0] - line[1] * point[0]));
        limit = huber_sigmas * 1.4826 * median_of(sizes);
    }
    double most = median_of(squares) - beam_min_px * beam_min_px;
    return std::sqrt(std::max(std::min(line[0], most), lens_min_px * lens_min_px));
}

/* From the window's middle to the middle of a fine sample. */
static double fine_px(int sample)
{
    return (sample + 0.5) / parts - 0.5 * fine_side / parts;
}

/* How light the sheet is around a pixel, CV_64F. */
static cv::Mat draw_surface(const Spots &spots, const cv::Matx33d &map, cv::Point middle_px)
{
    cv::Mat surface(fine_side, fine_side, CV_64F);
    Sight sight = draw_sight(spots.tangents, middle_px);
    for (int row = 0; row < fine_side; row++) {
        for (int column = 0; column < fine_side; column++) {
            double white = draw_sample(spots.print, map * sight.beside(fine_px(column), fine_px(row)));
            surface.at<double>(row, column) = spots.dark_share + (1.0 - spots.dark_share) * white;
        }
    }
    return surface;
}

/* A bell curve's values at the fine samples. */
static cv::Mat bell(double middle_px, double sigma_px)
{
    cv::Mat values(fine_side, 1, CV_64F);
    for (int i = 0; i < fine_side; i++) {
        double away = (fine_px(i) - middle_px) / sigma_px;
        values.at<double>(i) = std::exp(-0.5 * away * away);
    }
    return values;
}

/* What each of the window's pixels gets of each fine sample, along one axis. */
static cv::Mat lens_of(double lens_px)
{
    cv::Mat lens(dot_side_px, fine_side, CV_64F);
    for (int i = 0; i < dot_side_px; i++)
        cv::Mat(bell(i - dot_reach_px, lens_px).t()).copyTo(lens.row(i));
    return lens;
}

/* A beam on the surface through the lens, as bright as `like_grey` in its middle. */
static cv::Mat draw_dot(const cv::Mat &surface, const cv::Mat &lens, cv::Point2d beam_px, double beam_sigma_px,
                        double like_grey)
{
    cv::Mat beam = bell(beam_px.y, beam_sigma_px) * bell(beam_px.x, beam_sigma_px).t(), drawn;
    cv::Mat seen = lens * beam.mul(surface) * lens.t();
    double peak = seen.at<double>(dot_reach_px, dot_reach_px);
    seen.convertTo(drawn, CV_32F, like_grey / std::max(peak, 1e-9));
    return drawn;
}

/* False: no place is found that would look like the dot. */
static bool place_spot(const cv::Mat &surface, const cv::Mat &lens, double lens_px, const cv::Mat &rise,
                       const cv::Mat &lit, cv::Point2d &place_px)
{
    Dot seen, drawn;
    if (!dot_fit(rise, lit, seen))
        return false;
    cv::Point2d start = place_px;
    double square = seen.sigma_px * seen.sigma_px - lens_px * lens_px, least = beam_min_px * beam_min_px;
    for (int round = 0; round < rounds; round++) {
        square = std::max(square, least);
        if (!dot_fit(draw_dot(surface, lens, place_px, std::sqrt(square), seen.peak_grey), lit, drawn))
            return false;
        place_px += seen.px - drawn.px;
        square += seen.sigma_px * seen.sigma_px - drawn.sigma_px * drawn.sigma_px;
        if (cv::norm(place_px - start) > moved_max_px)
            return false;
    }
    return true;
}

void spots_place(const Spots &spots, const cv::Mat &grey, const cv::Mat &dark, Lit &lit)
{
    cv::Mat rise = grey - dark, lens = lens_of(spots.lens_px);
    cv::Matx33d map = draw_map(spots.board, lit.view.turn, lit.view.shift);
    for (Sighting &sighting : lit.sightings) {
        cv::Point middle(cvRound(sighting.px.x), cvRound(sighting.px.y));
        cv::Rect window = dot_window(middle);
        cv::Point2d place = sighting.px - cv::Point2d(middle);
        if ((window & cv::Rect({0, 0}, grey.size())) == window &&
            place_spot(draw_surface(spots, map, middle), lens, spots.lens_px, rise(window), grey(window), place))
            sighting_place(spots.camera, lit.view, cv::Point2d(middle) + place, sighting);
    }
}
} // namespace cal
