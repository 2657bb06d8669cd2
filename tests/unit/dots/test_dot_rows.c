/* ih_dot_rows: the order, and positions against the lens' own equations in double. */
#include "dots/ih_dot_rows.h"
#include "rig/ih_camera.h"
#include "rig/ih_rig.h"

#include "ih_test.h"
#include "moved_rig.h"
#include "rigs.inc"

static struct ih_rig rig;
static struct ih_dots dots;
static struct ih_dot_rows rows;
static struct ih_test_random random_source;

void setUp(void)
{
    random_source.state = 47;
    memset(&dots, 0, sizeof dots);
    memset(&rows, IH_TEST_FILL, sizeof rows);
}

void tearDown(void)
{
}

static void use_rig(int which)
{
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &vector_rigs[which], &bad_slot));
}

static void scatter(int32_t count)
{
    dots.dot_count = count;
    for (int32_t i = 0; i < count; i++) {
        dots.dot[i].u_px_q12 =
            (int32_t)ih_test_between(&random_source, 0, (rig.calibration.width - 1) * 4096);
        dots.dot[i].v_px_q12 =
            (int32_t)ih_test_between(&random_source, 0, (rig.calibration.height - 1) * 4096);
    }
}

/* Each dot once, by row, those of one row as they came. */
static void assert_order(void)
{
    static int32_t uses[IH_DOTS_MAX];

    memset(uses, 0, sizeof uses);
    IH_TEST_EQUAL(dots.dot_count, rows.dot_count, "dots", 0);
    IH_TEST_EQUAL(INT32_MAX, rows.v_px_q12[rows.dot_count], "behind the last one", 0);
    for (int32_t i = 0; i < rows.dot_count; i++) {
        IH_TEST_RANGE(0, dots.dot_count - 1, rows.dot[i], "dot", i);
        IH_TEST_EQUAL(0, uses[rows.dot[i]]++, "uses", i);
        if (i > 0) {
            TEST_ASSERT_TRUE(
                rows.v_px_q12[i - 1] < rows.v_px_q12[i] ||
                (rows.v_px_q12[i - 1] == rows.v_px_q12[i] && rows.dot[i - 1] < rows.dot[i]));
        }
    }
}

/* Where the lens shows what was found is the dot. The camera's own bound is 0.005 px. */
static void assert_positions(int which)
{
    const struct ih_calibration *c = &rig.calibration;

    for (int32_t i = 0; i < rows.dot_count; i++) {
        const struct ih_dot *dot = &dots.dot[rows.dot[i]];
        const double k1 = ldexp(c->k1_q24, -24), k2 = ldexp(c->k2_q24, -24);
        const double p1 = ldexp(c->p1_q24, -24), p2 = ldexp(c->p2_q24, -24);
        const double x = (rows.u_px_q12[i] * 16.0 - c->cx_px_q16) / c->fx_px_q16;
        const double y = (rows.v_px_q12[i] * 16.0 - c->cy_px_q16) / c->fy_px_q16;
        const double r2 = x * x + y * y;
        const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * ldexp(c->k3_q24, -24)));
        const double u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
        const double v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;

        IH_TEST_WITHIN(0.006, dot->u_px_q12 / 4096.0, (u * c->fx_px_q16 + c->cx_px_q16) / 65536,
                       "u", which);
        IH_TEST_WITHIN(0.006, dot->v_px_q12 / 4096.0, (v * c->fy_px_q16 + c->cy_px_q16) / 65536,
                       "v", which);
    }
}

static void dots_come_by_row_without_the_lens(void)
{
    for (int which = 0; which < IH_TEST_COUNT(vector_rigs); which++) {
        for (int32_t count = 0; count <= IH_DOTS_MAX; count = 4 * count + 16) {
            use_rig(which);
            scatter(count);
            ih_dot_rows_fill(&dots, &rig, &rows);
            assert_order();
            assert_positions(which);
        }
    }
}

/* The longest way for the insertion, and the shortest. */
static void order_of_dots_does_not_matter(void)
{
    use_rig(2); /* no distortion */
    dots.dot_count = IH_DOTS_MAX;
    for (int pass = 0; pass < 3; pass++) {
        for (int32_t i = 0; i < IH_DOTS_MAX; i++) {
            const int32_t row = pass == 0 ? i : pass == 1 ? IH_DOTS_MAX - i : 512;

            dots.dot[i] = (struct ih_dot){(i * 37 % 320) * 4096, row * 512, 100};
        }
        ih_dot_rows_fill(&dots, &rig, &rows);
        assert_order();
        IH_TEST_EQUAL(pass == 1 ? IH_DOTS_MAX - 1 : 0, rows.dot[0], "first", pass);
        IH_TEST_EQUAL(pass == 1 ? 0 : IH_DOTS_MAX - 1, rows.dot[IH_DOTS_MAX - 1], "last", pass);
    }
}

