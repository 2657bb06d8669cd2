/* ih_ellipse against closed forms, against float64 moments by triangles, and its search against a
 * float64 search that tries every part. */
#include "nests/ih_contours.h"
#include "nests/ih_ellipse.h"
#include "nests/ih_arcs.h"

#include "ih_test.h"

struct vector_polygon {
    const char *name;
    int16_t vertex_count;
    const struct ih_vertex *vertex;
    double area, x, y, xx, xy, yy, shape, ratio;
};

struct vector_part {
    const char *name;
    int32_t point_count;
    bool closed;
    int16_t vertex_count;
    const struct ih_vertex *vertex;
    struct ih_vertex place;
    bool found;
    double merit, area, x, y;
};

#include "ellipse.inc"

#define UNIT 512

static struct ih_contours contours;
static struct ih_contour contour;
static struct ih_ellipse ellipse;
static struct ih_ellipse_params params;
static int32_t points; /* on a contour: searches are tested with the most and with fewer */
static struct ih_arcs arcs;
static struct ih_ellipse_scratch scratch;

static void set_params(void)
{
    ih_ellipse_params_default(&params);
    params.point_count = points;
}

void setUp(void)
{
    memset(&contours, IH_TEST_FILL, sizeof contours);
    memset(&arcs, IH_TEST_FILL, sizeof arcs);
    memset(&scratch, IH_TEST_FILL, sizeof scratch);
    memset(&ellipse, IH_TEST_FILL, sizeof ellipse);
    set_params();
}

void tearDown(void)
{
}

/* Somewhere inside the pool, so that the first vertex is not the pool's. */
static void take(const struct ih_vertex *vertex, int32_t count, bool closed)
{
    contour = (struct ih_contour){100, (int16_t)count, closed};
    memcpy(&contours.vertex[100], vertex, (size_t)count * sizeof *vertex);
}

static double from_q16(int64_t value)
{
    return ih_test_from_q(value, 16);
}

static void moments_match_float64(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_polygons); i++) {
        const struct vector_polygon *v = &vector_polygons[i];
        double length = 0, size = sqrt(v->xx + v->yy), error;
        int k;

        take(v->vertex, v->vertex_count, true);
        for (k = 0; k < v->vertex_count; k++) {
            const struct ih_vertex a = v->vertex[k], b = v->vertex[(k + 1) % v->vertex_count];

            length += hypot(a.x_q9 - b.x_q9, a.y_q9 - b.y_q9) / UNIT;
        }
        /* Vertices are rounded to Q8: each may be off by 1/512 step across its edge, all to one
         * side in the worst case. That moves the area by at most length / 512, the centre by that
         * times the distance to it over the area, the second moments by the distance squared; the
         * farthest vertex is at most 3 sigma away. */
        error = length / 512;
        TEST_ASSERT_TRUE_MESSAGE(ih_ellipse_of_contour(&contours, &contour, &ellipse), v->name);
        IH_TEST_WITHIN(error, v->area, from_q16(ellipse.area_q16), v->name, 0);
        error /= fabs(v->area);
        IH_TEST_WITHIN(error * 3 * size + 2e-5, v->x, from_q16(ellipse.x_q16), v->name, 1);
        IH_TEST_WITHIN(error * 3 * size + 2e-5, v->y, from_q16(ellipse.y_q16), v->name, 2);
        error = error * 9 * size * size + 2e-5;
        IH_TEST_WITHIN(error, v->xx, from_q16(ellipse.xx_q16), v->name, 3);
        IH_TEST_WITHIN(error, v->xy, from_q16(ellipse.xy_q16), v->name, 4);
        IH_TEST_WITHIN(error, v->yy, from_q16(ellipse.yy_q16), v->name, 5);
        if (v->ratio < 10) { /* else the smaller axis is a matter of rounding */
            /* In relative terms those errors, doubled by the division. */
            IH_TEST_WITHIN(0.01, 1.0, from_q16(ellipse.shape_q16) / v->shape, v->name, 6);
            IH_TEST_WITHIN(0.01, 1.0, from_q16(ellipse.ratio_q16) / v->ratio, v->name, 7);
        }
    }
}

