/* ih_contours against closed forms, and by what must hold for the contours of any surface. */
#include "nests/ih_contours.h"
#include "surface/ih_surface.h"

#include <stdlib.h>

#include "ih_test.h"

#define SIDE IH_SURFACE_GRID
#define UNIT 512 /* one step in Q9 */
#define LAST ((SIDE - 1) * UNIT)

static struct ih_surface surface;
static struct ih_contours contours;
static struct ih_test_random random_source;

void setUp(void)
{
    random_source.state = 71;
    memset(&surface, 0, sizeof surface);
    memset(&contours, IH_TEST_FILL, sizeof contours);
    surface.valid = true;
}

void tearDown(void)
{
}

static int32_t node(int32_t x, int32_t y)
{
    return surface.depth_mm_q8[y][x];
}

/* A crossing: one end of a grid edge is nearer than the level, the other is not. */
struct crossing {
    bool there, used;
    double x, y;
};

static struct crossing crossings[2][SIDE][SIDE]; /* of the edges to the right and down */

static void find_crossing(int32_t x, int32_t y, int32_t down, int32_t level)
{
    const int32_t x2 = x + (down == 0), y2 = y + (down != 0);
    struct crossing *c = &crossings[down][y][x];

    *c = (struct crossing){false, false, 0, 0};
    if (x2 < SIDE && y2 < SIDE && (node(x, y) < level) != (node(x2, y2) < level)) {
        const double part = ((double)level - node(x, y)) / ((double)node(x2, y2) - node(x, y));

        c->there = true;
        c->x = UNIT * (x + (x2 - x) * part);
        c->y = UNIT * (y + (y2 - y) * part);
    }
}

static int32_t find_crossings(int32_t level)
{
    int32_t x, y, down, count = 0;

    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            for (down = 0; down < 2; down++) {
                find_crossing(x, y, down, level);
                count += crossings[down][y][x].there;
            }
        }
    }
    return count;
}

/* The unused crossing at which a vertex stands; a vertex on a node may belong to several. */
static bool use_crossing(struct ih_vertex vertex)
{
    const int32_t x0 = vertex.x_q9 / UNIT, y0 = vertex.y_q9 / UNIT;
    int32_t x, y, down;

    for (y = y0 > 0 ? y0 - 1 : 0; y <= y0; y++) {
        for (x = x0 > 0 ? x0 - 1 : 0; x <= x0; x++) {
            for (down = 0; down < 2; down++) {
                struct crossing *c = &crossings[down][y][x];

                /* Rounded to the nearest of 512 parts of the edge. */
                if (c->there && !c->used && fabs(c->x - vertex.x_q9) < 0.501 &&
                    fabs(c->y - vertex.y_q9) < 0.501) {
                    c->used = true;
                    return true;
                }
            }
        }
    }
    return false;
}

static bool on_border(struct ih_vertex v)
{
    return v.x_q9 == 0 || v.y_q9 == 0 || v.x_q9 == LAST || v.y_q9 == LAST;
}

/* Two neighbours on a contour lie on the border of one cell. */
static bool are_in_one_cell(struct ih_vertex a, struct ih_vertex b)
{
    const int32_t cx = (a.x_q9 + b.x_q9) / 2 / UNIT, cy = (a.y_q9 + b.y_q9) / 2 / UNIT;

    return abs(a.x_q9 - b.x_q9) <= UNIT && abs(a.y_q9 - b.y_q9) <= UNIT &&
           a.x_q9 >= (cx - 1) * UNIT && a.y_q9 >= (cy - 1) * UNIT;
}

static double signed_area(const struct ih_contour *contour)
{
    const struct ih_vertex *v = &contours.vertex[contour->first];
    double sum = 0;
    int32_t i;

    for (i = 0; i < contour->vertex_count; i++) {
        const struct ih_vertex a = v[i], b = v[(i + 1) % contour->vertex_count];

        sum += (double)a.x_q9 * b.y_q9 - (double)b.x_q9 * a.y_q9;
    }
    return sum / 2 / UNIT / UNIT;
}

