#include "nests/ih_contours.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"

#define CELLS (IH_SURFACE_GRID - 1)
/* A bit for each cell of a row; those at the border. */
#define ALL_CELLS (((uint64_t)1 << CELLS) - 1)
#define BORDER_CELLS ((uint64_t)1 << (CELLS - 1) | 1)
/* With a rise below this a crossing fits 32 bits. */
#define RISE_NARROW (1 << 22)
_Static_assert(IH_SURFACE_GRID <= 64, "a row of nodes has a bit each in 64");

/* Corners of a cell clockwise on the screen; edge i runs from corner i to corner i + 1. A contour
 * walks with the inside on its right, so it enters through an edge whose corner i is inside and
 * i + 1 outside, and leaves through one where it is the other way round. */
static const int8_t beyond_x[4] = {0, 1, 0, -1};
static const int8_t beyond_y[4] = {-1, 0, 1, 0};

/* The edge through which a contour leaves, by the corners that are inside: 0, 1, 3 and 2 from the lowest bit.
 * Two opposite ones are a saddle, whose exit depends on the depths; none and all have no exit. */
#define SADDLE 4
static const int8_t exit_of[16] = {-1, 3, 0, 3, 2, 2, SADDLE, 2, 1, SADDLE, 0, 3, 1, 1, 0, -1};

/* An edge of a cell: its ends as nodes from the cell's first one, its start and direction. */
struct line {
    int32_t from, to;
    int32_t x_q9, y_q9;
    int32_t step_x, step_y;
};
static const struct line line_of_edge[4] = {
    {0, 1, 0, 0, 1, 0},
    {1, IH_SURFACE_GRID + 1, 512, 0, 0, 1},
    {IH_SURFACE_GRID + 1, IH_SURFACE_GRID, 512, 512, -1, 0},
    {IH_SURFACE_GRID, 0, 0, 512, 0, -1},
};

struct walker {
    int32_t x, y; /* cell */
    int32_t edge; /* entered through */
};

/* Corners 0, 1, 3, 2 from the lowest bit. */
static uint32_t inside_corners(const struct ih_contours *contours, int32_t x, int32_t y)
{
    return (uint32_t)(contours->inside[y] >> x & 3u) | (uint32_t)(contours->inside[y + 1] >> x & 3u)
                                                           << 2;
}

static bool is_cell(int32_t x, int32_t y)
{
    return x >= 0 && y >= 0 && x < CELLS && y < CELLS;
}

/* Are both corners inside joined? Where the mean of all four is inside. */
static int32_t exit_of_saddle(const struct ih_surface *surface, const struct ih_contours *contours,
                              const struct walker *at)
{
    int64_t sum = 0;
    for (int32_t corner = 0; corner < 4; corner++) {
        sum += surface->depth_mm_q8[at->y + corner / 2][at->x + corner % 2];
    }
    return (sum < 4 * (int64_t)contours->level_mm_q8 ? at->edge + 1 : at->edge + 3) & 3;
}

/* The edge through which the contour leaves the cell. */
static int32_t exit_edge(const struct ih_surface *surface, const struct ih_contours *contours,
                         const struct walker *at)
{
    const int32_t leave = exit_of[inside_corners(contours, at->x, at->y)];
    return leave == SADDLE ? exit_of_saddle(surface, contours, at) : leave;
}

/* Where the level crosses an edge, as a fraction from its start. One end is inside and one is not: the rise is
 * not 0, the quotient in 0 .. 512. */
static int32_t edge_fraction_q9(int64_t from, int64_t to, int64_t level)
{
    int64_t rise = to - from;
    int64_t up = level - from;
    if (rise < 0) {
        rise = -rise;
        up = -up;
    }
    if (rise < RISE_NARROW) {
        return (int32_t)(((uint32_t)up * 512u + (uint32_t)rise / 2) / (uint32_t)rise);
    }
    return (int32_t)ih_div_round(up * 512, rise);
}

static struct ih_vertex crossing(const struct ih_surface *surface, int32_t level_mm_q8,
                                 const struct walker *at)
{
    const struct line *line = &line_of_edge[at->edge];
    const int32_t *node = &surface->depth_mm_q8[0][0] + (at->y * IH_SURFACE_GRID + at->x);
    const int32_t fraction_q9 = edge_fraction_q9(node[line->from], node[line->to], level_mm_q8);
    const int32_t x_q9 = at->x * 512 + line->x_q9 + line->step_x * fraction_q9;
    const int32_t y_q9 = at->y * 512 + line->y_q9 + line->step_y * fraction_q9;
    IH_IN_RANGE(x_q9, 0, CELLS * 512);
    IH_IN_RANGE(y_q9, 0, CELLS * 512);
    return (struct ih_vertex){(int16_t)x_q9, (int16_t)y_q9};
}

/* Is the cell's entrance through this edge unused? It is used now. */
static bool enter(struct ih_contours *contours, const struct walker *at)
{
    uint64_t *entrances = &contours->entrance[at->edge >> 1][at->y];
    const uint64_t cell = (uint64_t)1 << at->x;
    const bool is_unused = (*entrances & cell) != 0;
    *entrances &= ~cell;
    return is_unused;
}

