#include "view_sheet.hpp"

#include <algorithm>
#include <cmath>

#include "view_control.hpp"
#include "view_error.hpp"

namespace view
{
static constexpr double margin = 16, cell_room = 264, gap = 14, words_size = 20, words_height = 34;
/* How much wider than high a sheet should be: paper on its side. */
static constexpr double page_shape = 1.41;
static constexpr double small = 0.45, key_row = 22;
static constexpr double pair_room = 620, pair_much = 0.75;

struct Grid {
    int rows, columns;
    cv::Size2d cell;
};

static Grid grid_of(size_t frame_count, const Rig &rig)
{
    Plot plot = plot_fit(rig.size_px, {0, 0, cell_room, cell_room});
    cv::Size2d cell(plot.where.width + gap, 2 * plot.where.height + 4 + words_height + gap);
    double count = static_cast<double>(frame_count + 1); /* the key */
    int rows = std::max(1, cvRound(std::sqrt(count * cell.width / cell.height / page_shape)));
    return {rows, static_cast<int>(std::ceil(count / rows)), cell};
}

cv::Size sheet_page(size_t frame_count, const Rig &rig)
{
    Grid grid = grid_of(frame_count, rig);
    return {cvRound(2 * margin - gap + grid.columns * grid.cell.width),
            cvRound(2 * margin - gap + grid.rows * grid.cell.height)};
}

Plot sheet_plot(const Rig &rig)
{
    return plot_fit(rig.size_px, {0, 0, cell_room, cell_room});
}

static void draw_image(Canvas &canvas, const Plot &plot, const Shown &frame, const Rig &rig, double much)
{
    control_draw_small(canvas, plot, frame.image, frame.trace, rig);
    canvas.clip(plot.where);
    heads_draw(canvas, plot, frame.trace, much);
    canvas.unclip();
}

static void draw_cell(Canvas &canvas, cv::Point2d at, const Shader &shader, const Shown &frame, const Rig &rig)
{
    Plot above = plot_fit(rig.size_px, {at.x, at.y, cell_room, cell_room});
    Plot below = above;
    below.where.y += above.where.height + 4;
    draw_image(canvas, above, frame, rig, small);
    contours_draw_plot(canvas, below, shader, frame.trace, rig, contours_few, small);
    cv::Point2d words(at.x, below.where.br().y + words_height / 2);
    std::string name = frame.trace.file.substr(0, frame.trace.file.rfind('.'));
    canvas.text(words, name, words_size * 0.85);
    canvas.text({below.where.br().x, words.y}, head_words(frame.trace), words_size, Anchor::right, true);
}

void sheet_draw(Canvas &canvas, const Shader &shader, const std::vector<Shown> &frames, const Rig &rig)
{
    Grid grid = grid_of(frames.size(), rig);
    int index = 0;
    auto position = [&] {
        cv::Point2d at(margin + index % grid.columns * grid.cell.width,
                       margin + index / grid.columns * grid.cell.height);
        index++;
        return at;
    };
    for (const Shown &frame : frames)
        draw_cell(canvas, position(), shader, frame, rig);
    key_draw(canvas, position(), 1, {cell_room, key_row}, small, frames.front().trace.paper);
}

cv::Size pair_page(const Rig &rig)
{
    Plot plot = plot_fit(rig.size_px, {0, 0, pair_room, pair_room});
    cv::Size page(cvRound(2 * plot.where.width + gap), cvRound(plot.where.height + words_height));
    return {page.width + page.width % 2, page.height + page.height % 2}; /* films want even sizes */
}

Plot pair_plot(const Rig &rig)
{
    return plot_fit(rig.size_px, {0, 0, pair_room, pair_room});
}

void pair_draw(Canvas &canvas, const Shader &shader, const Shown &frame, const Rig &rig)
{
    Plot left = plot_fit(rig.size_px, {0, 0, pair_room, pair_room});
    Plot right = left;
    right.where.x += left.where.width + gap;
    draw_image(canvas, left, frame, rig, pair_much);
    contours_draw_plot(canvas, right, shader, frame.trace, rig, contours_few, pair_much);
    double y = left.where.br().y + words_height / 2;
    canvas.text({4, y}, frame.trace.file + text(", %.2f s", 1e-6 * static_cast<double>(frame.trace.time_us)),
                words_size);
    canvas.text({right.where.br().x - 4, y}, head_words(frame.trace), words_size, Anchor::right, true);
}
} // namespace view
