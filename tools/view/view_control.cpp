#include "view_control.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <unistd.h>

#include "view_error.hpp"

namespace view
{
static constexpr double margin = 20, image_width = 1880, image_height = 1880, title_height = 44, foot_height = 84;
static constexpr double words_size = 26, label_size = 15, ring_radius = 5;
/* So much of the image may be white; the scene behind stays dark, so that what is drawn on it shows. */
static constexpr double white_fraction = 0.005, white_medians = 3;
static constexpr double gamma = 0.7;
/* From grey to grey in a picture: finer ones are camera noise, and make the file large. */
static constexpr int grey_step = 12;

static cv::Mat1b to_few_greys(const cv::Mat1b &image)
{
    cv::Mat1b table(1, 256), few;
    for (int grey = 0; grey < 256; grey++)
        table(grey) = static_cast<uint8_t>(std::min(255, (grey + grey_step / 2) / grey_step * grey_step));
    cv::LUT(image, table, few);
    return few;
}

static cv::Mat1b stretch(const cv::Mat &samples, double min, double max)
{
    cv::Mat1b grey(samples.size());
    cv::Mat values;
    samples.convertTo(values, CV_64F);
    for (int y = 0; y < grey.rows; y++) {
        for (int x = 0; x < grey.cols; x++) {
            double arc = std::clamp((values.at<double>(y, x) - min) / (max - min), 0.0, 1.0);
            grey(y, x) = static_cast<uint8_t>(cvRound(255 * std::pow(arc, gamma)));
        }
    }
    return grey;
}

static double quantile(const cv::Mat &samples, double fraction)
{
    cv::Mat values = samples.clone().reshape(1, 1);
    values.convertTo(values, CV_64F);
    double *begin = values.ptr<double>(), *end = begin + values.cols;
    double *at = begin + static_cast<std::ptrdiff_t>(fraction * (values.cols - 1));
    std::nth_element(begin, at, end);
    return *at;
}

cv::Mat1b control_image(const std::string &path, const Rig &rig)
{
    if (path.size() > 4 && path.compare(path.size() - 4, 4, ".xyz") == 0)
        return {rig.size_px, 255}; /* a list of points has no image */
    if (access(path.c_str(), R_OK) != 0)
        throw Error(path + ": " + std::strerror(errno));
    cv::Mat samples = cv::imread(path, cv::IMREAD_ANYDEPTH | cv::IMREAD_GRAYSCALE);
    if (samples.empty())
        throw Error(path + ": not a complete binary PGM");
    if (samples.size() != rig.size_px)
        throw Error(path + text(": has %dx%d pixels, the rig %dx%d", samples.cols, samples.rows, rig.size_px.width,
                                rig.size_px.height));
    if (!rig.range)
        return stretch(samples, 0,
                       std::max({1.0, quantile(samples, 1 - white_fraction), white_medians * quantile(samples, 0.5)}));
    cv::Mat1b grey = stretch(samples, rig.near_mm, rig.far_mm);
    grey.setTo(255, samples == 0); /* nothing was measured there */
    return grey;
}

static void draw_points(Canvas &canvas, const Plot &plot, const Trace &trace, const Rig &rig, double radius)
{
    for (const Point &point : trace.points) {
        if (point.seen)
            canvas.ellipse(plot.page(rig.pixel(point.position)), radius, radius, 0, {yellow, 2, {}, false, 1, black});
    }
}

/* Which dots have a label; the others' positions too. */
static std::vector<bool> labelled_dots(const Trace &trace)
{
    std::vector<bool> labelled(trace.dots_px.size());
    for (const Label &label : trace.labels) {
        if (label.dot >= 0)
            labelled[static_cast<size_t>(label.dot)] = true;
    }
    return labelled;
}

void control_draw_small(Canvas &canvas, const Plot &plot, const cv::Mat1b &image, const Trace &trace, const Rig &rig)
{
    cv::Mat1b fit;
    cv::resize(image, fit, cv::Size(cvRound(plot.where.width), cvRound(plot.where.height)), 0, 0, cv::INTER_AREA);
    canvas.image(to_few_greys(fit), plot.where);
    canvas.clip(plot.where);
    std::vector<bool> labelled = labelled_dots(trace);
    for (size_t i = 0; i < labelled.size(); i++) {
        if (labelled[i])
            canvas.ellipse(plot.page(trace.dots_px[i]), 0.8, 0.8, 0, {yellow, 1.6, {}, false, 0.7, black});
    }
    if (rig.range)
        draw_points(canvas, plot, trace, rig, 2);
    canvas.unclip();
}

static void draw_residuals(Canvas &canvas, const Plot &plot, const Trace &trace, const Rig &rig)
{
    if (rig.range)
        return; /* no dots, no lines */
    for (size_t slot = 0; slot < slot_count; slot++) {
        const Label &label = trace.labels[slot];
        if (label.dot < 0)
            continue;
        cv::Point2d dot = trace.dots_px[static_cast<size_t>(label.dot)];
        cv::Point2d end = dot + rig.across(slot, dot) * (label.perp_px * bar_times);
        canvas.line({plot.page(dot), plot.page(end)}, {vermilion, 3.4, {}, false, 1.3, white});
    }
}

static void draw_dots(Canvas &canvas, const Plot &plot, const Trace &trace, Room &room)
{
    std::vector<bool> labelled = labelled_dots(trace);
    for (size_t i = 0; i < labelled.size(); i++) {
        cv::Point2d at = plot.page(trace.dots_px[i]);
        if (labelled[i])
            canvas.ellipse(at, ring_radius, ring_radius, 0, {yellow, 2.4, {}, false, 1.2, black});
        else
            canvas.cross(at, ring_radius + 2, {sky, 2.6, {}, false, 1.2, black}, false);
        room.block({at.x - ring_radius, at.y - ring_radius, 2 * ring_radius, 2 * ring_radius});
    }
}

/* Each number where there is room beside its dot; returns how many found none. */
static int draw_numbers(Canvas &canvas, const Plot &plot, const Trace &trace, Room &room)
{
    int without = 0;
    for (size_t slot = 0; slot < slot_count; slot++) {
        if (trace.labels[slot].dot < 0)
            continue;
        std::string number = std::to_string(slot);
        cv::Point2d at = plot.page(trace.dots_px[static_cast<size_t>(trace.labels[slot].dot)]);
        double width = canvas.text_width(number, label_size) + 2, height = 0.8 * label_size, off = ring_radius + 3;
        bool placed = false;
        for (cv::Point2d offset : {cv::Point2d(0.5, 0),
                                   {0, 0.5},
                                   {0, -0.5},
                                   {-0.5, 0},
                                   {0.5, 0.5},
                                   {0.5, -0.5},
                                   {-0.5, 0.5},
                                   {-0.5, -0.5}}) {
            cv::Point2d middle = at + cv::Point2d(offset.x * (width + 2 * off), offset.y * (height + 2 * off));
            if (room.take({middle.x - width / 2, middle.y - height / 2, width, height})) {
                canvas.text_with_halo(middle, number, label_size, Anchor::middle, white, black);
                placed = true;
                break;
            }
        }
        without += !placed;
    }
    return without;
}

/* "epipolar residuals: median 0.10 px, largest 0.60 px" */
static std::string residual_words(const Trace &trace)
{
    std::vector<double> off_px;
    for (const Label &label : trace.labels) {
        if (label.dot >= 0)
            off_px.push_back(std::abs(label.perp_px));
    }
    if (off_px.empty())
        return "no dot has a label";
    std::sort(off_px.begin(), off_px.end());
    return text("bar: epipolar residual, %.0f times as long; median %.2f px, largest %.2f px", bar_times,
                off_px[off_px.size() / 2], off_px.back());
}

static void draw_foot(Canvas &canvas, cv::Point2d at, const Trace &trace, int without)
{
    double x = at.x + ring_radius;
    canvas.ellipse({x, at.y}, ring_radius + 2, ring_radius + 2, 0, {yellow, 2.4, {}, false, 1.2, black});
    std::string words = text("dot with the number of its slot (%d)", trace.labelled_count());
    canvas.text({x + 20, at.y}, words, words_size);
    x += 60 + canvas.text_width(words, words_size);
    canvas.cross({x, at.y}, ring_radius + 4, {sky, 2.6, {}, false, 1.2, black}, false);
    words = text("dot without a label (%zu)", trace.dots_px.size() - static_cast<size_t>(trace.labelled_count()));
    canvas.text({x + 20, at.y}, words, words_size);
    x += 60 + canvas.text_width(words, words_size);
    if (without > 0)
        canvas.text({x, at.y}, text("%d numbers left out: no room", without), words_size);
    at.y += 40;
    canvas.line({at, {at.x + 40, at.y}}, {vermilion, 3.4, {}, false, 1.3, white});
    canvas.text({at.x + 55, at.y}, residual_words(trace), words_size);
}

cv::Size control_page(const Rig &rig)
{
    Plot plot = plot_fit(rig.size_px, {0, 0, image_width, image_height});
    return {cvRound(image_width + 2 * margin), cvRound(plot.where.height + 2 * margin + title_height + foot_height)};
}

void control_draw(Canvas &canvas, const cv::Mat1b &image, const Trace &trace, const Rig &rig)
{
    Plot plot = plot_fit(rig.size_px, {margin, margin + title_height, image_width, image_height});
    Room room(plot.where);
    canvas.text({margin, margin + title_height / 2 - 6},
                trace.file + text(", %.2f s: ", 1e-6 * static_cast<double>(trace.time_us)) + head_words(trace),
                words_size, Anchor::left, true);
    canvas.image(to_few_greys(image), plot.where);
    canvas.clip(plot.where);
    draw_residuals(canvas, plot, trace, rig);
    draw_dots(canvas, plot, trace, room);
    if (rig.range)
        draw_points(canvas, plot, trace, rig, ring_radius);
    heads_draw(canvas, plot, trace, 1);
    up_draw(canvas, plot, trace, 1.5);
    int without = draw_numbers(canvas, plot, trace, room);
    canvas.unclip();
    cv::Point2d foot(margin, plot.where.br().y + 26);
    if (rig.range)
        canvas.text(foot, "depth, near is dark; rings: the points that were sampled from it", words_size);
    else
        draw_foot(canvas, foot, trace, without);
}
} // namespace view
