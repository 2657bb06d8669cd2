/* Corners and dots against places that are known: a board drawn here, finely and by other means than the program's own.
 * Each case is one thing that pushed them aside once. Prints TAP; exit status 1 when a case fails.
 */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "cal_pairs.hpp"
#include "cal_refine.hpp"
#include "cal_spot.hpp"
#include "cal_wall.hpp"

static int number, failed;

static void result(const char *name, bool good, double found, double limit)
{
    number++;
    failed += !good;
    std::printf("%s %d - %s (%.4f, limit %.4f)\n", good ? "ok" : "not ok", number, name, found,
                limit);
}

/* A camera without a lens' bend, and a board that leans before it. */
static constexpr int width = 640, height = 480, fine = 5, finest = 10, sheet_px_per_mm = 20;
static constexpr double focal_px = 700.0, centre_u = 325.3, centre_v = 236.8;
static constexpr double dark_grey = 44.0, white_grey = 124.0, black = 4.0;

struct Stage {
    cal::Board board;
    cv::Mat sheet;
    cal::Camera camera;
    cal::View view;
    cv::Matx33d rotation;

    explicit Stage(const char *name = "charuco-9x6-30")
        : board(cal::board_parse(name)), sheet(cal::board_bitmap(board, sheet_px_per_mm))
    {
        camera.size = {width, height};
        camera.matrix =
            (cv::Mat_<double>(3, 3) << focal_px, 0, centre_u, 0, focal_px, centre_v, 0, 0, 1);
        camera.distortion = cv::Mat::zeros(1, 5, CV_64F);
        view.rvec = {0.35, -0.3, 0.12};
        cv::Rodrigues(view.rvec, rotation);
        view.shift = cv::Vec3d(25.0, -10.0, 620.0) - rotation * cv::Vec3d(135.0, 90.0, 0.0);
    }

    /* White's fraction of the sheet at a pixel; beyond it there is nothing. */
    double white_at(double u, double v) const
    {
        cv::Vec3d sight((u - centre_u) / focal_px, (v - centre_v) / focal_px, 1.0);
        cv::Vec3d normal(rotation(0, 2), rotation(1, 2), rotation(2, 2));
        cv::Vec3d position =
            rotation.t() * (sight * (normal.dot(view.shift) / normal.dot(sight)) - view.shift);
        cv::Point2d origin = board.sheet_origin_mm();
        int x = cvFloor((position[0] - origin.x) * sheet_px_per_mm),
            y = cvFloor((position[1] - origin.y) * sheet_px_per_mm);
        bool on = x >= 0 && y >= 0 && x < sheet.cols && y < sheet.rows;
        return on ? sheet.at<uchar>(y, x) / 255.0 : 0.0;
    }

    /* Drawn wider than the frame: the blur brings in what is beyond its border. */
    cv::Mat picture(double blur_px) const
    {
        constexpr int beyond = 6;
        cv::Mat sharp(height + 2 * beyond, width + 2 * beyond, CV_64F), soft, grey;
        for (int v = 0; v < sharp.rows; v++) {
            for (int u = 0; u < sharp.cols; u++) {
                double sum = 0.0;
                for (int i = 0; i < finest * finest; i++)
                    sum += white_at(u - beyond + (i % finest + 0.5) / finest - 0.5,
                                    v - beyond + (i / finest + 0.5) / finest - 0.5);
                sharp.at<double>(v, u) =
                    dark_grey + (white_grey - dark_grey) * sum / (finest * finest);
            }
        }
        cv::GaussianBlur(sharp, soft, {}, blur_px);
        soft(cv::Rect(beyond, beyond, width, height)).convertTo(grey, CV_32F);
        return grey;
    }

    cv::Point2d seen(const cv::Point3d &position_mm) const
    {
        cv::Vec3d at =
            rotation * cv::Vec3d(position_mm.x, position_mm.y, position_mm.z) + view.shift;
        return {centre_u + focal_px * at[0] / at[2], centre_v + focal_px * at[1] / at[2]};
    }

