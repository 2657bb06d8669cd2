#include "peer.hpp"

#include <cmath>

#include <opencv2/imgproc.hpp>

namespace
{

constexpr double SHAPE_MAX = 1.045;
constexpr double SHAPE_MIN = 0.996;
constexpr double RATIO_WHOLE_MAX = 1.9;
constexpr double RATIO_PART_MAX = 1.75;
constexpr double CHORD_MAX = 0.42;
constexpr double CHORD_COST = 1.6;
constexpr double SHAPE_COST = 8;
constexpr double AREA_MIN = 0.5; /* grid cells */
constexpr double LEAST = -1e9;   /* merit */
constexpr int POINTS = 56;
constexpr int PART_EDGES_MIN = 8;
constexpr double FOUR_PI = 4 * 3.14159265358979323846;

struct sums {
    double area2, x, y, xx, xy, yy;
    int winding;
};

/* How an edge crosses the ray from the origin along x. */
int winding_of(double w, double py, double qy)
{
    return py <= 0 && qy > 0 && w > 0 ? 1 : py > 0 && qy <= 0 && w < 0 ? -1 : 0;
}

/* Green's theorem; times 2, 6, 6, 12, 24, 12. */
void add_edge(sums &m, double px, double py, double qx, double qy)
{
    double w = px * qy - qx * py;
    m.area2 += w;
    m.x += w * (px + qx);
    m.y += w * (py + qy);
    m.xx += w * (px * px + px * qx + qx * qx);
    m.yy += w * (py * py + py * qy + qy * qy);
    m.xy += w * (2 * px * py + px * qy + qx * py + 2 * qx * qy);
    m.winding += winding_of(w, py, qy);
}

struct shape {
    peer_ellipse ellipse;
    double shape, ratio;
};

bool shape_of_sums(const sums &m, cv::Point2f place, shape &out)
{
    if (m.area2 < 2 * AREA_MIN) {
        return false;
    }
    double x = m.x / (3 * m.area2), y = m.y / (3 * m.area2);
    double xx = m.xx / (6 * m.area2) - x * x;
    double yy = m.yy / (6 * m.area2) - y * y;
    double xy = m.xy / (12 * m.area2) - x * y;
    double determinant = xx * yy - xy * xy;
    if (determinant <= 0) {
        return false;
    }
    double half = (xx + yy) / 2;
    double root = std::sqrt((xx - yy) * (xx - yy) / 4 + xy * xy);
    if (half <= root) {
        return false;
    }
    out.shape = FOUR_PI * 2 * std::sqrt(determinant) / m.area2;
    out.ratio = std::sqrt((half + root) / (half - root));
    out.ellipse = {m.area2 / 2, x + static_cast<double>(place.x), y + static_cast<double>(place.y)};
    return true;
}

sums sums_of_contour(const peer_contour &contour, cv::Point2f place)
{
    sums m = {0, 0, 0, 0, 0, 0, 0};
    for (size_t i = 0; i < contour.vertex.size(); i++) {
        cv::Point2f a = contour.vertex[i] - place;
        cv::Point2f b = contour.vertex[i + 1 < contour.vertex.size() ? i + 1 : 0] - place;
        add_edge(m, static_cast<double>(a.x), static_cast<double>(a.y), static_cast<double>(b.x),
                 static_cast<double>(b.y));
    }
    return m;
}

/* Peer A: the direct fit, judged by the areas of contour and ellipse. */
bool whole_by_fit(const peer_contour &contour, peer_ellipse &out)
{
    if (contour.vertex.size() < 5) {
        return false;
    }
    double area = cv::contourArea(contour.vertex);
    cv::RotatedRect fit = cv::fitEllipseDirect(contour.vertex);
    double major = static_cast<double>(std::max(fit.size.width, fit.size.height));
    double minor = static_cast<double>(std::min(fit.size.width, fit.size.height));
    double fitted = FOUR_PI / 16 * major * minor;
    if (area < AREA_MIN || !(minor > 0) || major > RATIO_WHOLE_MAX * minor ||
        std::abs(fitted / area - 1) > SHAPE_MAX - 1) {
        return false;
    }
    out = {area, static_cast<double>(fit.center.x), static_cast<double>(fit.center.y)};
    return true;
}

/* Points at equal steps, twice round where the contour is closed, and sums before each. */
struct resampled {
    double x[2 * POINTS], y[2 * POINTS];
    sums before[2 * POINTS];
    int count;
    double length, step;
};

double edge_length(const peer_contour &contour, size_t edge)
{
    cv::Point2f d =
        contour.vertex[edge + 1 < contour.vertex.size() ? edge + 1 : 0] - contour.vertex[edge];
    return std::sqrt(static_cast<double>(d.dot(d)));
}

void resample(const peer_contour &contour, cv::Point2f place, resampled &r)
{
    size_t edges = contour.vertex.size() - (contour.closed ? 0 : 1);
    r.length = 0;
    for (size_t i = 0; i < edges; i++) {
        r.length += edge_length(contour, i);
    }
    r.step = r.length / (contour.closed ? POINTS : POINTS - 1);
    r.count = contour.closed ? 2 * POINTS : POINTS;
    size_t edge = 0;
    double before = 0, length = edge_length(contour, 0);
    for (int k = 0; k < POINTS; k++) {
        double target = k * r.step;
        while (edge < edges - 1 && before + length < target) {
            before += length;
            length = edge_length(contour, ++edge);
        }
        cv::Point2f a = contour.vertex[edge] - place;
        cv::Point2f b = contour.vertex[edge + 1 < contour.vertex.size() ? edge + 1 : 0] - place;
        double part = length > 0 ? std::min(target - before, length) / length : 0;
        r.x[k] = static_cast<double>(a.x) + part * static_cast<double>(b.x - a.x);
        r.y[k] = static_cast<double>(a.y) + part * static_cast<double>(b.y - a.y);
    }
    for (int k = POINTS; k < r.count; k++) {
        r.x[k] = r.x[k - POINTS];
        r.y[k] = r.y[k - POINTS];
    }
    r.before[0] = {0, 0, 0, 0, 0, 0, 0};
    for (int k = 1; k < r.count; k++) {
        r.before[k] = r.before[k - 1];
        add_edge(r.before[k], r.x[k - 1], r.y[k - 1], r.x[k], r.y[k]);
    }
}

/* Is the part from..to an ellipse, and of more merit than the best so far? */
bool test_part(const resampled &r, int from, int to, cv::Point2f place, double best, shape &out,
               double &merit)
{
    double arc = (to - from) * r.step;
    double dx = r.x[to] - r.x[from], dy = r.y[to] - r.y[from];
    double chord2 = dx * dx + dy * dy;
    if (chord2 > CHORD_MAX * CHORD_MAX * arc * arc) {
        return false;
    }
    double chord = std::sqrt(chord2);
    if (arc - CHORD_COST * chord - SHAPE_COST * (SHAPE_MIN - 1) * arc <= best) {
        return false;
    }
    const sums &b = r.before[from];
    double w = r.x[to] * r.y[from] - r.x[from] * r.y[to];
    if (r.before[to].winding - b.winding + winding_of(w, r.y[to], r.y[from]) != 1) {
        return false;
    }
    sums m = r.before[to];
    m = {m.area2 - b.area2,    m.x - b.x, m.y - b.y, m.xx - b.xx, m.xy - b.xy, m.yy - b.yy,
         m.winding - b.winding};
    add_edge(m, r.x[to], r.y[to], r.x[from], r.y[from]);
    if (!shape_of_sums(m, place, out) || out.shape < SHAPE_MIN || out.shape > SHAPE_MAX ||
        out.ratio > RATIO_PART_MAX) {
        return false;
    }
    merit = arc - CHORD_COST * chord - SHAPE_COST * (out.shape - 1) * arc;
    return merit > best;
}

} // namespace