/* Positions by slot. */
static void positions_of(int which, const struct moved_rig *moved, double position_px[][2])
{
    static const struct moved_scene scene = {1200, 0, 1, 0};
    static int16_t slot_of_dot[IH_DOTS_MAX];

    random_source.state = 5;
    see_dots(&vector_rigs[which], moved, &scene, &random_source, slot_of_dot, &dots);
    TEST_ASSERT_GREATER_THAN_INT32(350, dots.dot_count);
    ih_dot_rows_fill(&dots, &rig, &rows);
    memset(position_px, 0, IH_SLOTS * sizeof *position_px);
    for (int32_t i = 0; i < rows.dot_count; i++) {
        const int16_t slot = slot_of_dot[rows.dot[i]];

        position_px[slot][0] = rows.u_px_q12[i] / 4096.0;
        position_px[slot][1] = rows.v_px_q12[i] / 4096.0;
    }
}

/* Dots of a camera that was refocused lie where the file's camera would see them; what a slot's dots differ by is the
 * lens' error twice, and half a unit of each. */
static void another_focal_length_is_taken_off(void)
{
    static const double focals[] = {0.01, -0.01, 0.004, -0.015, 0.015};
    static const struct moved_rig file;
    static double straight_px[IH_SLOTS][2], position_px[IH_SLOTS][2];

    for (int which = 0; which < 2; which++) {
        for (int i = 0; i < IH_TEST_COUNT(focals); i++) {
            const struct moved_rig moved = {{0, 0, 0}, focals[i]};

            use_rig(which);
            positions_of(which, &file, straight_px);
            rig.focal_q30 = (int32_t)lround(focals[i] * Q30);
            positions_of(which, &moved, position_px);
            for (int slot = 0; slot < IH_SLOTS; slot++) {
                for (int axis = 0; axis < 2 && straight_px[slot][0] > 0 && position_px[slot][0] > 0;
                     axis++) {
                    IH_TEST_WITHIN(0.011, straight_px[slot][axis], position_px[slot][axis],
                                   "position", 1000 * i + slot);
                }
            }
        }
    }
}

static void dots_above_a_row_are_counted(void)
{
    use_rig(2);
    for (int pass = 0; pass < 2000; pass++) {
        const int32_t row = (int32_t)ih_test_between(&random_source, -1, 9);
        int32_t above = 0;

        dots.dot_count = (int32_t)ih_test_between(&random_source, 0, 12);
        for (int32_t i = 0; i < dots.dot_count; i++) {
            dots.dot[i].v_px_q12 = (int32_t)ih_test_between(&random_source, 0, 8) * 4096;
        }
        ih_dot_rows_fill(&dots, &rig, &rows);
        for (int32_t i = 0; i < dots.dot_count; i++) {
            above += rows.v_px_q12[i] < row * 4096;
        }
        IH_TEST_EQUAL(
            above,
            ih_dot_rows_count_above(&rows, row * 4096,
                                    (int32_t)ih_test_between(&random_source, 0, dots.dot_count)),
            "above", pass);
    }
}

/* Along and across, by their definition. */
static void positions_on_a_line_are_exact(void)
{
    for (int pass = 0; pass < 1000; pass++) {
        const double angle = 6.2831853 * ih_test_unit(&random_source);
        const double along = 4096 * (100 * ih_test_unit(&random_source) - 20);
        const double across = 4096 * (40 * ih_test_unit(&random_source) - 20);
        const struct ih_line line = {.infinity_u_px_q12 = 300 * 4096,
                                     .infinity_v_px_q12 = -200 * 4096,
                                     .dir_u_q30 = (int32_t)lround(cos(angle) * Q30),
                                     .dir_v_q30 = (int32_t)lround(sin(angle) * Q30)};

        rows.u_px_q12[9] = (int32_t)lround(300 * 4096 + along * cos(angle) - across * sin(angle));
        rows.v_px_q12[9] = (int32_t)lround(-200 * 4096 + along * sin(angle) + across * cos(angle));
        IH_TEST_WITHIN(1.3, along, (double)ih_dot_rows_along_px_q12(&rows, 9, &line), "along",
                       pass);
        IH_TEST_WITHIN(1.3, across, (double)ih_dot_rows_across_px_q12(&rows, 9, &line), "across",
                       pass);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(dots_come_by_row_without_the_lens);
    RUN_TEST(order_of_dots_does_not_matter);
    RUN_TEST(another_focal_length_is_taken_off);
    RUN_TEST(dots_above_a_row_are_counted);
    RUN_TEST(positions_on_a_line_are_exact);
    return UNITY_END();
}