    /* A beam of light on the sheet, through a lens. */
    cv::Mat dot(cv::Point2d px, double beam_px, double lens_px, double grey) const
    {
        constexpr int around = 9;
        cv::Mat lit = cv::Mat::zeros(height, width, CV_32F);
        cv::Point middle(cvRound(px.x), cvRound(px.y));
        double area = 2.0 * CV_PI * lens_px * lens_px * fine * fine;
        for (int i = -around * fine; i <= around * fine; i++) {
            for (int j = -around * fine; j <= around * fine; j++) {
                double u = middle.x + static_cast<double>(i) / fine,
                       v = middle.y + static_cast<double>(j) / fine;
                double light = dark_grey - black + (white_grey - dark_grey) * white_at(u, v);
                double beam = light / (white_grey - black) *
                              std::exp(-0.5 * ((u - px.x) * (u - px.x) + (v - px.y) * (v - px.y)) /
                                       (beam_px * beam_px));
                for (int n = 0; n < (2 * around + 1) * (2 * around + 1); n++) {
                    int column = middle.x + n % (2 * around + 1) - around,
                        row = middle.y + n / (2 * around + 1) - around;
                    double away = (column - u) * (column - u) + (row - v) * (row - v);
                    lit.at<float>(row, column) += static_cast<float>(
                        grey / area * beam * std::exp(-0.5 * away / (lens_px * lens_px)));
                }
            }
        }
        return lit;
    }
};

/* The board is found roughly and drawn `given_blur_px` soft. Largest distance of any corner that stands in the picture,
 * and how many are found. */
static double corner_error(const Stage &stage, double blur_px, double given_blur_px, size_t &count)
{
    cv::Mat print = cal::board_picture(stage.board, cal::draw_px_per_mm);
    cv::Mat tangents =
        cal::draw_tangents(stage.camera.size, stage.camera.matrix, stage.camera.distortion);
    cal::Corners corners;
    for (int id = 0; id < stage.board.corner_count(); id++) {
        cv::Point2d px = stage.seen(stage.board.corner_mm(id));
        if (px.x > 20.0 && px.y > 20.0 && px.x < width - 20.0 && px.y < height - 20.0) {
            corners.ids.push_back(id);
            corners.px.emplace_back(px + cv::Point2d(0.2 * std::sin(id), 0.2 * std::cos(3 * id)));
        }
    }
    corners.edge_px = 2.5066 * std::hypot(given_blur_px, 0.29);
    cal::corners_refine(stage.board, print, tangents, stage.picture(blur_px), stage.camera.matrix,
                        stage.camera.distortion, corners);
    double max = 0.0;
    for (size_t i = 0; i < corners.ids.size(); i++)
        max = std::max(max, cv::norm(cv::Point2d(corners.px[i]) -
                                     stage.seen(stage.board.corner_mm(corners.ids[i]))));
    count = corners.ids.size();
    return max;
}

static void check_corners()
{
    Stage stage;
    size_t count, expected = 0;
    double max = corner_error(stage, 0.8, 0.8, count);
    for (int id = 0; id < stage.board.vertex_count(); id++) {
        cv::Point2d px = stage.seen(stage.board.corner_mm(id));
        expected += px.x > 0.0 && px.y > 0.0 && px.x < width - 1.0 && px.y < height - 1.0;
    }
    result("corners, without noise", max < 0.01, max, 0.01);
    result("the outline's corners are among them", count == 70 && expected == 70,
           static_cast<double>(count), 70.0);
    max = corner_error(stage, 0.8, 0.6, count);
    result("corners of a picture softer than it is given as", max < 0.01 && count == 70, max, 0.01);
    /* Edges between the samples of the drawing. */
    for (const char *name : {"charuco-8x6-27.3", "chessboard-9x6-25.1"}) {
        Stage other(name);
        max = corner_error(other, 0.8, 0.8, count);
        result(name, max < 0.02 && count > 60, max, 0.02);
    }
    stage.view.shift += cv::Vec3d(150.0, 0.0, 0.0); /* the right side is out of the frame */
    max = corner_error(stage, 0.8, 0.8, count);
    result("corners of a board at the frame's border", max < 0.01 && count > 45 && count < 70, max,
           0.01);
}

