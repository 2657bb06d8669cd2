/* ih_labels on dots of made-up scenes whose labels are known. */
#include "base/ih_config.h"
#include "base/ih_types.h"
#include "dots/ih_dot_rows.h"
#include "dots/ih_dots.h"
#include "labels/ih_labels.h"
#include "rig/ih_camera.h"
#include "rig/ih_rig.h"

#include <stdlib.h>

#include "ih_test.h"
#include "rigs.inc"

struct vector_dot {
    int32_t u_px_q12, v_px_q12;
    int16_t slot; /* IH_NONE: not a dot of the pattern */
};

struct vector_scene {
    const char *name;
    int rig;
    bool clean; /* no noise, nothing missing, nothing spurious */
    int32_t dot_count;
    const struct vector_dot *dot;
};

#include "labels.inc"

static struct ih_rig rig;
static struct ih_labels_params params;
static struct ih_labels_scratch scratch;
static struct ih_dot_rows rows;
static struct ih_dots dots;
static struct ih_labels labels;
static int16_t truth[IH_DOTS_MAX]; /* slot of each dot */
static struct ih_test_random random_source;

struct outcome {
    int32_t right, wrong;
    int32_t real; /* dots of the pattern that are there */
};

static void use_rig(int index)
{
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &vector_rigs[index], &bad_slot));
}

void setUp(void)
{
    random_source.state = 61;
    ih_labels_params_default(&params);
    memset(&dots, 0, sizeof dots);
    memset(&labels, IH_TEST_FILL, sizeof labels);
    memset(&scratch, IH_TEST_FILL, sizeof scratch);
    memset(truth, 0, sizeof truth);
}

void tearDown(void)
{
}

static void add_dot(int32_t u_px_q12, int32_t v_px_q12, int16_t slot)
{
    if (dots.dot_count < IH_DOTS_MAX) {
        truth[dots.dot_count] = slot;
        dots.dot[dots.dot_count++] = (struct ih_dot){u_px_q12, v_px_q12, 100000};
    }
}

static void take_scene(const struct vector_scene *scene)
{
    int32_t i;

    use_rig(scene->rig);
    dots.dot_count = 0;
    for (i = 0; i < scene->dot_count; i++) {
        add_dot(scene->dot[i].u_px_q12, scene->dot[i].v_px_q12, scene->dot[i].slot);
    }
}

/* By row, then column, as ih_dots gives them. */
static void sort_dots(void)
{
    int32_t i, j;

    for (i = 1; i < dots.dot_count; i++) {
        const struct ih_dot dot = dots.dot[i];
        const int16_t slot = truth[i];

        for (j = i; j > 0 && (dots.dot[j - 1].v_px_q12 > dot.v_px_q12 ||
                              (dots.dot[j - 1].v_px_q12 == dot.v_px_q12 &&
                               dots.dot[j - 1].u_px_q12 > dot.u_px_q12));
             j--) {
            dots.dot[j] = dots.dot[j - 1];
            truth[j] = truth[j - 1];
        }
        dots.dot[j] = dot;
        truth[j] = slot;
    }
}

static void assign(void)
{
    ih_dot_rows_fill(&dots, &rig, &rows);
    ih_labels_assign(&dots, &rows, &rig, &params, &scratch, &labels);
}

/* What holds for any input: no dot twice, counts that agree, dots that lie on their lines. */
static void check_table(const char *what)
{
    static int32_t uses[IH_DOTS_MAX];
    int32_t slot, labelled = 0;

    memset(uses, 0, sizeof uses);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_line *line = &rig.line[slot];
        const int32_t dot = labels.dot_of_slot[slot];

        IH_TEST_RANGE(IH_NONE, dots.dot_count - 1, dot, what, slot);
        if (dot == IH_NONE) {
            continue;
        }
        IH_TEST_EQUAL(0, uses[dot]++, what, slot);
        IH_TEST_RANGE(-params.perp_max_px_q12, params.perp_max_px_q12, labels.perp_px_q12[slot],
                      what, slot);
        /* The working range, and half a pixel for the error of a centre. */
        IH_TEST_RANGE(line->t_far_px_q12 - 2048, line->t_near_px_q12 + 2048, labels.t_px_q12[slot],
                      what, slot);
        labelled++;
    }
    IH_TEST_EQUAL(labelled, labels.labelled_count, what, 0);
    IH_TEST_RANGE(0, labelled, labels.seed_count, what, 0);
}

static struct outcome count_right(void)
{
    struct outcome outcome = {0, 0, 0};
    int32_t i;

