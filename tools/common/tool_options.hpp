/* tool_options - the command line of a tool: a verb, options, and what they are about.
 */
#ifndef TOOL_OPTIONS_HPP
#define TOOL_OPTIONS_HPP

#include <functional>
#include <getopt.h>
#include <string>
#include <vector>

namespace tool
{
/* "PROGRAM: WHAT" on standard error; always false. */
bool complain(const char *program, const std::string &what);

/* argv[1], the verb; empty: there is none. */
std::string options_verb(int argc, char **argv);

/* What stands for --help among a tool's options; its other ids are above it. */
constexpr int opt_help = 1;

enum class Parsed { words, help, wrong };

/* Each option behind the verb is handed to take() with its argument, until --help or until take() returns false; then the
 * words that are no options are in `words`. wrong: take() or getopt_long, as `program`, has printed why. */
Parsed options_walk(const char *program, int argc, char **argv, const struct option *known,
                    const std::function<bool(int, const char *)> &take,
                    std::vector<std::string> &words);
} // namespace tool

#endif