/* Dots on both sides of an edge, in steps, and where edges cross. */
static void check_dots()
{
    Stage stage;
    constexpr double beam_px = 0.8, lens_px = 0.9;
    cv::Mat dark = stage.picture(lens_px);
    cal::Spots spots{
        stage.board,
        stage.camera,
        cal::board_picture(stage.board, cal::draw_px_per_mm),
        cal::draw_tangents(stage.camera.size, stage.camera.matrix, stage.camera.distortion),
        lens_px,
        (dark_grey - black) / (white_grey - black),
        {}};
    double divided = 0.0, drawn = 0.0;
    for (int i = 0; i < 12; i++) {
        cv::Point2d px =
            stage.seen({30.0 * (2 + i / 4) + 0.5 * (i - 6), 60.0 + 4.5 * (i % 3), 0.0});
        cv::Mat lit = dark + stage.dot(px, beam_px, lens_px, 90.0);
        cal::Lit found;
        found.view = stage.view;
        cal::sightings_find(stage.board, stage.camera, lit, dark, found);
        if (found.sightings.size() != 1) {
            result("one dot is found", false, static_cast<double>(found.sightings.size()), 1.0);
            return;
        }
        divided = std::max(divided, cv::norm(found.sightings[0].px - px));
        cal::spots_refine(spots, lit, dark, found);
        drawn = std::max(drawn, cv::norm(found.sightings[0].px - px));
    }
    result("dots on edges, as they are found first, are pushed aside", divided > 0.1, divided, 0.1);
    result("dots on edges", drawn < 0.03, drawn, 0.03);
}

static void check_lens()
{
    cal::Lit lit;
    for (int i = 0; i < 200; i++) {
        cal::Sighting sighting{};
        double z_mm = 400.0 + 5.0 * i, near = 1000.0 / z_mm;
        sighting.position_mm = {0.0, 0.0, z_mm};
        sighting.wide_px = std::sqrt(0.81 + 0.2 * near * near + 0.05 * std::sin(2.4 * i)) +
                           (i % 20 == 7 ? 1.0 : 0.0); /* two dots taken for one */
        lit.sightings.push_back(sighting);
    }
    double error = std::abs(cal::spot_lens_px({lit}) - 0.9);
    result("the lens' part of a dot's width", error < 0.03, error, 0.03);
    /* Dots of 1.2 px, a few of them, all as far off: by chance the farther ones are the wider. */
    lit.sightings.clear();
    for (int i = -20; i < 20; i++) {
        cal::Sighting sighting{};
        sighting.position_mm = {0.0, 0.0, 600.0 + 0.5 * i};
        sighting.wide_px = 1.2 + 0.005 * i;
        lit.sightings.push_back(sighting);
    }
    double lens_px = cal::spot_lens_px({lit});
    result("it is no more than the width", lens_px < 1.2, lens_px, 1.2);
}