/* Closed form: w x h at (x, y): w h, w^2 / 12, h^2 / 12, 4 pi / 12, w / h. Whole numbers of Q8, so
 * that nothing is rounded before the divisions. */
static void rectangles_match_the_closed_form(void)
{
    static const int16_t box[][4] = {{0, 0, 1, 1},   {3, 5, 4, 4},   {10, 0, 30, 5},
                                     {0, 0, 46, 46}, {44, 1, 2, 45}, {20, 20, 3, 1}};
    int i;

    for (i = 0; i < IH_TEST_COUNT(box); i++) {
        const int16_t x = (int16_t)(box[i][0] * UNIT), y = (int16_t)(box[i][1] * UNIT);
        const int16_t x2 = (int16_t)(x + box[i][2] * UNIT), y2 = (int16_t)(y + box[i][3] * UNIT);
        const double w = box[i][2], h = box[i][3];
        const struct ih_vertex corner[4] = {{x, y}, {x2, y}, {x2, y2}, {x, y2}};

        take(corner, 4, true);
        TEST_ASSERT_TRUE(ih_ellipse_of_contour(&contours, &contour, &ellipse));
        /* Half a unit of Q16 each; the second moments take the square of the centre away. */
        IH_TEST_WITHIN(1.0 / 65536, w * h, from_q16(ellipse.area_q16), "area", i);
        IH_TEST_WITHIN(1.0 / 65536, box[i][0] + w / 2, from_q16(ellipse.x_q16), "x", i);
        IH_TEST_WITHIN(1.0 / 65536, box[i][1] + h / 2, from_q16(ellipse.y_q16), "y", i);
        IH_TEST_WITHIN(50.0 / 65536, w * w / 12, from_q16(ellipse.xx_q16), "xx", i);
        IH_TEST_WITHIN(50.0 / 65536, h * h / 12, from_q16(ellipse.yy_q16), "yy", i);
        IH_TEST_WITHIN(50.0 / 65536, 0, from_q16(ellipse.xy_q16), "xy", i);
        IH_TEST_WITHIN(0.002, acos(-1.0) / 3, from_q16(ellipse.shape_q16), "shape", i);
        IH_TEST_WITHIN(0.002, 1.0, from_q16(ellipse.ratio_q16) / (w > h ? w / h : h / w), "ratio",
                       i);
    }
}

/* Moments belong to the polygon, not to where it stands or where its list begins. */
static void place_and_beginning_do_not_matter(void)
{
    static struct ih_vertex moved[256];
    const struct vector_part *v = &vector_parts[1];
    struct ih_ellipse first;
    int i;

    take(v->vertex, v->vertex_count, true);
    TEST_ASSERT_TRUE(ih_ellipse_of_contour(&contours, &contour, &first));
    for (i = 0; i < v->vertex_count; i++) {
        const struct ih_vertex from = v->vertex[(i + 37) % v->vertex_count];

        moved[i] =
            (struct ih_vertex){(int16_t)(from.x_q9 + 5 * UNIT), (int16_t)(from.y_q9 - 7 * UNIT)};
    }
    take(moved, v->vertex_count, true);
    TEST_ASSERT_TRUE(ih_ellipse_of_contour(&contours, &contour, &ellipse));
    /* Another beginning is another origin: vertices are rounded the other way, up to 1/512 step. */
    IH_TEST_WITHIN(0.1, from_q16(first.area_q16), from_q16(ellipse.area_q16), "area", 0);
    IH_TEST_WITHIN(0.01, from_q16(first.x_q16) + 5, from_q16(ellipse.x_q16), "x", 0);
    IH_TEST_WITHIN(0.01, from_q16(first.y_q16) - 7, from_q16(ellipse.y_q16), "y", 0);
    IH_TEST_WITHIN(0.05, from_q16(first.xx_q16), from_q16(ellipse.xx_q16), "xx", 0);
}

