/* ih_surroundings against a float64 reference, with maps and moves of the test's own: the learnt ones may change. And cells,
 * ranges and weights at their limits. */
#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_rays.h"
#include "detect/ih_surroundings.h"

#include "ih_test.h"

struct vector_ray {
    int32_t slope_x_q20, slope_y_q20, depth_mm_q8, state, place;
};

struct vector_scene {
    const char *name;
    const struct vector_ray *ray;
    int32_t centre_mm_q8[3];
    double weight, answer[IH_SURROUNDINGS_MAPS], move_mm[3]; /* aside, down, away */
    double promise;
};

#include "surroundings.inc"

_Static_assert(sizeof vector_maps ==
                   sizeof(uint32_t[IH_SURROUNDINGS_PLACES][IH_SURROUNDINGS_WORDS]),
               "other maps");

/* A ray every 64 mm at 1024 mm: slopes of 1/16, and each ray stands for one cell. */
#define PITCH_Q20 (1 << 16)
#define DEPTH_MM 1024
#define SEMI_MM_Q8 (80 << 8)

static struct ih_rays rays;
static struct ih_ellipsoid head;
static struct ih_surroundings found;
static uint32_t maps[IH_SURROUNDINGS_PLACES][IH_SURROUNDINGS_WORDS];
static int32_t answer_q8[IH_SURROUNDINGS_MAPS];
static struct ih_surroundings_moves moves;

/* More than any of the scenes moves. */
#define FAR_MM 20000

void setUp(void)
{
    int slot;

    memset(&rays, 0, sizeof rays);
    memset(maps, 0x88, sizeof maps);
    memset(answer_q8, IH_TEST_FILL, sizeof answer_q8);
    memset(&moves, 0, sizeof moves);
    moves.step_mm_q12[0] = 1 << 10;
    moves.step_mm_q12[1] = 1 << 11;
    moves.step_mm_q12[2] = 1 << 12;
    memset(&found, IH_TEST_FILL, sizeof found);
    head = (struct ih_ellipsoid){.centre_mm_q8 = {0, 0, DEPTH_MM << 8},
                                 .semi_mm_q8 = {SEMI_MM_Q8, SEMI_MM_Q8, SEMI_MM_Q8}};
    for (slot = 0; slot < IH_SLOTS; slot++) {
        rays.ray[slot] = (struct ih_ray){.slope_x_q20 = (slot % IH_GRID - 9) * PITCH_Q20,
                                         .slope_y_q20 = (slot / IH_GRID - 9) * PITCH_Q20,
                                         .state = IH_RAY_UNKNOWN};
    }
    ih_rays_fill_table(&rays);
}

void tearDown(void)
{
}

static void use_scene(const struct vector_scene *scene)
{
    int slot;

    memcpy(rays.origin_mm_q8, vector_origin_mm_q8, sizeof rays.origin_mm_q8);
    memcpy(head.centre_mm_q8, scene->centre_mm_q8, sizeof head.centre_mm_q8);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        const struct vector_ray *ray = &scene->ray[slot];

        rays.ray[slot] = (struct ih_ray){.slope_x_q20 = ray->slope_x_q20,
                                         .slope_y_q20 = ray->slope_y_q20,
                                         .point_mm_q8 = {0, 0, ray->depth_mm_q8},
                                         .state = ray->state};
    }
    ih_rays_fill_table(&rays);
}