static void check_contour(const struct ih_contour *contour, int32_t index)
{
    const struct ih_vertex *v = &contours.vertex[contour->first];
    int32_t i;

    IH_TEST_RANGE(2, IH_CONTOURS_VERTICES_MAX, contour->vertex_count, "vertices of contour", index);
    for (i = 0; i < contour->vertex_count; i++) {
        if (!use_crossing(v[i])) {
            IH_TEST_EQUAL(0, 1, "a vertex on no crossing, or one used twice, in contour", index);
        }
        if (i > 0 && !are_in_one_cell(v[i - 1], v[i])) {
            IH_TEST_EQUAL(0, 1, "a jump in contour", index);
        }
    }
    if (contour->closed) {
        TEST_ASSERT_TRUE(are_in_one_cell(v[contour->vertex_count - 1], v[0]));
    } else {
        TEST_ASSERT_TRUE(on_border(v[0]) && on_border(v[contour->vertex_count - 1]));
    }
}

/* What holds for every surface while the tables suffice: the contours are made of all crossings,
 * each used once, in unbroken lines; the tables' tails stay as they were. */
static void cut(int32_t level_mm_q8)
{
    const int32_t crossing_count = find_crossings(level_mm_q8);
    int32_t i, next = 0;

    memset(&contours, IH_TEST_FILL, sizeof contours);
    ih_contours_level(&surface, level_mm_q8, &contours);
    IH_TEST_EQUAL(level_mm_q8, contours.level_mm_q8, "level", 0);
    for (i = 0; i < contours.contour_count; i++) {
        IH_TEST_EQUAL(next, contours.contour[i].first, "first", i);
        check_contour(&contours.contour[i], i);
        next += contours.contour[i].vertex_count;
    }
    IH_TEST_EQUAL(next, contours.vertex_count, "vertices in all", 0);
    if (contours.contours_dropped == 0) {
        IH_TEST_EQUAL(crossing_count, contours.vertex_count, "crossings used", 0);
    }
    IH_TEST_UNTOUCHED(&contours.contour[contours.contour_count],
                      (size_t)(IH_CONTOURS_CONTOURS_MAX - contours.contour_count) *
                          sizeof contours.contour[0],
                      "contours beyond the last");
}

static void fill(double (*depth_mm)(double x, double y))
{
    int32_t x, y;

    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            surface.depth_mm_q8[y][x] = (int32_t)lround(256 * depth_mm(x, y));
        }
    }
}

static double cone(double x, double y)
{
    return 800 + 10 * hypot(x - 21.3, y - 24.8);
}

static double pit(double x, double y)
{
    return 1000 - 10 * hypot(x - 21.3, y - 24.8);
}

/* On an edge of length 1 the distance to the middle differs from its linear interpolation by at
 * most 1 / (8 R); Q8 depths at 10 mm a step and Q9 places add less than 0.002. */
static void check_circle(const struct ih_contour *contour, double radius)
{
    int32_t i;

    TEST_ASSERT_TRUE(contour->closed);
    for (i = 0; i < contour->vertex_count; i++) {
        const struct ih_vertex v = contours.vertex[contour->first + i];

        IH_TEST_WITHIN(1 / (8 * radius) + 0.002, radius,
                       hypot(v.x_q9 / 512.0 - 21.3, v.y_q9 / 512.0 - 24.8), "radius", i);
    }
}

static void a_cone_is_cut_in_circles(void)
{
    double radius;

    fill(cone);
    for (radius = 1.5; radius < 21; radius += 0.37) {
        cut((int32_t)lround(256 * (800 + 10 * radius)));
        TEST_ASSERT_EQUAL_INT32(1, contours.contour_count);
        check_circle(&contours.contour[0], radius);
        /* A chord polygon with at least 4 R corners, positive around a minimum. */
        IH_TEST_WITHIN(1.2, acos(-1.0) * radius * radius, signed_area(&contours.contour[0]), "area",
                       (int64_t)radius);
    }
}

static void around_a_maximum_the_area_is_negative(void)
{
    fill(pit);
    cut(880 << 8); /* radius 12; all outside it is nearer */
    TEST_ASSERT_EQUAL_INT32(1, contours.contour_count);
    check_circle(&contours.contour[0], 12);
    IH_TEST_WITHIN(1.2, -acos(-1.0) * 144, signed_area(&contours.contour[0]), "area", 0);
}