    for (i = 0; i < dots.dot_count; i++) {
        outcome.real += truth[i] != IH_NONE;
    }
    for (i = 0; i < IH_SLOTS; i++) {
        if (labels.dot_of_slot[i] != IH_NONE) {
            if (truth[labels.dot_of_slot[i]] == i) {
                outcome.right++;
            } else {
                outcome.wrong++;
            }
        }
    }
    return outcome;
}

/* t and perp by their definition, from the undistorted place in double. */
static void check_places(const char *what)
{
    const struct ih_calibration *c = &rig.calibration;
    int32_t slot;

    for (slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_line *line = &rig.line[slot];
        const int32_t dot = labels.dot_of_slot[slot];
        int32_t x, y;
        double u, v, dir_u, dir_v;

        if (dot == IH_NONE) {
            continue;
        }
        ih_camera_undistort(&rig, dots.dot[dot].u_px_q12, dots.dot[dot].v_px_q12, &x, &y);
        u = ih_test_from_q(x, 28) * ih_test_from_q(c->fx_px_q16, 16) +
            ih_test_from_q(c->cx_px_q16, 16) - ih_test_from_q(line->infinity_u_px_q12, 12);
        v = ih_test_from_q(y, 28) * ih_test_from_q(c->fy_px_q16, 16) +
            ih_test_from_q(c->cy_px_q16, 16) - ih_test_from_q(line->infinity_v_px_q12, 12);
        dir_u = ih_test_from_q(line->dir_u_q30, 30);
        dir_v = ih_test_from_q(line->dir_v_q30, 30);
        /* Undistorted places are rounded to Q12, the products once more: two units. */
        IH_TEST_WITHIN(2.0 / 4096, u * dir_u + v * dir_v, ih_test_from_q(labels.t_px_q12[slot], 12),
                       what, slot);
        IH_TEST_WITHIN(2.0 / 4096, fabs(u * dir_v - v * dir_u),
                       fabs(ih_test_from_q(labels.perp_px_q12[slot], 12)), what, slot);
    }
}

/* On flat walls without noise every place is exact: all are labelled, and all are right. */
static void flat_walls_are_labelled_without_error(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_scenes); i++) {
        const struct vector_scene *scene = &vector_scenes[i];
        struct outcome outcome;

        if (!scene->clean ||
            (strstr(scene->name, "wall") == NULL && strstr(scene->name, "tilted") == NULL)) {
            continue;
        }
        take_scene(scene);
        assign();
        check_table(scene->name);
        outcome = count_right();
        IH_TEST_EQUAL(0, outcome.wrong, scene->name, 0);
        IH_TEST_EQUAL(outcome.real, outcome.right, scene->name, 0);
    }
}

static void scenes_with_edges_are_labelled_right(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_scenes); i++) {
        const struct vector_scene *scene = &vector_scenes[i];
        struct outcome outcome;

        if (!scene->clean) {
            continue;
        }
        take_scene(scene);
        assign();
        check_table(scene->name);
        check_places(scene->name);
        outcome = count_right();
        /* Only a dot at an edge, which no rectangle holds, may be wrong or left out. */
        IH_TEST_RANGE(0, outcome.real / 100, outcome.wrong, scene->name, i);
        IH_TEST_RANGE(outcome.real * 93 / 100, outcome.real, outcome.right, scene->name, i);
    }
}

/* 0.1 px of noise, an eighth missing, sixty spurious dots. */
static void rough_scenes_are_labelled_mostly_right(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_scenes); i++) {
        const struct vector_scene *scene = &vector_scenes[i];
        struct outcome outcome;

        if (scene->clean) {
            continue;
        }
        take_scene(scene);
        assign();
        check_table(scene->name);
        check_places(scene->name);
        outcome = count_right();
        /* The goal on whole sequences is 0.4 % wrong with the paper's rig and 3.5 % with the wide
         * one; a single scene of 140 to 320 labels with that many spurious dots may double it. */
        IH_TEST_RANGE(0, (outcome.right + outcome.wrong) * (scene->rig == 0 ? 1 : 7) / 100,
                      outcome.wrong, scene->name, i);
        IH_TEST_RANGE(outcome.real * 85 / 100, outcome.real, outcome.right, scene->name, i);
    }
}

static void without_dots_nothing_is_labelled(void)
{
    int32_t slot;

    use_rig(0);
    assign();
    TEST_ASSERT_EQUAL_INT32(0, labels.labelled_count);
    TEST_ASSERT_EQUAL_INT32(0, labels.seed_count);
    TEST_ASSERT_EQUAL_INT32(0, labels.candidates_dropped);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        TEST_ASSERT_EQUAL_INT16(IH_NONE, labels.dot_of_slot[slot]);
    }
}

