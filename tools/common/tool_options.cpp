#include "tool_options.hpp"

#include <cstdio>

namespace tool
{
bool complain(const char *program, const std::string &what)
{
    std::fprintf(stderr, "%s: %s\n", program, what.c_str());
    return false;
}

std::string options_verb(int argc, char **argv)
{
    return argc > 1 ? argv[1] : "";
}

Parsed options_walk(int argc, char **argv, const struct option *known,
                    const std::function<bool(int, const char *)> &take,
                    std::vector<std::string> &words)
{
    int id;
    while ((id = getopt_long(argc - 1, argv + 1, "", known, nullptr)) != -1) {
        if (id == opt_help)
            return Parsed::help;
        if (id == '?' || !take(id, optarg)) /* getopt_long has told of the first */
            return Parsed::wrong;
    }
    words.assign(argv + 1 + optind, argv + argc);
    return Parsed::words;
}
} // namespace tool
