/* tool_progress - how far a long run is: one line of standard error that is written again and again, where that is a
 * terminal; elsewhere nothing at all.
 */
#ifndef TOOL_PROGRESS_HPP
#define TOOL_PROGRESS_HPP

#include <chrono>
#include <cstddef>
#include <string>

namespace tool
{
class Progress
{
  public:
    /* beside_results: standard output is written to meanwhile. On one terminal the two would mix, and results are progress
     * enough. */
    explicit Progress(bool beside_results = false);
    /* The line is gone with the object: also before the message of an error that ends the run. */
    ~Progress();
    Progress(const Progress &) = delete;
    Progress &operator=(const Progress &) = delete;

    /* "WHAT DONE/COUNT, TIME left", ten times a second at most; the time from the third second of this `what` on.
     * count 0: WHAT alone, for steps that nobody can count. */
    void show(const std::string &what, size_t done = 0, size_t count = 0);
    /* Before something else is written. */
    void clear();

  private:
    using Clock = std::chrono::steady_clock;
    bool terminal_, shown_ = false;
    std::string what_;
    Clock::time_point began_, written_;
};
} // namespace tool

#endif
