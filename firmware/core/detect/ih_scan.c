#include "detect/ih_scan.h"

#include <stdbool.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "base/ih_types.h"
#include "detect/ih_head_model.h"
#include "detect/ih_surroundings.h"

#define RANK_BITS 9
#define RANK_SLOTS (1 << RANK_BITS) /* more than there are slots */

void ih_scan_params_default(struct ih_scan_params *params)
{
    *params = (struct ih_scan_params){
        .deep_mm = IH_HEAD_SEMI_Z_MM,
        .promise_min_q5 = -96,
        .spacing_mm = 60,
        .candidate_max = IH_SCAN_MAX,
    };
}

/* The centre deep_mm behind a point, along its ray. */
static void centre_behind(const struct ih_ray *ray, int32_t deep_mm, int32_t centre_mm_q8[3])
{
    const int64_t x = ray->slope_x_q20;
    const int64_t y = ray->slope_y_q20;
    const uint64_t length2_q40 = (uint64_t)(x * x + y * y) + ((uint64_t)1 << 40);
    /* 1 over its root: from the table, and a first correction */
    const int half = (33 - __builtin_clzll(length2_q40)) / 2; /* 5 to 7 */
    const uint32_t square = (uint32_t)(length2_q40 >> (2 * half));
    const uint64_t r_q15 = ih_inverse_root_q15(square);
    const uint64_t residual_q32 = ((uint64_t)1 << 32) - ((square * r_q15 >> 15) * r_q15 >> 15);
    const uint64_t inverse_q31 = (r_q15 << 16) + (r_q15 * residual_q32 >> 17);
    const int64_t step_q8 = ih_mul_shift((int64_t)deep_mm << 8, (int64_t)inverse_q31, 27 + half);
    centre_mm_q8[0] = ray->point_mm_q8[0] + (int32_t)ih_mul_shift(step_q8, x, 20);
    centre_mm_q8[1] = ray->point_mm_q8[1] + (int32_t)ih_mul_shift(step_q8, y, 20);
    centre_mm_q8[2] = ray->point_mm_q8[2] + (int32_t)step_q8;
}

static bool is_near(const int32_t a_mm_q8[3], const int32_t b_mm_q8[3], int32_t distance_mm)
{
    int64_t limit = (int64_t)distance_mm << 8;
    if (ih_abs_s32(a_mm_q8[0] - b_mm_q8[0]) > limit) {
        return false; /* most are */
    }
    return ih_distance2_s32(a_mm_q8, b_mm_q8) <= limit * limit;
}

/* A promise and a slot in one, so that the maximum is the best, the first of equals. */
static int32_t rank_of(int32_t promise_q5, int32_t slot)
{
    return promise_q5 * RANK_SLOTS + RANK_SLOTS - 1 - slot;
}

static int32_t promise_of(int32_t rank)
{
    return rank >> RANK_BITS;
}

static int32_t slot_of(int32_t rank)
{
    return RANK_SLOTS - 1 - (int32_t)(IH_WRAPS(uint32_t, rank) % RANK_SLOTS);
}

/* The best of the candidates that are left. No branch, so that compilers make vectors of it. */
static int32_t best_rank(const struct ih_scan_scratch *scratch)
{
    int32_t best = INT32_MIN;
    for (int32_t i = 0; i < scratch->rank_count; i++) {
        best = ih_max_s32(best, scratch->rank[i]);
    }
    return best;
}

/* Keep a candidate; drop it and all near it from the ranks. */
static void keep(struct ih_scan_scratch *scratch, int32_t rank, int32_t spacing_mm,
                 struct ih_scan *out)
{
    const int32_t *kept_mm_q8 = scratch->centre_mm_q8[slot_of(rank)];
    struct ih_scan_candidate *candidate = &out->candidate[out->candidate_count++];
    candidate->promise_q5 = promise_of(rank);
    memcpy(candidate->centre_mm_q8, kept_mm_q8, sizeof candidate->centre_mm_q8);
    for (int32_t i = scratch->rank_count - 1; i >= 0; i--) {
        if (is_near(kept_mm_q8, scratch->centre_mm_q8[slot_of(scratch->rank[i])], spacing_mm)) {
            scratch->rank_count--;
            scratch->rank[i] = scratch->rank[scratch->rank_count];
        }
    }
}

/* The centre behind a slot's point, if it promises enough. */
static void rank_slot(const struct ih_rays *rays, const struct ih_scan_params *params, int32_t slot,
                      struct ih_scan_scratch *scratch)
{
    int32_t *centre_mm_q8 = scratch->centre_mm_q8[slot];
    centre_behind(&rays->ray[slot], params->deep_mm, centre_mm_q8);
    const int32_t promise_q5 = ih_surroundings_promise_q5(rays, centre_mm_q8);
    if (promise_q5 >= params->promise_min_q5) {
        scratch->rank[scratch->rank_count++] = rank_of(promise_q5, slot);
    }
}

/* The first seen slot of the block of two by two that begins at a slot, or IH_NONE. */
static int32_t first_seen(const struct ih_rays *rays, int32_t line, int32_t first)
{
    for (int32_t y = line; y < ih_min_s32(line + 2, IH_GRID); y++) {
        for (int32_t x = first; x < ih_min_s32(first + 2, IH_GRID); x++) {
            if (rays->ray[y * IH_GRID + x].state == IH_RAY_SEEN) {
                return y * IH_GRID + x;
            }
        }
    }
    return IH_NONE;
}

void ih_scan_find(const struct ih_rays *rays, const struct ih_scan_params *params,
                  struct ih_scan_scratch *scratch, struct ih_scan *out)
{
    out->candidate_count = 0;
    scratch->rank_count = 0;
    for (int32_t y = 0; y < IH_GRID; y += 2) {
        for (int32_t x = 0; x < IH_GRID; x += 2) {
            const int32_t slot = first_seen(rays, y, x);
            if (slot != IH_NONE) {
                rank_slot(rays, params, slot, scratch);
            }
        }
    }
    while (out->candidate_count < params->candidate_max && scratch->rank_count > 0) {
        keep(scratch, best_rank(scratch), params->spacing_mm, out);
    }
}
