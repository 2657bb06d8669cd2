#include "view_stop.hpp"

#include <atomic>
#include <chrono>
#include <sys/wait.h>
#include <thread>

namespace view
{
/* How long a run goes on at most when a signal comes while another program works. */
static constexpr std::chrono::milliseconds look_every{20};
/* 0: none has come. A thread of some library may be the one that takes it. */
static std::atomic<int> came{0};
static_assert(std::atomic<int>::is_always_lock_free, "a signal's handler sets it");

static void note(int number)
{
    came = number;
}

Stop::Stop()
{
    struct sigaction noting = {};
    noting.sa_handler = note;
    noting.sa_flags = static_cast<int>(SA_RESTART | SA_RESETHAND);
    for (size_t i = 0; i < count_; i++) {
        sigaction(numbers_[i], nullptr, &before_[i]);
        /* nohup ignores SIGHUP, a shell SIGINT in the background. */
        if (before_[i].sa_handler != SIG_IGN)
            sigaction(numbers_[i], &noting, nullptr);
    }
}

Stop::~Stop()
{
    for (size_t i = 0; i < count_; i++)
        sigaction(numbers_[i], &before_[i], nullptr);
    if (came != 0)
        raise(came);
}

void stop_check()
{
    if (came != 0)
        throw Stopped();
}

bool stop_wait(pid_t child, int &status)
{
    for (;;) {
        pid_t ended = waitpid(child, &status, WNOHANG);
        if (ended != 0)
            return ended == child;
        if (came != 0) {
            kill(child, SIGTERM);
            waitpid(child, &status, 0);
            throw Stopped();
        }
        std::this_thread::sleep_for(look_every);
    }
}
} // namespace view
