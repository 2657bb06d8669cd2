#include "cal_guide.hpp"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "cal_coverage.hpp"
#include "cal_error.hpp"
#include "cal_twins.hpp"
#include "tool_progress.hpp"

namespace cal
{
/* A board is held still when its corners move less than this from one frame to the next; it is shown in a new way when
 * they are this far from where they were in every picture, in parts of the frame's width. */
static constexpr double still_px = 0.5, new_share = 0.06;
static constexpr int still_frames = 3, grab_failures_max = 30;

static bool tell_missing(const Board &board, cv::Size size, std::vector<View> &views)
{
    coverage_guess_poses(board, size, views);
    std::vector<std::string> missing = coverage_missing(views, size, coverage_wanted);
    std::printf(missing.empty() ? "nothing is missing: go on with calibrate solve\n" : "still missing:\n");
    for (const std::string &sentence : missing)
        std::printf("  - %s\n", sentence.c_str());
    std::fflush(stdout);
    return missing.empty();
}

static View look(const Board &board, const std::string &file, const cv::Mat &grey8)
{
    View view;
    view.file = file;
    view.grey8 = grey8;
    view.corners = corners_find(board, grey8);
    return view;
}

bool guide_directory(const Options &options)
{
    Board board = board_parse(options.board);
    std::vector<Picture> pictures = pictures_read(options.target);
    std::vector<View> views, dark;
    int twin_count = 0;
    tool::Progress progress(true);
    for (const Picture &picture : pictures) {
        progress.show("looking for the board", views.size(), pictures.size());
        views.push_back(look(board, picture.file, picture.grey8()));
        const Corners &corners = views.back().corners;
        if (corners.refused.empty())
            std::printf("%s: good, %zu corners, laser %s\n", picture.file.c_str(), corners.ids.size(),
                        picture.laser ? "on" : "off");
        else
            std::printf("%s: no good: %s\n", picture.file.c_str(), corners.refused.c_str());
        if (!picture.laser)
            dark.push_back(views.back());
    }
    progress.clear();
    for (int twin : twins_find(pictures, views))
        twin_count += twin >= 0;
    std::printf(
        "%zu pictures without the laser, %zu with it, %d of these beside one without where the board did not move\n",
        dark.size(), pictures.size() - dark.size(), twin_count);
    return tell_missing(board, pictures.front().grey.size(), dark);
}

/* How far corners that both show are apart, median; a large number where they share too few. */
static double moved_px(const Corners &a, const Corners &b)
{
    std::vector<double> ways;
    for (size_t i = 0; i < a.ids.size(); i++) {
        auto other = std::find(b.ids.begin(), b.ids.end(), a.ids[i]);
        if (other != b.ids.end())
            ways.push_back(cv::norm(a.px[i] - b.px[static_cast<size_t>(other - b.ids.begin())]));
    }
    if (ways.size() < 4)
        return 1e9;
    std::nth_element(ways.begin(), ways.begin() + static_cast<std::ptrdiff_t>(ways.size() / 2), ways.end());
    return ways[ways.size() / 2];
}

static cv::VideoCapture open_camera(const std::string &name)
{
    cv::VideoCapture camera;
    bool number = name.find_first_not_of("0123456789") == std::string::npos;
    if (number ? !camera.open(std::stoi(name), cv::CAP_V4L2) : !camera.open(name))
        throw Error("--camera " + name + ": could not be opened");
    return camera;
}

/* False: the film is at its end. */
static bool next_frame(cv::VideoCapture &camera, cv::Mat &grey8)
{
    cv::Mat frame;
    for (int failures = 0; failures < grab_failures_max; failures++) {
        if (camera.read(frame) && !frame.empty()) {
            if (frame.channels() == 3)
                cv::cvtColor(frame, grey8, cv::COLOR_BGR2GRAY);
            else
                grey8 = frame.clone();
            return true;
        }
    }
    return false;
}

/* Frames until the board was found, sharp, still, and elsewhere than in all views. False: no more frames. */
static bool wait_for_board(const Board &board, cv::VideoCapture &camera, const std::vector<View> &views, View &taken)
{
    Corners before;
    std::string told;
    cv::Mat grey8;
    for (int still = 0; next_frame(camera, grey8);) {
        taken = look(board, "", grey8);
        bool is_new = std::all_of(views.begin(), views.end(), [&](const View &view) {
            return moved_px(view.corners, taken.corners) > new_share * grey8.cols;
        });
        still = taken.good() && moved_px(before, taken.corners) < still_px ? still + 1 : 0;
        std::string say = !taken.good() ? taken.corners.refused
                          : !is_new     ? "show the board elsewhere, nearer, farther or tilted"
                                        : "hold still";
        before = taken.corners;
        if (say != told)
            std::printf("  %s\n", say.c_str());
        std::fflush(stdout);
        told = say;
        if (taken.good() && is_new && still >= still_frames)
            return true;
    }
    return false;
}

/* The same pose with the laser on. False: no more frames. */
static bool take_lit(cv::VideoCapture &camera, const std::string &path)
{
    std::string line;
    cv::Mat grey8;
    std::printf("  now switch the laser on, hold still, press Enter\n");
    std::fflush(stdout);
    std::getline(std::cin, line);
    /* What the driver queued before. */
    for (int i = 0; i < still_frames; i++) {
        if (!next_frame(camera, grey8))
            return false;
    }
    picture_write(path, grey8);
    std::printf("  taken; switch it off again\n");
    return true;
}

bool guide_camera(const Options &options)
{
    Board board = board_parse(options.board);
    cv::VideoCapture camera = open_camera(options.camera);
    std::vector<View> views;
    std::error_code failed;
    std::filesystem::create_directories(options.target, failed);
    if (failed || !std::filesystem::is_empty(options.target))
        throw Error(options.target + ": must be an empty directory, or none yet");
    for (;;) {
        View taken;
        if (!wait_for_board(board, camera, views, taken)) {
            std::printf("no more frames from %s\n", options.camera.c_str());
            return false;
        }
        std::string name = text("%03zu", views.size());
        taken.file = name + "-off.pgm";
        picture_write(options.target + "/" + taken.file, taken.grey8);
        std::printf("picture %s\n", taken.file.c_str());
        views.push_back(taken);
        if (!take_lit(camera, options.target + "/" + name + "-on.pgm"))
            return false;
        if (tell_missing(board, taken.grey8.size(), views))
            return true;
    }
}
} // namespace cal