/* Noise of a sensor on white paper, on which the old limit left every pixel but a few out; and dots. */
static void check_pairs()
{
    cv::RNG random(7);
    cv::Mat dark(height, width, CV_32F, cv::Scalar(180.0)), lit = dark.clone(),
                                                            noise(dark.size(), CV_32F);
    cv::Mat spot = cv::Mat::zeros(dark.size(), CV_32F);
    for (int v = 20; v < height - 20; v += 40) {
        for (int u = 20; u < width - 20; u += 40) {
            for (int n = 0; n < 121; n++) {
                int column = n % 11 - 5, row = n / 11 - 5;
                spot.at<float>(v + row, u + column) =
                    static_cast<float>(40.0 * std::exp(-0.5 * (column * column + row * row) / 1.7));
            }
        }
    }
    for (cv::Mat *picture : {&dark, &lit}) {
        random.fill(noise, cv::RNG::NORMAL, 0.0, 3.3);
        *picture += noise;
    }
    lit += spot;
    cv::Mat mean = cal::pairs_mean(dark, lit), used = mean != dark;
    double fraction = cv::countNonZero(used & (spot == 0.0f)) /
                      static_cast<double>(cv::countNonZero(spot == 0.0f));
    result("laser-on and laser-off pictures are averaged where no dot is", fraction > 0.85,
           fraction, 0.85);
    double leaked = cv::countNonZero(used & (spot > 3.0f));
    result("and nowhere else", leaked == 0.0, leaked, 0.0);
}

/* Light that fades to the right, as in a room with one window. */
static void check_fading()
{
    Stage stage;
    cv::Mat print = cal::board_picture(stage.board, cal::draw_px_per_mm), grey = stage.picture(0.8);
    cv::Mat tangents =
        cal::draw_tangents(stage.camera.size, stage.camera.matrix, stage.camera.distortion);
    for (int v = 0; v < height; v++) {
        for (int u = 0; u < width; u++)
            grey.at<float>(v, u) *= 1.5f - 1.0f * static_cast<float>(u) / width;
    }
    cal::Corners corners;
    for (int id = 0; id < stage.board.corner_count(); id++) {
        corners.ids.push_back(id);
        corners.px.emplace_back(stage.seen(stage.board.corner_mm(id)));
    }
    corners.edge_px = 2.5066 * std::hypot(0.8, 0.29);
    cal::corners_refine(stage.board, print, tangents, grey, stage.camera.matrix,
                        stage.camera.distortion, corners);
    double max = 0.0;
    for (size_t i = 0; i < corners.ids.size(); i++)
        max = std::max(max, cv::norm(cv::Point2d(corners.px[i]) -
                                     stage.seen(stage.board.corner_mm(corners.ids[i]))));
    result("corners in light that fades", max < 0.006 && corners.ids.size() > 60, max, 0.006);
}

/* Dots whose beams have speckle: the fit that models it errs less than the one to which all pixels are alike, and
 * tells its error. */
static void check_speckle()
{
    constexpr double beam_px = 0.9, lens_px = 0.9, noise_grey = 3.0, contrast = 0.45;
    constexpr int count = 200, side = cal::dot_side_px;
    cv::RNG random(11);
    double plain = 0.0, knowing = 0.0, reported = 0.0;
    for (int n = 0; n < count; n++) {
        cv::Mat light(cal::beam_side, cal::beam_side, CV_64F), lens(side, cal::beam_side, CV_64F),
            rise;
        cv::Point2d px(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5));
        for (int i = 0; i < cal::beam_side * cal::beam_side; i++) {
            double x = cal::beam_sample_px(i % cal::beam_side) - px.x,
                   y = cal::beam_sample_px(i / cal::beam_side) - px.y;
            /* A sample is a ninth of a px^2; speckle of 0.1 of the beam's square have 0.9 of its light's variance. */
            double speckle_var =
                1.0 + contrast / 0.45 * beam_px * random.gaussian(std::sqrt(0.1 * 9.0));
            light.at<double>(i / cal::beam_side, i % cal::beam_side) =
                speckle_var * std::exp(-0.5 * (x * x + y * y) / (beam_px * beam_px));
        }
        for (int i = 0; i < side * cal::beam_side; i++) {
            double away =
                (i / cal::beam_side - cal::dot_reach_px - cal::beam_sample_px(i % cal::beam_side)) /
                lens_px;
            lens.at<double>(i / cal::beam_side, i % cal::beam_side) =
                2.0 * std::exp(-0.5 * away * away);
        }
        cv::Mat(lens * light * lens.t()).convertTo(rise, CV_32F);
        cv::Mat noise(rise.size(), CV_32F);
        random.fill(noise, cv::RNG::NORMAL, 0.0, noise_grey);
        rise += noise;
        cal::Dot dot{};
        cal::Beam beam{{0.0, 0.0}, 0.7, 0.0};
        cal::BeamWindow window{cv::Mat(light.size(), CV_64F, cv::Scalar(1.0)), rise, rise,
                               cv::Mat(rise.size(), CV_64F, cv::Scalar(noise_grey * noise_grey)),
                               lens_px};
        if (!cal::dot_fit(rise, rise, dot) || !cal::beam_fit(window, beam)) {
            result("a grainy dot is fitted", false, n, count);
            return;
        }
        plain += (dot.px - px).ddot(dot.px - px) / (2 * count);
        knowing += (beam.px - px).ddot(beam.px - px) / (2 * count);
        reported += beam.sigma_px * beam.sigma_px / count;
    }
    double better = std::sqrt(knowing / plain), honest = std::sqrt(knowing / reported);
    result("speckle moves a fit that models it less", better < 0.95, better, 0.95);
    result("and it tells its error", honest > 0.8 && honest < 1.25, honest, 1.25);
}

