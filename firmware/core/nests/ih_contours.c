#include "nests/ih_contours.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"

/* No plain loop becomes the bits of a comparison. */
#if defined __x86_64__ && defined __SSE2__
#include <immintrin.h>
#endif

#define CELLS (IH_SURFACE_GRID - 1)
/* Cells of a row, bit by bit; those at the border. */
#define ALL_CELLS (((uint64_t)1 << CELLS) - 1)
#define BORDER_CELLS ((uint64_t)1 << (CELLS - 1) | 1)
/* With a rise below this a crossing is worked out in 32 bits. */
#define RISE_NARROW (1 << 22)
_Static_assert(IH_SURFACE_GRID <= 64, "a row of nodes has a bit each in 64");

/* Corners of a cell clockwise on the screen; edge i runs from corner i to corner i + 1. A contour
 * walks with the inside on its right, so it enters through an edge whose corner i is inside and
 * i + 1 outside, and leaves through one where it is the other way round. */
static const int8_t beyond_x[4] = {0, 1, 0, -1};
static const int8_t beyond_y[4] = {-1, 0, 1, 0};

/* By the corners that are inside, 0, 1, 3 and 2 from the lowest bit: through which edge a contour
 * leaves. Two opposite ones are a saddle, whose exit is not known by them; none or all have none. */
#define SADDLE 4
static const int8_t exit_of[16] = {-1, 3, 0, 3, 2, 2, SADDLE, 2, 1, SADDLE, 0, 3, 1, 1, 0, -1};

/* An edge in its cell: its ends as nodes from the cell's first, its beginning, its direction. */
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
static uint32_t inside_corners(const struct ih_contours *cuts, int32_t x, int32_t y)
{
    return (uint32_t)(cuts->inside[y] >> x & 3u) | (uint32_t)(cuts->inside[y + 1] >> x & 3u) << 2;
}

static bool is_cell(int32_t x, int32_t y)
{
    return x >= 0 && y >= 0 && x < CELLS && y < CELLS;
}

/* Both corners inside are joined, or not. */
static int32_t exit_of_saddle(const struct ih_surface *surface, const struct ih_contours *cuts,
                              const struct walker *at)
{
    int64_t sum = 0;
    for (int32_t corner = 0; corner < 4; corner++) {
        sum += surface->depth_mm_q8[at->y + corner / 2][at->x + corner % 2];
    }
    return (sum < 4 * (int64_t)cuts->level_mm_q8 ? at->edge + 1 : at->edge + 3) & 3;
}

/* The edge through which the contour leaves the cell. */
static int32_t exit_edge(const struct ih_surface *surface, const struct ih_contours *cuts,
                         const struct walker *at)
{
    const int32_t leave = exit_of[inside_corners(cuts, at->x, at->y)];
    return leave == SADDLE ? exit_of_saddle(surface, cuts, at) : leave;
}

/* Where on an edge the level lies, from the end at `from`. One end is inside and one is not: the rise
 * is not 0, the quotient in 0 .. 512. */
static int32_t part_of_edge_q9(int64_t from, int64_t to, int64_t level)
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

/* Where the level crosses an edge of the cell. */
static struct ih_vertex crossing(const struct ih_surface *surface, int32_t level_mm_q8,
                                 const struct walker *at)
{
    const struct line *line = &line_of_edge[at->edge];
    const int32_t *node = &surface->depth_mm_q8[0][0] + (at->y * IH_SURFACE_GRID + at->x);
    const int32_t part_q9 = part_of_edge_q9(node[line->from], node[line->to], level_mm_q8);
    const int32_t x_q9 = at->x * 512 + line->x_q9 + line->step_x * part_q9;
    const int32_t y_q9 = at->y * 512 + line->y_q9 + line->step_y * part_q9;
    IH_IN_RANGE(x_q9, 0, CELLS * 512);
    IH_IN_RANGE(y_q9, 0, CELLS * 512);
    return (struct ih_vertex){(int16_t)x_q9, (int16_t)y_q9};
}

/* Is the cell still to be entered through the edge? Then it is entered now. */
static bool enter(struct ih_contours *cuts, const struct walker *at)
{
    uint64_t *left = &cuts->entrance[at->edge >> 1][at->y];
    const uint64_t cell = (uint64_t)1 << at->x;
    const bool is_left = (*left & cell) != 0;
    *left &= ~cell;
    return is_left;
}

/* Follow one contour from where it enters a cell until it closes or leaves the grid. */
static void trace(const struct ih_surface *surface, struct ih_contours *cuts, struct walker at)
{
    const int32_t level_mm_q8 = cuts->level_mm_q8;
    const int32_t room = IH_CONTOURS_VERTICES_MAX - cuts->vertex_count;
    struct ih_vertex *vertex = &cuts->vertex[cuts->vertex_count];
    int32_t count = 0;
    bool closed = true;
    while (!closed || enter(cuts, &at)) {
        if (count < room) {
            vertex[count] = crossing(surface, level_mm_q8, &at);
        }
        count++;
        if (!closed) {
            break; /* that was where it leaves the grid */
        }
        const int32_t leave = exit_edge(surface, cuts, &at);
        const struct walker next = {at.x + beyond_x[leave], at.y + beyond_y[leave], leave ^ 2};
        closed = is_cell(next.x, next.y);
        if (closed) {
            at = next;
        } else {
            at.edge = leave;
        }
    }
    if (count > room || cuts->contour_count == IH_CONTOURS_CONTOURS_MAX) {
        cuts->contours_dropped++;
        return;
    }
    cuts->contour[cuts->contour_count++] = (struct ih_contour){
        .first = (int16_t)cuts->vertex_count, .vertex_count = (int16_t)count, .closed = closed};
    cuts->vertex_count += count;
}

