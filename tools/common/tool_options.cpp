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

Parsed options_walk(const char *program, int argc, char **argv, const struct option *known,
                    const std::function<bool(int, const char *)> &take,
                    std::vector<std::string> &words)
{
    /* getopt_long begins its messages with the word before the options: that is the verb. */
    std::string name = program;
    std::vector<char *> rest(argv + 1, argv + argc);
    rest.front() = name.data();
    rest.push_back(nullptr);
    int id, count = argc - 1;
    while ((id = getopt_long(count, rest.data(), "", known, nullptr)) != -1) {
        if (id == opt_help)
            return Parsed::help;
        if (id == '?' || !take(id, optarg)) /* getopt_long has told of the first */
            return Parsed::wrong;
    }
    words.assign(rest.begin() + optind, rest.begin() + count);
    return Parsed::words;
}
} // namespace tool