static void polygons_without_area_are_no_ellipse(void)
{
    static const struct ih_vertex line[] = {{0, 0}, {5000, 5000}, {10000, 10000}};
    static const struct ih_vertex point[] = {{700, 700}, {700, 700}, {700, 700}, {700, 700}};
    static const struct ih_vertex two[] = {{0, 512}, {512, 0}};

    take(line, 3, true);
    TEST_ASSERT_FALSE(ih_ellipse_of_contour(&contours, &contour, &ellipse));
    take(point, 4, true);
    TEST_ASSERT_FALSE(ih_ellipse_of_contour(&contours, &contour, &ellipse));
    take(two, 2, true);
    TEST_ASSERT_FALSE(ih_ellipse_of_contour(&contours, &contour, &ellipse));
}

/* Squares of 16 cells at both ends of the grid and one of -30 in the middle, on a thread: 2 cells of
 * area, its middle in the grid, but a variance of 7056. */
static void a_polygon_whose_parts_cancel_is_no_ellipse(void)
{
    static const struct ih_vertex threaded[] = {
        {0, 10752},     {2048, 10752},  {2048, 12800},  {0, 12800},
        {0, 10752},     {10240, 10496}, {10240, 13056}, {13312, 13056},
        {13312, 10496}, {10240, 10496}, {21504, 10752}, {23552, 10752},
        {23552, 12800}, {21504, 12800}, {21504, 10752}, {10240, 10496}};

    take(threaded, 16, true);
    TEST_ASSERT_FALSE(ih_ellipse_of_contour(&contours, &contour, &ellipse));
}

static void the_winding_tells_inside_from_beside_and_minima_from_maxima(void)
{
    static const struct ih_vertex box[] = {
        {5120, 5120}, {10240, 5120}, {10240, 10240}, {5120, 10240}};
    static const struct ih_vertex back[] = {
        {5120, 5120}, {5120, 10240}, {10240, 10240}, {10240, 5120}};
    static const struct ih_vertex beside[] = {{5000, 7000},  {11000, 7000}, {7000, 5000},
                                              {7000, 11000}, {0, 0},        {23552, 23552},
                                              {0, 10240},    {5120, 0}};
    int i;

    take(box, 4, true);
    TEST_ASSERT_EQUAL_INT32(
        1, ih_ellipse_winding(&contours, &contour, (struct ih_vertex){7168, 7168}));
    TEST_ASSERT_EQUAL_INT32(
        1, ih_ellipse_winding(&contours, &contour, (struct ih_vertex){5122, 10238}));
    for (i = 0; i < IH_TEST_COUNT(beside); i++) {
        IH_TEST_EQUAL(0, ih_ellipse_winding(&contours, &contour, beside[i]), "beside", i);
    }
    take(back, 4, true);
    TEST_ASSERT_EQUAL_INT32(
        -1, ih_ellipse_winding(&contours, &contour, (struct ih_vertex){7168, 7168}));
    take(box, 4, false); /* an open one is closed by its chord */
    TEST_ASSERT_EQUAL_INT32(
        1, ih_ellipse_winding(&contours, &contour, (struct ih_vertex){7168, 7168}));
}

/* A horseshoe: its gap is not inside. */
static void the_winding_follows_a_concave_contour(void)
{
    static const struct ih_vertex horseshoe[] = {{5120, 5120},   {15360, 5120}, {15360, 15360},
                                                 {12800, 15360}, {12800, 7680}, {7680, 7680},
                                                 {7680, 15360},  {5120, 15360}};

    take(horseshoe, 8, true);
    TEST_ASSERT_EQUAL_INT32(
        0, ih_ellipse_winding(&contours, &contour, (struct ih_vertex){10240, 12800}));
    TEST_ASSERT_EQUAL_INT32(
        1, ih_ellipse_winding(&contours, &contour, (struct ih_vertex){10240, 6400}));
    TEST_ASSERT_EQUAL_INT32(
        1, ih_ellipse_winding(&contours, &contour, (struct ih_vertex){6400, 12800}));
}

static bool find_part_around(struct ih_vertex place)
{
    return ih_arcs_make(&contours, &contour, &params, &arcs) &&
           ih_ellipse_of_part(&arcs, place, &params, &scratch, &ellipse);
}

static bool find_part(const struct vector_part *v)
{
    params.point_count = v->point_count;
    take(v->vertex, v->vertex_count, v->closed);
    return find_part_around(v->place);
}