/* The weight is a square of a spacing in steps of 1/256 mm, known to 2: an isqrt's and its own. */
static void scenes_match_float64(void)
{
    struct ih_ellipsoid moved;
    int i, slot, map, axis;

    for (i = 0; i < IH_TEST_COUNT(vector_scenes); i++) {
        const struct vector_scene *scene = &vector_scenes[i];
        const double error = 4.0 * sqrt(scene->weight) / (64 * 256) + 1.0 / 4096;

        use_scene(scene);
        ih_surroundings_find(&rays, &head, &found);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            IH_TEST_EQUAL(scene->ray[slot].place, found.place[slot], scene->name, slot);
        }
        IH_TEST_WITHIN(error, scene->weight, ih_test_from_q(found.weight_q12, 12), scene->name, i);
        /* Besides, half a step. */
        IH_TEST_WITHIN(
            fabs(scene->promise - vector_promise.bias_q5 / 32.0) * error / scene->weight + 1.0 / 64,
            scene->promise,
            ih_surroundings_promise_by_q5(&vector_promise, &rays, head.centre_mm_q8) / 32.0,
            scene->name, 300);
        ih_surroundings_ask_maps(vector_maps, &found, answer_q8);
        for (map = 0; map < IH_SURROUNDINGS_MAPS; map++) {
            IH_TEST_WITHIN(fabs(scene->answer[map]) * error / scene->weight + 1.0 / 256,
                           scene->answer[map], ih_test_from_q(answer_q8[map], 8), scene->name,
                           100 + map);
        }
        moved = head;
        ih_surroundings_move_by(&vector_moves, &rays, FAR_MM, &moved);
        for (axis = 0; axis < 3; axis++) {
            const double move_mm =
                ih_test_from_q(moved.centre_mm_q8[axis] - head.centre_mm_q8[axis], 8);

            IH_TEST_WITHIN(fabs(scene->move_mm[axis]) * (error / scene->weight + 1e-5) + 1.0 / 256,
                           scene->move_mm[axis], move_mm, scene->name, 200 + axis);
        }
    }
}

/* One ray, so many 1/256 mm from the centre at its depth, and its point so far behind the centre. */
static int32_t place_of(int32_t x_mm_q8, int32_t y_mm_q8, int32_t state, int32_t dz_mm_q8)
{
    rays.ray[0] = (struct ih_ray){.slope_x_q20 = 4 * x_mm_q8, /* 2^20 / (1024 * 256) */
                                  .slope_y_q20 = 4 * y_mm_q8,
                                  .point_mm_q8 = {0, 0, head.centre_mm_q8[2] + dz_mm_q8},
                                  .state = state};
    ih_surroundings_find(&rays, &head, &found);
    return found.place[0];
}

static int32_t place_at(int32_t row, int32_t column, int32_t depth)
{
    return (row * IH_SURROUNDINGS_COLUMNS + column) * IH_SURROUNDINGS_DEPTHS + depth;
}

static void cells_begin_and_end_at_their_limits(void)
{
    enum { MM = 256 };
    static const struct {
        int32_t x_mm_q8, y_mm_q8, row, column;
    } cases[] = {
        {0, 0, 5, 0},         {64 * MM - 1, 0, 5, 0},  {64 * MM, 0, 5, 1},  {-64 * MM + 1, 0, 5, 0},
        {-64 * MM, 0, 5, 1},  {128 * MM - 1, 0, 5, 1}, {128 * MM, 0, 5, 2}, {384 * MM - 1, 0, 5, 2},
        {384 * MM, 0, -1, 0}, {-384 * MM, 0, -1, 0}};
    /* Where rows end, in mm below the centre. */
    static const int32_t end_mm[IH_SURROUNDINGS_ROWS] = {-256, -192, -128, -64, 0,
                                                         64,   128,  192,  320, 448};
    int i;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        const int32_t expected =
            cases[i].row < 0 ? IH_NONE : place_at(cases[i].row, cases[i].column, 3);

        IH_TEST_EQUAL(expected, place_of(cases[i].x_mm_q8, cases[i].y_mm_q8, IH_RAY_SEEN, 0),
                      "place", i);
    }
    IH_TEST_EQUAL(IH_NONE, place_of(0, -384 * MM - 1, IH_RAY_SEEN, 0), "above", 0);
    IH_TEST_EQUAL(place_at(0, 0, 3), place_of(0, -384 * MM, IH_RAY_SEEN, 0), "highest", 0);
    for (i = 0; i < IH_SURROUNDINGS_ROWS; i++) {
        IH_TEST_EQUAL(place_at(i, 0, 3), place_of(0, end_mm[i] * MM - 1, IH_RAY_SEEN, 0), "row", i);
        IH_TEST_EQUAL(i + 1 < IH_SURROUNDINGS_ROWS ? place_at(i + 1, 0, 3) : IH_NONE,
                      place_of(0, end_mm[i] * MM, IH_RAY_SEEN, 0), "behind row", i);
    }
}

