/* ih_exposure: single steps against float64, and closed loops with a camera made of formulas. */
#include "base/ih_config.h"
#include "dots/ih_bandpass.h"
#include "dots/ih_dots.h"
#include "labels/ih_labels.h"
#include "upkeep/ih_exposure.h"

#include <stdlib.h>

#include "ih_test.h"

struct vector_step {
    struct ih_exposure before;
    struct ih_exposure_look look;
    double exposure_us, duty_q8, ceiling_us;
    int32_t ceiling_frames;
};

#include "exposure.inc"

static struct ih_exposure_params params;
static struct ih_exposure state;
static struct ih_dots dots;
static struct ih_labels labels;

void setUp(void)
{
    ih_exposure_params_default(&params);
    memset(&dots, 0, sizeof dots);
    memset(&labels, 0, sizeof labels);
    memset(labels.dot_of_slot, 0xff, sizeof labels.dot_of_slot);
}

void tearDown(void)
{
}

static void steps_match_float64(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_steps); i++) {
        const struct vector_step *v = &vector_steps[i];

        state = v->before;
        ih_exposure_next(&params, &v->look, &state);
        /* Rounded once; the factor is rounded to 1/256 twice before, of at most 20,000 us. */
        IH_TEST_WITHIN(0.5 + v->before.exposure_us / 256.0, v->exposure_us, state.exposure_us,
                       "exposure", i);
        IH_TEST_WITHIN(1.5, v->duty_q8, state.duty_q8, "duty", i);
        IH_TEST_WITHIN(0.5 + v->before.exposure_us / 256.0, v->ceiling_us, state.ceiling_us,
                       "ceiling", i);
        IH_TEST_EQUAL(v->ceiling_frames, state.ceiling_frames, "frames", i);
    }
}

/* --- looking ------------------------------------------------------------------------------------ */

/* Dots of a lattice of 30 px, 10 R more from one to the next. */
static void label_all(void)
{
    int32_t slot;

    for (slot = 0; slot < IH_SLOTS; slot++) {
        dots.dot[slot].u_px_q12 = (40 + 30 * (slot % IH_GRID)) * 4096;
        dots.dot[slot].v_px_q12 = (20 + 30 * (slot / IH_GRID)) * 4096;
        dots.dot[slot].peak = 1000 + 10 * ((slot * 7) % IH_SLOTS);
        labels.dot_of_slot[slot] = (int16_t)slot;
    }
    dots.dot_count = labels.labelled_count = IH_SLOTS;
}

static void light_all(void)
{
    memset(dots.bright, 0xff, sizeof dots.bright);
}

static void take_out(int32_t slot)
{
    labels.dot_of_slot[slot] = IH_NONE;
    labels.labelled_count--;
}

static void a_look_sorts_the_labelled_peaks(void)
{
    struct ih_exposure_look look;

    label_all();
    ih_exposure_look(&dots, &labels, 640, 600, &look);
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS, look.labelled_count);
    TEST_ASSERT_EQUAL_INT32(1000 + 10 * (IH_SLOTS / 4), look.weak);
    TEST_ASSERT_EQUAL_INT32(1000 + 10 * (IH_SLOTS * 9 / 10), look.strong);
    TEST_ASSERT_EQUAL_INT32(0, look.lost_count);
}

static void only_missing_dots_in_bright_places_are_lost(void)
{
    struct ih_exposure_look look;

    label_all();
    light_all();
    memset(&dots.bright[40], 0, sizeof dots.bright - sizeof dots.bright[0] * 40);
    ih_exposure_look(&dots, &labels, 1280, 800, &look);
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS * 40 / 100 / 8, look.lost_count); /* of the whole frame */
    memset(dots.bright, 0, sizeof dots.bright);
    dots.bright[2][40 / 8 / 32] |= 1u << 40 / 8 % 32;
    dots.bright[290 / 8][310 / 8 / 32] |= 1u << 310 / 8 % 32;
    dots.bright[290 / 8][340 / 8 / 32] |= 1u << 340 / 8 % 32;
    dots.bright[4][56 / 8 / 32] |= 1u << 56 / 8 % 32; /* the middle of the corner's 8 neighbours */
    dots.bright[52 / 8][72 / 8 / 32] |= 1u << 72 / 8 % 32;
    ih_exposure_look(&dots, &labels, 640, 600, &look);
    TEST_ASSERT_EQUAL_INT32(0, look.lost_count);
    take_out(0);
    take_out(9 * IH_GRID + 9);
    take_out(9 * IH_GRID + 10);
    ih_exposure_look(&dots, &labels, 640, 600, &look);
    TEST_ASSERT_EQUAL_INT32(3, look.lost_count);
    memset(dots.bright, 0, sizeof dots.bright);
    ih_exposure_look(&dots, &labels, 640, 600, &look);
    TEST_ASSERT_EQUAL_INT32(0, look.lost_count);
}

