#include "peer.hpp"

#include <opencv2/imgproc.hpp>

namespace
{

constexpr double THRESHOLD_A = 2.5; /* grey levels of the difference of Gaussians */
constexpr double THRESHOLD_B = 4;   /* and of Gaussian less box */
constexpr int AREA_MIN_PX = 2;
constexpr int AREA_MAX_PX = 120;

/* Peer A: two Gaussians in float, connected components, centres weighted by the response. */
void find_dots_a(const cv::Mat &image, std::vector<cv::Point2d> &dots)
{
    cv::Mat grey, inner, outer, response, mask, labels, stats, centroids;
    image.convertTo(grey, CV_32F);
    cv::GaussianBlur(grey, inner, cv::Size(), 1.0);
    cv::GaussianBlur(grey, outer, cv::Size(), 2.5);
    cv::subtract(inner, outer, response);
    cv::compare(response, THRESHOLD_A, mask, cv::CMP_GT);
    int count = cv::connectedComponentsWithStats(mask, labels, stats, centroids, 8, CV_32S);
    for (int i = 1; i < count; i++) {
        const int *s = stats.ptr<int>(i);
        if (s[cv::CC_STAT_AREA] < AREA_MIN_PX || s[cv::CC_STAT_AREA] > AREA_MAX_PX) {
            continue;
        }
        double sum = 0, sum_u = 0, sum_v = 0;
        for (int v = s[cv::CC_STAT_TOP]; v < s[cv::CC_STAT_TOP] + s[cv::CC_STAT_HEIGHT]; v++) {
            const int *label = labels.ptr<int>(v);
            const float *value = response.ptr<float>(v);
            for (int u = s[cv::CC_STAT_LEFT]; u < s[cv::CC_STAT_LEFT] + s[cv::CC_STAT_WIDTH]; u++) {
                double weight = label[u] == i ? static_cast<double>(value[u]) : 0;
                sum += weight;
                sum_u += weight * u;
                sum_v += weight * v;
            }
        }
        dots.emplace_back(sum_u / sum, sum_v / sum);
    }
}

/* Peer B: everything in 8 bits, outlines of blobs, centres weighted in the box around each. */
void find_dots_b(const cv::Mat &image, std::vector<cv::Point2d> &dots)
{
    cv::Mat inner, outer, response, mask;
    std::vector<std::vector<cv::Point>> contours;
    cv::GaussianBlur(image, inner, cv::Size(3, 3), 0);
    cv::blur(image, outer, cv::Size(13, 13));
    cv::subtract(inner, outer, response);
    cv::threshold(response, mask, THRESHOLD_B, 255, cv::THRESH_BINARY);
    cv::findContours(mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    for (const auto &contour : contours) {
        cv::Rect box = cv::boundingRect(contour);
        if (box.area() < AREA_MIN_PX || box.area() > AREA_MAX_PX) {
            continue;
        }
        int sum = 0, sum_u = 0, sum_v = 0;
        for (int v = box.y; v < box.y + box.height; v++) {
            const uchar *value = response.ptr<uchar>(v);
            for (int u = box.x; u < box.x + box.width; u++) {
                sum += value[u];
                sum_u += value[u] * (u - box.x);
                sum_v += value[u] * (v - box.y);
            }
        }
        dots.emplace_back(box.x + static_cast<double>(sum_u) / sum,
                          box.y + static_cast<double>(sum_v) / sum);
    }
}

} // namespace

void peer_find_dots(peer &p)
{
    p.dots.clear();
    (p.kind == peer_kind::a ? find_dots_a : find_dots_b)(p.image, p.dots);
}