/* A closed contour that winds round the place and is an ellipse. */
bool peer_ellipse_whole(peer_kind kind, const peer_contour &contour, cv::Point2f place,
                        peer_ellipse &out)
{
    if (kind == peer_kind::a) {
        return whole_by_fit(contour, out);
    }
    shape found;
    if (!shape_of_sums(sums_of_contour(contour, place), place, found) || found.shape > SHAPE_MAX ||
        found.ratio > RATIO_WHOLE_MAX) {
        return false;
    }
    out = found.ellipse;
    return true;
}

/* The best elliptical part around the place; peer B does not look at what cannot be better. */
bool peer_ellipse_part(peer_kind kind, const peer_contour &contour, cv::Point2f place,
                       peer_ellipse &out, double &merit)
{
    static resampled r;
    bool found = false;
    merit = LEAST;
    if (contour.vertex.size() < PART_EDGES_MIN) {
        return false;
    }
    resample(contour, place, r);
    for (int from = 0; from < POINTS; from++) {
        for (int to = from + PART_EDGES_MIN; to <= std::min(r.count - 1, from + POINTS - 1); to++) {
            shape part;
            double part_merit;
            double best = kind == peer_kind::a ? LEAST : merit;
            if (test_part(r, from, to, place, best, part, part_merit) && part_merit > merit) {
                out = part.ellipse;
                merit = part_merit;
                found = true;
            }
        }
    }
    return found;
}
