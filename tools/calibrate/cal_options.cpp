#include "cal_options.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "cal_board.hpp"
#include "cal_error.hpp"
#include "cal_pictures.hpp"
#include "tool_options.hpp"

namespace cal
{
const char *const options_help = /* at most 80 columns */
    "Usage: calibrate board [--board NAME] FILE\n"
    "       calibrate guide [--board NAME] [--camera DEVICE [--size WxH]] DIR\n"
    "       calibrate solve [--board NAME] [--near MM] [--far MM]\n"
    "                       [--tilt DEG] [--roll DEG] [--plumb FILE]\n"
    "                       [--middle FILE:U,V]\n"
    "                       --out OUT DIR\n"
    "From pictures of a printed board to rig.json: docs/calibration.md has the steps.\n"
    "\n"
    "  board            the board to print, A4 in true size: FILE.pdf; FILE.pgm for\n"
    "                   tools/render\n"
    "  guide            which of DIR's pictures are good, and what is missing; exit\n"
    "                   status 1 while something is\n"
    "  solve            camera and projector: OUT/rig.json and OUT/report.html\n"
    "\n"
    "  --board NAME     charuco-9x6-30 (default) or the like, or chessboard-...:\n"
    "                   squares across, down, mm of a side\n"
    "  --camera DEVICE  take pictures into DIR, beside those that are there: a\n"
    "                   camera's number or device, or a film; each pose twice,\n"
    "                   laser off and on\n"
    "  --size WxH       the size of the camera's frames in pixels (default: that of\n"
    "                   DIR's pictures, else as the camera gives them)\n"
    "  --near MM, --far MM   the working range in Z, for rig.json (default 400,\n"
    "                   2600; from 100 to 16000)\n"
    "  --tilt DEG, --roll DEG   how the camera will hang, for rig.json: it looks down\n"
    "                   by the tilt (-80 to 80, below 0: up), and heads' tops tip to\n"
    "                   the right in its picture by the roll (-180 to 180)\n"
    "  --plumb FILE     it will hang as it did for this picture, in which the board\n"
    "                   hung plumb, with its upper edge level\n"
    "  --middle FILE:U,V     the pattern's middle dot is at pixel U,V of a picture\n"
    "                   with the laser on; needed only where the pattern's edges are\n"
    "                   not seen on the board\n"
    "  --help           this text\n"
    "\n"
    "DIR holds binary PGM files and frames.jsonl, which says in which the laser was\n"
    "on (docs/contract.md), or files named NAME-on.pgm and NAME-off.pgm.\n"
    "Exit status: 0 done; 1 pictures that cannot be read, or that cannot support a\n"
    "calibration, a camera that cannot be used or gives no more frames, a file that\n"
    "cannot be written; 2 wrong usage.\n";

enum OptionId {
    opt_board = tool::opt_help + 1,
    opt_camera,
    opt_size,
    opt_near,
    opt_far,
    opt_middle,
    opt_out,
    opt_tilt,
    opt_roll,
    opt_plumb
};

static bool complain(const std::string &what)
{
    return tool::complain("calibrate", what);
}

/* What the core takes (firmware/core/base/ih_config.h). */
static constexpr double depth_min_mm = 100.0, depth_max_mm = 16000.0;

static bool read_board(const std::string &value, Board &board)
{
    try {
        board = board_parse(value);
    } catch (const Error &error) {
        return complain(std::string("--board ") + error.what());
    }
    return true;
}

static bool read_mm(const char *name, const char *value, double &mm)
{
    char *end;
    mm = std::strtod(value, &end);
    if (end == value || *end != '\0' || !(mm >= depth_min_mm && mm <= depth_max_mm))
        return complain(
            text("--%s %s: must be a number of mm from %.0f to %.0f", name, value, depth_min_mm, depth_max_mm));
    return true;
}

static bool read_degrees(const char *name, const char *value, double max_deg, double &degrees)
{
    char *end;
    degrees = std::strtod(value, &end);
    if (end == value || *end != '\0' || !(std::abs(degrees) <= max_deg))
        return complain(text("--%s %s: must be a number of degrees from %.0f to %.0f", name, value, -max_deg, max_deg));
    return true;
}

static bool read_middle(const std::string &value, MiddleDot &middle)
{
    size_t colon = value.rfind(':');
    int length = 0;
    if (colon == std::string::npos || colon == 0 ||
        std::sscanf(value.c_str() + colon + 1, "%lf,%lf%n", &middle.px.x, &middle.px.y, &length) != 2 ||
        value.size() != colon + 1 + static_cast<size_t>(length))
        return complain("--middle " + value + ": must be FILE:U,V, U and V in pixels");
    if (!(middle.px.x >= 0.0 && middle.px.x < width_max && middle.px.y >= 0.0 && middle.px.y < height_max))
        return complain("--middle " + value +
                        text(": U must be from 0 to %d px, V from 0 to %d", width_max - 1, height_max - 1));
    middle.file = value.substr(0, colon);
    return true;
}

static bool belongs_to_solve(const char *name, const Options &options)
{
    return options.verb == Verb::solve || complain(std::string("--") + name + " belongs to solve");
}

static bool read_size(const std::string &value, cv::Size &size)
{
    int length = 0;
    if (std::sscanf(value.c_str(), "%4dx%4d%n", &size.width, &size.height, &length) != 2 ||
        value.size() != static_cast<size_t>(length) || !picture_size_fits(size))
        return complain("--size " + value + ": must be WxH, from " + picture_sizes);
    return true;
}

static bool take(int id, const char *value, Options &options)
{
    if (*value == '\0')
        return complain("an option's argument is empty; see calibrate --help");
    switch (id) {
    case opt_board:
        return read_board(value, options.board);
    case opt_camera:
        options.camera = value;
        return options.verb == Verb::guide || complain("--camera belongs to guide");
    case opt_size:
        return read_size(value, options.size);
    case opt_near:
        return belongs_to_solve("near", options) && read_mm("near", value, options.range.near_mm);
    case opt_far:
        return belongs_to_solve("far", options) && read_mm("far", value, options.range.far_mm);
    case opt_tilt:
        return belongs_to_solve("tilt", options) && read_degrees("tilt", value, 80.0, options.mount.tilt_deg);
    case opt_roll:
        return belongs_to_solve("roll", options) && read_degrees("roll", value, 180.0, options.mount.roll_deg);
    case opt_plumb:
        options.mount.plumb_file = value;
        return belongs_to_solve("plumb", options);
    case opt_middle:
        return belongs_to_solve("middle", options) && read_middle(value, options.middle);
    case opt_out:
        options.out = value;
        return true;
    default:
        return false;
    }
}

/* Pictures may have a rig.json of their own, which is no result of ours. Throws Error of a directory that is shut. */
static bool has_pictures(const std::string &dir)
{
    std::error_code unknown; /* of a directory that is not there: it will be made */
    return std::filesystem::is_directory(dir, unknown) &&
           (std::filesystem::exists(dir + "/frames.jsonl", unknown) || !pictures_list(dir).empty());
}

static bool check(const Options &options)
{
    bool solve = options.verb == Verb::solve;
    if (options.target.empty())
        return complain(options.verb == Verb::board ? "one FILE is needed; see calibrate --help"
                                                    : "one DIR is needed; see calibrate --help");
    if (options.verb == Verb::board && !board_prints(options.target))
        return complain(options.target + ": a board's file must end in .pdf or .pgm");
    if (solve != !options.out.empty())
        return complain("--out belongs to solve, which needs it; see calibrate --help");
    std::error_code unknown; /* of a directory that is not there: that is reported later */
    if (solve && std::filesystem::equivalent(options.out, options.target, unknown))
        return complain("--out must be another directory than the pictures': a rig.json there would be lost");
    if (solve && has_pictures(options.out))
        return complain("--out " + options.out + ": has pictures in it: a rig.json there would be lost; is it DIR?");
    if (!options.mount.plumb_file.empty() && !options.board.charuco)
        return complain("--plumb needs a board with markers: a chessboard looks the same upside down");
    if (!options.mount.plumb_file.empty() && (options.mount.tilt_deg != 0.0 || options.mount.roll_deg != 0.0))
        return complain("--plumb says it all: without --tilt and --roll");
    if (!options.size.empty() && options.camera.empty())
        return complain("--size belongs to guide --camera");
    return options.range.near_mm < options.range.far_mm || complain("--near must be less than --far");
}

bool options_parse(int argc, char **argv, Options &options)
{
    static const struct option long_options[] = {
        {"board", required_argument, nullptr, opt_board}, {"camera", required_argument, nullptr, opt_camera},
        {"near", required_argument, nullptr, opt_near},   {"far", required_argument, nullptr, opt_far},
        {"tilt", required_argument, nullptr, opt_tilt},   {"roll", required_argument, nullptr, opt_roll},
        {"plumb", required_argument, nullptr, opt_plumb}, {"middle", required_argument, nullptr, opt_middle},
        {"out", required_argument, nullptr, opt_out},     {"size", required_argument, nullptr, opt_size},
        {"help", no_argument, nullptr, tool::opt_help},   {nullptr, 0, nullptr, 0},
    };
    std::string verb = tool::options_verb(argc, argv);
    if (verb == "--help")
        return true;
    if (verb != "board" && verb != "guide" && verb != "solve")
        return complain("the first word must be board, guide or solve; see calibrate --help");
    options.verb = verb == "board" ? Verb::board : verb == "guide" ? Verb::guide : Verb::solve;
    std::vector<std::string> words;
    auto parsed = tool::options_walk(
        "calibrate", argc, argv, long_options, [&](int id, const char *value) { return take(id, value, options); },
        words);
    if (parsed == tool::Parsed::help)
        options.verb = Verb::help;
    if (parsed != tool::Parsed::words)
        return parsed == tool::Parsed::help;
    if (words.size() == 1)
        options.target = words[0];
    return check(options);
}
} // namespace cal
