/* Contours of any surface: closed or ending at the border, never crossing each other, not at one level and
 * not at two; and nested: what a contour encloses lies within what the next level's enclose. In exact
 * integers of Q9 grid steps, apart from what ih_contours itself reckons. */
#include "nests/ih_contours.h"
#include "surface/ih_surface.h"
#include "prop_scene.h"

#include <stdlib.h>

#define SIDE IH_SURFACE_GRID
#define CELLS (SIDE - 1)
#define UNIT 512
#define LAST (CELLS * UNIT)
#define KINDS 9
#define LEVELS 4
#define SEGMENTS_MAX (2 * IH_CONTOURS_VERTICES_MAX)
/* Segments of two levels in one cell: two each, and those on its border. */
#define PER_CELL_MAX 16

static struct ih_surface surface;
static struct ih_contours near_contours, contours;
static struct ih_test_random random_source;

struct segment {
    struct ih_vertex a, b;
};

static struct segment cell_segments[CELLS][CELLS][PER_CELL_MAX];
static int32_t cell_counts[CELLS][CELLS];
static int32_t nested_of_kind[KINDS]; /* pairs of levels */
static int64_t contour_total, closed_total, nodes_total, pairs_total, dropped_total;

void setUp(void)
{
}

void tearDown(void)
{
}

static int64_t between(int64_t low, int64_t high)
{
    return ih_test_between(&random_source, low, high);
}

/* Depth of a node in Q8: one of several kinds of surfaces, the nasty ones among them. */
static int32_t node_depth(int kind, int32_t x, int32_t y, int32_t scale)
{
    const double smooth = 40 * sin((x + scale) / 5.1) * cos((y - scale) / 4.3) + 0.5 * x;

    switch (kind) {
    case 0: /* smooth */
        return (int32_t)lround(256 * (900 + smooth));
    case 1: /* smooth and rough */
        return (int32_t)lround(256 * (900 + smooth)) + (int32_t)between(-scale * 64, scale * 64);
    case 2: /* terraces: plateaus whose edges are steep */
        return (900 + (int32_t)lround(smooth / 20) * 20) * 256;
    case 3: /* whole steps of 10 mm: nodes exactly at levels, equal neighbours */
        return (900 + (int32_t)between(-2, 2) * 10) * 256;
    case 4: /* saddles everywhere: a chequerboard of near and far, its mean near the level */
        return (900 + ((x + y) % 2 != 0 ? 30 : -30)) * 256 + (int32_t)between(-scale, scale);
    case 5: /* saddles whose mean is exactly a level */
        return (900 + ((x + y) % 2 != 0 ? 10 : -10) * (1 + (x / 2 + y / 2) % 3)) * 256;
    case 6: /* two depths only */
        return (between(0, 5) == 0 ? 880 : 900) * 256;
    case 7: /* differences of single steps of Q8: crossings are rounded to nodes */
        return 900 * 256 + (int32_t)between(-3, 3);
    default: /* all of the range that depths have */
        return (int32_t)between(256, 32000 * 256);
    }
}

/* is_closed: far away at its border, so that all its contours are closed. Of the rough kinds only a part
 * is near: its contours must fit the tables. */
static void make_surface(int kind, int32_t scale, bool is_closed)
{
    const int32_t arc = kind < 3 ? SIDE : kind == 6 ? 18 : 10;
    const int32_t left = (int32_t)between(0, SIDE - arc), top = (int32_t)between(0, SIDE - arc);

    for (int32_t y = 0; y < SIDE; y++) {
        for (int32_t x = 0; x < SIDE; x++) {
            const bool border = x == 0 || y == 0 || x == SIDE - 1 || y == SIDE - 1;
            const bool out = x < left || y < top || x >= left + arc || y >= top + arc;
            const int32_t depth = node_depth(kind, x, y, scale);

            surface.depth_mm_q8[y][x] = (border && is_closed) || out ? 32000 << 8 : depth;
        }
    }
}

static bool on_border(struct ih_vertex v)
{
    return v.x_q9 == 0 || v.y_q9 == 0 || v.x_q9 == LAST || v.y_q9 == LAST;
}

