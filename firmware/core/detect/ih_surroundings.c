#include "detect/ih_surroundings.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "base/ih_types.h"
#include "detect/ih_surroundings_map.h"

#define CELL_BITS 14 /* 64 mm in Q8 */
#define CELL_MM_Q8 (1 << CELL_BITS)
#define TOP_MM_Q8 (6 * CELL_MM_Q8) /* above the centre */
#define ASIDE_CELLS 6              /* the last column has four of them */
#define CELLS 13
/* Depths against the centre's, by steps of 8 mm; the maps' limits are -176, -96, -40, 40, 128 and 200 mm. */
#define NEAREST_MM (-176)
#define STEP_BITS 3
#define STEPS 48
#define EMPTY (IH_SURROUNDINGS_DEPTHS - 1)

/* Two maps, half a word apart, are summed at once: 361 numbers below 16 do not overflow 16 bits. */
#define WORD_MAPS (IH_SURROUNDINGS_MAPS / IH_SURROUNDINGS_WORDS)
#define PAIRS (WORD_MAPS / 2)
#define PAIR_MASK 0x000f000fu
_Static_assert(WORD_MAPS == 8 && IH_SURROUNDINGS_BITS == 4,
               "a word has a number by each of 8 maps");

/* Every other ray of every other line is asked for the promise. */
#define PROMISE_STRIDE 2

static const uint8_t row_of_cell[CELLS] = {0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 8, 9, 9};

static const uint8_t depth_of_step[STEPS] = {
    1, 1, 1, 1, 1, 1, 1, 1, 1, 1,    /* -176 */
    2, 2, 2, 2, 2, 2, 2,             /* -96 */
    3, 3, 3, 3, 3, 3, 3, 3, 3, 3,    /* -40 */
    4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, /* 40 */
    5, 5, 5, 5, 5, 5, 5, 5, 5,       /* 128 */
    6,                               /* 200 and more */
};

/* The candidate, as every ray needs it. */
struct head_from_rays {
    int32_t depth_mm_q8; /* of its centre, from where rays start */
    int32_t away_mm_q8[2];
    int32_t centre_mm_q8; /* its depth in the level frame */
};

static struct head_from_rays candidate_of(const struct ih_rays *rays, const int32_t centre_mm_q8[3])
{
    return (struct head_from_rays){
        .depth_mm_q8 = centre_mm_q8[2] - rays->origin_mm_q8[2],
        .away_mm_q8 = {rays->origin_mm_q8[0] - centre_mm_q8[0],
                       rays->origin_mm_q8[1] - centre_mm_q8[1]},
        .centre_mm_q8 = centre_mm_q8[2],
    };
}

static int32_t depth_of(const struct head_from_rays *candidate, const struct ih_ray *ray)
{
    if (ray->state == IH_RAY_EMPTY) {
        return EMPTY;
    }
    const int32_t behind_mm_q8 = ray->point_mm_q8[2] - candidate->centre_mm_q8;
    const int32_t step = (((behind_mm_q8 + (1 << 7)) >> 8) - NEAREST_MM) >> STEP_BITS;
    return step < 0 ? 0 : depth_of_step[ih_min_s32(step, STEPS - 1)];
}

/* How far from the centre a ray passes at its depth. */
static int32_t across_mm_q8(const struct head_from_rays *candidate, int32_t slope_q20, int axis)
{
    return candidate->away_mm_q8[axis] +
           (int32_t)ih_mul_shift(candidate->depth_mm_q8, slope_q20, 20);
}

/* In the maps, or IH_NONE. */
static int32_t place_of(const struct head_from_rays *candidate, const struct ih_ray *ray)
{
    if (ray->state == IH_RAY_UNKNOWN) {
        return IH_NONE;
    }
    const int32_t column = ih_abs_s32(across_mm_q8(candidate, ray->slope_x_q20, 0)) >> CELL_BITS;
    const int32_t cell = (across_mm_q8(candidate, ray->slope_y_q20, 1) + TOP_MM_Q8) >> CELL_BITS;
    if (column >= ASIDE_CELLS || cell < 0 || cell >= CELLS) {
        return IH_NONE;
    }
    const int32_t row_and_column = row_of_cell[cell] * IH_SURROUNDINGS_COLUMNS +
                                   ih_min_s32(column, IH_SURROUNDINGS_COLUMNS - 1);
    return row_and_column * IH_SURROUNDINGS_DEPTHS + depth_of(candidate, ray);
}

/* Spacing^2 / cell^2. */
static int32_t weight_q12(const struct ih_rays *rays, int64_t depth_mm_q8)
{
    const int64_t spacing_mm_q8 =
        ih_min_s64(ih_mul_shift(ih_max_s64(depth_mm_q8, 0), rays->table.pitch_q20, 20), CELL_MM_Q8);
    return (int32_t)ih_shift_round(spacing_mm_q8 * spacing_mm_q8, 2 * CELL_BITS - 12);
}

