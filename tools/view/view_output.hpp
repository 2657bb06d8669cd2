/* view_output - pages into a file: one into a PNG, each onto a sheet of A4 of a PDF, each a frame of an MP4.
 * An MP4 is H.264 where OpenCV's FFmpeg has an encoder, else MPEG-4 part 2, and a message says so; without either it is an
 * error.
 * A file is there whole or not at all, but for an MP4, which is removed when something fails.
 */
#ifndef VIEW_OUTPUT_HPP
#define VIEW_OUTPUT_HPP

#include <functional>
#include <memory>
#include <string>

#include "view_canvas.hpp"

namespace view
{
using Drawing = std::function<void(Canvas &)>;

class Output
{
  public:
    virtual ~Output() = default;
    virtual void page(cv::Size size, const Drawing &draw) = 0;
    virtual void finish() = 0;
};

enum class Format { png, pdf, mp4 };

/* By the name's end; throws view::Error for any other. */
Format format_of(const std::string &path);

/* frames_per_s is for films alone. */
std::unique_ptr<Output> output_open(const std::string &path, double frames_per_s);
} // namespace view

#endif