/* Rounded to whole mm, halves upwards. */
static void ranges_begin_at_their_limits(void)
{
    static const int32_t limit_mm[] = {-176, -96, -40, 40, 128, 200};
    int i;

    for (i = 0; i < IH_TEST_COUNT(limit_mm); i++) {
        const int32_t limit_q8 = limit_mm[i] * 256 - 128;

        IH_TEST_EQUAL(place_at(5, 0, i), place_of(0, 0, IH_RAY_SEEN, limit_q8 - 1), "before", i);
        IH_TEST_EQUAL(place_at(5, 0, i + 1), place_of(0, 0, IH_RAY_SEEN, limit_q8), "at", i);
    }
    IH_TEST_EQUAL(place_at(5, 0, 0), place_of(0, 0, IH_RAY_SEEN, -head.centre_mm_q8[2]), "near", 0);
    IH_TEST_EQUAL(place_at(5, 0, 6), place_of(0, 0, IH_RAY_SEEN, 1 << 25), "far", 0);
    IH_TEST_EQUAL(place_at(5, 0, 7), place_of(0, 0, IH_RAY_EMPTY, 0), "empty", 0);
    IH_TEST_EQUAL(IH_NONE, place_of(0, 0, IH_RAY_UNKNOWN, 0), "unknown", 0);
}

/* So dense a pattern, so far, of a weight: the square of the spacing in cells, at most 1. */
static void dense_rays_have_small_weights(void)
{
    static const struct {
        int32_t pitch_q20, depth_mm, weight_q12;
    } cases[] = {{PITCH_Q20, 1024, 4096},   {PITCH_Q20 / 2, 1024, 1024}, {PITCH_Q20 / 4, 1024, 256},
                 {PITCH_Q20 / 2, 512, 256}, {PITCH_Q20, 2048, 4096},     {PITCH_Q20, 512, 1024},
                 {PITCH_Q20, -100, 0}};
    int i, slot;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        for (slot = 0; slot < IH_SLOTS; slot++) {
            rays.ray[slot].slope_x_q20 = (slot % IH_GRID - 9) * cases[i].pitch_q20;
            rays.ray[slot].slope_y_q20 = (slot / IH_GRID - 9) * cases[i].pitch_q20;
        }
        ih_rays_fill_table(&rays);
        head.centre_mm_q8[2] = cases[i].depth_mm * 256;
        ih_surroundings_find(&rays, &head, &found);
        IH_TEST_EQUAL(cases[i].weight_q12, found.weight_q12, "weight", i);
    }
}

/* Three rays of four ask the same place, and by each map get its number there. */
static void rays_of_known_state_add_up(void)
{
    int i, map;

    for (map = 0; map < IH_SURROUNDINGS_MAPS; map++) {
        maps[place_at(5, 0, 3)][map / 8] += (uint32_t)(map % 15 - 7) << 4 * (map % 8);
    }
    for (i = 0; i < 4; i++) {
        struct ih_ray *ray = &rays.ray[180 + i];

        *ray = (struct ih_ray){.point_mm_q8 = {0, 0, head.centre_mm_q8[2]},
                               .state = i == 2 ? IH_RAY_UNKNOWN : IH_RAY_SEEN};
    }
    ih_surroundings_find(&rays, &head, &found);
    ih_surroundings_ask_maps(maps, &found, answer_q8);
    for (map = 0; map < IH_SURROUNDINGS_MAPS; map++) {
        IH_TEST_EQUAL(3 * (map % 15 - 7) * 256, answer_q8[map], "answer", map);
    }
}

