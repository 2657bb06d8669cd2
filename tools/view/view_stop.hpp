/* view_stop - a run that is stopped from outside ends as one that fails: what it made for itself is removed first.
 * SIGHUP, SIGINT and SIGTERM (those that are not ignored anyway) are only noted while a Stop lives, and looked for where
 * the work can end: between pages, and while another program runs. At the end they act as they would have at once. The
 * second of a kind acts at once.
 */
#ifndef VIEW_STOP_HPP
#define VIEW_STOP_HPP

#include <csignal>
#include <cstddef>
#include <exception>
#include <sys/types.h>

namespace view
{
/* What ends the work when a signal has come. */
struct Stopped : std::exception {
};

/* One at a time. */
class Stop
{
  public:
    Stop();
    /* A signal that came acts now. */
    ~Stop();
    Stop(const Stop &) = delete;
    Stop &operator=(const Stop &) = delete;

  private:
    static constexpr int numbers_[] = {SIGHUP, SIGINT, SIGTERM};
    static constexpr size_t count_ = sizeof numbers_ / sizeof *numbers_;
    struct sigaction before_[count_] = {};
};

/* Throws view::Stopped when a signal has come. */
void stop_check();

/* Waits for a child's end; status as waitpid has it; false: errno says why. When a signal comes the child is ended by SIGTERM,
 * and view::Stopped thrown. */
bool stop_wait(pid_t child, int &status);
} // namespace view

#endif
