#include "cal_spot.hpp"

#include <algorithm>

#include "cal_beam.hpp"
#include "cal_draw.hpp"

namespace cal
{
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
 * all as far off do not determine it: but the lens does not make more than all of their width. */
double spot_lens_px(const std::vector<Lit> &pictures)
{
    std::vector<cv::Vec2d> points;
    std::vector<double> squares;
    for (const Lit &lit : pictures) {
        for (const Sighting &sighting : lit.sightings) {
            squares.push_back(sighting.wide_px * sighting.wide_px);
            points.emplace_back(1e6 / (sighting.position_mm[2] * sighting.position_mm[2]), squares.back());
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
    double max = median_of(squares) - beam_min_px * beam_min_px;
    return std::sqrt(std::max(std::min(line[0], max), lens_min_px * lens_min_px));
}

/* How light the sheet is around a pixel, CV_64F. */
static cv::Mat draw_surface(const Spots &spots, const cv::Matx33d &map, cv::Point middle_px)
{
    cv::Mat surface(beam_side, beam_side, CV_64F);
    Sight sight = draw_sight(spots.tangents, middle_px);
    for (int row = 0; row < beam_side; row++) {
        for (int column = 0; column < beam_side; column++) {
            double white = draw_sample(spots.print, map * sight.beside(beam_sample_px(column), beam_sample_px(row)));
            surface.at<double>(row, column) = spots.dark_fraction + (1.0 - spots.dark_fraction) * white;
        }
    }
    return surface;
}

void spots_refine(const Spots &spots, const cv::Mat &grey, const cv::Mat &dark, Lit &lit)
{
    cv::Mat rise = grey - dark;
    cv::Matx33d map = draw_map(spots.board, lit.view.rvec, lit.view.shift);
    for (Sighting &sighting : lit.sightings) {
        cv::Point middle(cvRound(sighting.px.x), cvRound(sighting.px.y));
        cv::Rect window = dot_window(middle);
        if ((window & cv::Rect({0, 0}, grey.size())) != window)
            continue;
        double square = sighting.wide_px * sighting.wide_px - spots.lens_px * spots.lens_px;
        cv::Point2d start = sighting.px - cv::Point2d(middle);
        Beam beam{start, std::sqrt(std::max(square, 0.0)), 0.0};
        cv::Mat noise;
        cv::Mat(grey(window) + dark(window)).convertTo(noise, CV_64F, spots.noise.by_light, 2.0 * spots.noise.dark);
        BeamWindow seen{draw_surface(spots, map, middle), rise(window), grey(window), noise, spots.lens_px};
        if (beam_fit(seen, beam) && cv::norm(beam.px - start) <= moved_max_px) {
            sighting_set(spots.camera, lit.view, cv::Point2d(middle) + beam.px, sighting);
            sighting.sigma_px = beam.sigma_px;
        }
    }
}
} // namespace cal
