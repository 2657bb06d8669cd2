#include "ih_cuts.h"

#include <string.h>

#include "ih_fix.h"

#define CELLS (IH_SURFACE_GRID - 1)
/* Cells of a row, bit by bit; those at the border. */
#define ALL_CELLS (((uint64_t)1 << CELLS) - 1)
#define BORDER_CELLS ((uint64_t)1 << (CELLS - 1) | 1)
_Static_assert(IH_SURFACE_GRID <= 64, "a row of nodes has a bit each in 64");

/* Corners of a cell clockwise on the screen; edge i runs from corner i to corner i + 1. A contour
 * walks with the inside on its right, so it enters through an edge whose corner i is inside and
 * i + 1 outside, and leaves through one where it is the other way round. */
static const int8_t corner_x[4] = {0, 1, 1, 0};
static const int8_t corner_y[4] = {0, 0, 1, 1};
static const int8_t beyond_x[4] = {0, 1, 0, -1};
static const int8_t beyond_y[4] = {-1, 0, 1, 0};

struct walker {
    int32_t x, y; /* cell */
    int32_t edge; /* entered through */
};

static int32_t corner_depth(const struct ih_surface *surface, int32_t x, int32_t y, int32_t corner)
{
    int32_t i = corner & 3;
    return surface->depth_mm_q8[y + corner_y[i]][x + corner_x[i]];
}

static bool is_inside(const struct ih_surface *surface, const struct ih_cuts *cuts, int32_t x,
                      int32_t y, int32_t corner)
{
    return corner_depth(surface, x, y, corner) < cuts->level_mm_q8;
}

/* Bit i = corner i is inside. */
static uint32_t inside_corners(const struct ih_surface *surface, const struct ih_cuts *cuts,
                               int32_t x, int32_t y)
{
    uint32_t corners = 0;
    for (int32_t corner = 0; corner < 4; corner++) {
        corners |= (uint32_t)is_inside(surface, cuts, x, y, corner) << corner;
    }
    return corners;
}

static bool can_enter(uint32_t corners, int32_t edge)
{
    return (corners >> edge & 1u) != 0 && (corners >> ((edge + 1) & 3) & 1u) == 0;
}

static bool is_cell(int32_t x, int32_t y)
{
    return x >= 0 && y >= 0 && x < CELLS && y < CELLS;
}

/* The edge through which the contour leaves the cell. */
static int32_t exit_edge(const struct ih_surface *surface, const struct ih_cuts *cuts,
                         const struct walker *at)
{
    bool opposite_inside = is_inside(surface, cuts, at->x, at->y, at->edge + 2);
    bool last_inside = is_inside(surface, cuts, at->x, at->y, at->edge + 3);
    if (opposite_inside && !last_inside) { /* saddle: both corners inside are joined, or not */
        int64_t sum = 0;
        for (int32_t corner = 0; corner < 4; corner++) {
            sum += corner_depth(surface, at->x, at->y, corner);
        }
        return sum < 4 * (int64_t)cuts->level_mm_q8 ? at->edge + 1 : at->edge + 3;
    }
    return at->edge + (opposite_inside ? 1 : last_inside ? 2 : 3);
}

/* Where the level crosses an edge. */
static struct ih_vertex crossing(const struct ih_surface *surface, const struct ih_cuts *cuts,
                                 int32_t x, int32_t y, int32_t edge)
{
    int32_t from = edge & 3;
    int32_t to = (edge + 1) & 3;
    int64_t from_depth = corner_depth(surface, x, y, from);
    int64_t to_depth = corner_depth(surface, x, y, to);
    /* One end is inside and one is not: the difference is not 0, the quotient in 0 .. 512. */
    int64_t rise = to_depth - from_depth;
    int64_t part_q9 =
        ih_div_round((cuts->level_mm_q8 - from_depth) * (rise > 0 ? 512 : -512), ih_abs_s64(rise));
    int64_t x_q9 = (x + corner_x[from]) * 512 + (corner_x[to] - corner_x[from]) * part_q9;
    int64_t y_q9 = (y + corner_y[from]) * 512 + (corner_y[to] - corner_y[from]) * part_q9;
    IH_IN_RANGE(x_q9, 0, CELLS * 512);
    IH_IN_RANGE(y_q9, 0, CELLS * 512);
    return (struct ih_vertex){(int16_t)x_q9, (int16_t)y_q9};
}