/* Start contours at every entrance of the cell that is left. Of edges 0 and 1 only one can be an
 * entrance, which one says the corner between them; so it is with 2 and 3. */
static void start_in_cell(const struct ih_surface *surface, struct ih_contours *cuts, int32_t x,
                          int32_t y, bool border)
{
    for (int32_t half = 0; half < 2; half++) {
        const bool between_inside = (cuts->inside[y + half] >> (x + 1 - half) & 1u) != 0;
        const int32_t edge = 2 * half + (between_inside ? 1 : 0);
        const int32_t across = edge % 2 == 0 ? y : x;
        const bool on_border = across == (edge == 1 || edge == 2 ? CELLS - 1 : 0);
        if ((cuts->entrance[half][y] >> x & 1u) != 0 && (on_border || !border)) {
            trace(surface, cuts, (struct walker){x, y, edge});
        }
    }
}

#if defined __x86_64__ && defined __SSE2__
#define LANES 16
_Static_assert(IH_SURFACE_GRID >= LANES, "a row of nodes fills the lanes");

static uint64_t nodes_inside(const int32_t *depth_mm_q8, int32_t level_mm_q8)
{
    const __m128i level = _mm_set1_epi32(level_mm_q8);
    uint64_t nodes = 0;
    for (int32_t block = 0; block < IH_SURFACE_GRID; block += LANES) {
        const int32_t first = ih_min_s32(block, IH_SURFACE_GRID - LANES); /* some twice */
        const __m128i *four = (const __m128i *)(const void *)&depth_mm_q8[first];
        __m128i is_inside[4];
        for (int i = 0; i < 4; i++) {
            is_inside[i] = _mm_cmpgt_epi32(level, _mm_loadu_si128(&four[i]));
        }
        const __m128i bytes = _mm_packs_epi16(_mm_packs_epi32(is_inside[0], is_inside[1]),
                                              _mm_packs_epi32(is_inside[2], is_inside[3]));
        const uint32_t sixteen = (uint32_t)_mm_movemask_epi8(bytes);
        nodes |= (uint64_t)sixteen << first;
    }
    return nodes;
}
#else
/* In two words: shifts of 64 bits are long on small processors. */
#define WORD_NODES 32
_Static_assert(IH_SURFACE_GRID > WORD_NODES, "a row of nodes fills more than a word");

static uint32_t bits_inside(const int32_t *depth_mm_q8, int32_t count, int32_t level_mm_q8)
{
    uint32_t bits = 0;
    for (int32_t x = count - 1; x >= 0; x--) {
        bits = bits << 1 | (depth_mm_q8[x] < level_mm_q8);
    }
    return bits;
}

static uint64_t nodes_inside(const int32_t *depth_mm_q8, int32_t level_mm_q8)
{
    const uint64_t high =
        bits_inside(&depth_mm_q8[WORD_NODES], IH_SURFACE_GRID - WORD_NODES, level_mm_q8);
    return high << WORD_NODES | bits_inside(depth_mm_q8, WORD_NODES, level_mm_q8);
}
#endif

static void find_inside(const struct ih_surface *surface, struct ih_contours *cuts)
{
    for (int32_t y = 0; y < IH_SURFACE_GRID; y++) {
        cuts->inside[y] = nodes_inside(surface->depth_mm_q8[y], cuts->level_mm_q8);
    }
}

/* Which cells a contour enters through edge 0 or 1, and which through 2 or 3. */
static void find_entrances(struct ih_contours *cuts)
{
    for (int32_t y = 0; y < CELLS; y++) {
        const uint64_t corner0 = cuts->inside[y], corner1 = corner0 >> 1;
        const uint64_t corner3 = cuts->inside[y + 1], corner2 = corner3 >> 1;
        cuts->entrance[0][y] = ((corner0 & ~corner1) | (corner1 & ~corner2)) & ALL_CELLS;
        cuts->entrance[1][y] = ((corner2 & ~corner3) | (corner3 & ~corner0)) & ALL_CELLS;
    }
}

/* Contours that begin at the border come first, so that an open one is found from its beginning. */
static void start_contours(const struct ih_surface *surface, struct ih_contours *cuts, bool border)
{
    for (int32_t y = 0; y < CELLS; y++) {
        bool border_row = y == 0 || y == CELLS - 1;
        uint64_t left = (cuts->entrance[0][y] | cuts->entrance[1][y]) &
                        (border && !border_row ? BORDER_CELLS : ALL_CELLS);
        for (; left != 0; left &= left - 1) {
            start_in_cell(surface, cuts, __builtin_ctzll(left), y, border);
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