/* At each corner and edge of the pattern, so many of the neighbours within two rows and columns being
 * labelled: three say where the dot would be, in the middle between them, two do not. */
static void dots_at_the_edges_of_the_pattern_can_be_lost(void)
{
    static const int32_t slots[] = {0,
                                    IH_GRID / 2,
                                    IH_GRID - 1,
                                    9 * IH_GRID,
                                    10 * IH_GRID - 1,
                                    IH_SLOTS - IH_GRID,
                                    IH_SLOTS - IH_GRID / 2,
                                    IH_SLOTS - 1};
    static const int32_t kept[] = {2, 3, 7, 24};
    struct ih_exposure_look look;
    int i;

    for (i = 0; i < IH_TEST_COUNT(slots) * IH_TEST_COUNT(kept); i++) {
        const int32_t slot = slots[i / IH_TEST_COUNT(kept)];
        const int32_t max = kept[i % IH_TEST_COUNT(kept)];
        int32_t other, count = 0, u, v;
        double sum_u = 0, sum_v = 0;

        label_all();
        take_out(slot);
        for (other = 0; other < IH_SLOTS; other++) {
            if (other == slot || abs(other % IH_GRID - slot % IH_GRID) > 2 ||
                abs(other / IH_GRID - slot / IH_GRID) > 2) {
                continue;
            }
            if (count == max) {
                take_out(other);
                continue;
            }
            sum_u += dots.dot[other].u_px_q12 / 4096.0;
            sum_v += dots.dot[other].v_px_q12 / 4096.0;
            count++;
        }
        u = (int32_t)(sum_u / count);
        v = (int32_t)(sum_v / count);
        memset(dots.bright, 0, sizeof dots.bright);
        dots.bright[v / 8][u / 8 / 32] |= 1u << (u / 8 % 32);
        ih_exposure_look(&dots, &labels, 640, 600, &look);
        if (max == 2) {
            IH_TEST_EQUAL(0, look.lost_count, "of two", slot);
        } else {
            IH_TEST_RANGE(1, 2, look.lost_count, "lost",
                          slot); /* its neighbour's middle may be the same */
        }
    }
}

static void without_labels_the_frame_itself_is_looked_at(void)
{
    struct ih_exposure_look look;

    ih_exposure_look(&dots, &labels, 640, 600, &look);
    TEST_ASSERT_EQUAL_INT32(0, look.lost_count + look.weak + look.strong + look.labelled_count);
    light_all();
    ih_exposure_look(&dots, &labels, 640, 600, &look);
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS / 8, look.lost_count);
}

/* Aims of 8 and 80 grey levels: the gaps begin at 7 and 70 below, at 9 and 90 above. */
static void steps_begin_beyond_the_gaps(void)
{
    static const struct {
        int32_t weak, strong, step; /* less its limit by one, at it, ...; which way */
    } cases[] = {
        {7 * IH_BANDPASS_UNIT - 1, 70 * IH_BANDPASS_UNIT - 1, 1},
        {7 * IH_BANDPASS_UNIT, 70 * IH_BANDPASS_UNIT - 1, 0},
        {7 * IH_BANDPASS_UNIT - 1, 70 * IH_BANDPASS_UNIT, 0},
        {9 * IH_BANDPASS_UNIT, 90 * IH_BANDPASS_UNIT + 1, 0},
        {9 * IH_BANDPASS_UNIT + 1, 90 * IH_BANDPASS_UNIT, 0},
        {9 * IH_BANDPASS_UNIT + 1, 90 * IH_BANDPASS_UNIT + 1, -1},
    };
    int i;

    params.weak_grey_q4 = 8 * 16;
    params.strong_grey_q4 = 80 * 16;
    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        const struct ih_exposure_look look = {
            .labelled_count = IH_SLOTS, .weak = cases[i].weak, .strong = cases[i].strong};

        ih_exposure_start(&params, 2000, 128, &state);
        ih_exposure_next(&params, &look, &state);
        IH_TEST_EQUAL(cases[i].step, (state.duty_q8 > 128) - (state.duty_q8 < 128), "duty", i);
        IH_TEST_EQUAL(2000, state.exposure_us, "exposure", i);
    }
}

