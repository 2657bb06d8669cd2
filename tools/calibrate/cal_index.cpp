#include "cal_index.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <set>

#include "cal_error.hpp"
#include "cal_trial.hpp"

namespace cal
{
static constexpr int lattice_min = 8; /* dots of a picture in its lattice */
/* A dot this near to the sheet's or the frame's edge may be missed. */
static constexpr double edge_mm = 8.0, edge_px = 8.0;
/* A line of dots is one when so many are seen, and this fraction of those that might be; it is none when it was looked at
 * so often and hardly any were. */
static constexpr int line_seen_min = 3, void_looks_min = 6;
static constexpr double line_fraction = 0.25, void_fraction = 0.08;

/* A lattice position as a direction: as it was seen, or continued in a straight line from the next two. */
static bool direction_at(const Trial &trial, Step step, cv::Point2d &direction)
{
    static constexpr int offsets[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    auto known = trial.known.find(step);
    if (known != trial.known.end()) {
        direction = known->second.direction;
        return true;
    }
    for (const auto &offset : offsets) {
        auto next = trial.known.find({step.first + offset[0], step.second + offset[1]});
        auto after = trial.known.find({step.first + 2 * offset[0], step.second + 2 * offset[1]});
        if (next != trial.known.end() && after != trial.known.end()) {
            direction = 2.0 * next->second.direction - after->second.direction;
            return true;
        }
    }
    return false;
}

/* Whether a dot of that direction would be seen on the board of a picture. */
static bool is_on_board(const Board &board, const Camera &camera, const Lit &lit, const cv::Vec3d &origin_mm,
                        cv::Point2d direction)
{
    cv::Vec3d ray(direction.x, direction.y, 1.0), normal = lit.view.normal();
    cv::Vec3d position = origin_mm + ray * ((normal.dot(lit.view.shift) - normal.dot(origin_mm)) / normal.dot(ray));
    cv::Point2d sheet = lit.view.on_board(position) - board.sheet_origin_mm();
    std::vector<cv::Point2d> px;
    cv::projectPoints(std::vector<cv::Point3d>{{position[0], position[1], position[2]}}, cv::Vec3d(), cv::Vec3d(),
                      camera.matrix, camera.distortion, px);
    return sheet.x > edge_mm && sheet.y > edge_mm && sheet.x < sheet_width_mm - edge_mm &&
           sheet.y < sheet_height_mm - edge_mm && px[0].x > edge_px && px[0].y > edge_px &&
           px[0].x < camera.size.width - edge_px && px[0].y < camera.size.height - edge_px;
}

/* How often dots of a column or row of the lattice should have been seen, were they of the pattern, and how often they
 * were. */
struct Line {
    int looked = 0, seen = 0;
};

static std::map<int, Line> count_lines(const Board &board, const Camera &camera, const std::vector<Lit> &pictures,
                                       const Trial &trial, int axis)
{
    std::map<int, Line> lines;
    std::set<Step> sites;
    for (const auto &[step, known] : trial.known) {
        for (int away = -1; away <= 1; away++)
            sites.insert(axis == 0 ? Step{step.first + away, step.second} : Step{step.first, step.second + away});
    }
    for (size_t i = 0; i < pictures.size(); i++) {
        std::set<Step> here;
        for (const Sighting &sighting : pictures[i].sightings) {
            if (trial.placed[i] && sighting.in_lattice)
                here.insert({sighting.step[0] + trial.shift[i][0], sighting.step[1] + trial.shift[i][1]});
        }
        for (const Step &site : sites) {
            cv::Point2d direction;
            if (trial.placed[i] && direction_at(trial, site, direction) &&
                is_on_board(board, camera, pictures[i], trial.origin_mm, direction)) {
                Line &line = lines[axis == 0 ? site.first : site.second];
                line.looked++;
                line.seen += here.count(site) != 0;
            }
        }
    }
    return lines;
}

/* The lattice's column (axis 0) or row of the pattern's first one: by the lines that are seen, and beyond them one where
 * dots were looked for in vain. */
static int first_by_edges(const std::map<int, Line> &lines, int axis)
{
    const char *names = axis == 0 ? "columns" : "rows", *sides = axis == 0 ? "left or right" : "upper or lower";
    int first = 1, last = 0;
    auto is_void = [&](int at) {
        auto line = lines.find(at);
        return line != lines.end() && line->second.looked >= void_looks_min &&
               line->second.seen < void_fraction * line->second.looked;
    };
    for (const auto &[at, line] : lines) {
        if (line.seen < line_seen_min || line.seen < line_fraction * line.looked)
            continue;
        first = first > last ? at : first;
        last = at;
    }
    int count = last - first + 1;
    if (count > pattern_side)
        throw Error(text("%d %s of dots are seen on the board, the pattern has %d: is the board flat, and did it stand "
                         "still in each pair of pictures?",
                         count, names, pattern_side));
    if (count == pattern_side || is_void(first - 1))
        return first;
    if (is_void(last + 1))
        return last - pattern_side + 1;
    throw Error(text(
        "%d %s of dots are seen on the board, and no edge of the pattern: the middle dot cannot be determined. Add:\n"
        "  - pictures with the laser on and the board across the pattern's %s edge; or name the middle dot "
        "in one picture with --middle FILE:U,V",
        count, names, sides));
}

/* The same by the dot that the user points at. */
static cv::Vec2i first_by_middle(const std::vector<Lit> &pictures, const Trial &trial, const MiddleDot &middle)
{
    constexpr double near_px = 6.0;
    for (size_t i = 0; i < pictures.size(); i++) {
        const Sighting *nearest = nullptr;
        if (pictures[i].file != middle.file || !trial.placed[i])
            continue;
        for (const Sighting &sighting : pictures[i].sightings) {
            if (sighting.in_lattice && cv::norm(sighting.px - middle.px) < near_px &&
                (nearest == nullptr || cv::norm(sighting.px - middle.px) < cv::norm(nearest->px - middle.px)))
                nearest = &sighting;
        }
        if (nearest == nullptr)
            throw Error(
                text("--middle: there is no dot within %.0f px of %.1f,%.1f in ", near_px, middle.px.x, middle.px.y) +
                middle.file);
        return nearest->step + trial.shift[i] - cv::Vec2i(pattern_side / 2, pattern_side / 2);
    }
    throw Error("--middle: " + middle.file + " is none of the pictures with the laser on whose dots could be placed");
}

cv::Vec3d index_assign(const Board &board, const Camera &camera, std::vector<Lit> &pictures, const MiddleDot &middle)
{
    for (Lit &lit : pictures) {
        int count = static_cast<int>(
            std::count_if(lit.sightings.begin(), lit.sightings.end(), [](const Sighting &s) { return s.in_lattice; }));
        lit.sparse = lit.refused.empty() && count < lattice_min;
        if (lit.sparse)
            lit.refused = text("only %d dots in a lattice on the board, %d are needed", count, lattice_min);
    }
    Trial trial = trial_best(pictures);
    cv::Vec2i first;
    if (!middle.file.empty())
        first = first_by_middle(pictures, trial, middle);
    for (int axis = 0; axis < 2 && middle.file.empty(); axis++)
        first[axis] = first_by_edges(count_lines(board, camera, pictures, trial, axis), axis);
    for (size_t i = 0; i < pictures.size(); i++) {
        if (pictures[i].refused.empty() && !trial.placed[i])
            pictures[i].refused = "its dots do not fall on the lattice of the others";
        for (Sighting &sighting : pictures[i].sightings) {
            cv::Vec2i step = sighting.step + trial.shift[i] - first;
            bool inside = step[0] >= 0 && step[1] >= 0 && step[0] < pattern_side && step[1] < pattern_side;
            bool used = pictures[i].refused.empty() && sighting.in_lattice && inside;
            sighting.slot = used ? step[1] * pattern_side + step[0] : no_slot;
        }
    }
    return trial.origin_mm;
}
} // namespace cal
