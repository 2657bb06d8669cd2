#include "cal_trial.hpp"

#include <algorithm>

#include "cal_error.hpp"

namespace cal
{
static constexpr int common_min = 7;       /* dots that two pictures must share */
static constexpr double meet_rms_mm = 1.5; /* lines meet within this */
static constexpr double origin_max_mm = 600.0;
static constexpr double ratio_min = 1.2; /* of the distances of a pair */
static constexpr size_t pair_count = 6;
static constexpr int support_min = 6;
static constexpr double support_fraction = 0.7, on_lattice = 0.22;
static constexpr size_t near_count = 10;
static constexpr double near_steps = 2.2;
/* Another position of the projector must explain less than this fraction of the best one's dots. */
static constexpr double clear_fraction = 0.9;
static constexpr double same_origin_mm = 8.0;

static cv::Point2d direction_of(const cv::Vec3d &origin_mm, const cv::Vec3d &position_mm)
{
    cv::Vec3d offset = position_mm - origin_mm;
    return {offset[0] / offset[2], offset[1] / offset[2]};
}

static std::map<Step, cv::Vec3d> positions_by_step(const Lit &lit)
{
    std::map<Step, cv::Vec3d> positions;
    for (const Sighting &sighting : lit.sightings) {
        if (sighting.in_lattice)
            positions[{sighting.step[0], sighting.step[1]}] = sighting.position_mm;
    }
    return positions;
}

/* The point nearest to all lines; false: they do not meet. */
static bool meet(const std::vector<std::pair<cv::Vec3d, cv::Vec3d>> &lines, cv::Vec3d &point)
{
    cv::Matx33d normal = cv::Matx33d::zeros();
    cv::Vec3d right(0.0, 0.0, 0.0);
    double sum = 0.0;
    for (const auto &[from, to] : lines) {
        cv::Vec3d offset = cv::normalize(to - from);
        cv::Matx33d across = cv::Matx33d::eye() - offset * offset.t();
        normal += across;
        right += across * from;
    }
    if (!cv::solve(normal, right, point, cv::DECOMP_CHOLESKY))
        return false;
    for (const auto &[from, to] : lines) {
        cv::Vec3d offset = cv::normalize(to - from), away = point - from;
        away -= offset * offset.dot(away);
        sum += away.dot(away);
    }
    return std::sqrt(sum / static_cast<double>(lines.size())) < meet_rms_mm && cv::norm(point) < origin_max_mm;
}

/* All candidate positions of the projector, by one pair of pictures. */
static void add_candidates(const Lit &a, const Lit &b, std::vector<cv::Vec3d> &candidates)
{
    std::map<Step, cv::Vec3d> positions_a = positions_by_step(a), positions_b = positions_by_step(b);
    for (int row = -2 * pattern_side; row <= 2 * pattern_side; row++) {
        for (int column = -2 * pattern_side; column <= 2 * pattern_side; column++) {
            std::vector<std::pair<cv::Vec3d, cv::Vec3d>> lines;
            for (const auto &[step, from] : positions_a) {
                auto other = positions_b.find({step.first + column, step.second + row});
                if (other != positions_b.end())
                    lines.emplace_back(from, other->second);
            }
            cv::Vec3d point;
            if (static_cast<int>(lines.size()) >= common_min && meet(lines, point) &&
                point[2] < 0.8 * std::min(a.view.shift[2], b.view.shift[2]))
                candidates.push_back(point);
        }
    }
}

/* Lattice coordinates of a direction by the known ones around it. False: too few are near. */
static bool predict(const Trial &trial, cv::Point2d direction, double step_length, cv::Point2d &step)
{
    std::vector<std::pair<double, const std::pair<const Step, Known> *>> near;
    for (const auto &entry : trial.known) {
        double away = cv::norm(entry.second.direction - direction) / step_length;
        if (away < near_steps)
            near.emplace_back(away, &entry);
    }
    if (near.size() < 4)
        return false;
    size_t kept = std::min(near_count, near.size());
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(kept), near.end());
    cv::Matx33d normal = cv::Matx33d::zeros();
    cv::Matx<double, 3, 2> right = cv::Matx<double, 3, 2>::zeros();
    for (size_t i = 0; i < kept; i++) {
        cv::Point2d offset = (near[i].second->second.direction - direction) / step_length;
        cv::Matx31d terms(1.0, offset.x, offset.y);
        double weight = 1.0 / (0.1 + near[i].first * near[i].first);
        normal += weight * (terms * terms.t());
        right += weight * (terms * cv::Matx12d(near[i].second->first.first, near[i].second->first.second));
    }
    if (cv::determinant(normal) < 1e-3)
        return false;
    cv::Matx<double, 3, 2> found = normal.inv() * right;
    step = {found(0, 0), found(0, 1)};
    return true;
}

struct Placing {
    cv::Vec2i shift;
    int support = 0, predicted = 0;
    double square_sum = 0.0;
};

static Placing position(const Trial &trial, const Lit &lit, double step_length)
{
    std::vector<cv::Point2d> shifts;
    std::map<Step, int> votes;
    Placing placing;
    for (const Sighting &sighting : lit.sightings) {
        cv::Point2d step;
        if (!sighting.in_lattice ||
            !predict(trial, direction_of(trial.origin_mm, sighting.position_mm), step_length, step))
            continue;
        cv::Point2d shift(step.x - sighting.step[0], step.y - sighting.step[1]);
        shifts.push_back(shift);
        votes[{cvRound(shift.x), cvRound(shift.y)}]++;
    }
    placing.predicted = static_cast<int>(shifts.size());
    if (shifts.empty())
        return placing;
    auto max =
        std::max_element(votes.begin(), votes.end(), [](const auto &a, const auto &b) { return a.second < b.second; });
    placing.shift = {max->first.first, max->first.second};
    for (const cv::Point2d &shift : shifts) {
        cv::Point2d off(shift.x - placing.shift[0], shift.y - placing.shift[1]);
        if (std::max(std::abs(off.x), std::abs(off.y)) < on_lattice) {
            placing.support++;
            placing.square_sum += off.ddot(off);
        }
    }
    return placing;
}