/* An eighth more of a duty of 3 is rounded to nothing: it is one more all the same, not two, and
 * never more than there may be. */
static void a_small_duty_grows_by_one(void)
{
    const int32_t weak_aim = params.weak_grey_q4 * IH_BANDPASS_UNIT / 16;
    const struct ih_exposure_look look = {
        .labelled_count = IH_SLOTS, .weak = weak_aim * 8 / 10, .strong = 1};

    params.duty_min_q8 = 1;
    params.duty_max_q8 = 5;
    ih_exposure_start(&params, 2000, 3, &state);
    ih_exposure_next(&params, &look, &state);
    TEST_ASSERT_EQUAL_INT32(4, state.duty_q8);
    ih_exposure_next(&params, &look, &state);
    TEST_ASSERT_EQUAL_INT32(5, state.duty_q8);
    ih_exposure_next(&params, &look, &state);
    TEST_ASSERT_EQUAL_INT32(5, state.duty_q8);
    TEST_ASSERT_GREATER_THAN_INT32(2000, state.exposure_us);
}

/* Once the duty is at its limit: 1 us times 1.25 would be 1 us again. */
static void a_small_exposure_grows_by_one(void)
{
    const int32_t weak_aim = params.weak_grey_q4 * IH_BANDPASS_UNIT / 16;
    const struct ih_exposure_look look = {
        .labelled_count = IH_SLOTS, .weak = weak_aim * 8 / 10, .strong = 1};
    int32_t us;

    params.exposure_min_us = 1;
    params.exposure_max_us = 4;
    ih_exposure_start(&params, 1, params.duty_max_q8, &state);
    for (us = 2; us <= 5; us++) {
        ih_exposure_next(&params, &look, &state);
        TEST_ASSERT_EQUAL_INT32(us < 4 ? us : 4, state.exposure_us);
    }
}

/* Fewer than 24 labels say nothing about how high dots are. */
static void twenty_four_labels_say_something(void)
{
    const int32_t weak_aim = params.weak_grey_q4 * IH_BANDPASS_UNIT / 16;
    struct ih_exposure_look look;
    int32_t count, slot;

    for (count = 23; count <= 24; count++) {
        label_all();
        for (slot = count; slot < IH_SLOTS; slot++) {
            take_out(slot);
        }
        ih_exposure_look(&dots, &labels, 640, 600, &look);
        IH_TEST_EQUAL(count < 24, look.weak == 0 && look.strong == 0, "looked at", count);
        /* Dots as high as they should be: nothing to do, unless too few say so. */
        look = (struct ih_exposure_look){.labelled_count = count,
                                         .weak = weak_aim,
                                         .strong = params.strong_grey_q4 * IH_BANDPASS_UNIT / 16};
        ih_exposure_start(&params, 2000, 128, &state);
        ih_exposure_next(&params, &look, &state);
        IH_TEST_EQUAL(count < 24 ? 160 : 128, state.duty_q8, "duty", count); /* 1.25 times */
        /* Weak dots, many lost, all the duty: shorter only if there is nothing to lose. */
        look.weak = weak_aim / 2 - 1;
        look.lost_count = params.lost_max + 1;
        ih_exposure_start(&params, 2000, 256, &state);
        ih_exposure_next(&params, &look, &state);
        IH_TEST_EQUAL(count < 24, state.exposure_us < 2000, "exposure", count);
    }
}

/* With all the duty a shorter exposure is for dots that have half of what they should have, and for
 * more lost ones than are accepted. */
static void over_exposure_is_left_by_its_limits(void)
{
    static const struct {
        int32_t weak_below, lost_more, duty_q8;
        bool is_shorter;
    } cases[] = {{0, 1, 256, true},
                 {1, 1, 256, false},
                 {0, 0, 256, false},
                 {1, 1, 255, true},
                 {1, 0, 255, false}};
    int i;

    params.weak_grey_q4 = 16 * 2; /* 2 levels: an even number */
    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        const struct ih_exposure_look look = {.labelled_count = IH_SLOTS,
                                              .weak = IH_BANDPASS_UNIT - cases[i].weak_below,
                                              .strong =
                                                  params.strong_grey_q4 * IH_BANDPASS_UNIT / 16,
                                              .lost_count = params.lost_max + cases[i].lost_more};

        ih_exposure_start(&params, 2000, cases[i].duty_q8, &state);
        ih_exposure_next(&params, &look, &state);
        IH_TEST_EQUAL(cases[i].is_shorter ? lround(2000 * 205 / 256.0) : 2000, state.exposure_us,
                      "exposure", i);
        IH_TEST_EQUAL(cases[i].is_shorter ? IH_EXPOSURE_RETRY : 0, state.ceiling_frames, "ceiling",
                      i);
    }
}

