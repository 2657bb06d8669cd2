#include "tool_progress.hpp"

#include <cstdio>
#include <unistd.h>

#include "tool_error.hpp"

namespace tool
{
static constexpr std::chrono::milliseconds show_every{100}, left_after{2000};

Progress::Progress(bool beside_results)
    : terminal_(isatty(STDERR_FILENO) == 1 && !(beside_results && isatty(STDOUT_FILENO) == 1))
{
}

Progress::~Progress()
{
    clear();
}

void Progress::show(const std::string &what, size_t done, size_t count)
{
    if (!terminal_)
        return;
    Clock::time_point now = Clock::now();
    bool same = shown_ && what == what_;
    if (!same) {
        what_ = what;
        began_ = now;
    } else if (now - written_ < show_every) {
        return;
    }
    std::string line = what;
    if (count > 0)
        line += text(" %zu/%zu", done, count);
    if (done > 0 && done < count && now - began_ >= left_after) {
        double run_s = std::chrono::duration<double>(now - began_).count();
        int left_s = static_cast<int>(run_s / static_cast<double>(done) *
                                      static_cast<double>(count - done)) +
                     1;
        line += text(", %d:%02d min left", left_s / 60, left_s % 60);
    }
    std::fprintf(stderr, "\r\033[K%s", line.c_str());
    std::fflush(stderr);
    written_ = now;
    shown_ = true;
}

void Progress::clear()
{
    if (shown_)
        std::fputs("\r\033[K", stderr);
    shown_ = false;
}
} // namespace tool
