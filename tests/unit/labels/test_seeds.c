/* The steps of ih_labels one by one, on made-up tables, against their definitions in double: candidates,
 * seeds, what neighbours expect, the order of offers. */
#include "base/ih_config.h"
#include "dots/ih_dots.h"
#include "labels/ih_label_growth.h"
#include "labels/ih_label_lines.h"
#include "labels/ih_label_order.h"
#include "labels/ih_label_seeds.h"
#include "labels/ih_labels.h"
#include "rig/ih_rig.h"

#include <stdlib.h>

#include "ih_test.h"

static struct ih_labels_scratch scratch;
static struct ih_dot_rows rows;
static struct ih_labels_params params;
static struct ih_labels labels;
static struct ih_dots dots;
static struct ih_rig rig; /* of it the last corner's line alone */
static struct ih_test_random random_source;

void setUp(void)
{
    random_source.state = 4711;
    ih_labels_params_default(&params);
    memset(&scratch, 0, sizeof scratch);
    memset(&rows, 0, sizeof rows);
    scratch.rows = &rows;
    memset(&labels, 0, sizeof labels);
    memset(scratch.choice, 0xff, sizeof scratch.choice);
    memset(scratch.slot_of_dot, 0xff, sizeof scratch.slot_of_dot);
    for (int16_t i = 0; i < IH_DOTS_MAX; i++) {
        rows.dot[i] = i;
    }
}

void tearDown(void)
{
}

static int32_t between(int64_t low, int64_t high)
{
    return (int32_t)ih_test_between(&random_source, low, high);
}

/* --- candidates --- */

/* Whatever comes in whatever order: the first 16 in reading order stay, in that order. */
static void the_first_sixteen_candidates_stay(void)
{
    int pass, i, k;

    for (pass = 0; pass < 500; pass++) {
        const int count = between(1, 40);

        scratch.candidate_count[5] = 0;
        labels.candidates_dropped = 0;
        for (i = 0; i < count; i++) {
            /* few different places, so that rows are equal, but no two dots are at one place */
            dots.dot[i].v_px_q12 = between(0, 5);
            dots.dot[i].u_px_q12 = between(0, 5) * 64 + i;
            ih_label_lines_add_candidate(&dots, (struct ih_candidate){.dot = (int16_t)i}, 5,
                                         &scratch, &labels);
        }
        IH_TEST_EQUAL(count < 16 ? count : 16, scratch.candidate_count[5], "kept", pass);
        IH_TEST_EQUAL(count < 16 ? 0 : count - 16, labels.candidates_dropped, "dropped", pass);
        for (i = 0; i < count; i++) {
            int before = 0;

            for (k = 0; k < count; k++) {
                before += dots.dot[k].v_px_q12 < dots.dot[i].v_px_q12 ||
                          (dots.dot[k].v_px_q12 == dots.dot[i].v_px_q12 &&
                           dots.dot[k].u_px_q12 < dots.dot[i].u_px_q12);
            }
            if (before < 16) {
                IH_TEST_EQUAL(i, scratch.candidate[5][before].dot, "in reading order", before);
            }
        }
    }
}

/* A level line, 4 px from its far end to its near end: 0.5 px more either way, 0.6 px beside. */
static void candidates_lie_on_their_line(void)
{
    static const struct {
        int32_t t, perp;
        bool is_candidate;
    } cases[] = {{40960 - 2048, 0, true},  {40960 - 2049, 0, false}, {57344 + 2048, 0, true},
                 {57344 + 2049, 0, false}, {50000, 2458, true},      {50000, 2459, false},
                 {50000, -2458, true},     {50000, -2459, false},    {50000, 1, true}};
    struct ih_line line = {.infinity_u_px_q12 = 400000,
                           .infinity_v_px_q12 = 300000,
                           .dir_u_q30 = 1 << 30,
                           .length_px_mm_q8 = 10000 << 8,
                           .t_far_px_q12 = 40960,
                           .t_near_px_q12 = 57344};
    int i, direction;

    dots.dot_count = 1;
    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        for (direction = 0; direction < 4; direction++) { /* to the right, down, to the left, up */
            const int32_t along_u = direction == 0 ? 1 : direction == 2 ? -1 : 0;
            const int32_t along_v = direction == 1 ? 1 : direction == 3 ? -1 : 0;

            line.dir_u_q30 = along_u * (1 << 30);
            line.dir_v_q30 = along_v * (1 << 30);
            rows.u_px_q12[0] = 400000 + cases[i].t * along_u - cases[i].perp * along_v;
            rows.v_px_q12[0] = 300000 + cases[i].t * along_v + cases[i].perp * along_u;
            rig.line[7] = line;
            ih_label_lines_find(&dots, &rig, &params, &scratch, &labels);
            IH_TEST_EQUAL(cases[i].is_candidate, scratch.candidate_count[7], "candidate", i);
            if (cases[i].is_candidate) {
                const struct ih_candidate *c = &scratch.candidate[7][0];

                IH_TEST_EQUAL(cases[i].perp, c->perp_px_q12, "perp", direction);
                IH_TEST_EQUAL(cases[i].t, c->t_px_q12, "t", direction);
                /* t = length / Z */
                IH_TEST_WITHIN(0.51, ldexp(cases[i].t / 4096.0 / 10000, 36),
                               ih_label_growth_inverse_q36(c, &line), "inverse depth", i);
            }
        }
    }
}