/* While it is raised for weak dots, the exposure grows only where at most half of the accepted are lost. */
static void exposure_grows_while_hardly_any_is_lost(void)
{
    int32_t lost;

    for (lost = 3; lost <= 4; lost++) {
        const struct ih_exposure_look look = {
            .labelled_count = IH_SLOTS, .weak = 81, .strong = 81, .lost_count = lost};

        params.lost_max = 6;
        ih_exposure_start(&params, 2000, 256, &state);
        ih_exposure_next(&params, &look, &state);
        IH_TEST_EQUAL(lost == 3 ? 2500 : 2000, state.exposure_us, "exposure", lost);
    }
}

/* A ceiling holds for so many frames, and no longer. */
static void a_ceiling_is_forgotten_in_time(void)
{
    const struct ih_exposure_look look = {.labelled_count = IH_SLOTS, .weak = 81, .strong = 81};
    int32_t left;

    for (left = 1; left <= 2; left++) {
        state = (struct ih_exposure){2000, 256, 2100, left};
        ih_exposure_next(&params, &look, &state);
        IH_TEST_EQUAL(left - 1, state.ceiling_frames, "frames", left);
        IH_TEST_EQUAL(left == 1 ? 2500 : 2100, state.exposure_us, "exposure", left);
    }
}

/* Blocks of the last, incomplete columns and rows count too: one of four here. */
static void parts_of_blocks_are_blocks(void)
{
    struct ih_exposure_look look;

    dots.bright[0][0] = 1;
    ih_exposure_look(&dots, &labels, 9, 9, &look);
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS / 4 / 8, look.lost_count);
    ih_exposure_look(&dots, &labels, 8, 8, &look);
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS / 8, look.lost_count);
}

/* The middle of three neighbours lies a unit left of, or above, a block's border: in the block before. */
static void a_lost_place_belongs_to_its_block(void)
{
    static const int32_t at[] = {1, IH_GRID, IH_GRID + 1};
    struct ih_exposure_look look;
    int axis, block, i;

    for (axis = 0; axis < 2; axis++) {
        for (block = 5; block <= 6; block++) {
            memset(dots.bright, 0, sizeof dots.bright);
            label_all();
            for (i = 0; i < IH_SLOTS; i++) {
                labels.dot_of_slot[i] = IH_NONE;
            }
            for (i = 0; i < 3; i++) {
                labels.dot_of_slot[at[i]] = (int16_t)at[i];
                dots.dot[at[i]].u_px_q12 = axis == 0 ? 48 * 4096 - (i == 2) : 20 * 4096;
                dots.dot[at[i]].v_px_q12 = axis == 1 ? 48 * 4096 - (i == 2) : 20 * 4096;
            }
            dots.bright[axis == 0 ? 2 : block][0] = 1u << (axis == 0 ? block : 2);
            ih_exposure_look(&dots, &labels, 640, 600, &look);
            IH_TEST_EQUAL(block == 5, look.lost_count > 0, "lost", 10 * axis + block);
        }
    }
}

/* --- closed loop --------------------------------------------------------------------------------- */

/* What a camera sees: a dot is as high as its surface, exposure and duty say, up to full scale less
 * the ambient light on it; from full scale on it is lost, below the noise it is not seen. */
struct scene {
    double dot[IH_SLOTS];     /* grey levels of R at 1000 us and full duty */
    double ambient[IH_SLOTS]; /* grey levels at 1000 us */
    double jitter;            /* of each frame's light */
};

static struct ih_test_random random_source = {11};
static struct scene scene;

