/* view_options - the command line.
 */
#ifndef VIEW_OPTIONS_HPP
#define VIEW_OPTIONS_HPP

#include <string>

namespace view
{
enum class Verb { help, control, contours, pair, sheet };

struct Options {
    Verb verb = Verb::help;
    std::string dir, out;
    std::string trace, rig; /* empty: host_sim is run; DIR/rig.json */
    std::string from;       /* empty: the first frame */
    long count = 0;         /* 0: as many as the picture usually has */
};

extern const char *const options_help;

/* False: the usage was wrong, and standard error says how. */
bool options_parse(int argc, char **argv, Options &options);
} // namespace view

#endif