/* --- seeds --- */

static void put_candidate(int32_t slot, int32_t dot, int32_t perp_px_q12)
{
    scratch.candidate[slot][scratch.candidate_count[slot]++] =
        (struct ih_candidate){1 << 24, (int16_t)perp_px_q12, (int16_t)dot};
}

/* The last corner is looked for along its line: wherever that leads, no seed may be lost. */
static void rotate_line(int32_t slot, double angle_rad)
{
    rig.line[slot] = (struct ih_line){.infinity_u_px_q12 = 200 * 4096,
                                      .infinity_v_px_q12 = 100 * 4096,
                                      .dir_u_q30 = (int32_t)lround(ldexp(cos(angle_rad), 30)),
                                      .dir_v_q30 = (int32_t)lround(ldexp(sin(angle_rad), 30))};
}

/* Error of a rectangle in Q12 px, as the header has it. */
static double rectangle_error(const int32_t dot[4], const int32_t perp[4])
{
    static const double sign[4] = {1, -1, -1, 1};
    double u = 0, v = 0, perp2 = 0;
    int i;

    for (i = 0; i < 4; i++) {
        u += sign[i] * rows.u_px_q12[dot[i]];
        v += sign[i] * rows.v_px_q12[dot[i]];
        perp2 += (double)perp[i] * perp[i];
    }
    return sqrt((u * u + v * v) / 4 + 9 * perp2 / 4);
}

/* Rectangles of up to three candidates a corner, off by up to 1 px, some dots candidates of two corners:
 * the best choice of different dots, tried one by one. */
static void the_best_rectangle_is_the_seed(void)
{
    static const int32_t slot[4] = {100, 101, 119, 120};
    int pass, seeds = 0, close = 0;

    for (pass = 0; pass < 3000; pass++) {
        int32_t dot[4][3], perp[4][3], best_choice[4] = {0};
        double best = 1e9, second = 2e9;
        struct ih_labels_offer offer;
        int i, k, choice;
        bool is_seed;

        for (i = 0; i < 4; i++) {
            const int count = between(pass % 50 == 0 ? 0 : 1, pass % 3 + 1);

            scratch.candidate_count[slot[i]] = 0;
            for (k = 0; k < count; k++) {
                dot[i][k] = 3 * i + k;
                if (i > 0 && between(0, 5) == 0) { /* a dot that an earlier corner has, too */
                    dot[i][k] = dot[between(0, i - 1)][0];
                }
                perp[i][k] = between(-1200, 1200);
                rows.u_px_q12[3 * i + k] = (i % 2 * 30 + 300) * 4096 + between(-4096, 4096);
                rows.v_px_q12[3 * i + k] = (i / 2 * 25 + 200) * 4096 + between(-4096, 4096);
                put_candidate(slot[i], dot[i][k], perp[i][k]);
            }
        }
        for (choice = 0; choice < 81; choice++) {
            const int32_t c[4] = {choice / 27, choice / 9 % 3, choice / 3 % 3, choice % 3};
            int32_t d[4], p[4];
            bool is_there = true;
            double error;

            for (i = 0; i < 4; i++) {
                is_there = is_there && c[i] < scratch.candidate_count[slot[i]];
                d[i] = is_there ? dot[i][c[i]] : -1 - i;
                p[i] = is_there ? perp[i][c[i]] : 0;
                for (k = 0; k < i; k++) {
                    is_there = is_there && d[i] != d[k];
                }
            }
            if (!is_there) {
                continue;
            }
            error = rectangle_error(d, p);
            if (error < best) {
                second = best;
                best = error;
                memcpy(best_choice, c, sizeof c);
            } else {
                second = fmin(second, error);
            }
        }
        rotate_line(slot[3], pass * 0.1);
        is_seed = ih_label_seeds_find(&rig, &scratch, slot, &params, &offer);
        if (best < 1e9 && (fabs(best - 4096) < 2 || fabs(second - best - 2048) < 2)) {
            close++; /* roots are cut off */
            continue;
        }
        IH_TEST_EQUAL(best < 4096 && second - best > 2048, is_seed, "seed", pass);
        if (is_seed) {
            IH_TEST_RANGE((int64_t)best - 1, (int64_t)best, offer.error_px_q12, "error", pass);
            for (i = 0; i < 4; i++) {
                IH_TEST_EQUAL(best_choice[i], offer.choice[i], "choice", pass);
            }
            seeds++;
        }
    }
    IH_TEST_RANGE(300, 3000, seeds, "seeds", close);
    IH_TEST_RANGE(0, 100, close, "close", seeds);
}