/* A near board under many bright dots, and the same a pixel aside. */
static void check_pair()
{
    Stage stage;
    cv::Mat dark = stage.picture(0.8), lit = dark.clone();
    for (int v = 10; v < height; v += 20) {
        for (int u = 10; u < width; u += 20)
            cv::circle(lit, {u, v}, 5, cv::Scalar(255.0), cv::FILLED);
    }
    cal::View view, none;
    for (int id = 0; id < stage.board.corner_count(); id++)
        view.corners.px.emplace_back(stage.seen(stage.board.corner_mm(id)));
    cv::Mat aside, move = (cv::Mat_<double>(2, 3) << 1.0, 0.0, 1.0, 0.0, 1.0, 0.4);
    cv::warpAffine(lit, aside, move, lit.size());
    int same = cal::pairs_find({{"a", dark, false}, {"b", lit, true}}, {view, none})[1];
    int moved = cal::pairs_find({{"a", dark, false}, {"b", aside, true}}, {view, none})[1];
    result("a board under dots stands still", same == 0, same, 0.0);
    result("and a pixel aside it does not", moved == -1, moved, -1.0);
}

/* A projector beside the camera, whose rays are known. */
static cal::Projector known_projector()
{
    cal::Projector projector;
    projector.origin_mm = {12.0, 1.0, 2.0};
    projector.nominal_sigma_deg = 0.01;
    for (size_t slot = 0; slot < cal::slot_count; slot++) {
        double column = static_cast<double>(slot % 19) - 9.0,
               row = static_cast<double>(slot / 19) - 9.0;
        projector.rays[slot] = cv::normalize(
            cv::Vec3d(0.03 * column - 0.0016 * row, 0.03 * row + 0.0016 * column, 1.0));
        projector.seen[slot] = 5;
        projector.sigma_deg[slot] = 0.003;
    }
    return projector;
}