/* All rays ask one place, where of each two maps that are summed together one says the most and the other the smallest. */
static void sums_of_two_maps_stay_apart(void)
{
    static const uint32_t words[] = {0x0000ffff, 0xffff0000, 0x0f0f0f0f, 0xf0f0f0f0};
    int i, map, slot;

    head.centre_mm_q8[2] =
        400 << 8; /* 25 mm apart: all within 225 mm aside, and so within five cells */
    for (slot = 0; slot < IH_SLOTS; slot++) {
        rays.ray[slot].state = IH_RAY_EMPTY;
    }
    for (i = 0; i < IH_TEST_COUNT(words); i++) {
        for (slot = 0; slot < IH_SURROUNDINGS_PLACES * IH_SURROUNDINGS_WORDS; slot++) {
            maps[slot / IH_SURROUNDINGS_WORDS][slot % IH_SURROUNDINGS_WORDS] =
                words[(i + slot % IH_SURROUNDINGS_WORDS) % IH_TEST_COUNT(words)];
        }
        ih_surroundings_find(&rays, &head, &found);
        ih_surroundings_ask_maps(maps, &found, answer_q8);
        for (map = 0; map < IH_SURROUNDINGS_MAPS; map++) {
            const int32_t each =
                (words[(i + map / 8) % IH_TEST_COUNT(words)] >> 4 * (map % 8) & 15) == 15 ? 7 : -8;

            /* (25 / 64)^2 of a cell each, in Q12 625. */
            IH_TEST_EQUAL((int32_t)floor(ldexp(IH_SLOTS * each * 625, -4) + 0.5), answer_q8[map],
                          "answer", map);
        }
    }
}

/* Three rays, of which one is of unknown state: aside to their own side, all else the same left and right, and from the third
 * column outwards. */
static void moves_add_up_by_columns(void)
{
    static const struct {
        int32_t x_mm, column;
    } cases[] = {{10, 0}, {-10, 0}, {70, 1}, {-70, 1}, {130, 2}, {200, 2}, {-370, 2}};
    int i, k;

    for (k = 0; k < IH_SURROUNDINGS_COLUMNS; k++) {
        int8_t *steps = moves.steps[place_at(5, k, 3)];

        steps[0] = (int8_t)(100 - k);
        steps[1] = (int8_t)(2 + k);
        steps[2] = (int8_t)(-3 - k);
    }
    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        struct ih_ellipsoid moved = head;

        for (k = 0; k < 3; k++) {
            rays.ray[k] = (struct ih_ray){.slope_x_q20 = 4 * 256 * cases[i].x_mm,
                                          .point_mm_q8 = {0, 0, head.centre_mm_q8[2]},
                                          .state = k == 1 ? IH_RAY_UNKNOWN : IH_RAY_SEEN};
        }
        ih_surroundings_find(&rays, &head, &found);
        ih_surroundings_move_by(&moves, &rays, FAR_MM, &moved);
        IH_TEST_EQUAL(head.centre_mm_q8[0] +
                          (cases[i].x_mm < 0 ? -2 : 2) * (100 - cases[i].column) * (256 / 4),
                      moved.centre_mm_q8[0], "aside", i);
        IH_TEST_EQUAL(head.centre_mm_q8[1] + 2 * (2 + cases[i].column) * (256 / 2),
                      moved.centre_mm_q8[1], "down", i);
        IH_TEST_EQUAL(head.centre_mm_q8[2] - 2 * (3 + cases[i].column) * 256, moved.centre_mm_q8[2],
                      "away", i);
        moved = head;
        ih_surroundings_move_by(&moves, &rays, 1, &moved);
        IH_TEST_EQUAL(head.centre_mm_q8[0] + (cases[i].x_mm < 0 ? -256 : 256),
                      moved.centre_mm_q8[0], "at most aside", i);
        IH_TEST_EQUAL(head.centre_mm_q8[1] + 256, moved.centre_mm_q8[1], "at most down", i);
        IH_TEST_EQUAL(head.centre_mm_q8[2] - 256, moved.centre_mm_q8[2], "at most towards", i);
        moved = head;
        ih_surroundings_move_by(&moves, &rays, 0, &moved);
        TEST_ASSERT_EQUAL_MEMORY(&head, &moved, sizeof head);
    }
}

