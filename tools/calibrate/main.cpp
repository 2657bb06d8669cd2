/* calibrate - from pictures of a printed board to rig.json; see calibrate --help.
 * The way: pictures -> find (corners) -> camera -> sightings (dots on the board) -> lattice, index (which dot) -> rays ->
 * rig, report.
 */
#include <cstdio>
#include <exception>

#include "cal_guide.hpp"
#include "cal_options.hpp"
#include "cal_print.hpp"
#include "cal_solve.hpp"

int main(int argc, char **argv)
{
    cal::Options options;
    if (!cal::options_parse(argc, argv, options))
        return 2;
    try {
        switch (options.verb) {
        case cal::Verb::help:
            std::fputs(cal::options_help, stdout);
            return 0;
        case cal::Verb::board:
            cal::board_print(cal::board_parse(options.board), options.target);
            return 0;
        case cal::Verb::guide:
            return (options.camera.empty() ? cal::guide_directory(options) : cal::guide_camera(options)) ? 0 : 1;
        case cal::Verb::solve:
            cal::solve_run(options);
            return 0;
        }
    } catch (const std::exception &error) {
        std::fprintf(stderr, "calibrate: %s\n", error.what());
    }
    return 1;
}
