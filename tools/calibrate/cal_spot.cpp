#include "cal_spot.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "cal_refine.hpp"

namespace cal
{
static constexpr int rounds = 8, rounds_min = 2;
/* Variance of a beam's relative lightness in a patch as large as its own sigma squared: speckle whose contrast is a
 * third. Half or twice of it changes the dots' errors by 3 % at most; the rays' residuals set the scale. */
static constexpr double speckle = 0.1;
static constexpr double width_min_px = 0.35, width_max_px = 3.0, still_px = 1e-3, step_max_px = 0.5;
static constexpr size_t used_min = 40;
static constexpr double light_kept = 0.3; /* of the light, in one step */
static constexpr int pixels = dot_side_px * dot_side_px;
static constexpr double cell_px2 = 1.0 / (beam_parts * beam_parts);
/* Samples that are this many of the beam's widths from its middle have no speckle to speak of. */
static constexpr double grainy_widths = 3.0;

/* Light, its derivatives by the position and by the width's square, background. */
static constexpr int unknowns = 5;
using Unknowns = cv::Matx<double, unknowns, 1>;
using Curvature = cv::Matx<double, unknowns, unknowns>;

using Row = std::array<double, beam_side>;

/* A normal distribution's density at the fine samples. */
static Row bell(double middle_px, double sigma_px)
{
    Row row;
    for (int i = 0; i < beam_side; i++) {
        double away = (beam_sample_px(i) - middle_px) / sigma_px;
        row[static_cast<size_t>(i)] = std::exp(-0.5 * away * away) / (sigma_px * std::sqrt(2.0 * CV_PI));
    }
    return row;
}

/* What each of the window's pixels gets of each fine sample, along one axis. */
static cv::Mat lens_of(double lens_px)
{
    cv::Mat lens(dot_side_px, beam_side, CV_64F);
    for (int i = 0; i < dot_side_px; i++) {
        Row row = bell(i - dot_reach_px, lens_px);
        std::copy(row.begin(), row.end(), lens.ptr<double>(i));
    }
    return lens;
}

/* The beam on the surface, before the lens, and its derivatives. */
struct LitSurface {
    cv::Mat light, by_u, by_v, by_square;
};

static LitSurface light_up(const cv::Mat &surface, const Beam &beam)
{
    Row across = bell(beam.px.x, beam.width_px), down = bell(beam.px.y, beam.width_px);
    double square = beam.width_px * beam.width_px;
    LitSurface lit{cv::Mat(surface.size(), CV_64F), cv::Mat(surface.size(), CV_64F), cv::Mat(surface.size(), CV_64F),
                   cv::Mat(surface.size(), CV_64F)};
    for (int row = 0; row < beam_side; row++) {
        double dv = beam_sample_px(row) - beam.px.y;
        for (int column = 0; column < beam_side; column++) {
            double du = beam_sample_px(column) - beam.px.x;
            double light = cell_px2 * across[static_cast<size_t>(column)] * down[static_cast<size_t>(row)] *
                           surface.at<double>(row, column);
            lit.light.at<double>(row, column) = light;
            lit.by_u.at<double>(row, column) = light * du / square;
            lit.by_v.at<double>(row, column) = light * dv / square;
            lit.by_square.at<double>(row, column) =
                light * ((du * du + dv * dv) / (2.0 * square * square) - 1.0 / square);
        }
    }
    return lit;
}

/* Covariance of the window's pixels by speckle, for a beam `bright` times `light`: surface speckle seen through the
 * lens. The lens is the same along both axes, so first columns are summed, then rows. */
static cv::Mat speckle_covariance(const cv::Mat &light, const cv::Mat &lens, const Beam &beam, double bright)
{
    constexpr int side = dot_side_px, pairs = side * side;
    double reach = grainy_widths * beam.width_px,
           scale = speckle * bright * bright * beam.width_px * beam.width_px / cell_px2;
    auto first_of = [&](double middle) {
        return std::max(0, static_cast<int>((middle - reach - beam_sample_px(0)) * beam_parts));
    };
    auto end_of = [&](double middle) {
        return std::min(beam_side, static_cast<int>((middle + reach - beam_sample_px(0)) * beam_parts) + 2);
    };
    cv::Mat columns = cv::Mat::zeros(beam_side, pairs, CV_64F), covariance = cv::Mat::zeros(pixels, pixels, CV_64F);
    int top = first_of(beam.px.y), bottom = end_of(beam.px.y);
    for (int row = top; row < bottom; row++) {
        double *sums = columns.ptr<double>(row);
        for (int column = first_of(beam.px.x); column < end_of(beam.px.x); column++) {
            double square = scale * light.at<double>(row, column) * light.at<double>(row, column);
            for (int i = 0; i < side; i++) {
                double part = square * lens.at<double>(i, column);
                for (int k = 0; k < side; k++)
                    sums[i * side + k] += part * lens.at<double>(k, column);
            }
        }
    }
    for (int i = 0; i < side; i++) {
        for (int k = 0; k < side; k++) {
            std::array<double, pairs> sums{};
            for (int row = top; row < bottom; row++) {
                double part = lens.at<double>(i, row) * lens.at<double>(k, row);
                const double *from = columns.ptr<double>(row);
                for (size_t n = 0; n < pairs; n++)
                    sums[n] += part * from[n];
            }
            for (int n = 0; n < pairs; n++)
                covariance.at<double>(i * side + n / side, k * side + n % side) = sums[static_cast<size_t>(n)];
        }
    }
    return covariance;
}

/* In place: the lower triangle becomes the factor. False: not positive. */
static bool factor(cv::Mat &matrix)
{
    for (int i = 0; i < matrix.rows; i++) {
        double *row = matrix.ptr<double>(i);
        for (int k = 0; k <= i; k++) {
            const double *other = matrix.ptr<double>(k);
            double sum = row[k];
            for (int n = 0; n < k; n++)
                sum -= row[n] * other[n];
            if (k < i) {
                row[k] = sum / other[k];
            } else {
                if (!(sum > 0.0))
                    return false;
                row[i] = std::sqrt(sum);
            }
        }
    }
    return true;
}

/* Whitens each column: variance 1, no correlation. */
static void whiten(const cv::Mat &lower, cv::Mat &columns)
{
    for (int i = 0; i < columns.rows; i++) {
        const double *row = lower.ptr<double>(i);
        double *here = columns.ptr<double>(i);
        for (int n = 0; n < i; n++) {
            const double *other = columns.ptr<double>(n);
            for (int k = 0; k < columns.cols; k++)
                here[k] -= row[n] * other[k];
        }
        for (int k = 0; k < columns.cols; k++)
            here[k] /= row[i];
    }
}

/* What is free besides the beam, and what does not change while it is fitted. */
struct Fit {
    std::vector<int> used; /* pixels that are not at the sensor's limit */
    cv::Mat lens;
    double light, ground;
};

/* Light and ground that fit best for a drawing, all pixels alike: what a fit begins with. */
static bool start_light(const cv::Mat &drawn, const cv::Mat &rise, Fit &fit)
{
    cv::Matx22d normal = cv::Matx22d::zeros();
    cv::Vec2d right(0.0, 0.0), found;
    for (int pixel : fit.used) {
        int row = pixel / dot_side_px, column = pixel % dot_side_px;
        cv::Vec2d terms(drawn.at<double>(row, column), 1.0);
        normal += terms * terms.t();
        right += terms * static_cast<double>(rise.at<float>(row, column));
    }
    bool solved = cv::solve(normal, right, found, cv::DECOMP_CHOLESKY);
    fit.light = found[0];
    fit.ground = found[1];
    return solved && fit.light > 0.0;
}

/* Each pixel's derivatives and residual, whitened. */
static bool whitened(const BeamWindow &window, const Fit &fit, const Beam &beam, const LitSurface &lit,
                     const cv::Mat &drawn, cv::Mat &columns)
{
    int count = static_cast<int>(fit.used.size());
    cv::Mat by_u = fit.lens * lit.by_u * fit.lens.t(), by_v = fit.lens * lit.by_v * fit.lens.t();
    cv::Mat by_square = fit.lens * lit.by_square * fit.lens.t();
    cv::Mat speckle_var = speckle_covariance(lit.light, fit.lens, beam, fit.light), covariance(count, count, CV_64F);
    columns.create(count, unknowns + 1, CV_64F);
    for (int i = 0; i < count; i++) {
        int pixel = fit.used[static_cast<size_t>(i)], row = pixel / dot_side_px, column = pixel % dot_side_px;
        for (int k = 0; k <= i; k++)
            covariance.at<double>(i, k) = speckle_var.at<double>(pixel, fit.used[static_cast<size_t>(k)]);
        covariance.at<double>(i, i) += window.noise.at<double>(row, column);
        double *terms = columns.ptr<double>(i);
        terms[0] = drawn.at<double>(row, column);
        terms[1] = fit.light * by_u.at<double>(row, column);
        terms[2] = fit.light * by_v.at<double>(row, column);
        terms[3] = fit.light * by_square.at<double>(row, column);
        terms[4] = 1.0;
        terms[unknowns] = static_cast<double>(window.rise.at<float>(row, column)) - fit.light * terms[0] - fit.ground;
    }
    if (!factor(covariance))
        return false;
    whiten(covariance, columns);
    return true;
}

/* One step of least squares. False: the pixels do not determine all unknowns. */
static bool improve(const cv::Mat &columns, Fit &fit, Beam &beam, double &moved_px)
{
    Curvature normal = Curvature::zeros();
    Unknowns right = Unknowns::zeros();
    for (int i = 0; i < columns.rows; i++) {
        const double *all = columns.ptr<double>(i);
        Unknowns terms(all);
        normal += terms * terms.t();
        right += terms * all[unknowns];
    }
    bool solved = false;
    Curvature inverse = normal.inv(cv::DECOMP_CHOLESKY, &solved);
    if (!solved)
        return false;
    Unknowns change = inverse * right;
    cv::Point2d move(change(1), change(2));
    double square = beam.width_px * beam.width_px;
    moved_px = cv::norm(move);
    beam.px += move * std::min(1.0, step_max_px / std::max(moved_px, 1e-9));
    square += std::clamp(change(3), -0.5 * square, square);
    beam.width_px = std::clamp(std::sqrt(square), width_min_px, width_max_px);
    fit.light = std::max(fit.light + change(0), light_kept * fit.light);
    fit.ground += change(4);
    beam.sigma_px = std::sqrt(0.5 * (inverse(1, 1) + inverse(2, 2)));
    return true;
}

double beam_speckle_px(double width_px)
{
    return std::sqrt(speckle / (8.0 * CV_PI)) * std::max(width_px, width_min_px);
}

bool beam_fit(const BeamWindow &window, Beam &beam)
{
    Fit fit{{}, lens_of(window.lens_px), 0.0, 0.0};
    for (int pixel = 0; pixel < pixels; pixel++) {
        if (static_cast<double>(window.lit.at<float>(pixel / dot_side_px, pixel % dot_side_px)) < saturated_grey)
            fit.used.push_back(pixel);
    }
    if (fit.used.size() < used_min)
        return false;
    beam.width_px = std::clamp(beam.width_px, width_min_px, width_max_px);
    for (int round = 0; round < rounds; round++) {
        LitSurface lit = light_up(window.surface, beam);
        cv::Mat drawn = fit.lens * lit.light * fit.lens.t(), columns;
        double moved_px;
        if ((round == 0 && !start_light(drawn, window.rise, fit)) ||
            !whitened(window, fit, beam, lit, drawn, columns) || !improve(columns, fit, beam, moved_px))
            return false;
        if (round >= rounds_min && moved_px < still_px)
            break;
    }
    return true;
}

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