static void the_best_part_matches_the_float_search(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_parts); i++) {
        const struct vector_part *v = &vector_parts[i];

        IH_TEST_EQUAL(v->found, find_part(v), v->name, i);
        if (!v->found) {
            continue;
        }
        /* Points rounded to 1/512 step around a part of radius r change its shape by about
         * 1 / (256 r), and the merit by 8 arc = 50 r times that: 0.2 step. */
        IH_TEST_WITHIN(0.25, v->merit, ih_test_from_q(ellipse.merit_q8, 8), v->name, i);
        /* Parts that differ by one point at an end have nearly the same merit. */
        IH_TEST_WITHIN(0.05, 1.0, from_q16(ellipse.area_q16) / v->area, v->name, i);
        IH_TEST_WITHIN(0.3, v->x, from_q16(ellipse.x_q16), v->name, i);
        IH_TEST_WITHIN(0.3, v->y, from_q16(ellipse.y_q16), v->name, i);
        TEST_ASSERT_TRUE(ellipse.shape_q16 <= params.shape_max_q16);
        TEST_ASSERT_TRUE(ellipse.ratio_q16 <= params.ratio_arc_max_q16);
    }
}

/* Every limit, set to what no part keeps, lets nothing through. */
static void limits_are_obeyed(void)
{
    const struct vector_part *v = &vector_parts[1];

    TEST_ASSERT_TRUE(find_part(v));
    params.shape_max_q16 = 65280;
    TEST_ASSERT_FALSE(find_part(v));
    set_params();
    params.ratio_arc_max_q16 = 65536;
    TEST_ASSERT_FALSE(find_part(v));
    set_params();
    params.chord_max_q16 = 0;
    TEST_ASSERT_FALSE(find_part(v));
}

static void contours_that_are_too_short_or_too_long_have_no_part(void)
{
    static struct ih_vertex longest[IH_CONTOURS_VERTICES_MAX];
    const struct ih_vertex place = {23 * UNIT, 23 * UNIT};
    int32_t i, count;

    for (count = 1; count < 8; count++) {
        take(vector_parts[0].vertex, count, false);
        TEST_ASSERT_FALSE(find_part_around(vector_parts[0].place));
    }
    for (i = 0; i < IH_CONTOURS_VERTICES_MAX; i++) {
        const double angle = i * 2 * acos(-1.0) / (IH_ARCS_VERTICES_MAX + 1);

        longest[i] = (struct ih_vertex){(int16_t)lround((23 + 20 * cos(angle)) * UNIT),
                                        (int16_t)lround((23 + 20 * sin(angle)) * UNIT)};
    }
    contour = (struct ih_contour){0, IH_ARCS_VERTICES_MAX + 1, true};
    memcpy(contours.vertex, longest, sizeof longest);
    TEST_ASSERT_FALSE(find_part_around(place));
}

/* All vertices at one place, and a line there and back: no length, no area, nothing to divide by.
 */
static void degenerate_contours_have_no_part(void)
{
    static struct ih_vertex vertex[40];
    const struct ih_vertex place = {20 * UNIT, 20 * UNIT};
    int i, pass;

    for (pass = 0; pass < 4; pass++) {
        for (i = 0; i < 40; i++) {
            const int along = pass / 2 == 0 ? 0 : i < 20 ? i : 39 - i;

            vertex[i] = (struct ih_vertex){(int16_t)(20 * UNIT + along * 500),
                                           (int16_t)(20 * UNIT + along * 300)};
        }
        take(vertex, 40, pass % 2 == 0);
        TEST_ASSERT_FALSE(find_part_around(place));
    }
}

/* The largest sums: a contour as long as is searched, all over the grid, seen from a corner. */
static void the_longest_contours_do_not_overflow(void)
{
    static struct ih_vertex vertex[IH_ARCS_VERTICES_MAX];
    struct ih_test_random random = {82};
    int32_t i, pass;

    for (pass = 0; pass < 40; pass++) {
        int32_t x = 23 * UNIT, y = 23 * UNIT;

        for (i = 0; i < IH_ARCS_VERTICES_MAX; i++) { /* a walk in steps of at most one cell */
            x += (int32_t)ih_test_between(&random, pass % 2 == 0 ? -UNIT : 0, UNIT);
            y += (int32_t)ih_test_between(&random, -UNIT, pass % 3 == 0 ? 0 : UNIT);
            x = x < 0 ? 0 : x > 46 * UNIT ? 46 * UNIT : x;
            y = y < 0 ? 0 : y > 46 * UNIT ? 46 * UNIT : y;
            vertex[i] = (struct ih_vertex){(int16_t)x, (int16_t)y};
        }
        take(vertex, IH_ARCS_VERTICES_MAX, pass % 4 < 2);
        if (find_part_around((struct ih_vertex){0, 0})) {
            IH_TEST_RANGE(0, 46 << 16, ellipse.x_q16, "x", pass);
        }
        (void)ih_ellipse_of_contour(&contours, &contour, &ellipse);
    }
}