/* One dot belongs to no rectangle, so there is nothing to grow from. */
static void one_dot_alone_is_not_labelled(void)
{
    take_scene(&vector_scenes[0]);
    dots.dot[0] = dots.dot[180];
    dots.dot_count = 1;
    assign();
    check_table("one dot");
    TEST_ASSERT_EQUAL_INT32(0, labels.labelled_count);
}

/* What is spurious must not matter: noise alone gives few labels. */
static void noise_alone_is_hardly_labelled(void)
{
    int32_t i;
    int k;

    for (k = 0; k < 2; k++) {
        use_rig(k);
        dots.dot_count = 0;
        for (i = 0; i < 120; i++) {
            add_dot((int32_t)ih_test_between(&random_source, 0, 751 * 4096),
                    (int32_t)ih_test_between(&random_source, 0, 581 * 4096), IH_NONE);
        }
        sort_dots();
        assign();
        check_table("noise");
        /* Chance rectangles: a seed needs four dots within about a pixel of where an affine map
         * wants them. A quarter of the slots would be far too many. */
        IH_TEST_RANGE(0, IH_SLOTS / 4, labels.labelled_count, "noise", k);
    }
}

/* More spurious dots, at other places each time: the right labels stay. */
static void spurious_dots_change_little(void)
{
    int32_t i, pass;

    for (pass = 0; pass < 5; pass++) {
        struct outcome outcome;

        take_scene(&vector_scenes[4]); /* paper rig, head before a wall, clean */
        for (i = 0; i < 50 * pass; i++) {
            add_dot((int32_t)ih_test_between(&random_source, 0, 751 * 4096),
                    (int32_t)ih_test_between(&random_source, 0, 581 * 4096), IH_NONE);
        }
        sort_dots();
        assign();
        check_table("spurious");
        outcome = count_right();
        IH_TEST_RANGE(0, 3 + 2 * pass, outcome.wrong, "wrong", pass);
        IH_TEST_RANGE(outcome.real * 90 / 100, outcome.real, outcome.right, "right", pass);
    }
}

/* The same dots twice: each rectangle has another choice that is just as good, so that none is a
 * seed. */
static void ambiguous_rectangles_are_no_seeds(void)
{
    int32_t i, count;

    take_scene(&vector_scenes[0]);
    count = dots.dot_count;
    for (i = 0; i < count; i++) {
        add_dot(dots.dot[i].u_px_q12, dots.dot[i].v_px_q12, truth[i]);
    }
    sort_dots();
    assign();
    check_table("doubled");
    TEST_ASSERT_EQUAL_INT32(0, labels.seed_count);
    TEST_ASSERT_EQUAL_INT32(0, labels.labelled_count);
}

/* Epsilon is raised until it reaches its limit, wherever it starts: the call must come back. */
static void growing_starts_from_any_epsilon(void)
{
    take_scene(&vector_scenes[5]);
    params.epsilon_min_px_q12 = 0;
    assign();
    TEST_ASSERT_TRUE(labels.labelled_count > labels.seed_count);
    check_table("epsilon from 0");
}

static void limits_are_obeyed(void)
{
    int32_t slot;

    take_scene(&vector_scenes[5]); /* with noise */
    params.seed_max_px_q12 = 0;
    assign();
    TEST_ASSERT_EQUAL_INT32(0, labels.labelled_count);
    ih_labels_params_default(&params);
    params.epsilon_max_px_q12 = params.epsilon_min_px_q12 - 1; /* no growing */
    assign();
    TEST_ASSERT_TRUE(labels.seed_count > 0);
    TEST_ASSERT_EQUAL_INT32(labels.seed_count, labels.labelled_count);
    ih_labels_params_default(&params);
    params.perp_max_px_q12 = 200; /* 0.05 px: half a sigma of the noise */
    assign();
    check_table("narrow lines");
    for (slot = 0; slot < IH_SLOTS; slot++) {
        TEST_ASSERT_TRUE(labels.dot_of_slot[slot] == IH_NONE ||
                         abs(labels.perp_px_q12[slot]) <= 200);
    }
}

static void as_many_dots_as_there_may_be_are_survived(void)
{
    int kind, k;
    int32_t i;

    for (k = 0; k < 2; k++) {
        for (kind = 0; kind < 3; kind++) {
            use_rig(k);
            dots.dot_count = 0;
            for (i = 0; i < IH_DOTS_MAX; i++) {
                if (kind == 0) { /* a fine lattice */
                    add_dot(i % 32 * 23 * 4096, i / 32 * 18 * 4096, IH_NONE);
                } else if (kind == 1) { /* all at one place */
                    add_dot(376 * 4096, 290 * 4096, IH_NONE);
                } else { /* along one row, where the epipolar lines run */
                    add_dot(i * 751 * 4, 290 * 4096, IH_NONE);
                }
            }
            sort_dots();
            assign();
            check_table("many");
            /* At most 16 candidates of 1024 dots at one place can be kept by a slot. */
            TEST_ASSERT_TRUE(kind != 1 || labels.candidates_dropped > 0);
        }
    }
}

