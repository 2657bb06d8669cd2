#include "peer.hpp"

#include <cstring>

#include <opencv2/imgproc.hpp>

namespace
{

/* Edges of cells: those from a node to the right, then those from a node down. */
constexpr int DOWN = PEER_NODES * PEER_NODES;
constexpr int EDGES = 2 * DOWN;
constexpr int WORD = 8; /* cells that are passed over at once */

struct walker {
    const peer_grid *surface_mm;
    double level_mm;
    /* Both are left as they were found: every contour is followed to its end. */
    int next[EDGES]; /* the edge that the contour leaves the cell through; -1: none */
    bool is_entered[EDGES];
    std::vector<int> edges; /* that a contour leaves from */
};

void link(walker &w, int from, int to)
{
    w.next[from] = to;
    w.is_entered[to] = true;
    w.edges.push_back(from);
}

/* Which corners of the cells are nearer, a bit each; by the cell's first node. The last node of a row has no
 * cell: none of its corners counts. */
void find_corners(const peer_grid &surface_mm, double level_mm, uchar corners[])
{
    static cv::Mat nearer;
    const cv::Mat depth(1, DOWN, CV_64F, const_cast<double *>(surface_mm.data()));
    cv::compare(depth, level_mm, nearer, cv::CMP_LT);
    const uchar *n = nearer.data;
    for (int i = 0; i < DOWN - PEER_NODES - 1; i++) {
        corners[i] = static_cast<uchar>((n[i] & 1) | (n[i + 1] & 2) | (n[i + PEER_NODES + 1] & 4) |
                                        (n[i + PEER_NODES] & 8));
    }
    for (int y = 0; y < PEER_NODES; y++) {
        corners[y * PEER_NODES + PEER_NODES - 1] = 0;
    }
}

/* Is one of the cells of a word neither all nearer nor all farther? */
bool is_crossed(const uchar corners[WORD])
{
    uint64_t word;
    std::memcpy(&word, corners, sizeof word);
    return word != 0 && word != 0x0f0f0f0f0f0f0f0f;
}

/* What is nearer is on the right as one goes from edge to edge. */
void trace_cell(walker &w, int y, int x, int corners)
{
    const peer_grid &z = *w.surface_mm;
    const int at = y * PEER_NODES + x;
    const int edge[4] = {at, DOWN + at + 1, at + PEER_NODES, DOWN + at}; /* top right bottom left */
    static const signed char segments[16][2] = {
        {-1, -1}, {0, 3}, {1, 0},   {1, 3}, {2, 1}, {-1, -1}, {2, 0}, {2, 3},
        {3, 2},   {0, 2}, {-1, -1}, {1, 2}, {3, 1}, {0, 1},   {3, 0}, {-1, -1}};
    if (segments[corners][0] >= 0) {
        link(w, edge[static_cast<int>(segments[corners][0])],
             edge[static_cast<int>(segments[corners][1])]);
        return;
    }
    bool joined = z(y, x) + z(y, x + 1) + z(y + 1, x + 1) + z(y + 1, x) < 4 * w.level_mm;
    if (corners == 5) {
        link(w, edge[0], edge[joined ? 1 : 3]);
        link(w, edge[2], edge[joined ? 3 : 1]);
    } else {
        link(w, edge[joined ? 3 : 1], edge[0]);
        link(w, edge[joined ? 1 : 3], edge[2]);
    }
}

cv::Point2f crossing(const walker &w, int edge)
{
    bool is_down = edge >= DOWN;
    int at = is_down ? edge - DOWN : edge;
    int y = at / PEER_NODES, x = at % PEER_NODES;
    const peer_grid &z = *w.surface_mm;
    double here = z(y, x), there = is_down ? z(y + 1, x) : z(y, x + 1);
    float arc = static_cast<float>((w.level_mm - here) / (there - here));
    return {static_cast<float>(x) + (is_down ? 0.0F : arc),
            static_cast<float>(y) + (is_down ? arc : 0.0F)};
}

void follow(walker &w, int start, peer_contour &out)
{
    int edge = start;
    do {
        out.vertex.push_back(crossing(w, edge));
        int next = w.next[edge];
        w.next[edge] = -1;
        w.is_entered[edge] = false;
        edge = next;
    } while (edge >= 0 && edge != start);
    out.closed = edge == start;
}

walker make_walker()
{
    walker w = {};
    std::fill(w.next, w.next + EDGES, -1);
    return w;
}

} // namespace

void peer_contours(const peer_grid &surface_mm, double level_mm, std::vector<peer_contour> &out)
{
    static walker w = make_walker();
    static uchar corners[(DOWN + WORD - 1) / WORD * WORD]; /* 0 behind the last cell */
    out.clear();
    w.surface_mm = &surface_mm;
    w.level_mm = level_mm;
    w.edges.clear();
    find_corners(surface_mm, level_mm, corners);
    for (int first = 0; first < DOWN; first += WORD) {
        if (!is_crossed(corners + first)) {
            continue;
        }
        for (int at = first; at < first + WORD; at++) {
            const int here = corners[at];
            if (here != 0 && here != 15) {
                trace_cell(w, at / PEER_NODES, at % PEER_NODES, here);
            }
        }
    }
    for (int open = 1; open >= 0; open--) { /* open ones first, from their beginnings */
        for (int edge : w.edges) {
            if (w.next[edge] >= 0 && (!open || !w.is_entered[edge])) {
                out.emplace_back();
                follow(w, edge, out.back());
            }
        }
    }
}
