/* view_traces - which trace files there are to draw: those that host_sim --trace wrote, or those that it writes now,
 * into a temporary folder that goes with the object.
 */
#ifndef VIEW_TRACES_HPP
#define VIEW_TRACES_HPP

#include <string>
#include <vector>

#include "view_options.hpp"

namespace view
{
/* Goes with all that is in it, also when what holds it could not be made. */
class TemporaryFolder
{
  public:
    TemporaryFolder() = default;
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder &) = delete;
    TemporaryFolder &operator=(const TemporaryFolder &) = delete;
    /* Throws view::Error. */
    void make();
    const std::string &path() const
    {
        return path_;
    }

  private:
    std::string path_; /* empty: none was made */
};

class Traces
{
  public:
    explicit Traces(const Options &options);

    /* Those from options.from on, at most `max`, in the order of their names. */
    std::vector<std::string> chosen(const std::string &from, size_t max) const;
    /* host_sim could not use all frames; it has reported which. */
    bool incomplete() const
    {
        return incomplete_;
    }

  private:
    void run_host_sim(const Options &options);
    void list(const std::string &path, const std::string &dir);
    TemporaryFolder temporary_;
    std::string from_where_;
    std::vector<std::string> paths_;
    bool incomplete_ = false;
};
} // namespace view

#endif
