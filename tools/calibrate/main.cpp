/* calibrate - from pictures of a printed board to rig.json; see calibrate --help.
 * Steps: pictures -> find (corners) -> camera -> sightings (dots on the board) -> lattice, index (which dot) -> rays ->
 * rig, report.
 */
#include <cstdio>
#include <exception>
#include <new>

#include "cal_board.hpp"
#include "cal_error.hpp"
#include "cal_guide.hpp"
#include "cal_options.hpp"
#include "cal_solve.hpp"

/* Output that was not written is an error. */
static int finished(int status)
{
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0)
        return status;
    throw cal::Error("standard output could not be written");
}

int main(int argc, char **argv)
{
    try {
        cal::Options options;
        if (!cal::options_parse(argc, argv, options))
            return 2;
        switch (options.verb) {
        case cal::Verb::help:
            std::fputs(cal::options_help, stdout);
            return finished(0);
        case cal::Verb::board:
            cal::board_print(options.board, options.target);
            return 0;
        case cal::Verb::guide:
            return finished((options.camera.empty() ? cal::guide_directory(options) : cal::guide_camera(options)) ? 0
                                                                                                                  : 1);
        case cal::Verb::solve:
            cal::solve_run(options);
            return finished(0);
        }
    } catch (const cal::Error &error) {
        std::fprintf(stderr, "calibrate: %s\n", error.what());
    } catch (const std::bad_alloc &) {
        std::fprintf(stderr, "calibrate: out of memory\n");
    } catch (const std::exception &error) {
        std::fprintf(stderr,
                     "calibrate: an error in the program, not in the pictures; please report it with this text: %s\n",
                     error.what());
    }
    return 1;
}