static void add_vertex(struct ih_cuts *cuts, struct ih_vertex vertex, int32_t *count)
{
    if (cuts->vertex_count + *count < IH_CUTS_VERTICES_MAX) {
        cuts->vertex[cuts->vertex_count + *count] = vertex;
    }
    ++*count;
}

/* Follow one contour from where it enters a cell until it closes or leaves the grid. */
static void trace(const struct ih_surface *surface, struct ih_cuts *cuts, struct walker at)
{
    int32_t count = 0;
    bool closed = true;
    while ((cuts->walked[at.y][at.x] & (1u << at.edge)) == 0) {
        cuts->walked[at.y][at.x] |= (uint8_t)(1u << at.edge);
        add_vertex(cuts, crossing(surface, cuts, at.x, at.y, at.edge), &count);
        int32_t leave = exit_edge(surface, cuts, &at) & 3;
        struct walker next = {at.x + beyond_x[leave], at.y + beyond_y[leave], (leave + 2) & 3};
        if (!is_cell(next.x, next.y)) {
            add_vertex(cuts, crossing(surface, cuts, at.x, at.y, leave), &count);
            closed = false;
            break;
        }
        at = next;
    }
    if (cuts->vertex_count + count > IH_CUTS_VERTICES_MAX ||
        cuts->contour_count == IH_CUTS_CONTOURS_MAX) {
        cuts->contours_dropped++;
        return;
    }
    cuts->contour[cuts->contour_count++] = (struct ih_contour){
        .first = (int16_t)cuts->vertex_count, .vertex_count = (int16_t)count, .closed = closed};
    cuts->vertex_count += count;
}

/* Start contours at every edge of the cell that is an entrance and has not been walked. */
static void start_in_cell(const struct ih_surface *surface, struct ih_cuts *cuts, int32_t x,
                          int32_t y, bool border)
{
    uint32_t corners = inside_corners(surface, cuts, x, y);
    for (int32_t edge = 0; edge < 4; edge++) {
        bool on_border = !is_cell(x + beyond_x[edge], y + beyond_y[edge]);
        if ((on_border || !border) && can_enter(corners, edge) &&
            (cuts->walked[y][x] & (1u << edge)) == 0) {
            trace(surface, cuts, (struct walker){x, y, edge});
        }
    }
}

/* Bit x = node x of a row is inside. */
static uint64_t inside_nodes(const struct ih_surface *surface, int32_t level_mm_q8, int32_t y)
{
    uint64_t nodes = 0;
    for (int32_t x = IH_SURFACE_GRID - 1; x >= 0; x--) {
        nodes = nodes << 1 | (surface->depth_mm_q8[y][x] < level_mm_q8);
    }
    return nodes;
}

/* Bit x = a contour passes cell x between two rows of nodes: some corners are inside, some not. */
static uint64_t passed_cells(uint64_t above, uint64_t below)
{
    uint64_t any = above | above >> 1 | below | below >> 1;
    uint64_t all = above & above >> 1 & below & below >> 1;
    return any & ~all & ALL_CELLS;
}

/* Contours that begin at the border come first, so that an open one is found from its beginning. */
static void start_contours(const struct ih_surface *surface, struct ih_cuts *cuts,
                           const uint64_t passed[CELLS], bool border)
{
    for (int32_t y = 0; y < CELLS; y++) {
        bool border_row = y == 0 || y == CELLS - 1;
        uint64_t left = passed[y] & (border && !border_row ? BORDER_CELLS : ALL_CELLS);
        for (; left != 0; left &= left - 1) {
            start_in_cell(surface, cuts, __builtin_ctzll(left), y, border);
        }
    }
}

void ih_cuts_level(const struct ih_surface *surface, int32_t level_mm_q8, struct ih_cuts *out)
{
    out->level_mm_q8 = level_mm_q8;
    out->contour_count = 0;
    out->vertex_count = 0;
    out->contours_dropped = 0;
    memset(out->walked, 0, sizeof out->walked);
    uint64_t passed[CELLS];
    uint64_t above = inside_nodes(surface, level_mm_q8, 0);
    for (int32_t y = 0; y < CELLS; y++) {
        uint64_t below = inside_nodes(surface, level_mm_q8, y + 1);
        passed[y] = passed_cells(above, below);
        above = below;
    }
    start_contours(surface, out, passed, true);
    start_contours(surface, out, passed, false);
}
