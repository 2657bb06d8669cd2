/* cal_options - the command line, checked.
 */
#ifndef CAL_OPTIONS_HPP
#define CAL_OPTIONS_HPP

#include "cal_index.hpp"
#include "cal_rig.hpp"

namespace cal
{
enum class Verb { board, guide, solve, help };

struct Options {
    Verb verb = Verb::help;
    Board board = board_parse("charuco-9x6-30");
    std::string target; /* the file to print to, or the directory of pictures */
    std::string out;    /* solve: where rig.json and the report go */
    std::string camera; /* guide: what cv::VideoCapture opens; empty: look at the directory only */
    cv::Size size;      /* guide: of the camera's frames; empty: as it gives them */
    Range range{400.0, 2600.0};
    Mount mount;
    MiddleDot middle;
};

/* False: what was wrong is printed on standard error. */
bool options_parse(int argc, char **argv, Options &options);
extern const char *const options_help;
} // namespace cal

#endif