static double tilted(double x, double y)
{
    return 700 + 5 * x + 3 * y;
}

static void a_plane_is_cut_in_one_straight_open_line(void)
{
    int32_t level_mm, i;

    fill(tilted);
    for (level_mm = 710; level_mm < 1060; level_mm += 17) {
        cut(level_mm << 8);
        TEST_ASSERT_EQUAL_INT32(1, contours.contour_count);
        TEST_ASSERT_FALSE(contours.contour[0].closed);
        for (i = 0; i < contours.vertex_count; i++) {
            /* Half a unit of Q9 in each coordinate, times the slopes of 5 and 3 mm a step. */
            IH_TEST_WITHIN(0.5 / 512 * 5 + 1e-9, level_mm,
                           tilted(contours.vertex[i].x_q9 / 512.0, contours.vertex[i].y_q9 / 512.0),
                           "line", i);
        }
        /* The nearer side, towards (0, 0), lies on the right: the line runs down on the left of the
         * screen, from the upper or right border to the left or lower one. */
        TEST_ASSERT_TRUE(contours.vertex[0].x_q9 > contours.vertex[contours.vertex_count - 1].x_q9);
        TEST_ASSERT_TRUE(contours.vertex[0].y_q9 < contours.vertex[contours.vertex_count - 1].y_q9);
    }
}

static double hills(double x, double y)
{
    return 900 + 40 * sin(x / 5.1) * cos(y / 4.3) + 25 * sin((x + 2 * y) / 7.7) + 0.5 * x;
}

/* Area nearer than the level, by counting 24 x 24 points in every cell of the bilinear surface. */
static double counted_area(int32_t level)
{
    double inside = 0;
    int32_t x, y, i, j;

    for (y = 0; y < SIDE - 1; y++) {
        for (x = 0; x < SIDE - 1; x++) {
            for (i = 0; i < 24 * 24; i++) {
                const double a = (i % 24 + 0.5) / 24;
                const double b = (double)(i / 24) / 24 + 0.5 / 24;
                double depth = 0;

                for (j = 0; j < 4; j++) {
                    depth += (j % 2 != 0 ? a : 1 - a) * (j / 2 != 0 ? b : 1 - b) *
                             node(x + j % 2, y + j / 2);
                }
                inside += depth < level;
            }
        }
    }
    return inside / (24 * 24);
}

/* Make every contour closed: the outermost nodes far away. */
static void close_border(void)
{
    int32_t i;

    for (i = 0; i < SIDE; i++) {
        surface.depth_mm_q8[0][i] = surface.depth_mm_q8[SIDE - 1][i] = 2000 << 8;
        surface.depth_mm_q8[i][0] = surface.depth_mm_q8[i][SIDE - 1] = 2000 << 8;
    }
}

static void signed_areas_add_up_to_what_is_nearer(void)
{
    int32_t level_mm, i;

    fill(hills);
    close_border();
    for (level_mm = 850; level_mm < 990; level_mm += 9) {
        double sum = 0;

        cut(level_mm << 8);
        TEST_ASSERT_EQUAL_INT32(0, contours.contours_dropped);
        for (i = 0; i < contours.contour_count; i++) {
            TEST_ASSERT_TRUE(contours.contour[i].closed);
            sum += signed_area(&contours.contour[i]);
        }
        /* A straight line instead of the bilinear surface's hyperbola, where the far border contours
         * off a corner: up to a tenth of a cell in each of some 20 such cells. */
        IH_TEST_WITHIN(2, counted_area(level_mm << 8), sum, "area", level_mm);
    }
}

static void any_surface_gives_unbroken_contours(void)
{
    int32_t pass, i;

    for (pass = 0; pass < 200; pass++) {
        const int64_t spread = INT64_C(1) << ih_test_between(&random_source, 1, 18);

        for (i = 0; i < SIDE * SIDE;
             i++) { /* smooth and rough ones, with equal depths at the end */
            surface.depth_mm_q8[i / SIDE][i % SIDE] =
                (int32_t)lround(256 * hills(i % SIDE, (double)(i / SIDE))) +
                (int32_t)ih_test_between(&random_source, -spread, spread) / (1 + pass % 3 * 100);
        }
        cut((880 + pass % 40) << 8);
    }
}