/* All errors are whole numbers of Q12 px here: the best below 1 px, the next worse by more than 0.5 px. */
static void seeds_end_at_their_limits(void)
{
    static const struct {
        int32_t best, next;
        bool is_seed;
    } cases[] = {{4095, 9000, true},  {4096, 9000, false}, {1000, 3048, false},
                 {1000, 3049, true},  {0, 2048, false},    {0, 2049, true},
                 {-4095, 9000, true}, {-4096, 9000, false}};
    static const int32_t slot[4] = {0, 1, 19, 20};
    int i, axis, corner;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        for (axis = 0; axis < 2; axis++) {
            int32_t *place = axis == 0 ? rows.u_px_q12 : rows.v_px_q12;
            struct ih_labels_offer offer;

            memset(rows.u_px_q12, 0, sizeof rows.u_px_q12);
            memset(rows.v_px_q12, 0, sizeof rows.v_px_q12);
            for (corner = 0; corner < 4; corner++) {
                scratch.candidate_count[slot[corner]] = 0;
                put_candidate(slot[corner], corner, 0);
            }
            put_candidate(slot[3], 4, 0);
            place[3] = 2 * cases[i].best; /* the error is half of it */
            place[4] = 2 * cases[i].next;
            rotate_line(slot[3], (i + axis) % 4 * 0.5 * acos(-1.0));
            IH_TEST_EQUAL(cases[i].is_seed,
                          ih_label_seeds_find(&rig, &scratch, slot, &params, &offer), "seed", i);
        }
    }
}

/* --- order --- */

static int compare_orders(const void *one, const void *two)
{
    const uint32_t *a = one, *b = two;

    return *a < *b ? -1 : *a > *b;
}

/* Errors all in one bin, in a few, beyond the last one, beyond what counts. */
static void offers_are_sorted_by_error_then_slot(void)
{
    static const int32_t error_max[] = {0, 9, 4095, 100000, INT32_MAX};
    static uint32_t sorted[IH_SLOTS];
    int32_t pass, i, count;

    for (pass = 0; pass < 400; pass++) {
        count = pass < 362 ? pass : between(300, 361);
        for (i = 0; i < count; i++) {
            const int32_t error = between(0, error_max[pass % 5]);

            scratch.order[i] = ih_label_order(error, i);
            IH_TEST_EQUAL(i, ih_label_order_slot(scratch.order[i]), "slot", pass);
            IH_TEST_EQUAL(error < 4194303 ? error : 4194303, scratch.order[i] >> 9, "error", pass);
        }
        for (i = count - 1; i > 0; i--) {
            const int32_t other = between(0, i);
            const uint32_t kept = scratch.order[i];

            scratch.order[i] = scratch.order[other];
            scratch.order[other] = kept;
        }
        memcpy(sorted, scratch.order, sizeof sorted);
        qsort(sorted, (size_t)count, sizeof sorted[0], compare_orders);
        ih_label_order_sort(scratch.order, count, scratch.sorted);
        for (i = 0; i < count; i++) {
            TEST_ASSERT_EQUAL_UINT32(sorted[i], scratch.sorted[i]);
        }
    }
}