/* Rectangles of sides w x h around places, turned either way, that hang on the middle of the grid by lines
 * there and back: their areas, positive or negative, add up, and so do their moments about the middle. */
struct lobe {
    double x, y, w, h;
    int sign;
};

static void take_lobes(const struct lobe *lobe, int count)
{
    static struct ih_vertex vertex[64];
    int i, k, n = 0;

    for (i = 0; i < count; i++) {
        const double x = 23 + lobe[i].x, y = 23 + lobe[i].y;

        vertex[n++] = (struct ih_vertex){23 * UNIT, 23 * UNIT};
        for (k = 0; k <= 4; k++) { /* its corners, back to the first */
            const int corner = (lobe[i].sign > 0 ? k : 4 - k) % 4;
            const double right = corner == 1 || corner == 2 ? 0.5 : -0.5;
            const double down = corner >= 2 ? 0.5 : -0.5;

            vertex[n++] = (struct ih_vertex){(int16_t)lround((x + right * lobe[i].w) * UNIT),
                                             (int16_t)lround((y + down * lobe[i].h) * UNIT)};
        }
    }
    take(vertex, n, true);
}

/* Areas that nearly cancel can have their centre or their moments anywhere; no polygon on the grid has
 * them beyond 47 steps, or 47^2. Two boxes of area 8, as far to either side, less one of 14 leave 2: the
 * centre is 7 times as far aside as that one, the moment 8 times the square of their distance. */
static void what_crosses_itself_is_no_ellipse(void)
{
    static const struct {
        double apart, aside, centre;
        bool is_ellipse;
    } cases[] = {
        {20, 6.5, 45.5, true}, {20, 6.8, 47.6, false}, {16, 0, 0, true}, {19, 0, 0, false}};
    int i, axis;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        for (axis = 0; axis < 2; axis++) {
            const double x = axis == 0 ? 1 : 0, y = 1 - x, a = cases[i].apart, n = cases[i].aside;
            const struct lobe lobes[] = {{a * x, a * y, 2 + 2 * x, 2 + 2 * y, 1},
                                         {-a * x, -a * y, 2 + 2 * x, 2 + 2 * y, 1},
                                         {-n * x, -n * y, 2 + 5 * x, 2 + 5 * y, -1}};

            take_lobes(lobes, 3);
            IH_TEST_EQUAL(cases[i].is_ellipse, ih_ellipse_of_contour(&contours, &contour, &ellipse),
                          "ellipse", 2 * i + axis);
            if (cases[i].is_ellipse) {
                IH_TEST_WITHIN(1e-4, 2, from_q16(ellipse.area_q16), "area", i);
                IH_TEST_WITHIN(1e-3, 23 + cases[i].centre * x, from_q16(ellipse.x_q16), "x", i);
                IH_TEST_WITHIN(1e-3, 23 + cases[i].centre * y, from_q16(ellipse.y_q16), "y", i);
            }
        }
    }
}