static void the_same_dots_give_the_same_labels(void)
{
    static struct ih_labels first;

    take_scene(&vector_scenes[IH_TEST_COUNT(vector_scenes) - 3]);
    assign();
    first = labels;
    memset(&scratch, 0x5A, sizeof scratch);
    assign();
    TEST_ASSERT_EQUAL_MEMORY(first.dot_of_slot, labels.dot_of_slot, sizeof first.dot_of_slot);
    TEST_ASSERT_EQUAL_INT32(first.seed_count, labels.seed_count);
}

/* Dots nearer or farther than the working range are nobody's. */
/* A slot's dot where a surface of this inverse depth, 1/mm, shows it. */
static void put_on_plane(int32_t slot, double inverse_depth)
{
    const struct ih_line *line = &rig.line[slot];
    const double t = inverse_depth * line->length_px_mm_q8 / 256;

    add_dot((int32_t)lround(line->infinity_u_px_q12 + 4096 * t * line->dir_u_q30 / (1 << 30)),
            (int32_t)lround(line->infinity_v_px_q12 + 4096 * t * line->dir_v_q30 / (1 << 30)),
            (int16_t)slot);
}

/* A rectangle whose fourth corner has two dots, both off by some px along its line: its error is half
 * of that. The better one must be better by seed_margin, 0.5, and below seed_max, 1. */
static void seeds_are_better_than_the_next_by_a_margin(void)
{
    static const struct {
        double one_px, other_px;
        bool is_seed;
    } cases[] = {{1.2, 2.0, false}, {1.2, 2.4, true},  {-1.2, 2.0, false}, {1.2, -2.4, true},
                 {0.2, 1.0, false}, {0.2, -1.4, true}, {2.2, 4.0, false},  {1.9, 3.1, true}};
    const int32_t corner = 10 * IH_GRID + 10;
    int i;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        double px;

        use_rig(2);
        dots.dot_count = 0;
        px = 256.0 / rig.line[corner].length_px_mm_q8;
        put_on_plane(corner, 1.0 / 900 + cases[i].one_px * px);
        put_on_plane(corner, 1.0 / 900 + cases[i].other_px * px);
        put_on_plane(corner - 1, 1.0 / 900);
        put_on_plane(corner - IH_GRID, 1.0 / 900);
        put_on_plane(corner - IH_GRID - 1, 1.0 / 900);
        params.epsilon_max_px_q12 = 0; /* seeds alone */
        assign();
        IH_TEST_EQUAL(cases[i].is_seed ? 4 : 0, labels.seed_count, "seeds", i);
        IH_TEST_EQUAL(cases[i].is_seed ? 0 : IH_NONE, labels.dot_of_slot[corner], "its dot", i);
    }
}

/* Four dots in each of the pattern's corners: the first and the last rectangles are seeds, too. */
static void rectangles_reach_all_corners(void)
{
    static const int32_t firsts[] = {0, IH_GRID - 2, 17 * IH_GRID, 17 * IH_GRID + IH_GRID - 2};
    int i;

    for (i = 0; i < IH_TEST_COUNT(firsts); i++) {
        use_rig(2);
        dots.dot_count = 0;
        put_on_plane(firsts[i], 1.0 / 900);
        put_on_plane(firsts[i] + 1, 1.0 / 900);
        put_on_plane(firsts[i] + IH_GRID, 1.0 / 900);
        put_on_plane(firsts[i] + IH_GRID + 1, 1.0 / 900);
        params.epsilon_max_px_q12 = 0; /* seeds alone */
        assign();
        IH_TEST_EQUAL(4, labels.seed_count, "seeds", firsts[i]);
        IH_TEST_EQUAL(0, labels.dot_of_slot[firsts[i]], "the first dot", firsts[i]);
    }
}

/* A slot at the pattern's edge, its neighbours along that edge missing, so that no rectangle has it,
 * before a plane whose dots move by 3 px from row to row of the pattern (or column to column). Its
 * own dot continues the plane; another is nearer to what its neighbours show, but not on the plane. */