static void add_picture(Trial &trial, const Lit &lit, size_t index, const Placing &placing)
{
    for (const Sighting &sighting : lit.sightings) {
        if (!sighting.in_lattice)
            continue;
        cv::Vec2i step = sighting.step + placing.shift;
        cv::Point2d direction = direction_of(trial.origin_mm, sighting.position_mm);
        Known &known = trial.known.try_emplace({step[0], step[1]}, Known{direction, 0}).first->second;
        known.count++;
        known.direction += (direction - known.direction) / known.count;
    }
    trial.placed[index] = true;
    trial.shift[index] = placing.shift;
    trial.dot_count += placing.support;
    trial.square_sum += placing.square_sum;
}

static double step_length_of(const Lit &lit, const cv::Vec3d &origin_mm)
{
    std::map<Step, cv::Vec3d> positions = positions_by_step(lit);
    std::vector<double> lengths;
    for (const auto &[step, at] : positions) {
        auto next = positions.find({step.first + 1, step.second});
        if (next != positions.end())
            lengths.push_back(cv::norm(direction_of(origin_mm, next->second) - direction_of(origin_mm, at)));
    }
    std::sort(lengths.begin(), lengths.end());
    return lengths.empty() ? 0.0 : lengths[lengths.size() / 2];
}

/* Lays all pictures on the first one's lattice, each time the one that shares most with what is there. */
static Trial try_origin(const std::vector<Lit> &pictures, size_t first, const cv::Vec3d &origin_mm)
{
    Trial trial;
    trial.origin_mm = origin_mm;
    trial.placed.assign(pictures.size(), false);
    trial.shift.assign(pictures.size(), {0, 0});
    add_picture(trial, pictures[first], first, {});
    double step_length = step_length_of(pictures[first], origin_mm);
    while (step_length > 0.0) {
        Placing best;
        size_t best_index = 0;
        for (size_t i = 0; i < pictures.size(); i++) {
            if (trial.placed[i] || !pictures[i].refused.empty())
                continue;
            Placing placing = position(trial, pictures[i], step_length);
            if (placing.support >= support_min && placing.support >= support_fraction * placing.predicted &&
                placing.support > best.support) {
                best = placing;
                best_index = i;
            }
        }
        if (best.support == 0)
            break;
        add_picture(trial, pictures[best_index], best_index, best);
    }
    return trial;
}

static size_t richest(const std::vector<Lit> &pictures)
{
    size_t best = 0;
    int max = -1;
    for (size_t i = 0; i < pictures.size(); i++) {
        int count = static_cast<int>(std::count_if(pictures[i].sightings.begin(), pictures[i].sightings.end(),
                                                   [](const Sighting &s) { return s.in_lattice; }));
        if (pictures[i].refused.empty() && count > max) {
            max = count;
            best = i;
        }
    }
    return best;
}

static std::vector<cv::Vec3d> all_candidates(const std::vector<Lit> &pictures, size_t first)
{
    std::vector<std::pair<double, size_t>> partners;
    std::vector<cv::Vec3d> candidates;
    double here_mm = pictures[first].view.shift[2];
    for (size_t i = 0; i < pictures.size(); i++) {
        double there_mm = pictures[i].view.shift[2], ratio = std::max(here_mm / there_mm, there_mm / here_mm);
        if (i != first && pictures[i].refused.empty() && ratio >= ratio_min)
            partners.emplace_back(-static_cast<double>(pictures[i].sightings.size()) * std::log(ratio), i);
    }
    std::sort(partners.begin(), partners.end());
    for (size_t i = 0; i < std::min(pair_count, partners.size()); i++)
        add_candidates(pictures[first], pictures[partners[i].second], candidates);
    return candidates;
}

static bool better(const Trial &a, const Trial &b)
{
    return a.dot_count != b.dot_count ? a.dot_count > b.dot_count : a.square_sum < b.square_sum;
}

Trial trial_best(const std::vector<Lit> &pictures)
{
    size_t first = richest(pictures);
    std::vector<cv::Vec3d> candidates = all_candidates(pictures, first);
    if (candidates.empty())
        throw Error("the projector's position cannot be determined. Add:\n  - pictures with the laser on at other "
                    "distances: the "
                    "board near (0.5 m) and far (1.2 m), with many dots on it");
    std::vector<Trial> trials;
    for (const cv::Vec3d &candidate : candidates)
        trials.push_back(try_origin(pictures, first, candidate));
    auto best = std::min_element(trials.begin(), trials.end(), better);
    for (const Trial &trial : trials) {
        bool elsewhere = cv::norm(trial.origin_mm - best->origin_mm) > same_origin_mm;
        if (elsewhere && trial.dot_count > clear_fraction * best->dot_count &&
            trial.square_sum < 2.0 * best->square_sum)
            throw Error(
                text("the projector's position is ambiguous: (%.0f, %.0f, %.0f) mm explains the dots as well as "
                     "(%.0f, %.0f, %.0f). Add:\n  - pictures with the laser on at other distances, near and far",
                     best->origin_mm[0], best->origin_mm[1], best->origin_mm[2], trial.origin_mm[0], trial.origin_mm[1],
                     trial.origin_mm[2]));
    }
    return *best;
}
} // namespace cal
