/* view - pictures of what host_sim finds in frames; see view --help.
 * Steps: traces (host_sim's, or made now) -> trace, rig, image -> control, contours, sheet -> output.
 */
#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <limits>

#include "tool_progress.hpp"
#include "view_control.hpp"
#include "view_error.hpp"
#include "view_options.hpp"
#include "view_output.hpp"
#include "view_sheet.hpp"
#include "view_stop.hpp"
#include "view_traces.hpp"

namespace view
{
static constexpr size_t sheet_count = 9;
/* A film of a single frame, or of frames without times. */
static constexpr double usual_frames_per_s = 10, max_frames_per_s = 60;

static size_t count_wanted(const Options &options, Format format)
{
    if (options.count > 0)
        return static_cast<size_t>(options.count);
    if (options.verb == Verb::sheet)
        return sheet_count;
    return format == Format::png ? 1 : std::numeric_limits<size_t>::max();
}

static Shown show(const std::string &trace_path, const std::string &dir, const Rig &rig)
{
    stop_check();
    Trace trace = trace_read(trace_path);
    return {trace, control_image(dir + "/" + trace.file, rig)};
}

static std::vector<int64_t> read_times_us(const std::vector<std::string> &paths)
{
    tool::Progress progress;
    std::vector<int64_t> times_us;
    for (const std::string &path : paths) {
        stop_check();
        progress.show("reading times", times_us.size(), paths.size());
        times_us.push_back(trace_read(path).time_us);
    }
    return times_us;
}

/* From the middle one of the gaps between frames. */
static double frames_per_s(const std::vector<int64_t> &times_us)
{
    std::vector<int64_t> gaps_us;
    for (size_t i = 1; i < times_us.size(); i++)
        gaps_us.push_back(times_us[i] - times_us[i - 1]);
    if (gaps_us.empty())
        return usual_frames_per_s;
    std::nth_element(gaps_us.begin(), gaps_us.begin() + static_cast<std::ptrdiff_t>(gaps_us.size() / 2), gaps_us.end());
    int64_t gap_us = gaps_us[gaps_us.size() / 2];
    return gap_us > 0 ? std::min(1e6 / static_cast<double>(gap_us), max_frames_per_s) : usual_frames_per_s;
}

static Plot shader_plot(Verb verb, const Rig &rig)
{
    switch (verb) {
    case Verb::contours:
        return contours_plot(rig);
    case Verb::pair:
        return pair_plot(rig);
    default:
        return sheet_plot(rig);
    }
}

static void draw_one(Verb verb, Output &output, const Shader &shader, const Shown &frame, const Rig &rig)
{
    switch (verb) {
    case Verb::control:
        output.page(control_page(rig), [&](Canvas &canvas) { control_draw(canvas, frame.image, frame.trace, rig); });
        break;
    case Verb::contours:
        output.page(contours_page(rig), [&](Canvas &canvas) { contours_draw(canvas, shader, frame.trace, rig); });
        break;
    default:
        output.page(pair_page(rig), [&](Canvas &canvas) { pair_draw(canvas, shader, frame, rig); });
    }
}

static void draw_sheet(Output &output, const Shader &shader, const std::vector<std::string> &paths,
                       const Options &options, const Rig &rig)
{
    tool::Progress progress;
    std::vector<Shown> frames;
    for (const std::string &path : paths) {
        progress.show("reading frames", frames.size(), paths.size());
        frames.push_back(show(path, options.dir, rig));
    }
    progress.show("drawing");
    output.page(sheet_page(frames.size(), rig), [&](Canvas &canvas) { sheet_draw(canvas, shader, frames, rig); });
}

static void draw_each(Output &output, const Shader &shader, const std::vector<std::string> &paths,
                      const Options &options, const Rig &rig)
{
    tool::Progress progress;
    for (size_t i = 0; i < paths.size(); i++) {
        draw_one(options.verb, output, shader, show(paths[i], options.dir, rig), rig);
        progress.show("drawing", i + 1, paths.size());
    }
}

static void check(const Options &options, Format format)
{
    std::error_code failed;
    if (!std::filesystem::is_directory(options.dir, failed))
        throw Error(options.dir + ": not a directory; expected a frames directory");
    if (options.verb == Verb::sheet && format == Format::mp4)
        throw Error(options.out + ": a sheet is one picture: write a PNG or a PDF, or a film of pair");
    if (options.verb != Verb::sheet && format == Format::png && options.count > 1)
        throw Error(options.out +
                    text(": a PNG holds one picture, not %ld: write a PDF or an MP4, or a sheet", options.count));
}

/* False: something was left out, and standard error says what. Throws view::Error. */
static bool run(const Options &options)
{
    Format format = format_of(options.out);
    check(options, format);
    Rig rig = rig_read(options.rig.empty() ? options.dir + "/rig.json" : options.rig);
    Traces traces(options);
    std::vector<std::string> paths = traces.chosen(options.from, count_wanted(options, format));
    double rate = format == Format::mp4 ? frames_per_s(read_times_us(paths)) : usual_frames_per_s;
    std::unique_ptr<Output> output = output_open(options.out, rate);
    Shader shader(rig, shader_plot(options.verb, rig));
    if (options.verb == Verb::sheet)
        draw_sheet(*output, shader, paths, options, rig);
    else
        draw_each(*output, shader, paths, options, rig);
    output->finish();
    return !traces.incomplete();
}
} // namespace view

int main(int argc, char **argv)
{
    view::Options options;
    if (!view::options_parse(argc, argv, options))
        return 2;
    if (options.verb == view::Verb::help) {
        std::fputs(view::options_help, stdout);
        return 0;
    }
    try {
        view::Stop stop;
        return view::run(options) ? 0 : 1;
    } catch (const view::Stopped &) {
        /* the signal has acted when `stop` went */
    } catch (const std::exception &error) {
        std::fprintf(stderr, "view: %s\n", error.what());
    }
    return 1;
}