/* --- growing --- */

static void label(int32_t row, int32_t column, int32_t inverse_depth_q36)
{
    const int32_t slot = row * IH_GRID + column;

    scratch.inverse_depth_q36[ih_label_growth_node(slot)] = inverse_depth_q36;
}

/* Some slots labelled near a plane of inverse depth, with steps. */
static void label_some(double fraction)
{
    const double middle = between(1 << 24, 1 << 26), x = between(-400000, 400000);
    const double y = between(-400000, 400000);
    int32_t slot;

    memset(scratch.inverse_depth_q36, 0, sizeof scratch.inverse_depth_q36);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        if (ih_test_unit(&random_source) < fraction) {
            const double step = between(0, 3) == 0 ? 3000000 : 0;

            label(slot / IH_GRID, slot % IH_GRID,
                  (int32_t)(middle + x * (slot % IH_GRID) + y * (slot / IH_GRID) + step));
        }
    }
}

/* Least squares by elimination, weights 1 / d^2: the value in the middle; NAN where three slots that are
 * not in a line are not there. */
static double plane_at(int32_t row, int32_t column)
{
    double m[3][4] = {{0}};
    int32_t dx, dy;
    int i, k, j;

    for (dy = -2; dy <= 2; dy++) {
        for (dx = -2; dx <= 2; dx++) {
            const int32_t r = row + dy, c = column + dx;
            const double term[3] = {1, dx, dy};

            if ((dx == 0 && dy == 0) || r < 0 || c < 0 || r >= IH_GRID || c >= IH_GRID ||
                scratch.inverse_depth_q36[ih_label_growth_node(r * IH_GRID + c)] == 0) {
                continue;
            }
            for (i = 0; i < 3; i++) {
                for (k = 0; k < 4; k++) {
                    const double value =
                        k < 3 ? term[k]
                              : scratch.inverse_depth_q36[ih_label_growth_node(r * IH_GRID + c)];

                    m[i][k] += term[i] * value / (dx * dx + dy * dy);
                }
            }
        }
    }
    for (i = 0; i < 3; i++) {
        int pivot = i;

        for (k = i + 1; k < 3; k++) {
            pivot = fabs(m[k][i]) > fabs(m[pivot][i]) ? k : pivot;
        }
        if (fabs(m[pivot][i]) < 1e-9) {
            return (double)NAN;
        }
        for (k = 0; k < 4; k++) {
            const double kept = m[i][k];

            m[i][k] = m[pivot][k];
            m[pivot][k] = kept;
        }
        for (k = 0; k < 3; k++) {
            const double part = k == i ? 0 : m[k][i] / m[i][i];

            for (j = 0; j < 4; j++) {
                m[k][j] -= part * m[i][j];
            }
        }
    }
    return m[0][3] / m[0][0];
}

/* What a slot expects: each labelled one of the 8 around it, in reading order, then the plane. */
static void neighbours_and_their_plane_are_expected(void)
{
    int pass, planes = 0, none = 0;
    int32_t slot, dx, dy;

    for (pass = 0; pass < 60; pass++) {
        label_some(pass % 6 * 0.15 + 0.05);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            const int32_t row = slot / IH_GRID, column = slot % IH_GRID;
            const double plane = plane_at(row, column);
            const int32_t own_q36 = scratch.inverse_depth_q36[ih_label_growth_node(slot)];
            struct ih_label_expectation is;
            int32_t count = 0;

            scratch.inverse_depth_q36[ih_label_growth_node(slot)] = 0; /* open, as those that ask */
            ih_label_growth_expect(&scratch, slot, &is);
            scratch.inverse_depth_q36[ih_label_growth_node(slot)] = own_q36;
            for (dy = -1; dy <= 1; dy++) {
                for (dx = -1; dx <= 1; dx++) {
                    const int32_t r = row + dy, c = column + dx;

                    if ((dx != 0 || dy != 0) && r >= 0 && c >= 0 && r < IH_GRID && c < IH_GRID &&
                        scratch.inverse_depth_q36[ih_label_growth_node(r * IH_GRID + c)] != 0) {
                        IH_TEST_EQUAL(
                            scratch.inverse_depth_q36[ih_label_growth_node(r * IH_GRID + c)],
                            is.value_q36[count], "neighbour", slot);
                        count++;
                    }
                }
            }
            IH_TEST_EQUAL(count + !isnan(plane), is.count, "count", slot);
            if (!isnan(plane)) {
                IH_TEST_WITHIN(0.51, plane, is.value_q36[count], "plane", slot);
                planes++;
            }
            none += is.count == 0;
        }
    }
    TEST_ASSERT_TRUE(planes > 1000 && none > 100);
}

