#include "cal_guide.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <iostream>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <unistd.h>

#include "cal_coverage.hpp"
#include "cal_dots.hpp"
#include "cal_error.hpp"
#include "cal_pairs.hpp"
#include "tool_progress.hpp"

namespace cal
{
/* A board is held still when its corners move less than this from one frame to the next; it is shown in a new way when
 * they are this far from where they were in every picture, in parts of the frame's width. */
static constexpr double still_px = 0.5, new_fraction = 0.06;
static constexpr int still_frames = 3;
/* A frame that fails may be followed by a good one. A camera that gives none lets each wait for seconds. */
static constexpr int grab_failures_max = 30;
static constexpr std::chrono::seconds grab_wait_max{3};
/* So many dots in the difference of a pair are the laser's. */
static constexpr size_t dots_min = 8;
/* A driver hands over what it queued before the laser was on: four frames or more. In so many there must be dots. */
static constexpr int lit_frames_max = 30;
/* Pairs with and without the laser: some may be lost. */
static constexpr int pairs_wanted = 15;

/* pair_count: pictures with the laser whose laser-off picture shows that they have it. */
static bool report_missing(const Board &board, cv::Size size, std::vector<View> &dark, int pair_count)
{
    coverage_guess_poses(board, size, dark);
    std::vector<std::string> missing = coverage_missing(dark, size, coverage_wanted);
    if (pair_count < pairs_wanted)
        missing.push_back(text("%d more pictures with the laser on, each beside one without it where the board did not "
                               "move: there are %d of %d",
                               pairs_wanted - pair_count, pair_count, pairs_wanted));
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

static size_t count_dots(const cv::Mat &lit, const cv::Mat &dark)
{
    return dots_find(lit, dark, cv::Mat(lit.size(), CV_8U, cv::Scalar(255))).size();
}

/* How many laser-on pictures have a laser-off one. Reports those whose dots are missing, or are in the other one. */
static int count_pairs(const std::vector<Picture> &pictures, const std::vector<View> &views, tool::Progress &progress)
{
    std::vector<int> dark_of = pairs_find(pictures, views);
    int pair_count = 0;
    for (size_t i = 0; i < pictures.size(); i++) {
        progress.show("looking for the laser's dots", i, pictures.size());
        if (dark_of[i] < 0)
            continue;
        const Picture &lit = pictures[i], &dark = pictures[static_cast<size_t>(dark_of[i])];
        if (count_dots(lit.grey, dark.grey) >= dots_min) {
            pair_count++;
            continue;
        }
        progress.clear();
        bool mixed_up = count_dots(dark.grey, lit.grey) >= dots_min;
        std::printf("%s: no good: no dots of the laser, %s\n", lit.file.c_str(),
                    mixed_up ? ("but in " + dark.file + ", which should have none: are the two mixed up?").c_str()
                             : "though it should be on");
    }
    progress.clear();
    return pair_count;
}

bool guide_directory(const Options &options)
{
    const Board &board = options.board;
    std::vector<Picture> pictures = pictures_read(options.target);
    std::vector<View> views, dark;
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
    int pair_count = count_pairs(pictures, views, progress);
    std::printf(
        "%zu pictures without the laser, %zu with it, %d of these beside one without where the board did not move\n",
        dark.size(), pictures.size() - dark.size(), pair_count);
    return report_missing(board, pictures.front().grey.size(), dark, pair_count);
}

/* How far corners that both show are apart, median; a large number where they share too few. */
static double moved_px(const Corners &a, const Corners &b)
{
    std::vector<double> offsets;
    for (size_t i = 0; i < a.ids.size(); i++) {
        auto other = std::find(b.ids.begin(), b.ids.end(), a.ids[i]);
        if (other != b.ids.end())
            offsets.push_back(cv::norm(a.px[i] - b.px[static_cast<size_t>(other - b.ids.begin())]));
    }
    if (offsets.size() < 4)
        return 1e9;
    std::nth_element(offsets.begin(), offsets.begin() + static_cast<std::ptrdiff_t>(offsets.size() / 2), offsets.end());
    return offsets[offsets.size() / 2];
}

/* A camera's number or device; else a film, or a film's frames as FFmpeg and OpenCV name them. */
static std::string device_of(const std::string &name)
{
    bool number = name.find_first_not_of("0123456789") == std::string::npos;
    return number ? "/dev/video" + name : name.compare(0, 5, "/dev/") == 0 ? name : "";
}

/* Luma as the camera gives it, as the board's program takes it: made of colours its lightest and darkest would be lost.
 * Once the size is set: a driver may have other samples for another one. */
static void take_luma(cv::VideoCapture &camera)
{
    int code = static_cast<int>(camera.get(cv::CAP_PROP_FOURCC));
    if (code == cv::VideoWriter::fourcc('Y', 'U', 'Y', 'V') || code == cv::VideoWriter::fourcc('G', 'R', 'E', 'Y'))
        camera.set(cv::CAP_PROP_CONVERT_RGB, 0.0);
}

static cv::VideoCapture open_camera(const std::string &name)
{
    cv::VideoCapture camera;
    std::string device = device_of(name);
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT); /* of backends that were tried in vain */
    int opened = device.empty() ? -1 : open(device.c_str(), O_RDWR | O_CLOEXEC);
    if (!device.empty() && opened < 0)
        throw Error("--camera " + name + ": " + device + ": " + std::strerror(errno));
    if (opened >= 0)
        close(opened);
    if (!device.empty() && !camera.open(device, cv::CAP_V4L2))
        throw Error("--camera " + name + ": " + device + ": is no camera, or another program has it");
    if (device.empty() && !camera.open(name))
        throw Error("--camera " + name + ": is neither a camera's number or device nor a film that can be read");
    return camera;
}

/* False: the film is at its end, or the camera gone. Throws where frames are too large or too small to be used later. */
static bool next_frame(cv::VideoCapture &camera, cv::Mat &grey8)
{
    cv::Mat frame;
    auto began = std::chrono::steady_clock::now();
    for (int failures = 0; failures < grab_failures_max; failures++) {
        if (failures > 0 && std::chrono::steady_clock::now() - began > grab_wait_max)
            break;
        if (camera.read(frame) && !frame.empty()) {
            picture_check_size("the camera's frames", frame.cols, frame.rows);
            if (frame.channels() == 3)
                cv::cvtColor(frame, grey8, cv::COLOR_BGR2GRAY);
            else if (frame.channels() == 2)
                cv::extractChannel(frame, grey8, 0);
            else
                grey8 = frame.clone();
            return true;
        }
    }
    return false;
}

/* Frames, of the wanted size if there is one, until the board was found, sharp, still, and elsewhere than in all views. False: no more frames. */
static bool wait_for_board(const Board &board, cv::VideoCapture &camera, cv::Size wanted,
                           const std::vector<View> &views, View &taken)
{
    Corners before;
    std::string reported;
    cv::Mat grey8;
    for (int still = 0; next_frame(camera, grey8);) {
        if (!wanted.empty() && grey8.size() != wanted)
            throw Error(text("the camera's frames: %dx%d pixels, not %dx%d as --size or the pictures before them want",
                             grey8.cols, grey8.rows, wanted.width, wanted.height));
        taken = look(board, "", grey8);
        bool is_new = std::all_of(views.begin(), views.end(), [&](const View &view) {
            return moved_px(view.corners, taken.corners) > new_fraction * grey8.cols;
        });
        still = taken.good() && moved_px(before, taken.corners) < still_px ? still + 1 : 0;
        std::string say = !taken.good() ? taken.corners.refused
                          : !is_new     ? "show the board elsewhere, nearer, farther or tilted"
                                        : "hold still";
        before = taken.corners;
        if (say != reported)
            std::printf("  %s\n", say.c_str());
        std::fflush(stdout);
        reported = say;
        if (taken.good() && is_new && still >= still_frames)
            return true;
    }
    return false;
}

static Picture as_picture(const std::string &file, const cv::Mat &grey8, bool laser)
{
    Picture picture{file, {}, laser};
    grey8.convertTo(picture.grey, CV_32F);
    return picture;
}

/* What became of a pose's picture with the laser. */
enum class Taken { whole, again, no_frames };

/* The next frame but one that shows dots: the laser may have come on within the first. again: there is none. */
static Taken next_lit(cv::VideoCapture &camera, const cv::Mat &dark, cv::Mat &grey8)
{
    for (int i = 0; i < lit_frames_max; i++) {
        if (!next_frame(camera, grey8))
            return Taken::no_frames;
        cv::Mat lit;
        grey8.convertTo(lit, CV_32F);
        if (count_dots(lit, dark) >= dots_min)
            return next_frame(camera, grey8) ? Taken::whole : Taken::no_frames;
    }
    return Taken::again;
}

static void wait_for_enter(const char *request)
{
    std::string line;
    std::printf("  %s, press Enter\n", request);
    std::fflush(stdout);
    if (!std::getline(std::cin, line))
        throw Error("nobody there to press Enter: standard input is at its end");
}

/* The same pose with the laser on. again: it failed, the message is printed and the user has switched it off;
 * no_frames: the message to do so is printed. */
static Taken take_lit(const Board &board, cv::VideoCapture &camera, const View &taken, cv::Mat &grey8)
{
    Picture dark = as_picture(taken.file, taken.grey8, false);
    wait_for_enter("now switch the laser on, hold still");
    Taken found = next_lit(camera, dark.grey, grey8);
    if (found == Taken::no_frames)
        std::printf("  no more frames come: switch the laser off\n");
    if (found == Taken::again) {
        std::printf(
            "  no dots of the laser are seen but those that were there before: is it on, and was it off then?\n");
        wait_for_enter("this pose once more: switch the laser off");
    }
    if (found != Taken::whole)
        return found;
    Picture lit = as_picture("lit", grey8, true);
    if (pairs_find({dark, lit}, {taken, look(board, lit.file, grey8)})[1] < 0) {
        std::printf("  the board has moved between the two pictures\n");
        wait_for_enter("this pose once more: switch the laser off");
        return Taken::again;
    }
    return Taken::whole;
}

/* Pairs that were taken before, without the laser. `size` is the one that is wanted, if any; theirs afterwards. */
static std::vector<View> views_before(const Board &board, const std::string &dir, cv::Size &size, int &pair_count)
{
    std::error_code failed;
    std::vector<View> views, dark;
    std::filesystem::create_directories(dir, failed);
    if (failed)
        throw Error(dir + ": " + failed.message());
    bool has_list = std::filesystem::exists(dir + "/frames.jsonl", failed);
    if (failed)
        throw Error(dir + "/frames.jsonl: " + failed.message());
    if (has_list)
        throw Error(dir +
                    ": has a frames.jsonl, which would not know of new pictures: take them into another directory");
    if (pictures_list(dir).empty())
        return {};
    tool::Progress progress;
    std::vector<Picture> pictures = pictures_read(dir);
    cv::Size there = pictures.front().grey.size();
    if (!size.empty() && size != there)
        throw Error(text("--size %dx%d: but the pictures in %s have %dx%d pixels: leave --size out, or take the others "
                         "into another directory",
                         size.width, size.height, dir.c_str(), there.width, there.height));
    size = there;
    for (const Picture &picture : pictures) {
        progress.show("looking at the pictures that are there", views.size(), pictures.size());
        views.push_back(look(board, picture.file, picture.grey8()));
        if (!picture.laser)
            dark.push_back(views.back());
    }
    pair_count = count_pairs(pictures, views, progress);
    std::printf("%zu pictures without the laser are there already\n", dark.size());
    return dark;
}

/* DIR/NNN, the first that is free. */
static std::string free_name(const std::string &dir)
{
    std::error_code unknown; /* writing it says why */
    for (int number = 0;; number++) {
        std::string name = dir + text("/%03d", number);
        if (!std::filesystem::exists(name + "-off.pgm", unknown) && !std::filesystem::exists(name + "-on.pgm", unknown))
            return name;
    }
}

/* Both or none, unless it is killed. */
static void write_pair(const std::string &name, const cv::Mat &dark, const cv::Mat &lit)
{
    picture_write(name + "-off.pgm", dark);
    try {
        picture_write(name + "-on.pgm", lit);
    } catch (const Error &) {
        std::error_code failed; /* the first fault is the one to tell */
        std::filesystem::remove(name + "-off.pgm", failed);
        throw;
    }
}

bool guide_camera(const Options &options)
{
    const Board &board = options.board;
    cv::VideoCapture camera = open_camera(options.camera);
    int pair_count = 0;
    cv::Size wanted = options.size;
    std::vector<View> views = views_before(board, options.target, wanted, pair_count);
    if (!wanted.empty()) {
        camera.set(cv::CAP_PROP_FRAME_WIDTH, wanted.width);
        camera.set(cv::CAP_PROP_FRAME_HEIGHT, wanted.height);
    }
    if (!device_of(options.camera).empty())
        take_luma(camera);
    View taken;
    while (wait_for_board(board, camera, wanted, views, taken)) {
        cv::Mat lit;
        Taken found = take_lit(board, camera, taken, lit);
        if (found == Taken::no_frames)
            break;
        if (found == Taken::again)
            continue;
        std::string name = free_name(options.target);
        write_pair(name, taken.grey8, lit);
        std::printf("taken: %s-off.pgm and %s-on.pgm; switch the laser off again\n", name.c_str(), name.c_str());
        views.push_back(taken);
        pair_count++;
        if (report_missing(board, taken.grey8.size(), views, pair_count))
            return true;
    }
    std::printf("no more frames from %s\n", options.camera.c_str());
    return false;
}
} // namespace cal