/* Follow one contour from where it enters a cell until it closes or leaves the grid. */
static void trace(const struct ih_surface *surface, struct ih_contours *contours, struct walker at)
{
    const int32_t level_mm_q8 = contours->level_mm_q8;
    const int32_t room = IH_CONTOURS_VERTICES_MAX - contours->vertex_count;
    struct ih_vertex *vertex = &contours->vertex[contours->vertex_count];
    int32_t count = 0;
    bool closed = true;
    while (!closed || enter(contours, &at)) {
        if (count < room) {
            vertex[count] = crossing(surface, level_mm_q8, &at);
        }
        count++;
        if (!closed) {
            break; /* at the grid's border */
        }
        const int32_t leave = exit_edge(surface, contours, &at);
        const struct walker next = {at.x + beyond_x[leave], at.y + beyond_y[leave], leave ^ 2};
        closed = is_cell(next.x, next.y);
        if (closed) {
            at = next;
        } else {
            at.edge = leave;
        }
    }
    if (count > room || contours->contour_count == IH_CONTOURS_CONTOURS_MAX) {
        contours->contours_dropped++;
        return;
    }
    contours->contour[contours->contour_count++] = (struct ih_contour){
        .first = (int16_t)contours->vertex_count, .vertex_count = (int16_t)count, .closed = closed};
    contours->vertex_count += count;
}

/* Start contours at the cell's unused entrances. Only one of edges 0 and 1 can be an entrance: the corner
 * between them decides which. The same holds for 2 and 3. */
static void start_in_cell(const struct ih_surface *surface, struct ih_contours *contours, int32_t x,
                          int32_t y, bool border)
{
    for (int32_t half = 0; half < 2; half++) {
        const bool between_inside = (contours->inside[y + half] >> (x + 1 - half) & 1u) != 0;
        const int32_t edge = 2 * half + (between_inside ? 1 : 0);
        const int32_t across = edge % 2 == 0 ? y : x;
        const bool on_border = across == (edge == 1 || edge == 2 ? CELLS - 1 : 0);
        if ((contours->entrance[half][y] >> x & 1u) != 0 && (on_border || !border)) {
            trace(surface, contours, (struct walker){x, y, edge});
        }
    }
}

/* Nodes of half a row: whole vectors of any width. The two halves overlap. */
#define HALF_NODES 24
_Static_assert(IH_SURFACE_GRID >= HALF_NODES && IH_SURFACE_GRID <= 2 * HALF_NODES,
               "two halves cover a row of nodes");

/* Bit x: is node x nearer than the level? Compilers make vectors of a table of bits, not of 1 << x. */
#define FOUR_BITS(lowest) (lowest), 2u * (lowest), 4u * (lowest), 8u * (lowest)
static uint32_t bits_inside(const int32_t *depth_mm_q8, int32_t level_mm_q8)
{
    static const uint32_t bit[HALF_NODES] = {FOUR_BITS(0x1u),     FOUR_BITS(0x10u),
                                             FOUR_BITS(0x100u),   FOUR_BITS(0x1000u),
                                             FOUR_BITS(0x10000u), FOUR_BITS(0x100000u)};
    uint32_t bits = 0;
    for (int32_t x = 0; x < HALF_NODES; x++) {
        bits |= depth_mm_q8[x] < level_mm_q8 ? bit[x] : 0;
    }
    return bits;
}

static uint64_t nodes_inside(const int32_t *depth_mm_q8, int32_t level_mm_q8)
{
    const int32_t second = IH_SURFACE_GRID - HALF_NODES;
    return (uint64_t)bits_inside(&depth_mm_q8[second], level_mm_q8) << second |
           bits_inside(depth_mm_q8, level_mm_q8);
}

static void find_inside(const struct ih_surface *surface, struct ih_contours *contours)
{
    for (int32_t y = 0; y < IH_SURFACE_GRID; y++) {
        contours->inside[y] = nodes_inside(surface->depth_mm_q8[y], contours->level_mm_q8);
    }
}

/* The cells that a contour enters through edge 0 or 1, and those through 2 or 3. */
static void find_entrances(struct ih_contours *contours)
{
    for (int32_t y = 0; y < CELLS; y++) {
        const uint64_t corner0 = contours->inside[y], corner1 = corner0 >> 1;
        const uint64_t corner3 = contours->inside[y + 1], corner2 = corner3 >> 1;
        contours->entrance[0][y] = ((corner0 & ~corner1) | (corner1 & ~corner2)) & ALL_CELLS;
        contours->entrance[1][y] = ((corner2 & ~corner3) | (corner3 & ~corner0)) & ALL_CELLS;
    }
}

/* Contours from the border come first, so that an open one is followed from its start. */
static void start_contours(const struct ih_surface *surface, struct ih_contours *contours,
                           bool border)
{
    for (int32_t y = 0; y < CELLS; y++) {
        bool border_row = y == 0 || y == CELLS - 1;
        uint64_t cells = (contours->entrance[0][y] | contours->entrance[1][y]) &
                         (border && !border_row ? BORDER_CELLS : ALL_CELLS);
        for (; cells != 0; cells &= cells - 1) {
            start_in_cell(surface, contours, __builtin_ctzll(cells), y, border);
        }
    }
}

void ih_contours_level(const struct ih_surface *surface, int32_t level_mm_q8,
                       struct ih_contours *out)
{
    out->level_mm_q8 = level_mm_q8;
    out->contour_count = 0;
    out->vertex_count = 0;
    out->contours_dropped = 0;
    find_inside(surface, out);
    find_entrances(out);
    start_contours(surface, out, true);
    start_contours(surface, out, false);
}
