/* view - pictures of what host_sim finds in frames; see view --help.
 * Steps: traces (host_sim's, or made now) -> trace, rig, image -> control, contours, sheet -> output.
 */
#include <cstdio>
#include <exception>

#include "view_options.hpp"
#include "view_run.hpp"
#include "view_stop.hpp"

int main(int argc, char **argv)
{
    view::Options options;
    if (!view::options_parse(argc, argv, options))
        return 2;
    if (options.verb == view::Verb::help) {
        std::fputs(view::options_help, stdout);
        return 0;
    }
    try {
        view::Stop stop;
        return view::view_run(options) ? 0 : 1;
    } catch (const view::Stopped &) {
        /* the signal has acted when `stop` went */
    } catch (const std::exception &error) {
        std::fprintf(stderr, "view: %s\n", error.what());
    }
    return 1;
}