/* Where the list of a contour begins says nothing of how it winds. */
static void the_winding_does_not_depend_on_the_first_vertex(void)
{
    static const struct ih_vertex shape[] = {{5120, 5120},  {9000, 4000},   {14000, 6000},
                                             {15000, 9000}, {12000, 14000}, {6000, 13000}};
    struct ih_vertex normal[6];
    int i, k;

    for (i = 0; i < 6; i++) {
        for (k = 0; k < 6; k++) {
            normal[k] = shape[(i + k) % 6];
        }
        take(normal, 6, true);
        IH_TEST_EQUAL(1, ih_ellipse_winding(&contours, &contour, (struct ih_vertex){10000, 9000}),
                      "inside", i);
        IH_TEST_EQUAL(0, ih_ellipse_winding(&contours, &contour, (struct ih_vertex){4000, 9000}),
                      "left", i);
        IH_TEST_EQUAL(0, ih_ellipse_winding(&contours, &contour, (struct ih_vertex){16000, 9000}),
                      "right", i);
        IH_TEST_EQUAL(0, ih_ellipse_winding(&contours, &contour, (struct ih_vertex){10000, 2000}),
                      "above", i);
        IH_TEST_EQUAL(0, ih_ellipse_winding(&contours, &contour, (struct ih_vertex){10000, 15000}),
                      "below", i);
    }
}

static void take_box(int32_t width_q9, int32_t height_q9)
{
    const int16_t x = 512, y = 1024, x2 = (int16_t)(x + width_q9), y2 = (int16_t)(y + height_q9);
    const struct ih_vertex corner[4] = {{x, y}, {x2, y}, {x2, y2}, {x, y2}};

    take(corner, 4, true);
}

/* Half a grid cell is the smallest area; 255 the largest ratio of the axes, here of 46 x 0.1 steps. */
static void areas_and_ratios_have_their_limits(void)
{
    take_box(UNIT, UNIT / 2);
    TEST_ASSERT_TRUE(ih_ellipse_of_contour(&contours, &contour, &ellipse));
    take_box(UNIT, UNIT / 2 - 2);
    TEST_ASSERT_FALSE(ih_ellipse_of_contour(&contours, &contour, &ellipse));
    take_box(46 * UNIT - 1024, UNIT / 10);
    TEST_ASSERT_TRUE(ih_ellipse_of_contour(&contours, &contour, &ellipse));
    TEST_ASSERT_EQUAL_INT32(255 << 16, ellipse.ratio_q16);
}

/* A regular polygon, its area n/2 r^2 sin(2 pi / n), from the fewest corners to the most. */
static void contours_have_eight_to_768_vertices(void)
{
    static const int32_t counts[] = {7, 8, IH_ARCS_VERTICES_MAX, IH_ARCS_VERTICES_MAX + 1};
    static struct ih_vertex vertex[IH_ARCS_VERTICES_MAX + 1];
    int32_t i, k;

    for (i = 0; i < IH_TEST_COUNT(counts); i++) {
        const int32_t n = counts[i];
        const struct ih_vertex place = {23 * UNIT, 22 * UNIT};
        const double step_angle = 2 * acos(-1.0) / n;

        for (k = 0; k < n; k++) {
            vertex[k] = (struct ih_vertex){(int16_t)lround((23 + 20 * cos(k * step_angle)) * UNIT),
                                           (int16_t)lround((22 + 20 * sin(k * step_angle)) * UNIT)};
        }
        take(vertex, n, true);
        IH_TEST_EQUAL(i == 1 || i == 2, find_part_around(place), "vertices", n);
        if (i == 1 || i == 2) {
            /* Points beside the corners cut them off. */
            const int32_t corners = n < points ? n : points;
            const double area = corners / 2.0 * 400 * sin(2 * acos(-1.0) / corners);

            IH_TEST_WITHIN(0.01, 1, from_q16(ellipse.area_q16) / area, "area", n);
            IH_TEST_WITHIN(0.1, 23, from_q16(ellipse.x_q16), "x", n);
            IH_TEST_WITHIN(0.1, 22, from_q16(ellipse.y_q16), "y", n);
        }
    }
}

/* What is found is found again with its own shape and ratio as limits, and not with less. */
static void limits_may_be_reached(void)
{
    struct ih_ellipse first;
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_parts); i++) {
        const struct vector_part *v = &vector_parts[i];

        if (!find_part(v)) {
            continue;
        }
        first = ellipse;
        params.shape_max_q16 = first.shape_q16;
        params.ratio_arc_max_q16 = first.ratio_q16;
        TEST_ASSERT_TRUE(find_part(v));
        IH_TEST_EQUAL(first.merit_q8, ellipse.merit_q8, v->name, i);
        params.shape_max_q16--;
        IH_TEST_EQUAL(false, find_part(v) && ellipse.shape_q16 >= first.shape_q16, v->name, i);
        params.shape_max_q16++;
        params.ratio_arc_max_q16--;
        IH_TEST_EQUAL(false, find_part(v) && ellipse.ratio_q16 >= first.ratio_q16, v->name, i);
        set_params();
    }
}

