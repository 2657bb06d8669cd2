#include "cal_solve.hpp"

#include <algorithm>
#include <filesystem>

#include "cal_coverage.hpp"
#include "cal_error.hpp"
#include "cal_nominal.hpp"
#include "cal_pairs.hpp"
#include "cal_refine.hpp"
#include "cal_report.hpp"
#include "cal_sightings.hpp"
#include "cal_spot.hpp"
#include "cal_wall.hpp"
#include "tool_progress.hpp"

namespace cal
{
static constexpr int lit_min = 5;
/* Rays and wall alternate: each round leaves a third of the change. */
static constexpr int wall_rounds = 6;

static std::vector<View> find_boards(const Board &board, const std::vector<Picture> &pictures, tool::Progress &progress)
{
    std::vector<View> views;
    for (const Picture &picture : pictures) {
        progress.show("looking for the board", views.size(), pictures.size());
        View view;
        view.file = picture.file;
        view.grey8 = picture.grey8();
        view.grey = picture.grey;
        view.corners = corners_find(board, view.grey8);
        views.push_back(view);
    }
    return views;
}

/* What the camera is calibrated from: all pictures but laser-on ones with a good laser-off one. */
static std::vector<View> camera_views(const std::vector<View> &views, const std::vector<int> &dark_of)
{
    std::vector<View> chosen;
    for (size_t i = 0; i < views.size(); i++) {
        if (dark_of[i] < 0 || !views[static_cast<size_t>(dark_of[i])].good())
            chosen.push_back(views[i]);
    }
    return chosen;
}

static const View *view_of(const std::vector<View> &views, const std::string &file)
{
    auto view = std::find_if(views.begin(), views.end(), [&](const View &v) { return v.file == file; });
    return view == views.end() ? nullptr : &*view;
}

static std::vector<Lit> find_dots(const Result &result, const std::vector<Picture> &pictures,
                                  const std::vector<int> &dark_of, tool::Progress &progress)
{
    std::vector<Lit> all;
    for (size_t i = 0; i < pictures.size(); i++) {
        progress.show("looking for the laser's dots", i, pictures.size());
        if (!pictures[i].laser)
            continue;
        Lit lit;
        lit.file = pictures[i].file;
        const View *view = view_of(result.views, lit.file);
        cv::Mat dark;
        if (dark_of[i] >= 0) {
            const Picture &dark_file = pictures[static_cast<size_t>(dark_of[i])];
            lit.dark_file = dark_file.file;
            dark = dark_file.grey;
            view = view_of(result.views, lit.dark_file);
        }
        lit.view = *view;
        lit.refused = view->corners.refused;
        if (!lit.refused.empty() && !lit.dark_file.empty())
            lit.refused = "its laser-off picture " + lit.dark_file + " is refused: " + lit.refused;
        if (lit.refused.empty()) {
            sightings_find(result.board, result.camera, pictures[i].grey, dark, lit);
            lattice_grow(lit.sightings);
        }
        all.push_back(lit);
    }
    return all;
}

/* Each picture's reason is printed beside this. */
static void check_used(const std::vector<Lit> &pictures)
{
    auto used = std::count_if(pictures.begin(), pictures.end(), [](const Lit &lit) { return lit.refused.empty(); });
    if (used == 0 && !pictures.empty())
        throw Error(text("none of the %zu pictures with the laser on can be used, for the reasons above. Add:\n"
                         "  - pictures with the laser on, each beside one without it: the board found in both, sharp, "
                         "held still, and many dots on it",
                         pictures.size()));
}

/* Not even one dot among its neighbours: the pictures are not what their names say. */
static void check_lit(const std::vector<Lit> &pictures)
{
    check_used(pictures);
    bool seen = std::any_of(pictures.begin(), pictures.end(), [](const Lit &lit) {
        return std::any_of(lit.sightings.begin(), lit.sightings.end(), [](const Sighting &s) { return s.in_lattice; });
    });
    if (!seen)
        throw Error(
            "no dots of the laser are seen on the board in any picture that should have it on: are those with and "
            "without it mixed up in frames.jsonl, or in the files' names? Add:\n  - pictures with the laser on");
}

/* How light the print's dark is: the median over all corners. */
static double dark_fraction(const std::vector<View> &views)
{
    std::vector<double> fractions;
    for (const View &view : views) {
        if (view.good())
            fractions.insert(fractions.end(), view.corners.dark_fraction.begin(), view.corners.dark_fraction.end());
    }
    auto middle = fractions.begin() + static_cast<std::ptrdiff_t>(fractions.size() / 2);
    std::nth_element(fractions.begin(), middle, fractions.end());
    return *middle;
}

/* The dots' positions again, corrected for the print under them. */
static void refine_dots(const std::vector<Picture> &pictures, const std::vector<int> &dark_of, Result &result)
{
    const Camera &camera = result.camera;
    Spots spots{result.board,
                camera,
                board_picture(result.board, draw_px_per_mm),
                draw_tangents(camera.size, camera.matrix, camera.distortion),
                spot_lens_px(result.lit),
                dark_fraction(result.views),
                pairs_noise(pictures, dark_of)};
    size_t next = 0;
    for (size_t i = 0; i < pictures.size(); i++) {
        if (!pictures[i].laser)
            continue;
        Lit &lit = result.lit[next++];
        if (lit.refused.empty() && dark_of[i] >= 0)
            spots_refine(spots, pictures[i].grey, pictures[static_cast<size_t>(dark_of[i])].grey, lit);
    }
}

/* What is known of the board's dots against each other becomes what is known of them: the wall has a noise of its own. */
static void scale_sigmas(double scale, std::vector<Lit> &pictures)
{
    for (Lit &lit : pictures) {
        for (Sighting &sighting : lit.sightings)
            sighting.sigma_px *= scale;
    }
}

/* Origin and rays by the board; then with what is behind it, too. */
static void find_rays(const std::vector<Picture> &pictures, const std::vector<int> &dark_of, const cv::Vec3d &origin_mm,
                      Result &result)
{
    result.projector = rays_solve(result.camera, result.lit, origin_mm);
    if (rays_join(result.camera, result.projector, result.lit) > 0)
        result.projector = rays_solve(result.camera, result.lit, result.projector.origin_mm);
    scale_sigmas(result.projector.scale, result.lit);
    Lit wall = wall_find(result.board, result.camera, pictures, dark_of, result.lit, pairs_noise(pictures, dark_of),
                         spot_lens_px(result.lit));
    if (!wall_lay(result.camera, result.projector, wall))
        return;
    result.lit.push_back(wall);
    for (int round = 0; round < wall_rounds; round++) {
        result.projector = rays_solve(result.camera, result.lit, result.projector.origin_mm);
        if (!wall_lay(result.camera, result.projector, result.lit.back())) {
            result.lit.pop_back();
            result.projector = rays_solve(result.camera, result.lit, result.projector.origin_mm);
            return;
        }
    }
    result.projector = rays_solve(result.camera, result.lit, result.projector.origin_mm);
}

static void report_pictures(const Result &result)
{
    for (const View &view : result.views) {
        if (!view.good())
            std::printf("%s: not used: %s\n", view.file.c_str(), view.corners.refused.c_str());
    }
    for (const Lit &lit : result.lit) {
        const View *view = view_of(result.views, lit.file);
        if (!lit.refused.empty() && (view == nullptr || view->good()))
            std::printf("%s: %s: %s\n", lit.file.c_str(), view == nullptr ? "not used" : "its dots are not used",
                        lit.refused.c_str());
    }
}

static void report_camera(const Camera &camera)
{
    std::printf("camera: rms %.3f px; fx %.2f +- %.2f, fy %.2f +- %.2f, cx %.2f +- %.2f, cy %.2f +- %.2f px\n",
                camera.rms_px, camera.matrix.at<double>(0, 0), camera.sigma_px[0], camera.matrix.at<double>(1, 1),
                camera.sigma_px[1], camera.matrix.at<double>(0, 2), camera.sigma_px[2], camera.matrix.at<double>(1, 2),
                camera.sigma_px[3]);
}

/* Parts of the frame where the lens is only continued from elsewhere. */
static void report_uncovered(const Camera &camera)
{
    for (size_t i = 0; i < camera.regions.size(); i++) {
        if (camera.regions[i].corner_count < coverage_min.region_corners)
            std::printf("note: %d corners %s in the frame: the lens is a guess there\n", camera.regions[i].corner_count,
                        coverage_region_names[i]);
    }
}

static void report_projector(const Projector &projector)
{
    auto seen = std::count_if(projector.seen.begin(), projector.seen.end(), [](int count) { return count > 0; });
    std::printf("projector: rms %.3f px of %d sightings, %d left out; origin (%.2f, %.2f, %.2f) mm, +- (%.2f, %.2f, "
                "%.2f)\n",
                projector.rms_px, projector.sighting_count, projector.outlier_count, projector.origin_mm[0],
                projector.origin_mm[1], projector.origin_mm[2], projector.origin_sigma_mm[0],
                projector.origin_sigma_mm[1], projector.origin_sigma_mm[2]);
    std::printf("dots: %d of %d seen", static_cast<int>(seen), slot_count);
    if (seen < slot_count)
        std::printf("; by the nominal lattice, which the others keep to %s:",
                    nominal_words(projector.nominal_sigma_deg).c_str());
    for (int slot = 0; slot < slot_count; slot++) {
        if (projector.seen[static_cast<size_t>(slot)] == 0)
            std::printf(" %d", slot);
    }
    std::printf("\n");
}

/* The picture in which the board hung plumb; of a pair either. */
static void hang_plumb(const std::string &file, Result &result)
{
    if (file.empty())
        return;
    auto pair = std::find_if(result.lit.begin(), result.lit.end(), [&](const Lit &lit) { return lit.file == file; });
    const View *view = view_of(result.views, file);
    if (view == nullptr && pair != result.lit.end())
        view = view_of(result.views, pair->dark_file);
    if (view == nullptr || !view->good())
        throw Error("--plumb: the board in " + file + " was not found; name another picture in which it hung plumb");
    result.up = up_of(*view);
    std::printf("up: tilt %.2f, roll %.2f degrees, by the board in %s\n", std::asin(-result.up[2]) * 180.0 / CV_PI,
                std::atan2(result.up[0], -result.up[1]) * 180.0 / CV_PI, file.c_str());
}

/* Names that may be mistyped: looked at before an earlier calibration is given up. */
static void check_names(const Options &options)
{
    std::vector<std::string> names = pictures_required(options.target);
    for (const auto &[option, file] :
         {std::pair("--middle", options.middle.file), std::pair("--plumb", options.mount.plumb_file)}) {
        if (!file.empty() && !std::binary_search(names.begin(), names.end(), file))
            throw Error(option + (": there is no " + file) + " in " + options.target);
    }
}

static void check_middle(const MiddleDot &middle, const std::vector<Picture> &pictures)
{
    auto named =
        std::find_if(pictures.begin(), pictures.end(), [&](const Picture &p) { return p.file == middle.file; });
    if (named == pictures.end())
        return;
    if (!named->laser)
        throw Error("--middle: " + middle.file + " has the laser off: name one with it on");
    if (middle.px.x >= named->grey.cols || middle.px.y >= named->grey.rows)
        throw Error(text("--middle: %g,%g is outside of ", middle.px.x, middle.px.y) + middle.file +
                    text(", which has %dx%d pixels", named->grey.cols, named->grey.rows));
}

/* Never a directory, which would go if it is empty: no calibration wrote that. */
static void remove_file(const std::string &path, std::error_code &failed)
{
    if (std::filesystem::is_directory(std::filesystem::symlink_status(path, failed)))
        failed = std::make_error_code(std::errc::is_a_directory);
    else
        std::filesystem::remove(path, failed);
}

/* A calibration that fails leaves no files behind, also none of an earlier one. */
static void make_out(const std::string &out)
{
    std::error_code failed;
    std::filesystem::create_directories(out, failed);
    if (failed)
        throw Error(out + ": " + failed.message());
    for (const char *name : {"/rig.json", "/report.html"}) {
        remove_file(out + name, failed);
        if (failed)
            throw Error(out + name + ": " + failed.message());
    }
}

static void remove_out(const std::string &out)
{
    std::error_code failed; /* the first error is the one to report */
    for (const char *name : {"/rig.json", "/report.html"})
        remove_file(out + name, failed);
}

static void write_out(const std::string &out, const Result &result)
{
    report_write(out + "/report.html", result);
    try {
        rig_write(out + "/rig.json", result.camera, result.projector, result.range, result.up);
    } catch (const Error &) {
        remove_out(out);
        throw;
    }
}

void solve_run(const Options &options)
{
    Result result;
    tool::Progress progress;
    check_names(options);
    make_out(options.out);
    result.board = options.board;
    result.range = options.range;
    result.up = up_of(options.mount);
    std::vector<Picture> pictures = pictures_read(options.target);
    check_middle(options.middle, pictures);
    auto lit_count = std::count_if(pictures.begin(), pictures.end(), [](const Picture &p) { return p.laser; });
    if (lit_count < lit_min)
        throw Error(text(
            "too few pictures with the laser on. Add:\n  - pictures with the laser on: there are %d of at least %d, "
            "better 25; calibrate guide says what else is missing",
            static_cast<int>(lit_count), lit_min));
    std::vector<View> views = find_boards(result.board, pictures, progress);
    std::vector<int> dark_of = pairs_find(pictures, views);
    for (size_t i = 0; i < pictures.size(); i++) {
        if (dark_of[i] >= 0)
            views[static_cast<size_t>(dark_of[i])].grey =
                pairs_mean(pictures[static_cast<size_t>(dark_of[i])].grey, pictures[i].grey);
    }
    result.views = camera_views(views, dark_of);
    try {
        progress.show("solving for the camera");
        result.camera = camera_solve(result.board, pictures.front().grey.size(), result.views);
        result.lit = find_dots(result, pictures, dark_of, progress);
        check_lit(result.lit);
        progress.show("locating the dots");
        refine_dots(pictures, dark_of, result);
        progress.show("solving for the projector");
        cv::Vec3d origin_mm = index_assign(result.board, result.camera, result.lit, options.middle);
        find_rays(pictures, dark_of, origin_mm, result);
    } catch (const Error &) {
        progress.clear();
        report_pictures(result);
        check_used(result.lit);
        throw;
    }
    progress.clear();
    report_pictures(result);
    report_camera(result.camera);
    report_uncovered(result.camera);
    report_projector(result.projector);
    hang_plumb(options.mount.plumb_file, result);
    write_out(options.out, result);
    std::printf("%s/rig.json and %s/report.html are written\n", options.out.c_str(), options.out.c_str());
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
        remove_out(options.out); /* main says why this failed */
}
} // namespace cal
