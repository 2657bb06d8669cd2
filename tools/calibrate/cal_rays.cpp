#include "cal_rays.hpp"

#include <algorithm>

#include "cal_error.hpp"
#include "cal_nominal.hpp"

namespace cal
{
static constexpr int steps = 25, rounds = 5;
static constexpr double huber_sigmas = 1.5, outlier_sigmas = 4.5;
/* How much larger residuals are than the sightings' sigmas: at least. */
static constexpr double scale_floor = 0.2;
static constexpr int slots_min = 180;
static constexpr double origin_sigma_max_mm = 1.0;
/* Neighbours are at least ten times as far apart. */
static constexpr double join_max_px = 1.5;
/* A picture's dots that are in no lattice are what they seem if so many of them are. */
static constexpr int sparse_min = 3;

/* A sighting as the equations need it: dot `slot` was seen at `tangent` on the plane normal . X = height. */
struct Equation {
    Sighting *sighting;
    size_t slot;
    cv::Vec3d normal;
    double height_mm;
};

struct State {
    cv::Vec3d origin_mm;
    std::array<cv::Vec2d, slot_count> tangents; /* a ray is (x, y, 1) */
};

struct Blocks {
    cv::Matx33d origin = cv::Matx33d::zeros();
    cv::Vec3d origin_right{0.0, 0.0, 0.0};
    std::array<cv::Matx22d, slot_count> ray{};
    std::array<cv::Matx<double, 3, 2>, slot_count> mixed{};
    std::array<cv::Vec2d, slot_count> ray_right{};
};

static cv::Vec3d meet_plane(const State &state, const Equation &equation, double &along_mm)
{
    cv::Vec2d tangent = state.tangents[equation.slot];
    cv::Vec3d ray(tangent[0], tangent[1], 1.0);
    along_mm = (equation.height_mm - equation.normal.dot(state.origin_mm)) / equation.normal.dot(ray);
    return state.origin_mm + along_mm * ray;
}

static cv::Vec2d residual(const Camera &camera, const State &state, const Equation &equation)
{
    double along_mm;
    cv::Vec3d position = meet_plane(state, equation, along_mm);
    return {camera.matrix.at<double>(0, 0) * (equation.sighting->tangent.x - position[0] / position[2]),
            camera.matrix.at<double>(1, 1) * (equation.sighting->tangent.y - position[1] / position[2])};
}

/* Adds one sighting to the normal equations: how its pixel moves with the origin and with its ray. */
static void add(const Camera &camera, const State &state, const Equation &equation, double weight, Blocks &blocks)
{
    double along_mm;
    cv::Vec3d position = meet_plane(state, equation, along_mm), n = equation.normal;
    cv::Vec2d tangent = state.tangents[equation.slot], miss = residual(camera, state, equation);
    cv::Vec3d ray(tangent[0], tangent[1], 1.0);
    double facing = n.dot(ray), fx = camera.matrix.at<double>(0, 0), fy = camera.matrix.at<double>(1, 1),
           z = position[2];
    cv::Matx<double, 2, 3> lens(fx / z, 0.0, -fx * position[0] / (z * z), 0.0, fy / z, -fy * position[1] / (z * z));
    cv::Matx33d glide = cv::Matx33d::eye() - ray * n.t() * (1.0 / facing); /* along the plane */
    cv::Matx<double, 2, 3> by_origin = lens * glide;
    cv::Matx22d by_ray = (by_origin * along_mm).get_minor<2, 2>(0, 0);
    blocks.origin += weight * (by_origin.t() * by_origin);
    blocks.origin_right += weight * (by_origin.t() * miss);
    blocks.ray[equation.slot] += weight * (by_ray.t() * by_ray);
    blocks.mixed[equation.slot] += weight * (by_origin.t() * by_ray);
    blocks.ray_right[equation.slot] += weight * (by_ray.t() * miss);
}

static bool is_seen(const Blocks &blocks, size_t slot)
{
    return cv::determinant(blocks.ray[slot]) > 0.0;
}

/* Every ray is regularised towards the lattice: the more, the less its sightings weigh against it. */
static void add_nominal(const Nominal &nominal, double scale, const State &state, Blocks &blocks)
{
    double weight = (scale * scale) / (nominal.sigma * nominal.sigma);
    for (size_t slot = 0; slot < slot_count; slot++) {
        blocks.ray[slot] += weight * cv::Matx22d::eye();
        blocks.ray_right[slot] += weight * (nominal.tangents[slot] - state.tangents[slot]);
    }
}

/* The origin's own equations once every ray has followed it. */
static cv::Matx33d reduced(const Blocks &blocks, cv::Vec3d &right)
{
    cv::Matx33d normal = blocks.origin;
    right = blocks.origin_right;
    for (size_t slot = 0; slot < slot_count; slot++) {
        if (!is_seen(blocks, slot))
            continue;
        cv::Matx<double, 3, 2> back = blocks.mixed[slot] * blocks.ray[slot].inv();
        normal -= back * blocks.mixed[slot].t();
        right -= back * blocks.ray_right[slot];
    }
    return normal;
}

static double step(const Blocks &blocks, State &state)
{
    cv::Vec3d right, change;
    cv::Matx33d normal = reduced(blocks, right);
    if (!cv::solve(normal, right, change, cv::DECOMP_CHOLESKY))
        throw Error("the rays do not meet in one origin. Add:\n  - pictures with the laser on at other distances");
    state.origin_mm += change;
    for (size_t slot = 0; slot < slot_count; slot++) {
        if (is_seen(blocks, slot))
            state.tangents[slot] += blocks.ray[slot].inv() * (blocks.ray_right[slot] - blocks.mixed[slot].t() * change);
    }
    return cv::norm(change);
}

/* A residual's size in the sighting's own standard deviations. */
static double size_of(const Camera &camera, const State &state, const Equation &equation)
{
    return cv::norm(residual(camera, state, equation)) / equation.sighting->sigma_px;
}

/* One component's standard deviation against the sightings' own, by the median; a ray seen once fits exactly
 * and says nothing. */
static double usual_scale(const Camera &camera, const State &state, const std::vector<Equation> &equations)
{
    std::vector<double> sizes;
    std::array<int, slot_count> seen{};
    for (const Equation &equation : equations)
        seen[equation.slot]++;
    for (const Equation &equation : equations) {
        double free = 1.0 - 1.0 / seen[equation.slot];
        if (free > 0.0)
            sizes.push_back(size_of(camera, state, equation) / std::sqrt(free));
    }
    if (sizes.empty())
        return scale_floor;
    auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    return std::max(*middle / 1.1774, scale_floor); /* a Rayleigh distribution's median */
}

static double certainty(const Equation &equation)
{
    return 1.0 / (equation.sighting->sigma_px * equation.sighting->sigma_px);
}

static double weight_of(double size, double scale)
{
    if (size > outlier_sigmas * scale)
        return 0.0;
    return size > huber_sigmas * scale ? huber_sigmas * scale / size : 1.0;
}

static std::vector<Equation> list_equations(std::vector<Lit> &pictures)
{
    std::vector<Equation> equations;
    for (Lit &lit : pictures) {
        cv::Vec3d normal = lit.view.normal();
        for (Sighting &sighting : lit.sightings) {
            if (sighting.slot != no_slot)
                equations.push_back(
                    {&sighting, static_cast<size_t>(sighting.slot), normal, normal.dot(lit.view.shift)});
        }
    }
    return equations;
}

static State start_state(const std::vector<Equation> &equations, const cv::Vec3d &origin_mm)
{
    State state{origin_mm, {}};
    std::array<std::vector<double>, slot_count> xs, ys;
    for (const Equation &equation : equations) {
        cv::Vec3d offset = equation.sighting->position_mm - origin_mm;
        xs[equation.slot].push_back(offset[0] / offset[2]);
        ys[equation.slot].push_back(offset[1] / offset[2]);
    }
    for (size_t slot = 0; slot < slot_count; slot++) {
        if (xs[slot].empty())
            continue;
        std::sort(xs[slot].begin(), xs[slot].end());
        std::sort(ys[slot].begin(), ys[slot].end());
        state.tangents[slot] = {xs[slot][xs[slot].size() / 2], ys[slot][ys[slot].size() / 2]};
    }
    return state;
}

/* Standard deviations from the equations' curvature at the solution. */
static void report_sigmas(const Blocks &blocks, double scale, Projector &projector)
{
    cv::Vec3d right;
    cv::Matx33d origin = reduced(blocks, right).inv() * (scale * scale);
    for (int axis = 0; axis < 3; axis++)
        projector.origin_sigma_mm[axis] = std::sqrt(origin(axis, axis));
    for (size_t slot = 0; slot < slot_count; slot++) {
        if (!is_seen(blocks, slot))
            continue;
        cv::Matx22d inverse = blocks.ray[slot].inv();
        cv::Matx<double, 2, 3> with_origin = inverse * blocks.mixed[slot].t();
        cv::Matx22d spread = inverse * (scale * scale) + with_origin * origin * with_origin.t();
        projector.sigma_deg[slot] = std::sqrt(0.5 * (spread(0, 0) + spread(1, 1))) * 180.0 / CV_PI;
    }
}

/* `nominal`: null where rays stand alone. */
static Projector projector_of(const Camera &camera, const State &state, const std::vector<Equation> &equations,
                              double scale, const Nominal *nominal)
{
    Projector projector;
    Blocks blocks;
    double sum = 0.0;
    projector.origin_mm = state.origin_mm;
    for (const Equation &equation : equations) {
        cv::Vec2d miss = residual(camera, state, equation);
        equation.sighting->residual_px = {miss[0], miss[1]};
        equation.sighting->fits = size_of(camera, state, equation) <= outlier_sigmas * scale;
        projector.sighting_count++;
        projector.outlier_count += !equation.sighting->fits;
        if (equation.sighting->fits) {
            add(camera, state, equation, certainty(equation), blocks);
            projector.seen[equation.slot]++;
            sum += miss.dot(miss);
        }
    }
    int good = projector.sighting_count - projector.outlier_count;
    projector.rms_px = std::sqrt(sum / std::max(1, good));
    for (size_t slot = 0; slot < slot_count; slot++)
        projector.rays[slot] = cv::normalize(cv::Vec3d(state.tangents[slot][0], state.tangents[slot][1], 1.0));
    if (nominal != nullptr)
        add_nominal(*nominal, scale, state, blocks);
    report_sigmas(blocks, scale, projector);
    return projector;
}

/* Origin and rays, with the lattice or without. Returns the residuals' scale. */
static double improve(const Camera &camera, const std::vector<Equation> &equations, const Nominal *nominal,
                      State &state)
{
    double scale = usual_scale(camera, state, equations);
    for (int i = 0; i < steps; i++) {
        Blocks blocks;
        for (const Equation &equation : equations) {
            double weight = weight_of(size_of(camera, state, equation), scale);
            if (weight > 0.0)
                add(camera, state, equation, weight * certainty(equation), blocks);
        }
        if (nominal != nullptr)
            add_nominal(*nominal, scale, state, blocks);
        double moved_mm = step(blocks, state);
        if (nominal == nullptr)
            scale = usual_scale(camera, state, equations);
        if (moved_mm < 1e-7)
            break;
    }
    return scale;
}

static void check(const Projector &projector)
{
    auto seen = std::count_if(projector.seen.begin(), projector.seen.end(), [](int count) { return count > 0; });
    double sigma_mm = cv::norm(projector.origin_sigma_mm);
    if (seen < slots_min)
        throw Error(
            text("only %d of the %d dots were seen on the board, %d are needed. Add:\n  - pictures with the laser "
                 "on and the board where the other dots are",
                 static_cast<int>(seen), slot_count, slots_min));
    if (sigma_mm > origin_sigma_max_mm)
        throw Error(
            text("the projector's origin is only known to %.1f mm, %.1f is allowed. Add:\n  - pictures with the "
                 "laser on at more different distances, 0.4 to 1.5 m",
                 sigma_mm, origin_sigma_max_mm));
}

Projector rays_solve(const Camera &camera, std::vector<Lit> &pictures, const cv::Vec3d &origin_mm)
{
    std::vector<Equation> equations = list_equations(pictures);
    if (equations.empty())
        throw Error("no dot of the laser was found on the board");
    State state = start_state(equations, origin_mm);
    double scale = improve(camera, equations, nullptr, state);
    Projector projector = projector_of(camera, state, equations, scale, nullptr);
    check(projector);
    Nominal nominal = nominal_fit(projector);
    for (int round = 0; round < rounds; round++) {
        improve(camera, equations, &nominal, state);
        projector = projector_of(camera, state, equations, scale, &nominal);
        double sigma = nominal.sigma;
        nominal = nominal_fit(projector);
        nominal.sigma = sigma; /* regularised rays would make it smaller each time */
    }
    projector.scale = scale;
    projector.nominal_sigma_deg = nominal.sigma < nominal_unknown ? nominal.sigma * 180.0 / CV_PI : 0.0;
    projector.pitch_deg = nominal.pitch_deg;
    projector.rotation_deg = nominal.rotation_deg;
    return projector;
}

/* Where a ray is expected on a picture's board, undistorted pixels, and how well that is known. */
struct Expected {
    cv::Point2d px;
    double sigma_px;
};

static std::vector<Expected> expect(const Camera &camera, const Projector &projector, const View &view)
{
    std::vector<Expected> all;
    cv::Vec3d normal = view.normal();
    double height_mm = normal.dot(view.shift) - normal.dot(projector.origin_mm);
    for (size_t slot = 0; slot < slot_count; slot++) {
        const cv::Vec3d &ray = projector.rays[slot];
        cv::Vec3d position = projector.origin_mm + ray * (height_mm / normal.dot(ray));
        double sigma_deg = projector.seen[slot] > 0 ? projector.sigma_deg[slot] : projector.nominal_sigma_deg;
        all.push_back({camera.undistorted_px({position[0] / position[2], position[1] / position[2]}),
                       sigma_deg * CV_PI / 180.0 * camera.focal_px()});
    }
    return all;
}

/* The slot whose ray is at a sighting, among those that the picture has not shown yet. */
static int slot_at(const std::vector<Expected> &all, const std::vector<bool> &taken, cv::Point2d px, double sigma_px)
{
    for (size_t slot = 0; slot < slot_count; slot++) {
        double near_px = outlier_sigmas * std::hypot(all[slot].sigma_px, sigma_px);
        if (!taken[slot] && cv::norm(px - all[slot].px) <= std::min(near_px, join_max_px))
            return static_cast<int>(slot);
    }
    return no_slot;
}

static int join(const Camera &camera, const Projector &projector, Lit &lit)
{
    std::vector<Expected> all = expect(camera, projector, lit.view);
    std::vector<bool> taken(slot_count, false);
    std::vector<Sighting *> joined;
    int alone = 0;
    for (const Sighting &sighting : lit.sightings) {
        if (sighting.slot != no_slot)
            taken[static_cast<size_t>(sighting.slot)] = true;
    }
    for (Sighting &sighting : lit.sightings) {
        if (sighting.slot != no_slot)
            continue;
        alone++;
        sighting.slot =
            slot_at(all, taken, camera.undistorted_px(sighting.tangent), projector.scale * sighting.sigma_px);
        if (sighting.slot == no_slot)
            continue;
        taken[static_cast<size_t>(sighting.slot)] = true;
        joined.push_back(&sighting);
    }
    int count = static_cast<int>(joined.size());
    if (lit.sparse && (count < sparse_min || 2 * count < alone)) {
        for (Sighting *sighting : joined)
            sighting->slot = no_slot;
        return 0;
    }
    lit.refused.clear();
    return count;
}

int rays_join(const Camera &camera, const Projector &projector, std::vector<Lit> &pictures)
{
    int count = 0;
    for (Lit &lit : pictures) {
        if (lit.refused.empty() || lit.sparse)
            count += join(camera, projector, lit);
    }
    return count;
}
} // namespace cal