/* Dots without neighbours on a board, where rays are or `aside_px` from there, in a picture that was refused for that. */
static size_t join_wrongly(double aside_px, bool &used)
{
    Stage stage;
    cal::Projector projector = known_projector();
    std::vector<cal::Lit> pictures(1);
    cal::Lit &lit = pictures.front();
    const std::vector<int> slots = {124, 163, 184, 206, 237};
    lit.view = stage.view;
    lit.refused = "few";
    lit.sparse = true;
    cv::Vec3d normal = lit.view.normal();
    double height_mm = normal.dot(lit.view.shift) - normal.dot(projector.origin_mm);
    for (int slot : slots) {
        const cv::Vec3d &ray = projector.rays[static_cast<size_t>(slot)];
        cv::Vec3d position = projector.origin_mm + ray * (height_mm / normal.dot(ray));
        cal::Sighting sighting{};
        cv::Point2d px(centre_u + focal_px * position[0] / position[2] + aside_px,
                       centre_v + focal_px * position[1] / position[2]);
        cal::sighting_set(stage.camera, lit.view, px, sighting);
        lit.sightings.push_back(sighting);
    }
    cal::rays_join(stage.camera, projector, pictures);
    used = lit.refused.empty();
    size_t wrong = 0;
    for (size_t i = 0; i < slots.size(); i++)
        wrong += lit.sightings[i].slot != (used ? slots[i] : cal::no_slot);
    return wrong;
}

static void check_join()
{
    bool used, used_aside;
    size_t wrong = join_wrongly(0.1, used), wrong_aside = join_wrongly(3.0, used_aside);
    result("dots without neighbours are identified by their rays", used && wrong == 0,
           static_cast<double>(wrong), 0.0);
    result("but not those that are elsewhere", !used_aside && wrong_aside == 0,
           static_cast<double>(wrong_aside), 0.0);
}

/* Pictures of a rough wall with dots of which 30 % are missing in each, behind a sheet that is elsewhere in each; in one of
 * them something bright stands before a part of it. */
static void check_wall_dots()
{
    constexpr int pairs = 18, apart_px = 25;
    constexpr double noise_grey = 1.2, peak_grey = 15.0, wide_px = 0.95, lens_px = 0.9;
    Stage stage;
    cv::RNG random(11);
    cv::Mat wall(height, width, CV_32F);
    random.fill(wall, cv::RNG::NORMAL, 50.0, 2.0);
    std::vector<cv::Point2d> positions;
    for (int v = apart_px; v < height - apart_px; v += apart_px) {
        for (int u = apart_px; u < width - apart_px; u += apart_px)
            positions.emplace_back(u + random.uniform(-0.5, 0.5), v + random.uniform(-0.5, 0.5));
    }
    std::vector<cal::Picture> pictures;
    std::vector<int> dark_of;
    std::vector<cal::Lit> all;
    for (int pair = 0; pair < pairs; pair++) {
        cv::Mat lit = wall.clone(), dark = wall.clone(), noise(height, width, CV_32F);
        for (const cv::Point2d &px : positions) {
            if (random.uniform(0.0, 1.0) < 0.3)
                continue;
            for (int i = 0; i < cal::dot_side_px * cal::dot_side_px; i++) {
                int u = cvRound(px.x) + i % cal::dot_side_px - cal::dot_reach_px,
                    v = cvRound(px.y) + i / cal::dot_side_px - cal::dot_reach_px;
                double away = cv::norm(cv::Point2d(u, v) - px) / wide_px;
                lit.at<float>(v, u) += static_cast<float>(peak_grey * std::exp(-0.5 * away * away));
            }
        }
        if (pair == 3)
            cv::circle(lit, {320, 240}, 60, cv::Scalar(130.0), cv::FILLED);
        for (cv::Mat *picture : {&lit, &dark}) {
            random.fill(noise, cv::RNG::NORMAL, 0.0, noise_grey);
            *picture += noise;
        }
        cal::Lit here;
        here.view = stage.view;
        here.view.shift += cv::Vec3d(random.uniform(-250.0, 250.0), random.uniform(-180.0, 180.0),
                                     random.uniform(100.0, 500.0));
        all.push_back(here);
        pictures.push_back({"lit", lit, true});
        pictures.push_back({"dark", dark, false});
        dark_of.push_back(2 * pair + 1);
        dark_of.push_back(-1);
    }
    cal::Lit found = cal::wall_find(stage.board, stage.camera, pictures, dark_of, all,
                                    {noise_grey * noise_grey, 0.0}, lens_px);
    double squares = 0.0, pulls = 0.0;
    for (const cal::Sighting &sighting : found.sightings) {
        double off_px = 1e9;
        for (const cv::Point2d &px : positions)
            off_px = std::min(off_px, cv::norm(sighting.px - px));
        squares += 0.5 * off_px * off_px;
        pulls += 0.5 * off_px * off_px / (sighting.sigma_px * sighting.sigma_px);
    }
    double count = static_cast<double>(found.sightings.size());
    double rms_px = std::sqrt(squares / count), pull = std::sqrt(pulls / count);
    result("dots on a wall, of which some are missing",
           count > 0.85 * static_cast<double>(positions.size()) && rms_px < 0.033, rms_px, 0.033);
    result("and how well they are known", pull > 0.65 && pull < 1.25, pull, 1.25);
}