static void all_inside_and_all_outside_have_no_contour(void)
{
    int32_t i;

    for (i = 0; i < SIDE * SIDE; i++) {
        surface.depth_mm_q8[i / SIDE][i % SIDE] = 1000;
    }
    cut(999);
    TEST_ASSERT_EQUAL_INT32(0, contours.contour_count);
    cut(1000); /* strictly nearer: a node at the level is outside */
    TEST_ASSERT_EQUAL_INT32(0, contours.contour_count);
    cut(1001);
    TEST_ASSERT_EQUAL_INT32(0, contours.contour_count);
    cut(INT32_MAX);
    cut(INT32_MIN);
    TEST_ASSERT_EQUAL_INT32(0, contours.contour_count + contours.contours_dropped);
}

static void flat_at(int32_t depth)
{
    int32_t i;

    for (i = 0; i < SIDE * SIDE; i++) {
        surface.depth_mm_q8[i / SIDE][i % SIDE] = depth;
    }
}

/* Closed form: a diamond of four vertices at half a step, area 1/2. */
static void one_near_node_is_a_diamond(void)
{
    int32_t x, y;

    for (y = 1; y < SIDE - 1; y += 5) {
        for (x = 1; x < SIDE - 1; x += 5) {
            flat_at(1000);
            surface.depth_mm_q8[y][x] = 0;
            cut(500);
            TEST_ASSERT_EQUAL_INT32(1, contours.contour_count);
            TEST_ASSERT_EQUAL_INT32(4, contours.vertex_count);
            TEST_ASSERT_TRUE(contours.contour[0].closed);
            IH_TEST_WITHIN(1e-9, 0.5, signed_area(&contours.contour[0]), "area", x);
        }
    }
}

/* At the border the same node has an open contour. */
static void a_near_node_at_the_border_is_open(void)
{
    flat_at(1000);
    surface.depth_mm_q8[0][20] = 0;
    cut(500);
    TEST_ASSERT_EQUAL_INT32(1, contours.contour_count);
    TEST_ASSERT_EQUAL_INT32(3, contours.vertex_count);
    TEST_ASSERT_FALSE(contours.contour[0].closed);
    flat_at(1000);
    surface.depth_mm_q8[SIDE - 1][SIDE - 1] = 0;
    cut(500);
    TEST_ASSERT_EQUAL_INT32(1, contours.contour_count);
    TEST_ASSERT_EQUAL_INT32(2, contours.vertex_count);
    TEST_ASSERT_FALSE(contours.contour[0].closed);
}

/* Two near nodes across a cell: one contour when the mean of the four is nearer, else two. */
static void saddles_follow_the_mean(void)
{
    int32_t pass;

    for (pass = 0; pass < 2; pass++) {
        flat_at(1000);
        surface.depth_mm_q8[20][20 + pass] = 0;
        surface.depth_mm_q8[21][21 - pass] = 0; /* the mean is 500 */
        cut(501);
        TEST_ASSERT_EQUAL_INT32(1, contours.contour_count);
        TEST_ASSERT_EQUAL_INT32(8, contours.vertex_count);
        cut(500);
        TEST_ASSERT_EQUAL_INT32(2, contours.contour_count);
        TEST_ASSERT_EQUAL_INT32(4, contours.contour[0].vertex_count);
        TEST_ASSERT_EQUAL_INT32(4, contours.contour[1].vertex_count);
    }
}

static void nodes_at_the_level_are_outside(void)
{
    flat_at(1000);
    surface.depth_mm_q8[20][20] = 0;
    cut(1000); /* the diamond reaches its four neighbours exactly */
    TEST_ASSERT_EQUAL_INT32(1, contours.contour_count);
    IH_TEST_WITHIN(1e-9, 2.0, signed_area(&contours.contour[0]), "area", 0);
    flat_at(0);
    surface.depth_mm_q8[20][20] = 1000;
    cut(1000); /* shrunk to the node itself: no area, but still one clean contour */
    TEST_ASSERT_EQUAL_INT32(1, contours.contour_count);
    IH_TEST_WITHIN(1e-9, 0.0, signed_area(&contours.contour[0]), "area", 0);
}

