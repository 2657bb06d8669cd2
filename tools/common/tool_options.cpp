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
    std::vector<char *> remainder(argv + 1, argv + argc);
    remainder.front() = name.data();
    remainder.push_back(nullptr);
    int id, count = argc - 1;
    while ((id = getopt_long(count, remainder.data(), "", known, nullptr)) != -1) {
        if (id == opt_help)
            return Parsed::help;
        if (id == '?' || !take(id, optarg)) /* getopt_long has reported the first */
            return Parsed::wrong;
    }
    words.assign(remainder.begin() + optind, remainder.begin() + count);
    return Parsed::words;
}
} // namespace tool