/* A projector beside the camera, and dots on a wall of which some are on things before it. */
static void check_wall()
{
    Stage stage;
    cv::RNG random(5);
    cal::Projector projector = known_projector();
    cal::Lit wall;
    cv::Vec3d normal = cv::normalize(cv::Vec3d(0.2, -0.1, 1.0));
    constexpr double height_mm = 2200.0, noise_px = 0.05;
    for (size_t slot = 0; slot < cal::slot_count; slot++) {
        const cv::Vec3d &ray = projector.rays[slot];
        double along = (height_mm - normal.dot(projector.origin_mm)) / normal.dot(ray);
        bool is_before = slot % 5 == 2;
        cv::Vec3d position = projector.origin_mm + ray * (is_before ? 0.6 * along : along);
        cal::Sighting sighting{};
        sighting.sigma_px = noise_px;
        sighting.px = {centre_u + focal_px * position[0] / position[2] + random.gaussian(noise_px),
                       centre_v + focal_px * position[1] / position[2] + random.gaussian(noise_px)};
        sighting.tangent = stage.camera.tangents({sighting.px}).front();
        wall.sightings.push_back(sighting);
    }
    bool laid = cal::wall_lay(stage.camera, projector, wall);
    double off_mm = 0.0;
    size_t wrong = 0, used = 0;
    for (size_t slot = 0; slot < cal::slot_count; slot++) {
        const cal::Sighting &sighting = wall.sightings[slot];
        used += sighting.slot != cal::no_slot;
        wrong += sighting.slot != cal::no_slot &&
                 (sighting.slot != static_cast<int>(slot) || slot % 5 == 2);
        cv::Vec3d position = wall.view.shift;
        off_mm = std::max(off_mm, std::abs(normal.dot(position) - height_mm));
    }
    result("a wall behind the board", laid && used > 270 && off_mm < 10.0, off_mm, 10.0);
    result("without the things before it", wrong == 0, static_cast<double>(wrong), 0.0);
    for (cal::Sighting &sighting : wall.sightings) {
        double along = random.uniform(900.0, 4000.0);
        size_t slot = static_cast<size_t>(&sighting - wall.sightings.data());
        cv::Vec3d position = projector.origin_mm + projector.rays[slot] * along;
        sighting.px = {centre_u + focal_px * position[0] / position[2],
                       centre_v + focal_px * position[1] / position[2]};
        sighting.tangent = stage.camera.tangents({sighting.px}).front();
    }
    laid = cal::wall_lay(stage.camera, projector, wall);
    size_t kept = static_cast<size_t>(
        std::count_if(wall.sightings.begin(), wall.sightings.end(),
                      [](const cal::Sighting &s) { return s.slot != cal::no_slot; }));
    result("a heap of things is no wall", !laid, static_cast<double>(kept), 0.0);
}

int main()
{
    check_corners();
    check_dots();
    check_lens();
    check_pairs();
    check_fading();
    check_speckle();
    check_pair();
    check_wall();
    check_wall_dots();
    check_join();
    std::printf("1..%d\n", number);
    return failed == 0 ? 0 : 1;
}