void ih_surroundings_find(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid,
                          struct ih_surroundings *out)
{
    const struct head_from_rays candidate = candidate_of(rays, ellipsoid->centre_mm_q8);
    out->weight_q12 = weight_q12(rays, candidate.depth_mm_q8);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        out->place[slot] = (int16_t)place_of(&candidate, &rays->ray[slot]);
    }
}

void ih_surroundings_ask_maps(const uint32_t maps[IH_SURROUNDINGS_PLACES][IH_SURROUNDINGS_WORDS],
                              const struct ih_surroundings *found,
                              int32_t answer_q8[IH_SURROUNDINGS_MAPS])
{
    uint32_t pair[IH_SURROUNDINGS_WORDS * PAIRS] = {0}; /* sums of two maps each, in 16 bits */
    int32_t count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int32_t place = found->place[slot];
        if (place == IH_NONE) {
            continue;
        }
        for (int word = 0; word < IH_SURROUNDINGS_WORDS; word++) {
            for (int i = 0; i < PAIRS; i++) {
                pair[word * PAIRS + i] += maps[place][word] >> IH_SURROUNDINGS_BITS * i & PAIR_MASK;
            }
        }
        count++;
    }
    for (int map = 0; map < IH_SURROUNDINGS_MAPS; map++) {
        const uint32_t both = pair[map / WORD_MAPS * PAIRS + map % PAIRS];
        const int32_t sum = (int32_t)(both >> (map % WORD_MAPS < PAIRS ? 0 : 16) & UINT16_MAX) -
                            count * IH_SURROUNDINGS_ZERO;
        IH_IN_RANGE(sum, -IH_RANGE_MAP_SUM, IH_RANGE_MAP_SUM);
        answer_q8[map] = (int32_t)ih_mul_shift(sum, found->weight_q12, 12 - 8);
    }
}

void ih_surroundings_ask(const struct ih_surroundings *found,
                         int32_t answer_q8[IH_SURROUNDINGS_MAPS])
{
    ih_surroundings_ask_maps(surroundings_maps, found, answer_q8);
}

void ih_surroundings_move_by(const struct ih_surroundings_moves *moves, const struct ih_rays *rays,
                             int32_t max_mm, struct ih_ellipsoid *ellipsoid)
{
    const struct head_from_rays candidate = candidate_of(rays, ellipsoid->centre_mm_q8);
    int32_t steps[3] = {0, 0, 0}; /* to the right, down, away */
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_ray *ray = &rays->ray[slot];
        const int32_t place = place_of(&candidate, ray);
        if (place == IH_NONE) {
            continue;
        }
        const int8_t *by_ray = moves->steps[place];
        steps[0] += across_mm_q8(&candidate, ray->slope_x_q20, 0) < 0 ? -by_ray[0] : by_ray[0];
        steps[1] += by_ray[1];
        steps[2] += by_ray[2];
    }
    const int32_t ray_weight_q12 = weight_q12(rays, candidate.depth_mm_q8);
    for (int i = 0; i < 3; i++) {
        IH_IN_RANGE(steps[i], -IH_RANGE_MOVE_SUM, IH_RANGE_MOVE_SUM);
        const int32_t move_mm_q8 =
            (int32_t)ih_mul_shift(steps[i] * moves->step_mm_q12[i], ray_weight_q12, 12 + 12 - 8);
        ellipsoid->centre_mm_q8[i] += ih_clamp_s32(move_mm_q8, -max_mm * 256, max_mm * 256);
        IH_IN_RANGE(ellipsoid->centre_mm_q8[i], -IH_RANGE_CENTRE_MM_Q8, IH_RANGE_CENTRE_MM_Q8);
    }
}

void ih_surroundings_move(const struct ih_rays *rays, int32_t max_mm,
                          struct ih_ellipsoid *ellipsoid)
{
    ih_surroundings_move_by(&surroundings_moves, rays, max_mm, ellipsoid);
}

int32_t ih_surroundings_promise_by_q5(const struct ih_surroundings_promise *promise,
                                      const struct ih_rays *rays, const int32_t centre_mm_q8[3])
{
    const struct head_from_rays candidate = candidate_of(rays, centre_mm_q8);
    int32_t sum_q5 = 0;
    for (int32_t line = 0; line < IH_GRID; line += PROMISE_STRIDE) {
        for (int32_t i = 0; i < IH_GRID; i += PROMISE_STRIDE) {
            const int32_t place = place_of(&candidate, &rays->ray[line * IH_GRID + i]);
            sum_q5 += place == IH_NONE ? 0 : promise->part_q5[place];
        }
    }
    IH_IN_RANGE(sum_q5, -IH_RANGE_PROMISE_SUM_Q5, IH_RANGE_PROMISE_SUM_Q5);
    return (int32_t)ih_mul_shift(sum_q5, weight_q12(rays, candidate.depth_mm_q8), 12) +
           promise->bias_q5;
}

int32_t ih_surroundings_promise_q5(const struct ih_rays *rays, const int32_t centre_mm_q8[3])
{
    return ih_surroundings_promise_by_q5(&surroundings_promise, rays, centre_mm_q8);
}
