#include "peer.hpp"

#include <cmath>

#include <opencv2/imgproc.hpp>

namespace
{

constexpr double SHAPE_MAX = 1.045;
constexpr double SHAPE_MIN = 0.996;
constexpr double RATIO_WHOLE_MAX = 1.9;
constexpr double RATIO_ARC_MAX = 1.75;
constexpr double CHORD_MAX = 0.42;
constexpr double CHORD_COST = 1.6;
constexpr double SHAPE_COST = 8;
constexpr double AREA_MIN = 0.5; /* grid cells */
constexpr int POINTS = PEER_POINTS;
constexpr int ARC_EDGES_MIN = 8;
constexpr double FOUR_PI = 4 * 3.14159265358979323846;

struct sums {
    double area2, x, y, xx, xy, yy;
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
}

struct shape {
    peer_ellipse ellipse;
    double shape, ratio;
};

bool shape_of_sums(const sums &m, shape &out)
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
    out.ellipse = {m.area2 / 2, x, y};
    return true;
}

sums sums_of_contour(const peer_contour &contour)
{
    sums m = {0, 0, 0, 0, 0, 0};
    for (size_t i = 0; i < contour.vertex.size(); i++) {
        cv::Point2f a = contour.vertex[i];
        cv::Point2f b = contour.vertex[i + 1 < contour.vertex.size() ? i + 1 : 0];
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

double edge_length(const peer_contour &contour, size_t edge)
{
    cv::Point2f d =
        contour.vertex[edge + 1 < contour.vertex.size() ? edge + 1 : 0] - contour.vertex[edge];
    return std::sqrt(static_cast<double>(d.dot(d)));
}

sums sums_of_arc(const peer_outline &r, int from, int to)
{
    sums m = {r.area2[to] - r.area2[from], r.mx[to] - r.mx[from], r.my[to] - r.my[from],
              r.xx[to] - r.xx[from],       r.xy[to] - r.xy[from], r.yy[to] - r.yy[from]};
    add_edge(m, r.x[to], r.y[to], r.x[from], r.y[from]);
    return m;
}

void add_arc(const peer_outline &r, int from, int to, std::vector<peer_arc> &out)
{
    double length = (to - from) * r.step;
    double dx = r.x[to] - r.x[from], dy = r.y[to] - r.y[from];
    double chord2 = dx * dx + dy * dy;
    shape found;
    if (chord2 <= CHORD_MAX * CHORD_MAX * length * length &&
        shape_of_sums(sums_of_arc(r, from, to), found) && found.shape >= SHAPE_MIN &&
        found.shape <= SHAPE_MAX && found.ratio <= RATIO_ARC_MAX) {
        double merit =
            length - CHORD_COST * std::sqrt(chord2) - SHAPE_COST * (found.shape - 1) * length;
        out.push_back({from, to, merit, found.ellipse});
    }
}

/* Peer B: all arcs of as many steps side by side; what passes without a root is looked at closely. */
void add_arcs_of(const peer_outline &r, int steps, std::vector<peer_arc> &out)
{
    using lanes = Eigen::Array<double, POINTS, 1>;
    const int count = std::min(r.count - steps, POINTS);
    const auto x0 = r.x.head<POINTS>(), y0 = r.y.head<POINTS>();
    const auto x1 = r.x.segment<POINTS>(steps), y1 = r.y.segment<POINTS>(steps);
    const double chord = CHORD_MAX * steps * r.step;
    const lanes over = (x1 - x0).square() + (y1 - y0).square() - chord * chord;
    if (over.head(count).minCoeff() > 0) {
        return;
    }
    const lanes w = x1 * y0 - x0 * y1;
    const lanes area2 = r.area2.segment<POINTS>(steps) - r.area2.head<POINTS>() + w;
    const lanes mx = r.mx.segment<POINTS>(steps) - r.mx.head<POINTS>() + w * (x0 + x1);
    const lanes my = r.my.segment<POINTS>(steps) - r.my.head<POINTS>() + w * (y0 + y1);
    const lanes mxx =
        r.xx.segment<POINTS>(steps) - r.xx.head<POINTS>() + w * (x0 * x0 + x0 * x1 + x1 * x1);
    const lanes myy =
        r.yy.segment<POINTS>(steps) - r.yy.head<POINTS>() + w * (y0 * y0 + y0 * y1 + y1 * y1);
    /* 18 area2^2 times the trace of the second moments; an ellipse of the largest ratio has the most */
    const lanes spread = 3 * area2 * (mxx + myy) - 2 * (mx * mx + my * my);
    const double max = 18 * (RATIO_ARC_MAX + 1 / RATIO_ARC_MAX) * SHAPE_MAX / (2 * FOUR_PI);
    /* every test as a number that is positive where it fails */
    const lanes bad = over.max(2 * AREA_MIN - area2).max(spread - max * area2.cube());
    for (int from = 0; from < count; from++) {
        if (bad[from] <= 0) {
            add_arc(r, from, from + steps, out);
        }
    }
}

} // namespace

/* A closed contour that is an ellipse. */
bool peer_ellipse_whole(peer_kind kind, const peer_contour &contour, peer_ellipse &out)
{
    if (kind == peer_kind::a) {
        return whole_by_fit(contour, out);
    }
    shape found;
    if (!shape_of_sums(sums_of_contour(contour), found) || found.shape > SHAPE_MAX ||
        found.ratio > RATIO_WHOLE_MAX) {
        return false;
    }
    out = found.ellipse;
    return true;
}

bool peer_outline_make(const peer_contour &contour, peer_outline &r)
{
    if (contour.vertex.size() < ARC_EDGES_MIN) {
        return false;
    }
    size_t edges = contour.vertex.size() - (contour.closed ? 0 : 1);
    double whole = 0;
    for (size_t i = 0; i < edges; i++) {
        whole += edge_length(contour, i);
    }
    r.step = whole / (contour.closed ? POINTS : POINTS - 1);
    r.count = contour.closed ? 2 * POINTS : POINTS;
    size_t edge = 0;
    double before = 0, length = edge_length(contour, 0);
    for (int k = 0; k < POINTS; k++) {
        double target = k * r.step;
        while (edge < edges - 1 && before + length < target) {
            before += length;
            length = edge_length(contour, ++edge);
        }
        cv::Point2f a = contour.vertex[edge];
        cv::Point2f b = contour.vertex[edge + 1 < contour.vertex.size() ? edge + 1 : 0];
        double arc = length > 0 ? std::min(target - before, length) / length : 0;
        r.x[k] = static_cast<double>(a.x) + arc * static_cast<double>(b.x - a.x);
        r.y[k] = static_cast<double>(a.y) + arc * static_cast<double>(b.y - a.y);
    }
    r.x.tail<POINTS>() = r.x.head<POINTS>();
    r.y.tail<POINTS>() = r.y.head<POINTS>();
    sums m = {0, 0, 0, 0, 0, 0};
    for (int k = 0; k < 2 * POINTS; k++) {
        if (k > 0) {
            add_edge(m, r.x[k - 1], r.y[k - 1], r.x[k], r.y[k]);
        }
        r.area2[k] = m.area2;
        r.mx[k] = m.x;
        r.my[k] = m.y;
        r.xx[k] = m.xx;
        r.xy[k] = m.xy;
        r.yy[k] = m.yy;
    }
    return true;
}

void peer_arcs(peer_kind kind, const peer_outline &outline, std::vector<peer_arc> &out)
{
    out.clear();
    for (int steps = ARC_EDGES_MIN; steps < POINTS; steps++) {
        if (kind == peer_kind::b) {
            add_arcs_of(outline, steps, out);
            continue;
        }
        for (int from = 0; from < std::min(outline.count - steps, POINTS); from++) {
            add_arc(outline, from, from + steps, out);
        }
    }
}

const peer_arc *peer_arc_around(const peer_outline &r, const std::vector<peer_arc> &arcs,
                                cv::Point2f position)
{
    int before[2 * POINTS] = {0}; /* how often the edges before a point wind round the position */
    const double x = static_cast<double>(position.x), y = static_cast<double>(position.y);
    auto winding = [&r, x, y](int from, int to) {
        double px = r.x[from] - x, py = r.y[from] - y, qx = r.x[to] - x, qy = r.y[to] - y;
        return winding_of(px * qy - qx * py, py, qy);
    };
    if (arcs.empty()) {
        return nullptr;
    }
    for (int k = 1; k < r.count; k++) {
        before[k] = before[k - 1] + winding(k - 1, k);
    }
    const peer_arc *best = nullptr;
    for (const peer_arc &arc : arcs) {
        if ((best == nullptr || arc.merit > best->merit) &&
            before[arc.to] - before[arc.from] + winding(arc.to, arc.from) == 1) {
            best = &arc;
        }
    }
    return best;
}
