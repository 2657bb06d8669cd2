#include "view_traces.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/wait.h>
#include <unistd.h>

#include "view_error.hpp"
#include "view_stop.hpp"

namespace view
{
namespace fs = std::filesystem;

static std::string last_part(const std::string &dir)
{
    fs::path path = fs::absolute(dir).lexically_normal();
    return path.has_filename() ? path.filename() : path.parent_path().filename();
}

static std::vector<std::string> traces_in(const fs::path &dir)
{
    std::vector<std::string> paths;
    std::error_code failed;
    for (const auto &entry : fs::directory_iterator(dir, failed)) {
        if (entry.path().extension() == ".json")
            paths.push_back(entry.path());
    }
    if (failed)
        throw Error(dir.string() + ": " + failed.message());
    std::sort(paths.begin(), paths.end());
    return paths;
}

/* A file, a directory of files, or the OUT of host_sim, which has a folder named as the frames directory. */
void Traces::list(const std::string &path, const std::string &dir)
{
    from_where_ = path;
    if (!fs::exists(path))
        throw Error(path + ": is not there: host_sim --trace " + path + " " + dir + " writes it");
    if (!fs::is_directory(path)) {
        paths_ = {path};
        return;
    }
    fs::path below = fs::path(path) / last_part(dir);
    paths_ = traces_in(path);
    if (paths_.empty() && fs::is_directory(below)) {
        from_where_ = below;
        paths_ = traces_in(below);
    }
    if (paths_.empty())
        throw Error(path + ": neither it nor " + below.string() + " holds a trace (*.json)");
}

/* host_sim makes one per frames directory, of whatever name; the folder itself when it made none. */
static std::string only_folder(const std::string &path)
{
    for (const auto &entry : fs::directory_iterator(path)) {
        if (entry.is_directory())
            return entry.path();
    }
    return path;
}

/* Lies beside this program in the build. */
static std::string host_sim_path()
{
    fs::path own = fs::read_symlink("/proc/self/exe");
    fs::path path = own.parent_path() / "../../sim/host_sim";
    if (access(path.c_str(), X_OK) != 0)
        throw Error(path.lexically_normal().string() + ": " + std::strerror(errno) +
                    ": build host_sim, or give --trace");
    return path;
}

/* Its records are not wanted; its messages are. Returns its exit status. */
static int run_quietly(const std::vector<std::string> &words)
{
    std::vector<char *> arguments;
    for (const std::string &word : words)
        arguments.push_back(const_cast<char *>(word.c_str()));
    arguments.push_back(nullptr);
    pid_t child = fork();
    if (child == 0) {
        int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
        if (nowhere >= 0 && dup2(nowhere, STDOUT_FILENO) >= 0)
            execv(arguments[0], arguments.data());
        _exit(127);
    }
    int status = 0;
    if (child < 0 || !stop_wait(child, status))
        throw Error(words[0] + ": could not be run: " + std::strerror(errno));
    stop_check(); /* a terminal's Ctrl-C ends both */
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

TemporaryFolder::~TemporaryFolder()
{
    std::error_code ignored; /* what is left of a temporary folder does no harm */
    if (!path_.empty())
        fs::remove_all(path_, ignored);
}

void TemporaryFolder::make()
{
    std::string made = (fs::temp_directory_path() / "view-XXXXXX").string();
    if (mkdtemp(made.data()) == nullptr)
        throw Error(made + ": " + std::strerror(errno));
    path_ = made;
}

void Traces::run_host_sim(const Options &options)
{
    temporary_.make();
    std::vector<std::string> words = {host_sim_path(), "--json", "--trace", temporary_.path()};
    if (!options.rig.empty())
        words.insert(words.end(), {"--rig", options.rig});
    words.insert(words.end(), {"--", options.dir});
    int status = run_quietly(words);
    if (status > 1)
        throw Error(words[0] + text(": ended with exit status %d", status));
    incomplete_ = status == 1;
}

Traces::Traces(const Options &options)
{
    if (!options.trace.empty()) {
        list(options.trace, options.dir);
        return;
    }
    try {
        run_host_sim(options);
        list(only_folder(temporary_.path()), options.dir);
        from_where_ = options.dir; /* the user knows of no other */
    } catch (const Error &) {
        if (incomplete_)
            throw Error(options.dir + ": host_sim could use none of its frames");
        throw;
    }
}

std::vector<std::string> Traces::chosen(const std::string &from, size_t max) const
{
    auto first = paths_.begin();
    if (!from.empty()) {
        fs::path name = from;
        if (name.extension() == ".pgm" || name.extension() == ".png" || name.extension() == ".xyz")
            name.replace_extension();
        first = std::find_if(paths_.begin(), paths_.end(), [&](const std::string &path) {
            fs::path stem = fs::path(path).stem();
            return stem == name || stem == from; // frames that differ in their suffix alone keep it
        });
        if (first == paths_.end())
            throw Error(from_where_ + ": has no trace of a frame " + name.string());
    }
    auto left = static_cast<size_t>(paths_.end() - first);
    return {first, first + static_cast<std::ptrdiff_t>(std::min(left, max))};
}
} // namespace view
