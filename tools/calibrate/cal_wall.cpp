#include "cal_wall.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "cal_rig.hpp"
#include "cal_spot.hpp"

namespace cal
{
/* So many pictures must show a pixel without the board; so far around the sheet is what holds it. */
static constexpr size_t shown_min = 5, shown_max = 255;
static constexpr int around_sheet_px = 24;
/* A dot is so near to its line, and so far from all others, somewhere in this range. */
static constexpr double on_line_px = 1.0, alone_px = 4.0, near_mm = 800.0, far_mm = 8000.0;
/* A wall has so many dots, and this fraction of those that are seen. */
static constexpr size_t wall_min = 60;
static constexpr double wall_fraction = 0.5;
/* A dot is on the wall up to so many times the usual distance from it. */
static constexpr double on_wall_sigmas = 3.0;
/* Up to this much more than its dots' own noise a wall is even: the rays' noise is not known better. */
static constexpr double even_scale = 1.25;
/* What is so many times less even than its dots are known is no wall. */
static constexpr double uneven_max = 3.0;
static constexpr int rounds = 30;
static constexpr size_t trimmed_fraction = 6; /* one in so many at each end */
/* A dot's position is found again in the pictures that show its whole window: a mean over others at each pixel biases it.
 * A dot is there where it is as high as usual, within this fraction, if it is so much higher than its noise. */
static constexpr double shown_fraction = 0.5, peak_noises = 3.0;
/* What else is in a dot's window may be so many times the usual. */
static constexpr double residual_max_times = 2.0;
static constexpr double position_max_px = 1.5;
static constexpr double noise_of_position =
    0.8; /* px, of a Gaussian whose peak is as high as the noise: sqrt(2 / pi) */

static double median_of(std::vector<double> values)
{
    auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/* Where the sheet and what holds it are not. */
static cv::Mat beside_sheet(const Board &board, const Camera &camera, const View &view)
{
    cv::Point2d first = board.sheet_origin_mm();
    std::vector<cv::Point3d> outline;
    std::vector<cv::Point2d> seen;
    std::vector<cv::Point> hull;
    for (int i = 0; i < 4; i++)
        outline.emplace_back(first.x + (i == 1 || i == 2 ? sheet_width_mm : 0.0),
                             first.y + (i >= 2 ? sheet_height_mm : 0.0), 0.0);
    cv::projectPoints(outline, view.rvec, view.shift, camera.matrix, camera.distortion, seen);
    for (const cv::Point2d &px : seen)
        hull.emplace_back(cvRound(px.x), cvRound(px.y));
    cv::Mat mask(camera.size, CV_8U, cv::Scalar(255));
    cv::fillConvexPoly(mask, hull, cv::Scalar(0));
    cv::polylines(mask, hull, true, cv::Scalar(0), 2 * around_sheet_px);
    return mask;
}

/* The mean of what is left without the largest and the smallest: somebody may have walked there. */
static float trimmed_mean(std::vector<float> &values)
{
    size_t trimmed = (values.size() + trimmed_fraction - 1) / trimmed_fraction;
    std::sort(values.begin(), values.end());
    float sum = 0.0f;
    for (size_t i = trimmed; i < values.size() - trimmed; i++)
        sum += values[i];
    return sum / static_cast<float>(values.size() - 2 * trimmed);
}

/* What the laser adds behind the board, over all pairs; CV_32F. `counts` (CV_8U): over how many, 0 where too few. */
static cv::Mat still_rise(const std::vector<cv::Mat> &rises, const std::vector<cv::Mat> &masks, cv::Mat &counts)
{
    cv::Size size = rises.front().size();
    cv::Mat still = cv::Mat::zeros(size, CV_32F);
    counts = cv::Mat::zeros(size, CV_8U);
    std::vector<float> values;
    for (int v = 0; v < size.height; v++) {
        for (int u = 0; u < size.width; u++) {
            values.clear();
            for (size_t i = 0; i < rises.size() && values.size() < shown_max; i++) {
                if (masks[i].at<uchar>(v, u) != 0)
                    values.push_back(rises[i].at<float>(v, u));
            }
            if (values.size() < shown_min)
                continue;
            counts.at<uchar>(v, u) = static_cast<uchar>(values.size());
            still.at<float>(v, u) = trimmed_mean(values);
        }
    }
    return still;
}

/* A laser-on/laser-off pair and where the board is not in them. */
struct LitDark {
    const cv::Mat *lit, *dark; /* CV_32F */
    cv::Mat mask;
};

/* A Gaussian as `dot` is one, over the window around `middle`; CV_64F, its mean is 0. */
static cv::Mat bell_of(const Dot &dot, cv::Point middle)
{
    cv::Mat bell(dot_side_px, dot_side_px, CV_64F);
    for (int row = 0; row < dot_side_px; row++) {
        for (int column = 0; column < dot_side_px; column++) {
            double du = middle.x + column - dot_reach_px - dot.px.x, dv = middle.y + row - dot_reach_px - dot.px.y;
            bell.at<double>(row, column) = std::exp(-0.5 * (du * du + dv * dv) / (dot.sigma_px * dot.sigma_px));
        }
    }
    return bell - cv::mean(bell)[0];
}

static cv::Mat window_of(const cv::Mat &picture, cv::Rect window)
{
    cv::Mat part;
    picture(window).convertTo(part, CV_64F);
    return part;
}

/* A window of one pair, how high the dot in it is, and what is left without the dot. */
struct Shown {
    cv::Mat lit, dark;
    double peak_grey = 0.0, residual_grey = 0.0;
};

static Shown show(const LitDark &dark_of, cv::Rect window, const cv::Mat &bell)
{
    Shown shown;
    shown.lit = window_of(*dark_of.lit, window);
    shown.dark = window_of(*dark_of.dark, window);
    cv::Mat rise = shown.lit - shown.dark;
    shown.peak_grey = rise.dot(bell) / bell.dot(bell);
    cv::Scalar mean, spread;
    cv::meanStdDev(rise - shown.peak_grey * bell, mean, spread);
    shown.residual_grey = spread[0];
    return shown;
}

static double upper_quartile(const std::vector<Shown> &all)
{
    std::vector<double> peaks;
    for (const Shown &shown : all)
        peaks.push_back(shown.peak_grey);
    auto at = peaks.begin() + static_cast<std::ptrdiff_t>(peaks.size() - 1 - peaks.size() / 4);
    std::nth_element(peaks.begin(), at, peaks.end());
    return *at;
}

/* All of a window's pictures, as means. `lit` are those with the dot; without it, laser-on pictures are averaged into `dark` too. */
struct Means {
    cv::Mat lit = cv::Mat::zeros(dot_side_px, dot_side_px, CV_64F), dark = lit.clone(), lightest = lit.clone();
    int lit_count = 0, dark_count = 0;
};

/* Pictures in which something else is are left out: they would bend the means. */
static Means means_of(const std::vector<Shown> &all, double peak_noise_grey)
{
    std::vector<double> rests;
    for (const Shown &shown : all)
        rests.push_back(shown.residual_grey);
    double usual = upper_quartile(all), residual_max = residual_max_times * median_of(rests);
    bool is_clear = shown_fraction * usual > peak_noises * peak_noise_grey;
    Means means;
    for (const Shown &shown : all) {
        double fraction = shown.peak_grey / usual;
        if (shown.residual_grey > residual_max || (is_clear && fraction > 2.0 - shown_fraction))
            continue;
        means.dark += shown.dark;
        means.dark_count++;
        bool there = !is_clear || fraction > shown_fraction;
        (there ? means.lit : means.dark) += shown.lit;
        cv::max(means.lightest, shown.lit, means.lightest);
        (there ? means.lit_count : means.dark_count)++;
    }
    means.lit /= std::max(1, means.lit_count);
    means.dark /= std::max(1, means.dark_count);
    return means;
}

/* What is left of a window without its level and its slopes. */
static cv::Mat texture_of(const cv::Mat &window)
{
    cv::Mat texture = window - cv::mean(window)[0], across(window.size(), CV_64F);
    for (int i = 0; i < dot_side_px; i++)
        across.col(i).setTo(i - dot_reach_px);
    for (const cv::Mat &slope : {across, cv::Mat(across.t())})
        texture -= slope * (texture.dot(slope) / slope.dot(slope));
    return texture;
}

/* A dot's position again, from the pictures that show all of its window, and how well it is known. False: too few do. */
static bool refine_dot(const std::vector<LitDark> &pairs, const Noise &noise, double lens_px, const Dot &dot,
                       Sighting &sighting)
{
    cv::Point middle(cvRound(dot.px.x), cvRound(dot.px.y));
    cv::Rect window = dot_window(middle);
    cv::Mat bell = bell_of(dot, middle);
    std::vector<Shown> all;
    for (const LitDark &dark_of : pairs) {
        if (cv::countNonZero(dark_of.mask(window)) == dot_side_px * dot_side_px)
            all.push_back(show(dark_of, window, bell));
    }
    if (all.size() < shown_min)
        return false;
    double variance = noise.at(cv::mean(all.front().dark)[0]);
    Means means = means_of(all, std::sqrt(2.0 * variance / bell.dot(bell)));
    if (means.lit_count < static_cast<int>(shown_min))
        return false;
    double dark_variance = variance / means.dark_count;
    variance = noise.at(cv::mean(means.lit)[0]) / means.lit_count;
    cv::Mat texture = texture_of(means.dark), rise, lightest;
    means.lightest.convertTo(lightest, CV_32F);
    double seen = texture.dot(texture) / (dot_side_px * dot_side_px - 3.0);
    double fraction = std::max(0.0, 1.0 - dark_variance / seen); /* of the texture that is no noise */
    cv::Mat(means.lit - means.dark + texture * (1.0 - fraction)).convertTo(rise, CV_32F);
    variance += fraction * dark_variance;
    Dot better;
    if (!dot_fit(rise, lightest, better) || cv::norm(better.px) > position_max_px)
        return false;
    sighting.wide_px = better.sigma_px;
    sighting.px = better.px + cv::Point2d(middle);
    double beam_px = std::sqrt(std::max(better.sigma_px * better.sigma_px - lens_px * lens_px, 0.0));
    sighting.sigma_px =
        std::hypot(noise_of_position * std::sqrt(variance) / better.peak_grey, beam_speckle_px(beam_px));
    return true;
}

Lit wall_find(const Board &board, const Camera &camera, const std::vector<Picture> &pictures,
              const std::vector<int> &dark_of, const std::vector<Lit> &lit, const Noise &noise, double lens_px)
{
    std::vector<cv::Mat> rises, masks;
    std::vector<LitDark> pairs;
    cv::Mat counts;
    size_t next = 0;
    Lit wall;
    wall.file = "behind the board";
    wall.dark_file = "all pictures";
    for (size_t i = 0; i < pictures.size(); i++) {
        if (!pictures[i].laser)
            continue;
        const Lit &here = lit[next++];
        if (!here.view.good() || dark_of[i] < 0)
            continue;
        const cv::Mat &grey = pictures[i].grey, &dark = pictures[static_cast<size_t>(dark_of[i])].grey;
        rises.push_back(grey - dark);
        masks.push_back(beside_sheet(board, camera, here.view));
        pairs.push_back({&grey, &dark, masks.back()});
    }
    if (rises.size() < shown_min)
        return wall;
    cv::Mat still = still_rise(rises, masks, counts);
    for (const Dot &dot : dots_find(still, {}, counts > 0)) {
        Sighting sighting;
        if (!refine_dot(pairs, noise, lens_px, dot, sighting))
            continue;
        sighting.tangent = camera.tangents({sighting.px}).front();
        wall.sightings.push_back(sighting);
    }
    return wall;
}

/* A dot on a line: nearness 1/Z, and how that is known. */
struct Position {
    Sighting *sighting;
    double nearness, sigma; /* 1/mm */
    double move_px;         /* for a change of the nearness by 1/mm */
};

/* Labels the dots; those that might be two, or none, get no slot. */
static std::vector<Position> label(const Camera &camera, const Projector &projector, Lit &wall)
{
    auto lines = epipolar_lines(camera, projector.origin_mm, projector.rays);
    std::vector<Position> positions;
    for (Sighting &sighting : wall.sightings) {
        cv::Point2d px = camera.undistorted_px(sighting.tangent);
        double best_px = 1e9, next_px = 1e9;
        Position position{&sighting, 0.0, 0.0, 0.0};
        sighting.slot = no_slot;
        for (size_t slot = 0; slot < slot_count; slot++) {
            cv::Point2d offset = px - lines[slot].infinity_px, move = lines[slot].move_px_mm;
            double nearness = std::clamp(offset.dot(move) / move.dot(move), 1.0 / far_mm, 1.0 / near_mm);
            double off_px = cv::norm(offset - move * nearness);
            if (off_px < best_px) {
                next_px = best_px;
                best_px = off_px;
                double ray_px = projector.sigma_deg[slot] * CV_PI / 180.0 * camera.focal_px();
                position.nearness = offset.dot(move) / move.dot(move);
                position.move_px = cv::norm(move);
                position.sigma = std::hypot(sighting.sigma_px, ray_px) / position.move_px;
                sighting.slot = projector.seen[slot] > 0 ? static_cast<int>(slot) : no_slot;
            } else {
                next_px = std::min(next_px, off_px);
            }
        }
        if (best_px > on_line_px || next_px < alone_px)
            sighting.slot = no_slot;
        if (sighting.slot != no_slot)
            positions.push_back(position);
    }
    return positions;
}

/* A plane m . X = 1 has nearness m . (tangent, 1). From a start that holds for most, those on it. */
static cv::Vec3d lay_plane(const std::vector<Position> &positions, double &scale)
{
    cv::Vec3d plane(0.0, 0.0, 0.0);
    std::vector<double> sizes;
    for (const Position &position : positions)
        sizes.push_back(position.nearness);
    plane[2] = median_of(sizes);
    for (int round = 0; round < rounds; round++) {
        sizes.clear();
        for (const Position &position : positions)
            sizes.push_back(std::abs(position.nearness - plane.dot(cv::Vec3d(position.sighting->tangent.x,
                                                                             position.sighting->tangent.y, 1.0))) /
                            position.sigma);
        scale = std::max(1.4826 * median_of(sizes), 1e-3);
        cv::Matx33d normal = cv::Matx33d::zeros();
        cv::Vec3d right(0.0, 0.0, 0.0);
        for (size_t i = 0; i < positions.size(); i++) {
            double size = sizes[i] / (on_wall_sigmas * scale);
            if (size >= 1.0)
                continue;
            double weight = (1.0 - size * size) * (1.0 - size * size) / (positions[i].sigma * positions[i].sigma);
            cv::Vec3d terms(positions[i].sighting->tangent.x, positions[i].sighting->tangent.y, 1.0);
            normal += weight * (terms * terms.t());
            right += weight * positions[i].nearness * terms;
        }
        plane = normal.inv(cv::DECOMP_SVD) * right;
    }
    return plane;
}

bool wall_lay(const Camera &camera, const Projector &projector, Lit &wall)
{
    std::vector<Position> positions = label(camera, projector, wall);
    if (positions.size() < wall_min)
        return false;
    double scale;
    cv::Vec3d plane = lay_plane(positions, scale);
    if (scale > uneven_max)
        return false;
    double height_mm = 1.0 / cv::norm(plane);
    cv::Vec3d normal = plane * height_mm, across = cv::normalize(normal.cross(cv::Vec3d(0.0, 1.0, 0.0)));
    cv::Vec3d down = normal.cross(across);
    cv::Matx33d rotation(across[0], down[0], normal[0], across[1], down[1], normal[1], across[2], down[2], normal[2]);
    cv::Rodrigues(rotation, wall.view.rvec);
    wall.view.shift = normal * height_mm;
    size_t on_wall = 0;
    for (Position &position : positions) {
        Sighting &sighting = *position.sighting;
        double off = position.nearness - plane.dot(cv::Vec3d(sighting.tangent.x, sighting.tangent.y, 1.0));
        if (std::abs(off) > on_wall_sigmas * scale * position.sigma) {
            sighting.slot = no_slot;
            continue;
        }
        sighting_set(camera, wall.view, sighting.px, sighting);
        sighting.sigma_px *= scale > even_scale ? scale : 1.0; /* an uneven wall is worth less */
        on_wall++;
    }
    return on_wall >= wall_min && static_cast<double>(on_wall) >= wall_fraction * static_cast<double>(positions.size());
}
} // namespace cal