/* 24 x 24 separate near nodes: 576 contours. */
static void contours_that_do_not_fit_are_counted(void)
{
    int32_t x, y;

    flat_at(1000);
    for (y = 0; y < SIDE; y += 2) {
        for (x = 0; x < SIDE; x += 2) {
            surface.depth_mm_q8[y][x] = 0;
        }
    }
    cut(300);
    TEST_ASSERT_EQUAL_INT32(IH_CONTOURS_CONTOURS_MAX, contours.contour_count);
    TEST_ASSERT_EQUAL_INT32(24 * 24 - IH_CONTOURS_CONTOURS_MAX, contours.contours_dropped);
}

/* A line that winds through the whole grid has more vertices than there is room for. */
static void a_contour_longer_than_the_table_is_left_out_whole(void)
{
    int32_t x, y;

    flat_at(1000);
    for (y = 1; y < SIDE - 1; y += 2) {
        for (x = 1; x < SIDE - 1; x++) {
            surface.depth_mm_q8[y][x] = 0;
        }
        if (y + 2 < SIDE - 1) {
            surface.depth_mm_q8[y + 1][y / 2 % 2 == 0 ? SIDE - 2 : 1] = 0;
        }
    }
    cut(500);
    TEST_ASSERT_EQUAL_INT32(1, contours.contours_dropped);
    TEST_ASSERT_EQUAL_INT32(0, contours.contour_count);
    TEST_ASSERT_EQUAL_INT32(0, contours.vertex_count);
    TEST_ASSERT_TRUE(find_crossings(500) > IH_CONTOURS_VERTICES_MAX);
}

static void the_ends_of_the_range_do_not_overflow(void)
{
    int32_t i;

    for (i = 0; i < SIDE * SIDE; i++) {
        surface.depth_mm_q8[i / SIDE][i % SIDE] = i % 7 == 0 ? INT32_MIN : INT32_MAX;
    }
    cut(0);
    cut(INT32_MAX);
    cut(INT32_MIN + 1);
    TEST_ASSERT_TRUE(contours.contour_count > 0);
}

/* A crossing is worked out in 32 bits or in 64, by the rise; cut() compares both with float64. */
static void rises_of_all_sizes_are_crossed_where_they_should_be(void)
{
    int32_t bits, i, offset;

    for (bits = 1; bits < 31; bits++) {
        for (offset = -2; offset <= 2; offset++) {
            const int64_t rise = (INT64_C(1) << bits) + offset;

            for (i = 0; i < SIDE * SIDE; i++) {
                surface.depth_mm_q8[i / SIDE][i % SIDE] =
                    (i + i / SIDE) % 2 == 0 ? 100
                                            : (int32_t)(100 + (rise > 0 ? rise : 1) - i % 3 / 2);
            }
            cut((int32_t)(101 + ih_test_between(&random_source, 0, rise > 0 ? rise - 1 : 0)));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_cone_is_cut_in_circles);
    RUN_TEST(around_a_maximum_the_area_is_negative);
    RUN_TEST(a_plane_is_cut_in_one_straight_open_line);
    RUN_TEST(signed_areas_add_up_to_what_is_nearer);
    RUN_TEST(any_surface_gives_unbroken_contours);
    RUN_TEST(all_inside_and_all_outside_have_no_contour);
    RUN_TEST(one_near_node_is_a_diamond);
    RUN_TEST(a_near_node_at_the_border_is_open);
    RUN_TEST(saddles_follow_the_mean);
    RUN_TEST(nodes_at_the_level_are_outside);
    RUN_TEST(contours_that_do_not_fit_are_counted);
    RUN_TEST(a_contour_longer_than_the_table_is_left_out_whole);
    RUN_TEST(the_ends_of_the_range_do_not_overflow);
    RUN_TEST(rises_of_all_sizes_are_crossed_where_they_should_be);
    return UNITY_END();
}