static void make_scene(double dot, double dot_spread, double ambient, double ambient_spread)
{
    int i;

    for (i = 0; i < IH_SLOTS; i++) {
        scene.dot[i] = dot * exp(dot_spread * ih_test_normal(&random_source));
        scene.ambient[i] = ambient * exp(ambient_spread * ih_test_normal(&random_source));
    }
    scene.jitter = 0.0;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

static void see(struct ih_exposure_look *look)
{
    const double light =
        state.exposure_us / 1000.0 * (1.0 + scene.jitter * ih_test_normal(&random_source));
    double seen[IH_SLOTS];
    int32_t i, count = 0, lost = 0, bright = 0;

    for (i = 0; i < IH_SLOTS; i++) {
        const double ambient = scene.ambient[i] * light;
        const double left = 0.42 * (255.0 - ambient); /* R of a dot of full scale */
        double r = scene.dot[i] * light * state.duty_q8 / 256.0;

        r = r < left ? r : left;
        bright += ambient > 200.0;
        if (r > 2.0 + 0.01 * ambient) {
            seen[count++] = r;
        } else {
            lost += ambient > 200.0;
        }
    }
    qsort(seen, (size_t)count, sizeof seen[0], compare_doubles);
    memset(look, 0, sizeof *look);
    look->labelled_count = count;
    look->lost_count = count < IH_EXPOSURE_LABELLED_MIN || bright / 8 > lost ? bright / 8 : lost;
    if (count >= IH_EXPOSURE_LABELLED_MIN) {
        look->weak = (int32_t)(81.0 * seen[count / 4]);
        look->strong = (int32_t)(81.0 * seen[count * 9 / 10]);
    }
}

static void check_limits(void)
{
    TEST_ASSERT_TRUE(state.exposure_us >= params.exposure_min_us &&
                     state.exposure_us <= params.exposure_max_us);
    TEST_ASSERT_TRUE(state.duty_q8 >= params.duty_min_q8 && state.duty_q8 <= params.duty_max_q8);
}

/* Changes of the settings over so many frames; what is seen in the last one. */
static int32_t run(int32_t frames, struct ih_exposure_look *look)
{
    int32_t i, changes = 0;

    for (i = 0; i < frames; i++) {
        const struct ih_exposure before = state;

        see(look);
        ih_exposure_next(&params, look, &state);
        check_limits();
        changes += before.exposure_us != state.exposure_us || before.duty_q8 != state.duty_q8;
    }
    see(look);
    return changes;
}

/* The most labels that any settings give. */
static int32_t best_labels(void)
{
    const struct ih_exposure keep = state;
    struct ih_exposure_look look;
    int32_t best = 0;

    for (state.exposure_us = 100; state.exposure_us <= 20000;
         state.exposure_us += state.exposure_us / 4) {
        for (state.duty_q8 = 16; state.duty_q8 <= 256; state.duty_q8 *= 2) {
            see(&look);
            best = look.labelled_count > best ? look.labelled_count : best;
        }
    }
    state = keep;
    return best;
}

/* Scenes from dark to sunlit, near and far, from all corners of the settings: comes to rest within
 * 80 frames and sees nearly what can be seen with any settings. */
static void all_scenes_come_to_rest_near_the_best(void)
{
    static const int32_t starts[][2] = {
        {100, 16}, {100, 256}, {20000, 16}, {20000, 256}, {2000, 128}};
    static const double ambients[] = {0.5, 5.0, 40.0, 150.0};
    static const double heights[] = {2.0, 10.0, 60.0, 400.0};
    struct ih_exposure_look look;
    int a, h, s, percent, index = 0;

    for (a = 0; a < IH_TEST_COUNT(ambients); a++) {
        for (h = 0; h < IH_TEST_COUNT(heights); h++) {
            make_scene(heights[h], 0.5, ambients[a], 0.4);
            for (s = 0; s < IH_TEST_COUNT(starts); s++, index++) {
                ih_exposure_start(&params, starts[s][0], starts[s][1], &state);
                (void)run(80, &look);
                IH_TEST_EQUAL(0, run(100, &look), "changes at rest", index);
                /* Where dots are much weaker than the sun some are lost either way. */
                percent = heights[h] < 0.02 * ambients[a]  ? 0
                          : heights[h] < 0.1 * ambients[a] ? 70
                                                           : 95;
                IH_TEST_RANGE(best_labels() * percent / 100, IH_SLOTS, look.labelled_count,
                              "labels", index);
            }
        }
    }
}

/* Over a thousand frames what over-exposes is tried again only now and then. */
static void retries_are_rare(void)
{
    struct ih_exposure_look look;

    make_scene(4.0, 0.3, 60.0, 0.05); /* weak dots, a uniform bright wall */
    ih_exposure_start(&params, 2000, 256, &state);
    (void)run(80, &look);
    IH_TEST_RANGE(0, 2 * 1024 / IH_EXPOSURE_RETRY * 4, run(1024, &look), "changes", 0);
}

/* Light that flickers by some per cent is not run after. */
static void jitter_is_not_amplified(void)
{
    struct ih_exposure_look look;
    int32_t i, min = INT32_MAX, max = 0;

    make_scene(30.0, 0.5, 10.0, 0.3);
    scene.jitter = 0.03;
    ih_exposure_start(&params, 500, 64, &state);
    (void)run(80, &look);
    for (i = 0; i < 200; i++) {
        int32_t light;

        (void)run(1, &look);
        light = state.exposure_us * state.duty_q8;
        min = light < min ? light : min;
        max = light > max ? light : max;
    }
    IH_TEST_RANGE(max * 3 / 4, max, min, "least light", max);
}

/* Somebody steps in from 3 m to 0.6 m and out again; the sun comes out. */
static void changes_are_followed(void)
{
    struct ih_exposure_look look;

    make_scene(6.0, 0.4, 4.0, 0.3);
    ih_exposure_start(&params, 1000, 128, &state);
    (void)run(60, &look);
    TEST_ASSERT_GREATER_THAN_INT32(340, look.labelled_count);
    make_scene(150.0, 0.4, 4.0, 0.3);
    (void)run(30, &look);
    TEST_ASSERT_LESS_THAN_INT32(110 * 81, look.strong);
    TEST_ASSERT_GREATER_THAN_INT32(340, look.labelled_count);
    make_scene(40.0, 0.4, 250.0, 0.3);
    (void)run(30, &look);
    TEST_ASSERT_GREATER_THAN_INT32(330, look.labelled_count);
    TEST_ASSERT_LESS_THAN_INT32(20, look.lost_count);
}

/* Nobody and nothing: up to the limits and no further; blinding light: down. */
static void empty_frames_go_to_the_limits(void)
{
    struct ih_exposure_look look;

    make_scene(0.0, 0.0, 0.0, 0.0);
    ih_exposure_start(&params, 100, 16, &state);
    (void)run(100, &look);
    TEST_ASSERT_EQUAL_INT32(params.exposure_max_us, state.exposure_us);
    TEST_ASSERT_EQUAL_INT32(params.duty_max_q8, state.duty_q8);
    make_scene(0.0, 0.0, 1e6, 0.0);
    (void)run(100, &look);
    TEST_ASSERT_EQUAL_INT32(params.exposure_min_us, state.exposure_us);
}

static void extreme_numbers_are_survived(void)
{
    static const int32_t sizes[] = {0, 1, 24, 361, 18648, INT16_MAX};
    struct ih_exposure_look look;
    int i, k;

    params.exposure_max_us = 1000000;
    for (i = 0; i < 4; i++) {
        for (k = 0; k < 6 * 6 * 6 * 4; k++) {
            look = (struct ih_exposure_look){sizes[k % 4], sizes[k / 4 % 6], sizes[k / 24 % 6],
                                             sizes[k / 144 % 6]};
            ih_exposure_start(&params, i % 2 == 0 ? INT32_MAX : 0, i < 2 ? INT32_MAX : INT32_MIN,
                              &state);
            check_limits();
            ih_exposure_next(&params, &look, &state);
            check_limits();
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(steps_match_float64);
    RUN_TEST(a_look_sorts_the_labelled_peaks);
    RUN_TEST(only_missing_dots_in_bright_places_are_lost);
    RUN_TEST(dots_at_the_edges_of_the_pattern_can_be_lost);
    RUN_TEST(without_labels_the_frame_itself_is_looked_at);
    RUN_TEST(steps_begin_beyond_the_gaps);
    RUN_TEST(a_small_duty_grows_by_one);
    RUN_TEST(a_small_exposure_grows_by_one);
    RUN_TEST(twenty_four_labels_say_something);
    RUN_TEST(over_exposure_is_left_by_its_limits);
    RUN_TEST(exposure_grows_while_hardly_any_is_lost);
    RUN_TEST(a_ceiling_is_forgotten_in_time);
    RUN_TEST(parts_of_blocks_are_blocks);
    RUN_TEST(a_lost_place_belongs_to_its_block);
    RUN_TEST(all_scenes_come_to_rest_near_the_best);
    RUN_TEST(retries_are_rare);
    RUN_TEST(jitter_is_not_amplified);
    RUN_TEST(changes_are_followed);
    RUN_TEST(empty_frames_go_to_the_limits);
    RUN_TEST(extreme_numbers_are_survived);
    return UNITY_END();
}