/* hypot(along, 6 perp) from the expectation that suits it best; along is at most 2^16 px. */
static void errors_are_those_of_the_nearest_expectation(void)
{
    int pass, i;

    for (pass = 0; pass < 20000; pass++) {
        const int32_t length = between(1, 1 << (12 + pass % 19));
        const struct ih_line line = {.length_px_mm_q8 = length};
        /* an inverse depth of at most 2^28 */
        const struct ih_candidate candidate = {between(1, ((int64_t)length >> 4) + 1),
                                               (int16_t)between(-2458, 2458), 0};
        const int32_t own_q36 = ih_label_growth_inverse_q36(&candidate, &line);
        struct ih_label_expectation expected = {.count = between(1, 9)};
        double off = 1e12, along;

        for (i = 0; i < expected.count; i++) {
            expected.value_q36[i] =
                pass % 4 == 0
                    ? between(1 << 29, INT32_MAX) /* so far that its square must be limited */
                    : own_q36 + (int32_t)ih_test_any_size(&random_source, 27);
            off = fmin(off, fabs((double)own_q36 - expected.value_q36[i]));
        }
        along = fmin(floor(off * length / 4294967296.0 + 0.5), 1 << 28);
        IH_TEST_EQUAL(floor(hypot(along, 6.0 * candidate.perp_px_q12)),
                      ih_label_growth_error_px_q12(&candidate, &expected, &line), "error", pass);
    }
}

/* Dots that are candidates of a few slots each, along depths that change slowly, some slots labelled. */
static void put_growing_scene(void)
{
    int32_t slot, i;

    memset(&scratch, 0, sizeof scratch);
    memset(scratch.choice, 0xff, sizeof scratch.choice);
    memset(scratch.slot_of_dot, 0xff, sizeof scratch.slot_of_dot);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        rig.line[slot].length_px_mm_q8 = 10000 << 8;
        scratch.candidate_count[slot] = (int8_t)between(0, 4);
        for (i = 0; i < scratch.candidate_count[slot]; i++) {
            scratch.candidate[slot][i] = (struct ih_candidate){
                50000 + slot % IH_GRID * 100 + between(-20000, 20000) / (1 + i),
                (int16_t)between(-2458, 2458), (int16_t)((slot + between(0, 6)) % IH_SLOTS)};
        }
        if (between(0, 9) == 0 && scratch.candidate_count[slot] > 0 &&
            ih_label_is_free(&scratch, slot, 0)) {
            ih_label_assign(&scratch, slot, 0);
        }
    }
    ih_label_growth_begin(&rig, &scratch);
}

/* An offer that is kept from pass to pass is what would be found again. */
static void kept_offers_are_those_that_would_be_found(void)
{
    static struct ih_labels_scratch again;
    int32_t pass, epsilon, labelled = 0;

    for (pass = 0; pass < 100; pass++) {
        put_growing_scene();
        again = scratch;
        for (epsilon = 2000; epsilon < 40000; epsilon += between(0, 1) * 2000) {
            const int32_t grown = ih_label_growth_pass(&rig, &scratch, epsilon);

            memset(again.is_stale, true, sizeof again.is_stale);
            IH_TEST_EQUAL(ih_label_growth_pass(&rig, &again, epsilon), grown, "labelled", pass);
            TEST_ASSERT_EQUAL_MEMORY(again.choice, scratch.choice, sizeof scratch.choice);
            labelled += grown;
        }
    }
    TEST_ASSERT_TRUE(labelled > 5000);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_first_sixteen_candidates_stay);
    RUN_TEST(candidates_lie_on_their_line);
    RUN_TEST(the_best_rectangle_is_the_seed);
    RUN_TEST(seeds_end_at_their_limits);
    RUN_TEST(offers_are_sorted_by_error_then_slot);
    RUN_TEST(neighbours_and_their_plane_are_expected);
    RUN_TEST(errors_are_those_of_the_nearest_expectation);
    RUN_TEST(kept_offers_are_those_that_would_be_found);
    return UNITY_END();
}