static void growing_follows_tilted_planes(void)
{
    static const struct {
        int32_t row, column, inwards_row, inwards_column;
    } edges[] = {{0, 9, 1, 0}, {18, 9, -1, 0}, {9, 0, 0, 1}, {9, 18, 0, -1}};
    int i, tilt;

    for (i = 0; i < 2 * IH_TEST_COUNT(edges); i++) {
        const int32_t row = edges[i / 2].row, column = edges[i / 2].column;
        const int32_t slot = row * IH_GRID + column;
        int32_t depth, across;
        double px;

        use_rig(2);
        dots.dot_count = 0;
        tilt = i % 2 == 0 ? 1 : -1;
        px = 256.0 / rig.line[slot].length_px_mm_q8; /* of inverse depth */
        put_on_plane(slot, 1.0 / 900);
        put_on_plane(slot, 1.0 / 900 + tilt * 2 * px); /* 1 px from the next row's */
        for (depth = 0; depth < 5; depth++) {
            for (across = -2; across <= 2; across++) {
                const int32_t r =
                    row + depth * edges[i / 2].inwards_row + across * edges[i / 2].inwards_column;
                const int32_t c = column + depth * edges[i / 2].inwards_column +
                                  across * edges[i / 2].inwards_row;

                if (depth > 0) {
                    put_on_plane(r * IH_GRID + c, 1.0 / 900 + tilt * depth * 3 * px);
                }
            }
        }
        assign();
        IH_TEST_RANGE(12, 20, labels.seed_count, "seeds", i);
        IH_TEST_EQUAL(0, labels.dot_of_slot[slot], "the dot on the plane", i);
    }
}

/* With a baseline of 10 mm the far end of a line is less than the margin from infinity, but nothing
 * lies behind infinity: a dot there is on no line. */
static void nothing_lies_behind_infinity(void)
{
    struct ih_calibration c = vector_rigs[2];
    int32_t bad_slot, off_q12, t_far;

    c.far_mm = IH_DEPTH_MAX_MM;
    memset(c.origin_mm_q16, 0, sizeof c.origin_mm_q16);
    c.origin_mm_q16[0] = 10 << 16;
    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &c, &bad_slot));
    t_far = rig.line[180].t_far_px_q12;
    IH_TEST_RANGE(1, 2047, t_far, "nearer than the margin", 0);
    for (off_q12 = -600; off_q12 <= 600; off_q12 += 200) {
        const struct ih_line *line = &rig.line[180];

        dots.dot_count = 0;
        /* a lens without distortion: undistorted pixels are pixels, to a few units */
        add_dot(line->infinity_u_px_q12 + (int32_t)((int64_t)off_q12 * line->dir_u_q30 >> 30),
                line->infinity_v_px_q12 + (int32_t)((int64_t)off_q12 * line->dir_v_q30 >> 30), 180);
        assign();
        if (off_q12 != 0) {
            IH_TEST_EQUAL(off_q12 > 0, scratch.candidate_count[180], "candidates", off_q12);
        }
    }
}

static void dots_out_of_range_are_not_labelled(void)
{
    int32_t slot;

    use_rig(1);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        int32_t x, y, u, v;

        ih_rig_dot_at(&rig, slot, 16000 << 8, &x, &y); /* far is 2600 mm: 35 px nearer */
        ih_camera_distort(&rig, x, y, &u, &v);
        if (ih_camera_sees(&rig, u, v)) {
            add_dot(u, v, (int16_t)slot);
        }
    }
    sort_dots();
    assign();
    check_table("beyond the range");
    TEST_ASSERT_EQUAL_INT32(0, count_right().right);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(flat_walls_are_labelled_without_error);
    RUN_TEST(scenes_with_edges_are_labelled_right);
    RUN_TEST(rough_scenes_are_labelled_mostly_right);
    RUN_TEST(without_dots_nothing_is_labelled);
    RUN_TEST(one_dot_alone_is_not_labelled);
    RUN_TEST(noise_alone_is_hardly_labelled);
    RUN_TEST(spurious_dots_change_little);
    RUN_TEST(ambiguous_rectangles_are_no_seeds);
    RUN_TEST(seeds_are_better_than_the_next_by_a_margin);
    RUN_TEST(growing_starts_from_any_epsilon);
    RUN_TEST(rectangles_reach_all_corners);
    RUN_TEST(growing_follows_tilted_planes);
    RUN_TEST(limits_are_obeyed);
    RUN_TEST(as_many_dots_as_there_may_be_are_survived);
    RUN_TEST(the_same_dots_give_the_same_labels);
    RUN_TEST(dots_out_of_range_are_not_labelled);
    RUN_TEST(nothing_lies_behind_infinity);
    return UNITY_END();
}