/* The same part at every place: of every other ray of every other line that has a place. */
static void check_promise(int32_t part_q5, int32_t pass)
{
    static struct ih_surroundings_promise promise;
    int32_t slot, counted = 0;

    promise.bias_q5 = pass - 200;
    memset(promise.part_q5, part_q5, sizeof promise.part_q5);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        counted +=
            found.place[slot] != IH_NONE && slot / IH_GRID % 2 == 0 && slot % IH_GRID % 2 == 0;
    }
    IH_TEST_EQUAL(
        promise.bias_q5 +
            (int32_t)floor(ldexp(counted * part_q5 * (double)found.weight_q12, -12) + 0.5),
        ih_surroundings_promise_by_q5(&promise, &rays, head.centre_mm_q8), "promise", pass);
}

/* By columns as moves: a part left and right of the centre, and in every column from the third outwards. */
static void parts_of_a_promise_add_up_by_columns(void)
{
    static const struct {
        int32_t x_mm, column;
    } cases[] = {{10, 0}, {-10, 0}, {70, 1}, {-70, 1}, {130, 2}, {-200, 2}, {370, 2}};
    struct ih_surroundings_promise promise = {.bias_q5 = -90};
    int32_t i, k;

    for (k = 0; k < IH_SURROUNDINGS_COLUMNS; k++) {
        promise.part_q5[place_at(5, k, 3)] = (int8_t)(5 + 20 * k);
    }
    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        for (k = 0; k < 5;
             k++) { /* two of them are between those that are counted, one is unknown */
            rays.ray[k] = (struct ih_ray){.slope_x_q20 = 4 * 256 * cases[i].x_mm,
                                          .point_mm_q8 = {0, 0, head.centre_mm_q8[2]},
                                          .state = k == 2 ? IH_RAY_UNKNOWN : IH_RAY_SEEN};
        }
        IH_TEST_EQUAL(-90 + 2 * (5 + 20 * cases[i].column),
                      ih_surroundings_promise_by_q5(&promise, &rays, head.centre_mm_q8), "promise",
                      i);
    }
}

/* The same steps at every place, of the longest step: those aside to the side of each ray. */
static void check_moves(int32_t each, int pass)
{
    int32_t counted[3] = {0, 0, 0};
    struct ih_ellipsoid moved = head;
    int slot, axis;

    for (slot = 0; slot < IH_SLOTS; slot++) {
        const double passes_mm_q8 = (double)rays.origin_mm_q8[0] - head.centre_mm_q8[0] +
                                    ldexp((double)(head.centre_mm_q8[2] - rays.origin_mm_q8[2]) *
                                              rays.ray[slot].slope_x_q20,
                                          -20);

        if (found.place[slot] != IH_NONE) {
            TEST_ASSERT_TRUE(fabs(passes_mm_q8) > 1.0);
            counted[0] += passes_mm_q8 < 0 ? -1 : 1;
            counted[1]++;
            counted[2]++;
        }
    }
    for (slot = 0; slot < IH_SURROUNDINGS_PLACES; slot++) {
        memset(moves.steps[slot], each, sizeof moves.steps[slot]);
    }
    for (axis = 0; axis < 3; axis++) {
        moves.step_mm_q12[axis] = 1 << 12;
    }
    ih_surroundings_move_by(&moves, &rays, 1000, &moved);
    for (axis = 0; axis < 3; axis++) {
        const double move_mm_q8 =
            floor(ldexp(counted[axis] * each * (double)found.weight_q12, -4) + 0.5);

        IH_TEST_EQUAL((int32_t)fmax(fmin(move_mm_q8, 256000), -256000),
                      moved.centre_mm_q8[axis] - head.centre_mm_q8[axis], "move", 3 * pass + axis);
    }
}