/* Twice the area of a triangle; positive where c lies on the right of a to b as seen on a screen. */
static int64_t side_of(struct ih_vertex a, struct ih_vertex b, struct ih_vertex c)
{
    return (int64_t)(b.x_q9 - a.x_q9) * (c.y_q9 - a.y_q9) -
           (int64_t)(b.y_q9 - a.y_q9) * (c.x_q9 - a.x_q9);
}

static bool cross(const struct segment *s, const struct segment *t)
{
    const int64_t a = side_of(s->a, s->b, t->a), b = side_of(s->a, s->b, t->b);
    const int64_t c = side_of(t->a, t->b, s->a), d = side_of(t->a, t->b, s->b);

    return ((a > 0 && b < 0) || (a < 0 && b > 0)) && ((c > 0 && d < 0) || (c < 0 && d > 0));
}

/* To the cell that it lies in, which must be one; none of those there may be crossed. */
static void add_segment(struct ih_vertex a, struct ih_vertex b, int32_t pass)
{
    const struct segment segment = {a, b};
    const int32_t x = (a.x_q9 + b.x_q9) / 2 / UNIT, y = (a.y_q9 + b.y_q9) / 2 / UNIT;
    const int32_t cx = x < CELLS ? x : CELLS - 1, cy = y < CELLS ? y : CELLS - 1;
    int32_t *count = &cell_counts[cy][cx];

    if (abs(a.x_q9 - b.x_q9) > UNIT || abs(a.y_q9 - b.y_q9) > UNIT) {
        IH_TEST_EQUAL(0, 1, "a contour jumps", pass);
    }
    for (int32_t i = 0; i < *count; i++) {
        pairs_total++;
        if (cross(&segment, &cell_segments[cy][cx][i])) {
            IH_TEST_EQUAL(0, 1, "contours cross", pass);
        }
    }
    IH_TEST_RANGE(0, PER_CELL_MAX - 1, *count, "segments of a cell", pass);
    cell_segments[cy][cx][(*count)++] = segment;
}

/* A contour is closed, or both of its ends are at the border. */
static void add_contours(const struct ih_contours *of, int32_t pass)
{
    for (int32_t i = 0; i < of->contour_count; i++) {
        const struct ih_contour *contour = &of->contour[i];
        const struct ih_vertex *v = &of->vertex[contour->first];
        const int32_t last = contour->vertex_count - 1;

        for (int32_t k = 0; k < last; k++) {
            add_segment(v[k], v[k + 1], pass);
        }
        if (contour->closed) {
            add_segment(v[last], v[0], pass);
        } else if (!on_border(v[0]) || !on_border(v[last])) {
            IH_TEST_EQUAL(0, 1, "an open contour ends inside", pass);
        }
        contour_total++;
        closed_total += contour->closed;
    }
    dropped_total += of->contours_dropped;
}

/* How often the closed contours wind round a position, clockwise on the screen. *touches: one passes
 * through it, and there is no telling. */
static int32_t winding(const struct ih_contours *of, struct ih_vertex place, bool *touches)
{
    int32_t sum = 0;

    *touches = false;
    for (int32_t i = 0; i < of->contour_count; i++) {
        const struct ih_contour *contour = &of->contour[i];
        const struct ih_vertex *v = &of->vertex[contour->first];

        for (int32_t k = 0; k < contour->vertex_count; k++) {
            const struct ih_vertex a = v[k], b = v[(k + 1) % contour->vertex_count];
            const int64_t side = side_of(a, b, place);
            const bool between_x = (a.x_q9 <= place.x_q9) != (b.x_q9 <= place.x_q9);
            const int32_t low_x = a.x_q9 < b.x_q9 ? a.x_q9 : b.x_q9;
            const int32_t high_x = a.x_q9 < b.x_q9 ? b.x_q9 : a.x_q9;
            const int32_t low_y = a.y_q9 < b.y_q9 ? a.y_q9 : b.y_q9;
            const int32_t high_y = a.y_q9 < b.y_q9 ? b.y_q9 : a.y_q9;

            if (side == 0 && place.x_q9 >= low_x && place.x_q9 <= high_x && place.y_q9 >= low_y &&
                place.y_q9 <= high_y) {
                *touches = true;
            } else if (between_x && a.x_q9 < b.x_q9 && side > 0) {
                sum++; /* to the right, the position below it */
            } else if (between_x && a.x_q9 > b.x_q9 && side < 0) {
                sum--;
            }
        }
    }
    return sum;
}

