#include "cal_nominal.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>

#include "cal_error.hpp"

namespace cal
{
static constexpr int steps = 12;
static constexpr double small = 1e-6;
static constexpr int middle = pattern_side / 2;
static constexpr int well_seen = 4;
static constexpr size_t well_seen_min = 40;
static constexpr double min_sigma = 1e-5;

static double square(double value)
{
    return value * value;
}

/* Rotation of the grating's frame (Rodrigues), then what a column and a row add to x and y. */
using Lattice = cv::Vec<double, 7>;

static cv::Vec3d ray_of(const Lattice &lattice, int slot)
{
    double column = slot % pattern_side - middle, row = slot / pattern_side - middle;
    double x = lattice[3] * column + lattice[4] * row, y = lattice[5] * column + lattice[6] * row;
    cv::Matx33d rotation;
    cv::Rodrigues(cv::Vec3d(lattice[0], lattice[1], lattice[2]), rotation);
    return rotation * cv::Vec3d(x, y, std::sqrt(std::max(0.0, 1.0 - x * x - y * y)));
}

/* A start: where the seen rays' middle is, and their mean steps. */
static Lattice start(const Projector &projector)
{
    cv::Matx33d normal = cv::Matx33d::zeros();
    cv::Matx<double, 3, 2> right = cv::Matx<double, 3, 2>::zeros();
    for (int slot = 0; slot < slot_count; slot++) {
        const cv::Vec3d &ray = projector.rays[static_cast<size_t>(slot)];
        if (projector.seen[static_cast<size_t>(slot)] == 0)
            continue;
        cv::Matx31d terms(1.0, slot % pattern_side - middle, slot / pattern_side - middle);
        normal += terms * terms.t();
        right += terms * cv::Matx12d(ray[0], ray[1]);
    }
    cv::Matx<double, 3, 2> found = normal.inv() * right;
    return {-std::asin(found(0, 1)), std::asin(found(0, 0)), 0.0, found(1, 0), found(2, 0), found(1, 1), found(2, 1)};
}

/* The rotation about the grating's own axis is in its steps already: 6 of the 7 are free. */
static Lattice improved(const Projector &projector, const Lattice &lattice)
{
    static constexpr int free_index[6] = {0, 1, 3, 4, 5, 6};
    cv::Matx<double, 6, 6> normal = cv::Matx<double, 6, 6>::zeros();
    cv::Matx<double, 6, 1> right = cv::Matx<double, 6, 1>::zeros();
    for (int slot = 0; slot < slot_count; slot++) {
        if (projector.seen[static_cast<size_t>(slot)] == 0)
            continue;
        cv::Vec3d expected = ray_of(lattice, slot), miss = projector.rays[static_cast<size_t>(slot)] - expected;
        cv::Matx<double, 3, 6> slope;
        for (int i = 0; i < 6; i++) {
            Lattice moved = lattice;
            moved[free_index[i]] += small;
            cv::Vec3d change = (ray_of(moved, slot) - expected) * (1.0 / small);
            for (int axis = 0; axis < 3; axis++)
                slope(axis, i) = change[axis];
        }
        normal += slope.t() * slope;
        right += slope.t() * miss;
    }
    cv::Matx<double, 6, 1> change = normal.inv(cv::DECOMP_SVD) * right;
    Lattice better = lattice;
    for (int i = 0; i < 6; i++)
        better[free_index[i]] += change(i);
    return better;
}

/* How far rays that are known well are from their nominal ones: the variance of one component, minus that of the
 * measurement. */
static double ray_variance(const Projector &projector, const Lattice &lattice)
{
    std::vector<double> squares;
    double noise = 0.0;
    for (size_t slot = 0; slot < slot_count; slot++) {
        if (projector.seen[slot] < well_seen)
            continue;
        cv::Vec3d miss = projector.rays[slot] - ray_of(lattice, static_cast<int>(slot));
        squares.push_back(miss.dot(miss));
        noise += square(projector.sigma_deg[slot] * CV_PI / 180.0);
    }
    if (squares.size() < well_seen_min)
        return square(nominal_unknown);
    auto half = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
    std::nth_element(squares.begin(), half, squares.end());
    double total = *half / 1.386; /* an exponential distribution's median, two components */
    return std::max(total - noise / static_cast<double>(squares.size()), square(min_sigma));
}

std::string nominal_words(double sigma_deg)
{
    return sigma_deg > 0.0 ? text("%.3f degrees", sigma_deg) : "an angle that so few sightings do not determine";
}

Nominal nominal_fit(const Projector &projector)
{
    Nominal nominal;
    Lattice lattice = start(projector);
    for (int step = 0; step < steps; step++)
        lattice = improved(projector, lattice);
    for (size_t slot = 0; slot < slot_count; slot++) {
        cv::Vec3d ray = ray_of(lattice, static_cast<int>(slot));
        nominal.tangents[slot] = {ray[0] / ray[2], ray[1] / ray[2]};
    }
    nominal.sigma = std::sqrt(ray_variance(projector, lattice));
    nominal.pitch_deg = std::hypot(lattice[3], lattice[5]) * 180.0 / CV_PI;
    nominal.rotation_deg = std::atan2(lattice[5], lattice[3]) * 180.0 / CV_PI;
    return nominal;
}
} // namespace cal
