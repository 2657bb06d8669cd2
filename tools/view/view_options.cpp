#include "view_options.hpp"

#include <cstdlib>

#include "tool_options.hpp"

namespace view
{
const char *const options_help = /* at most 80 columns */
    "Usage: view control|contours|pair|sheet [options] DIR FILE\n"
    "Draws what host_sim finds in the frames directory DIR: docs/view.md has\n"
    "examples.\n"
    "\n"
    "  control          the image with its dots, their labels and epipolar residuals\n"
    "  contours         the surface's contours, hypotheses with reasons, and the head\n"
    "  pair             both side by side, small\n"
    "  sheet            consecutive frames: image above, contours below, the head's\n"
    "                   distance\n"
    "\n"
    "FILE.png holds one picture, FILE.pdf a page and FILE.mp4 a film's frame per\n"
    "picture.\n"
    "\n"
    "  --from NAME      the first frame, with or without .pgm (default: the first\n"
    "                   there is)\n"
    "  --count N        that many frames from there on (default: 1 in a PNG, 9 in a\n"
    "                   sheet, else all)\n"
    "  --trace PATH     what host_sim --trace wrote, a directory or one file; without\n"
    "                   it host_sim is run\n"
    "  --rig FILE       this rig file instead of DIR/rig.json\n"
    "  --help           this text\n"
    "\n"
    "Exit status: 0 done; 1 input missing or wrong, or a file that cannot be\n"
    "written; 2 wrong usage.\n";

enum OptionId { opt_from = tool::opt_help + 1, opt_count, opt_trace, opt_rig };

static bool complain(const std::string &what)
{
    return tool::complain("view", what);
}

static bool read_count(const std::string &value, long &count)
{
    char *end;
    count = std::strtol(value.c_str(), &end, 10);
    return (!value.empty() && *end == '\0' && count >= 1 && count <= 1000000) ||
           complain("--count " + value + ": must be a whole number from 1 to 1000000");
}

static bool take(int id, const char *value, Options &options)
{
    if (*value == '\0') /* each option has one */
        return complain("an option's argument is empty; see view --help");
    switch (id) {
    case opt_from:
        options.from = value;
        return true;
    case opt_count:
        return read_count(value, options.count);
    case opt_trace:
        options.trace = value;
        return true;
    case opt_rig:
        options.rig = value;
        return true;
    default:
        return false;
    }
}

static bool read_verb(const std::string &word, Options &options)
{
    static const std::pair<const char *, Verb> verbs[] = {
        {"control", Verb::control}, {"contours", Verb::contours}, {"pair", Verb::pair}, {"sheet", Verb::sheet}};
    for (const auto &[name, verb] : verbs) {
        if (word == name) {
            options.verb = verb;
            return true;
        }
    }
    return complain("the first word must be control, contours, pair or sheet; see view --help");
}

bool options_parse(int argc, char **argv, Options &options)
{
    static const struct option long_options[] = {
        {"from", required_argument, nullptr, opt_from},   {"count", required_argument, nullptr, opt_count},
        {"trace", required_argument, nullptr, opt_trace}, {"rig", required_argument, nullptr, opt_rig},
        {"help", no_argument, nullptr, tool::opt_help},   {nullptr, 0, nullptr, 0},
    };
    std::string word = tool::options_verb(argc, argv);
    if (word == "--help")
        return true;
    if (!read_verb(word, options))
        return false;
    std::vector<std::string> words;
    auto parsed = tool::options_walk(
        "view", argc, argv, long_options, [&](int id, const char *value) { return take(id, value, options); }, words);
    if (parsed == tool::Parsed::help)
        options.verb = Verb::help;
    if (parsed != tool::Parsed::words)
        return parsed == tool::Parsed::help;
    if (words.size() != 2)
        return complain("a frames directory and a FILE are needed; see view --help");
    options.dir = words[0];
    options.out = words[1];
    return (!options.dir.empty() && !options.out.empty()) || complain("DIR and FILE must not be empty");
}
} // namespace view