/* One part by itself, whatever ih_arcs says of it. */
static bool is_ellipse(int32_t from, int32_t steps, struct ih_vertex place, struct ih_ellipse *out)
{
    static struct ih_arcs one;

    one = arcs;
    one.arc_count = 1;
    one.arc[0] = (struct ih_arc){INT32_MAX, (uint8_t)from, (uint8_t)steps};
    return ih_ellipse_of_part(&one, place, &params, &scratch, out);
}

/* The most merit that ih_arcs gives the arc; INT32_MIN when it is none. */
static int32_t promised_merit(int32_t from, int32_t steps)
{
    int32_t i;

    for (i = 0; i < arcs.arc_count; i++) {
        if (arcs.arc[i].from == from && arcs.arc[i].steps == steps) {
            return arcs.arc[i].merit_max_q8;
        }
    }
    return INT32_MIN;
}

/* Every part with a short enough chord is measured; the first and shortest of the best is taken. */
static void compare_with_all_parts(struct ih_vertex place, int64_t at, int32_t *ellipse_count)
{
    struct ih_ellipse best = {0}, other;
    struct ih_arc arc = {0};
    bool found = false;
    int32_t from, k;

    if (!ih_arcs_make(&contours, &contour, &params, &arcs)) {
        return;
    }
    for (from = 0; from < arcs.point_count; from++) {
        for (k = IH_ARCS_STEPS_MIN; k < arcs.point_count && from + k < arcs.count; k++) {
            const int64_t max_q8 = (int64_t)params.chord_max_q16 * arcs.length_q8[k] / 65536;

            if (ih_arcs_chord2_q16(&arcs, from, from + k) >= (max_q8 + 1) * (max_q8 + 1) ||
                !is_ellipse(from, k, place, &other)) {
                continue;
            }
            ++*ellipse_count;
            if (promised_merit(from, k) < other.merit_q8) {
                IH_TEST_EQUAL(other.merit_q8, promised_merit(from, k), "promised merit", at);
            }
            if (!found || other.merit_q8 > best.merit_q8) {
                best = other;
                arc = (struct ih_arc){0, (uint8_t)from, (uint8_t)k};
                found = true;
            }
        }
    }
    IH_TEST_EQUAL(found, ih_ellipse_of_part(&arcs, place, &params, &scratch, &other), "found", at);
    if (found) {
        IH_TEST_EQUAL(0, memcmp(&best, &other, sizeof best), "the best", at);
        IH_TEST_EQUAL(arc.from, scratch.arc.from, "its beginning", at);
        IH_TEST_EQUAL(arc.steps, scratch.arc.steps, "its steps", at);
    }
}

/* Outlines of all sizes, open and closed, round and lobed, smooth and rough, with limits of all kinds. */
static void no_part_is_missed_that_looking_at_all_would_find(void)
{
    static struct ih_vertex vertex[IH_ARCS_VERTICES_MAX];
    struct ih_test_random random = {85};
    int32_t ellipse_count = 0, pass, i;

    for (pass = 0; pass < 150; pass++) {
        const int32_t count = 40 + pass * 4;
        const double radius = 0.7 + pow((double)ih_test_between(&random, 0, 1000) / 1000, 2) * 21;
        const double wide = 0.6 + (double)ih_test_between(&random, 0, 100) / 100;
        const double lobe = pass % 3 == 0 ? 0 : (double)ih_test_between(&random, 0, 50) / 100;
        const double rough = pass % 5 == 0 ? radius / 10 : 0.01;
        const double x = (double)ih_test_between(&random, 0, 46);
        const double y = (double)ih_test_between(&random, 0, 46);
        const struct ih_vertex place = {(int16_t)(x * UNIT), (int16_t)(y * UNIT)};

        for (i = 0; i < count; i++) {
            const double angle = (pass % 2 == 0 ? 2 : 1.8) * acos(-1.0) * i / count;
            const double noise = (double)ih_test_between(&random, -100, 100) / 100 * rough;
            const double r = radius * (1 + lobe * cos((1 + pass % 4) * angle + pass)) + noise;

            vertex[i] = (struct ih_vertex){
                (int16_t)lround(fmax(0, fmin(46, x + r * wide * cos(angle))) * UNIT),
                (int16_t)lround(fmax(0, fmin(46, y + r * sin(angle))) * UNIT)};
        }
        set_params();
        if (pass % 4 == 1) {
            params.shape_max_q16 += 2000 * (pass % 16);
            params.ratio_arc_max_q16 += 3000 * (pass % 32);
            params.chord_max_q16 += 500 * (pass % 64);
        }
        take(vertex, count, pass % 2 == 0);
        compare_with_all_parts(place, pass, &ellipse_count);
    }
    /* The number of arcs grows with the square of that of points. */
    TEST_ASSERT_GREATER_THAN(5000 * points * points / (56 * 56), ellipse_count);
}

