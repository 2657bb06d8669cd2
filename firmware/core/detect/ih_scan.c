#include "detect/ih_scan.h"

#include <stdbool.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "detect/ih_head_model.h"

#define RANK_BITS 9
#define RANK_SLOTS (1 << RANK_BITS) /* more than there are slots */
#define RANK_NONE INT32_MIN

void ih_scan_params_default(struct ih_scan_params *params)
{
    *params = (struct ih_scan_params){
        .deep_mm = IH_HEAD_SEMI_Z_MM,
        .spacing_mm = 80,
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

/* A score and a slot in one, so that the maximum is the best, the first of equals. */
static int32_t rank_of(int32_t score_q12, int32_t slot)
{
    return score_q12 * RANK_SLOTS + RANK_SLOTS - 1 - slot;
}

static int32_t score_of(int32_t rank)
{
    return rank >> RANK_BITS;
}

static int32_t slot_of(int32_t rank)
{
    return RANK_SLOTS - 1 - (int32_t)(IH_WRAPS(uint32_t, rank) % RANK_SLOTS);
}

/* The best of the candidates that are left, or RANK_NONE. No branch, so that compilers make vectors of it. */
static int32_t best_rank(const struct ih_scan_scratch *scratch)
{
    int32_t best = RANK_NONE;
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
    const int32_t score_q12 = score_of(rank);
    int32_t at = out->candidate_count++;
    for (; at > 0 && out->candidate[at - 1].score_q12 < score_q12; at--) {
        out->candidate[at] = out->candidate[at - 1]; /* a later one may be better */
    }
    out->candidate[at].score_q12 = score_q12;
    memcpy(out->candidate[at].centre_mm_q8, kept_mm_q8, sizeof out->candidate[at].centre_mm_q8);
    for (int32_t i = scratch->rank_count - 1; i >= 0; i--) {
        if (is_near(kept_mm_q8, scratch->centre_mm_q8[slot_of(scratch->rank[i])], spacing_mm)) {
            scratch->rank_count--;
            scratch->rank[i] = scratch->rank[scratch->rank_count];
        }
    }
}

/* Score the centre behind a slot's point, if there is one and none is kept near it. */
static void score_slot(const struct ih_rays *rays, const struct ih_scan_params *params,
                       int32_t slot, struct ih_scan_scratch *scratch, const struct ih_scan *out)
{
    if (scratch->state[slot] != IH_SCAN_LEFT) {
        return;
    }
    int32_t *centre_mm_q8 = scratch->centre_mm_q8[slot];
    scratch->state[slot] = IH_SCAN_SCORED;
    centre_behind(&rays->ray[slot], params->deep_mm, centre_mm_q8);
    for (int32_t i = 0; i < out->candidate_count; i++) {
        if (is_near(out->candidate[i].centre_mm_q8, centre_mm_q8, params->spacing_mm)) {
            return;
        }
    }
    scratch->rank[scratch->rank_count++] =
        rank_of(ih_template_score_q12(rays, &scratch->table, centre_mm_q8), slot);
}

/* The first seen point of each block of two by two slots. */
static void begin(const struct ih_rays *rays, const struct ih_scan_params *params,
                  struct ih_scan_scratch *scratch, const struct ih_scan *out)
{
    scratch->rank_count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        scratch->state[slot] =
            rays->ray[slot].state == IH_RAY_SEEN ? IH_SCAN_LEFT : IH_SCAN_NOTHING;
    }
    for (int32_t y = 0; y < IH_GRID; y += 2) {
        for (int32_t x = 0; x < IH_GRID; x += 2) {
            for (int32_t i = 0; i < 4; i++) {
                const int32_t row = y + i / 2;
                const int32_t column = x + i % 2;
                const int32_t slot = row * IH_GRID + column;
                if (row < IH_GRID && column < IH_GRID && scratch->state[slot] == IH_SCAN_LEFT) {
                    score_slot(rays, params, slot, scratch, out);
                    break;
                }
            }
        }
    }
}

/* Score the up to 8 neighbours of a slot. */
static void widen(const struct ih_rays *rays, const struct ih_scan_params *params, int32_t slot,
                  struct ih_scan_scratch *scratch, const struct ih_scan *out)
{
    const int32_t row = slot / IH_GRID;
    const int32_t column = slot % IH_GRID;
    scratch->state[slot] = IH_SCAN_WIDENED;
    for (int32_t y = ih_max_s32(row - 1, 0); y <= ih_min_s32(row + 1, IH_GRID - 1); y++) {
        for (int32_t x = ih_max_s32(column - 1, 0); x <= ih_min_s32(column + 1, IH_GRID - 1); x++) {
            score_slot(rays, params, y * IH_GRID + x, scratch, out);
        }
    }
}

/* The best is kept once all its neighbours are scored. */
void ih_scan_find(const struct ih_rays *rays, const struct ih_scan_params *params,
                  struct ih_scan_scratch *scratch, struct ih_scan *out)
{
    ih_template_prepare(rays, &scratch->table);
    out->candidate_count = 0;
    begin(rays, params, scratch, out);
    while (out->candidate_count < params->candidate_max) {
        const int32_t best = best_rank(scratch);
        if (best == RANK_NONE) {
            break;
        }
        if (scratch->state[slot_of(best)] == IH_SCAN_WIDENED) {
            keep(scratch, best, params->spacing_mm, out);
        } else {
            widen(rays, params, slot_of(best), scratch, out);
        }
    }
}