/* All contours closed and none dropped: they wind once round what is nearer, and round nothing else. */
static void check_inside(const struct ih_contours *of, int32_t pass)
{
    for (int32_t y = 0; y < SIDE; y += 1 + pass % 3) {
        for (int32_t x = 0; x < SIDE; x += 1 + pass % 2) {
            const struct ih_vertex place = {(int16_t)(x * UNIT), (int16_t)(y * UNIT)};
            bool touches;
            const int32_t wound = winding(of, place, &touches);

            if (!touches) {
                IH_TEST_EQUAL(surface.depth_mm_q8[y][x] < of->level_mm_q8, wound,
                              "times that contours wind round a node", y * SIDE + x);
                nodes_total++;
            }
        }
    }
}

/* No vertex of the nearer level lies outside what the farther level's contours enclose. */
static void check_nest(int32_t pass)
{
    for (int32_t i = 0; i < near_contours.vertex_count; i += 3) {
        bool touches;
        const int32_t wound = winding(&contours, near_contours.vertex[i], &touches);

        if (!touches) {
            IH_TEST_EQUAL(1, wound, "times that the next level winds round a contour", pass);
        }
    }
}

static int32_t level_of(int32_t index)
{
    return index % 2 == 0 ? (int32_t)(870 + 10 * between(0, 6)) * 256
                          : 900 * 256 + (int32_t)between(-20 * 256, 20 * 256);
}

static void check_surface(int kind, bool is_closed, int32_t pass)
{
    for (int32_t i = 0; i < LEVELS; i++) {
        const int32_t one = kind == 8 ? (int32_t)between(256, 16000 * 256) : level_of(i);
        const int32_t two = kind == 7 ? 900 * 256 + (int32_t)between(-2, 3) : level_of(i + 1);

        memset(cell_counts, 0, sizeof cell_counts);
        ih_contours_level(&surface, one < two ? one : two, &near_contours);
        ih_contours_level(&surface, one < two ? two : one, &contours);
        add_contours(&near_contours, pass);
        if (one != two) {
            add_contours(&contours, pass);
        }
        if (is_closed && near_contours.contours_dropped + contours.contours_dropped == 0) {
            check_inside(&near_contours, pass);
            check_nest(pass);
            nested_of_kind[kind]++;
        }
    }
}

static void contours_end_at_the_border_never_cross_and_nest(void)
{
    const int32_t passes = prop_seeds(1800);

    random_source.state = 601;
    surface.valid = true;
    for (int32_t pass = 0; pass < passes; pass++) {
        const int kind = pass % KINDS;
        const bool is_closed = pass / KINDS % 3 != 0;

        make_surface(kind, 1 + pass % 29, is_closed);
        check_surface(kind, is_closed, pass);
    }
    printf(
        "contours: %d surfaces, %lld contours, %lld closed, %lld dropped, %lld pairs of segments, "
        "%lld nodes\n",
        (int)passes, (long long)contour_total, (long long)closed_total, (long long)dropped_total,
        (long long)pairs_total, (long long)nodes_total);
    for (int kind = 0; kind < KINDS; kind++) {
        IH_TEST_RANGE(passes / 10, LEVELS * passes, nested_of_kind[kind], "pairs of levels", kind);
    }
    TEST_ASSERT_GREATER_THAN_INT64(20 * passes, contour_total);
    TEST_ASSERT_GREATER_THAN_INT64(closed_total, contour_total);
    TEST_ASSERT_GREATER_THAN_INT64(200 * passes, nodes_total);
    TEST_ASSERT_GREATER_THAN_INT64(100 * passes, pairs_total);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(contours_end_at_the_border_never_cross_and_nest);
    return UNITY_END();
}
