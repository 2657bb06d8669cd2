#include "cal_chart.hpp"

#include <cmath>

#include "cal_error.hpp"

namespace cal
{
static constexpr double width = 460.0, height = 330.0, left = 62.0, right = 14.0, top = 28.0, bottom = 46.0;
static constexpr int ticks_about = 5;

static double tick_step(double span)
{
    double raw = span / ticks_about, scale = std::pow(10.0, std::floor(std::log10(raw))), part = raw / scale;
    return scale * (part < 1.5 ? 1.0 : part < 3.5 ? 2.0 : part < 7.5 ? 5.0 : 10.0);
}

Chart::Chart(const std::string &title, const std::string &x_name, const std::string &y_name, cv::Rect2d data, bool down)
    : data_(data), down_(down)
{
    body_ += text("<text x='%g' y='17' text-anchor='middle' font-weight='bold'>%s</text>", 0.5 * (width + left),
                  title.c_str());
    body_ += text("<text x='%g' y='%g' text-anchor='middle'>%s</text>", 0.5 * (width + left - right), height - 8.0,
                  x_name.c_str());
    body_ += text("<text transform='translate(14,%g) rotate(-90)' text-anchor='middle'>%s</text>",
                  0.5 * (height - bottom + top), y_name.c_str());
    double step = tick_step(data.width);
    for (double x = std::ceil(data.x / step - 1e-9) * step; x <= data.x + data.width + 1e-9 * step; x += step) {
        double at = on_page({x, data.y}).x;
        body_ += text("<path d='M%.1f %g V%g' stroke='#ddd'/><text x='%.1f' y='%g' text-anchor='middle'>%g</text>", at,
                      top, height - bottom, at, height - bottom + 15.0, std::abs(x) < 1e-9 * step ? 0.0 : x);
    }
    step = tick_step(data.height);
    for (double y = std::ceil(data.y / step - 1e-9) * step; y <= data.y + data.height + 1e-9 * step; y += step) {
        double at = on_page({data.x, y}).y;
        body_ += text("<path d='M%g %.1f H%g' stroke='#ddd'/><text x='%g' y='%.1f' text-anchor='end'>%g</text>", left,
                      at, width - right, left - 5.0, at + 4.0, std::abs(y) < 1e-9 * step ? 0.0 : y);
    }
}

cv::Point2d Chart::on_page(cv::Point2d position) const
{
    double x = (position.x - data_.x) / data_.width, y = (position.y - data_.y) / data_.height;
    return {left + x * (width - left - right),
            down_ ? top + y * (height - top - bottom) : height - bottom - y * (height - top - bottom)};
}

void Chart::points(const std::vector<cv::Point2d> &positions, const std::string &colour, double radius)
{
    body_ += "<g fill='" + colour + "' fill-opacity='0.6'>";
    for (const cv::Point2d &position : positions) {
        cv::Point2d at = on_page(position);
        if (at.x >= left && at.x <= width - right && at.y >= top && at.y <= height - bottom)
            body_ += text("<circle cx='%.1f' cy='%.1f' r='%.1f'/>", at.x, at.y, radius);
    }
    body_ += "</g>";
}

void Chart::line(const std::vector<cv::Point2d> &positions, const std::string &colour)
{
    body_ += "<polyline fill='none' stroke='" + colour + "' stroke-width='1.6' points='";
    for (const cv::Point2d &position : positions) {
        cv::Point2d at = on_page(position);
        body_ += text("%.1f,%.1f ", at.x, at.y);
    }
    body_ += "'/>";
}

void Chart::words(cv::Point2d position, const std::string &words)
{
    cv::Point2d at = on_page(position);
    body_ += text("<text x='%.1f' y='%.1f'>%s</text>", at.x, at.y, words.c_str());
}

std::string Chart::svg() const
{
    return text("<svg width='%g' height='%g' font-family='sans-serif' font-size='11'>", width, height) + body_ +
           text("<path d='M%g %g V%g H%g' fill='none' stroke='black'/></svg>\n", left, top, height - bottom,
                width - right);
}
} // namespace cal