/* The eight of a walk all over the grid, whose arcs cross themselves: what passes then is an accident. */
static void no_part_of_a_walk_is_missed(void)
{
    static struct ih_vertex vertex[IH_ARCS_VERTICES_MAX];
    struct ih_test_random random = {86};
    int32_t ellipse_count = 0, pass, i;

    for (pass = 0; pass < 60; pass++) {
        const int32_t stride = 1 << ih_test_between(&random, 3, 9);
        const int32_t count = pass % 2 == 0 ? IH_ARCS_VERTICES_MAX : 90;
        int32_t x = 23 * UNIT, y = 23 * UNIT;

        for (i = 0; i < count; i++) {
            x += (int32_t)ih_test_between(&random, -stride, stride);
            y += (int32_t)ih_test_between(&random, -stride, stride);
            x = x < 0 ? 0 : x > 46 * UNIT ? 46 * UNIT : x;
            y = y < 0 ? 0 : y > 46 * UNIT ? 46 * UNIT : y;
            vertex[i] = (struct ih_vertex){(int16_t)x, (int16_t)y};
        }
        take(vertex, count, pass % 3 == 0);
        compare_with_all_parts((struct ih_vertex){(int16_t)(vertex[count / 2].x_q9 & ~1),
                                                  (int16_t)(vertex[count / 2].y_q9 & ~1)},
                               pass, &ellipse_count);
    }
    TEST_ASSERT_GREATER_THAN(points == IH_ARCS_POINTS_MAX ? 100 : 5, ellipse_count);
}

int main(void)
{
    static const int32_t counts[] = {IH_ARCS_POINTS_MAX, 32, IH_ARCS_POINTS_MIN};
    int i;

    UNITY_BEGIN();
    RUN_TEST(moments_match_float64);
    RUN_TEST(rectangles_match_the_closed_form);
    RUN_TEST(place_and_beginning_do_not_matter);
    RUN_TEST(polygons_without_area_are_no_ellipse);
    RUN_TEST(a_polygon_whose_parts_cancel_is_no_ellipse);
    RUN_TEST(the_winding_tells_inside_from_beside_and_minima_from_maxima);
    RUN_TEST(the_winding_follows_a_concave_contour);
    RUN_TEST(the_best_part_matches_the_float_search);
    RUN_TEST(limits_are_obeyed);
    RUN_TEST(limits_may_be_reached);
    RUN_TEST(areas_and_ratios_have_their_limits);
    RUN_TEST(what_crosses_itself_is_no_ellipse);
    RUN_TEST(the_winding_does_not_depend_on_the_first_vertex);
    for (i = 0; i < IH_TEST_COUNT(counts); i++) {
        points = counts[i];
        RUN_TEST(no_part_is_missed_that_looking_at_all_would_find);
        RUN_TEST(no_part_of_a_walk_is_missed);
        RUN_TEST(contours_have_eight_to_768_vertices);
        RUN_TEST(contours_that_are_too_short_or_too_long_have_no_part);
        RUN_TEST(degenerate_contours_have_no_part);
        RUN_TEST(the_longest_contours_do_not_overflow);
    }
    return UNITY_END();
}