/* Every ray asks, on one side, and stands for a whole cell: each sum at its largest and smallest. */
static void the_largest_sums_do_not_overflow(void)
{
    int slot, pass;

    for (slot = 0; slot < IH_SLOTS; slot++) { /* 16 mm apart */
        rays.ray[slot] = (struct ih_ray){.slope_x_q20 = (slot % IH_GRID + 1) * PITCH_Q20 / 4,
                                         .slope_y_q20 = (slot / IH_GRID - 9) * PITCH_Q20 / 4,
                                         .state = IH_RAY_EMPTY};
    }
    ih_rays_fill_table(&rays);
    rays.table.pitch_q20 = PITCH_Q20;
    ih_surroundings_find(&rays, &head, &found);
    IH_TEST_EQUAL(4096, found.weight_q12, "weight", 0);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        TEST_ASSERT_NOT_EQUAL(IH_NONE, found.place[slot]);
    }
    for (pass = 0; pass < 2; pass++) {
        check_promise(pass == 0 ? -127 : 127, pass);
        check_moves(pass == 0 ? -128 : 127, pass);
    }
}

/* As far as rays, points and fits can be. The sanitizers watch. */
static void extremes_do_not_overflow(void)
{
    struct ih_test_random random = {31};
    int32_t known_sum[2] = {0, 0};
    int pass, slot, axis, map;

    for (pass = 0; pass < 400; pass++) {
        const int32_t each = pass % 2 == 0 ? -8 : 7; /* by all maps at all places */
        int32_t known = 0;

        memset(maps, pass % 2 == 0 ? 0 : UINT8_MAX, sizeof maps);

        for (axis = 0; axis < 3; axis++) {
            const int32_t far = pass % 4 < 2 ? 300 << 8 : 1 << 27;

            head.centre_mm_q8[axis] = (int32_t)ih_test_between(&random, -far, far);
            rays.origin_mm_q8[axis] = (int32_t)ih_test_between(&random, -256000, 256000);
        }
        for (slot = 0; slot < IH_SLOTS; slot++) {
            rays.ray[slot] = (struct ih_ray){
                .slope_x_q20 = (int32_t)ih_test_between(&random, -(4 << 20), 4 << 20),
                .slope_y_q20 = (int32_t)ih_test_between(&random, -(4 << 20), 4 << 20),
                .point_mm_q8 = {0, 0, (int32_t)ih_test_between(&random, -(1 << 25), 1 << 25)},
                .state = (int32_t)ih_test_between(&random, 0, 2)};
        }
        ih_rays_fill_table(&rays);
        ih_surroundings_find(&rays, &head, &found);
        check_promise(each < 0 ? -127 : 127, pass);
        ih_surroundings_ask_maps(maps, &found, answer_q8);
        IH_TEST_RANGE(0, 4096, found.weight_q12, "weight", pass);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            IH_TEST_RANGE(IH_NONE, IH_SURROUNDINGS_PLACES - 1, found.place[slot], "place", slot);
            known += found.place[slot] != IH_NONE;
        }
        known_sum[pass % 2] += known;
        for (map = 0; map < IH_SURROUNDINGS_MAPS; map++) {
            IH_TEST_EQUAL((int32_t)floor(ldexp(known * each * found.weight_q12, -4) + 0.5),
                          answer_q8[map], "answer", pass);
        }
        check_moves(each < 0 ? -128 : 127, pass);
    }
    /* Of each sign 100 centres are near: ten rays of each at least. */
    TEST_ASSERT_GREATER_THAN(1000, known_sum[0]);
    TEST_ASSERT_GREATER_THAN(1000, known_sum[1]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(scenes_match_float64);
    RUN_TEST(cells_begin_and_end_at_their_limits);
    RUN_TEST(ranges_begin_at_their_limits);
    RUN_TEST(dense_rays_have_small_weights);
    RUN_TEST(rays_of_known_state_add_up);
    RUN_TEST(sums_of_two_maps_stay_apart);
    RUN_TEST(moves_add_up_by_columns);
    RUN_TEST(parts_of_a_promise_add_up_by_columns);
    RUN_TEST(the_largest_sums_do_not_overflow);
    RUN_TEST(extremes_do_not_overflow);
    return UNITY_END();
}
