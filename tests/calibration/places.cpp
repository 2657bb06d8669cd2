/* Corners and dots against places that are known: a board drawn here, finely and by other means than the program's own.
 * Each case is one thing that pushed them aside once. Prints TAP; exit status 1 when a case fails.
 */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "cal_dots.hpp"
#include "cal_refine.hpp"
#include "cal_spot.hpp"
#include "cal_twins.hpp"

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
        view.turn = {0.35, -0.3, 0.12};
        cv::Rodrigues(view.turn, rotation);
        view.shift = cv::Vec3d(25.0, -10.0, 620.0) - rotation * cv::Vec3d(135.0, 90.0, 0.0);
    }

    /* White's share of the sheet at a pixel; beyond it there is nothing. */
    double white_at(double u, double v) const
    {
        cv::Vec3d sight((u - centre_u) / focal_px, (v - centre_v) / focal_px, 1.0);
        cv::Vec3d normal(rotation(0, 2), rotation(1, 2), rotation(2, 2));
        cv::Vec3d place =
            rotation.t() * (sight * (normal.dot(view.shift) / normal.dot(sight)) - view.shift);
        cv::Point2d origin = board.sheet_origin_mm();
        int x = cvFloor((place[0] - origin.x) * sheet_px_per_mm),
            y = cvFloor((place[1] - origin.y) * sheet_px_per_mm);
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

    cv::Point2d seen(const cv::Point3d &place_mm) const
    {
        cv::Vec3d at = rotation * cv::Vec3d(place_mm.x, place_mm.y, place_mm.z) + view.shift;
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

/* The board is found roughly and drawn `told_blur_px` soft. Largest distance of any corner that stands in the picture,
 * and how many are found. */
static double corner_error(const Stage &stage, double blur_px, double told_blur_px, size_t &count)
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
    corners.edge_px = 2.5066 * std::hypot(told_blur_px, 0.29);
    cal::corners_refine(stage.board, print, tangents, stage.picture(blur_px), stage.camera.matrix,
                        stage.camera.distortion, corners);
    double most = 0.0;
    for (size_t i = 0; i < corners.ids.size(); i++)
        most = std::max(most, cv::norm(cv::Point2d(corners.px[i]) -
                                       stage.seen(stage.board.corner_mm(corners.ids[i]))));
    count = corners.ids.size();
    return most;
}

static void check_corners()
{
    Stage stage;
    size_t count, expected = 0;
    double most = corner_error(stage, 0.8, 0.8, count);
    for (int id = 0; id < stage.board.vertex_count(); id++) {
        cv::Point2d px = stage.seen(stage.board.corner_mm(id));
        expected += px.x > 0.0 && px.y > 0.0 && px.x < width - 1.0 && px.y < height - 1.0;
    }
    result("corners, without noise", most < 0.01, most, 0.01);
    result("the outline's corners are among them", count == 70 && expected == 70,
           static_cast<double>(count), 70.0);
    most = corner_error(stage, 0.8, 0.6, count);
    result("corners of a picture softer than it is told", most < 0.01 && count == 70, most, 0.01);
    /* Edges between the samples of the drawing. */
    for (const char *name : {"charuco-8x6-27.3", "chessboard-9x6-25.1"}) {
        Stage other(name);
        most = corner_error(other, 0.8, 0.8, count);
        result(name, most < 0.02 && count > 60, most, 0.02);
    }
    stage.view.shift += cv::Vec3d(150.0, 0.0, 0.0); /* the right side is out of the frame */
    most = corner_error(stage, 0.8, 0.8, count);
    result("corners of a board at the frame's border", most < 0.01 && count > 45 && count < 70,
           most, 0.01);
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
        cal::spots_place(spots, lit, dark, found);
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
        sighting.place_mm = {0.0, 0.0, z_mm};
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
        sighting.place_mm = {0.0, 0.0, 600.0 + 0.5 * i};
        sighting.wide_px = 1.2 + 0.005 * i;
        lit.sightings.push_back(sighting);
    }
    double lens_px = cal::spot_lens_px({lit});
    result("it is no more than the width", lens_px < 1.2, lens_px, 1.2);
}

/* Noise of a sensor on white paper, on which the old limit left every pixel but a few out; and dots. */
static void check_twins()
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
    cv::Mat mean = cal::twins_mean(dark, lit), used = mean != dark;
    double share = cv::countNonZero(used & (spot == 0.0f)) /
                   static_cast<double>(cv::countNonZero(spot == 0.0f));
    result("twins are averaged where no dot is", share > 0.85, share, 0.85);
    double leaked = cv::countNonZero(used & (spot > 3.0f));
    result("and nowhere else", leaked == 0.0, leaked, 0.0);
}

int main()
{
    check_corners();
    check_dots();
    check_lens();
    check_twins();
    std::printf("1..%d\n", number);
    return failed == 0 ? 0 : 1;
}
