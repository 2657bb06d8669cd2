/* cal_chart - a small chart as SVG, to stand in an HTML page.
 */
#ifndef CAL_CHART_HPP
#define CAL_CHART_HPP

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace cal
{
class Chart
{
  public:
    /* The rectangle of data that is shown; y grows upwards unless `down`. */
    Chart(const std::string &title, const std::string &x_name, const std::string &y_name, cv::Rect2d data,
          bool down = false);
    void points(const std::vector<cv::Point2d> &positions, const std::string &colour, double radius);
    void line(const std::vector<cv::Point2d> &positions, const std::string &colour);
    void words(cv::Point2d position, const std::string &words);
    std::string svg() const;

  private:
    cv::Point2d on_page(cv::Point2d position) const;
    cv::Rect2d data_;
    bool down_;
    std::string body_;
};
} // namespace cal

#endif
