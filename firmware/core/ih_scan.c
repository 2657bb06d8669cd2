#include "ih_scan.h"

#include <string.h>

#include "ih_fix.h"

#define ONE_Q12 4096
#define ON_SURFACE_MM_Q8 (28 << 8)
#define BEHIND_FULL_MM_Q8 (60 << 8)
#define BEHIND_CENTRE_MM_Q8 (60 << 8)
#define VALUE_NEARER_Q12 (-614)  /* -0.15 */
#define VALUE_EMPTY_Q12 (-2458)  /* -0.6 */
#define VALUE_UNKNOWN_Q12 (-614) /* -0.15 */
#define RING_EMPTY_Q12 2867      /* 0.7 */
#define RING_NEAR_Q12 (-2458)    /* -0.6 */
#define RING_INNER2_Q14 27689    /* 1.3^2 */
#define RING_OUTER2_Q14 59146    /* 1.9^2 */
#define RING_SHARE_PERCENT 60
#define RAYS_LEAST 8

void ih_scan_params_default(struct ih_scan_params *params)
{
    *params = (struct ih_scan_params){
        .deep_mm = 98,
        .spacing_mm = 80,
        .place_max = IH_SCAN_MAX,
    };
}

static int32_t inside_value_q12(const struct ih_ray *ray, const struct ih_crossing *crossing)
{
    if (ray->state != IH_RAY_SEEN) {
        return ray->state == IH_RAY_EMPTY ? VALUE_EMPTY_Q12 : VALUE_UNKNOWN_Q12;
    }
    int32_t behind_q8 = ray->point_mm_q8[2] - crossing->entry_mm_q8;
    if (ih_abs_s32(behind_q8) < ON_SURFACE_MM_Q8) {
        return ONE_Q12;
    }
    if (behind_q8 < 0) {
        return VALUE_NEARER_Q12;
    }
    return -ih_min_s32(behind_q8, BEHIND_FULL_MM_Q8) * ONE_Q12 / BEHIND_FULL_MM_Q8;
}

static int32_t ring_value_q12(const struct ih_ray *ray, int32_t centre_depth_q8)
{
    if (ray->state != IH_RAY_SEEN) {
        return ray->state == IH_RAY_EMPTY ? RING_EMPTY_Q12 : 0;
    }
    return ray->point_mm_q8[2] > centre_depth_q8 + BEHIND_CENTRE_MM_Q8 ? ONE_Q12 : RING_NEAR_Q12;
}

/* Beside or above, not below (dy > |dx|, in mm). */
static bool is_in_ring(const struct ih_crossing *crossing, const struct ih_ellipsoid *head)
{
    int64_t dx = (int64_t)crossing->nearest_q14[0] * head->semi_mm_q8[0];
    int64_t dy = (int64_t)crossing->nearest_q14[1] * head->semi_mm_q8[1];
    return crossing->radius2_q14 > RING_INNER2_Q14 && crossing->radius2_q14 < RING_OUTER2_Q14 &&
           dy <= ih_abs_s64(dx);
}

/* ih_scan_half's shares are 2^this over the sides. */
#define SHARE_BITS 20
/* Slopes in 14 bits and whole mm: rounded down, they are off by 4 mm each at the limits, and by less
 * than a mm for the origin and the centre. */
#define NEAR_MARGIN_MM 12
/* 1 and what is rounded off a share and its square, Q20. */
#define NEAR_Q20 ((1 << 20) + (1 << 14))

/* Which rays pass through the ellipse in the box around a centre: those outside are farther away than
 * the ring's outer rim in any direction. A loop without a branch: compilers turn it into vectors.
 * Depths below 2^14.1 mm, slopes up to 2^14. */
static void flag_near(const struct ih_space *space, const int32_t centre_mm_q8[3],
                      struct ih_scan_scratch *scratch)
{
    const struct ih_scan_half *half = &scratch->half;
    const int32_t depth_mm = (centre_mm_q8[2] - space->origin_mm_q8[2]) >> 8;
    const int32_t x_mm = ((space->origin_mm_q8[0] - centre_mm_q8[0]) >> 8) + half->x_mm;
    const int32_t y_mm = ((space->origin_mm_q8[1] - centre_mm_q8[1]) >> 8) + half->y_mm;
    for (int32_t slot = 0; slot < IH_SCAN_FLAGS; slot++) {
        int32_t off_x_mm = (depth_mm * scratch->slope_q12[0][slot] >> 12) + x_mm;
        int32_t off_y_mm = (depth_mm * scratch->slope_q12[1][slot] >> 12) + y_mm;
        uint8_t in_x = IH_WRAPS(uint32_t, off_x_mm) <= 2 * (uint32_t)half->x_mm;
        uint8_t in_y = IH_WRAPS(uint32_t, off_y_mm) <= 2 * (uint32_t)half->y_mm;
        int32_t x_q10 = (in_x ? off_x_mm - half->x_mm : 0) * half->x_share >> (SHARE_BITS - 10);
        int32_t y_q10 = (in_y ? off_y_mm - half->y_mm : 0) * half->y_share >> (SHARE_BITS - 10);
        uint8_t is_round = x_q10 * x_q10 + y_q10 * y_q10 <= NEAR_Q20;
        scratch->near[slot] = in_x & in_y & is_round;
    }
}

/* What the rays through a head and around it say. */
struct sums {
    int32_t inside, inside_count;
    int32_t ring, ring_count;
};

static void add_ray(const struct ih_space *space, const struct ih_ellipsoid *head,
                    const struct ih_shares *shares, const struct ih_ray *ray,
                    const struct ih_aim *aim, struct sums *sums)
{
    struct ih_crossing crossing;
    if (!ih_ellipsoid_cross_aimed(head, shares, space->origin_mm_q8, ray, aim, &crossing)) {
        return;
    }
    if (crossing.radius2_q14 < 1 << 14) {
        sums->inside += inside_value_q12(ray, &crossing);
        sums->inside_count++;
    } else if (is_in_ring(&crossing, head)) {
        sums->ring += ring_value_q12(ray, head->centre_mm_q8[2]);
        sums->ring_count++;
    }
}

static int32_t score_q12(const struct ih_space *space, struct ih_scan_scratch *scratch,
                         const struct ih_ellipsoid *head)
{
    struct sums sums = {0};
    const struct ih_shares shares = ih_ellipsoid_shares(head->semi_mm_q8);
    flag_near(space, head->centre_mm_q8, scratch);
    for (int32_t first = 0; first < IH_SLOTS; first += 8) {
        uint64_t any; /* of eight slots */
        memcpy(&any, &scratch->near[first], sizeof any);
        for (int32_t slot = first; any != 0 && slot < ih_min_s32(first + 8, IH_SLOTS); slot++) {
            if (scratch->near[slot] != 0) {
                add_ray(space, head, &shares, &space->ray[slot], &scratch->aim[slot], &sums);
            }
        }
    }
    return sums.inside / ih_max_s32(sums.inside_count, RAYS_LEAST) +
           sums.ring * RING_SHARE_PERCENT / (100 * ih_max_s32(sums.ring_count, RAYS_LEAST));
}

/* The place `deep` behind a point, along its ray. */
static void centre_behind(const struct ih_ray *ray, int32_t deep_mm, int32_t centre_mm_q8[3])
{
    int64_t x = ray->slope_x_q20;
    int64_t y = ray->slope_y_q20;
    int64_t length_q20 = ih_isqrt_u64((uint64_t)(x * x + y * y) + ((uint64_t)1 << 40));
    int64_t deep_q8 = (int64_t)deep_mm << 8;
    int64_t step_q8 = ih_div_round(deep_q8 * (1 << 20), length_q20);
    centre_mm_q8[0] = ray->point_mm_q8[0] + (int32_t)ih_mul_shift(step_q8, x, 20);
    centre_mm_q8[1] = ray->point_mm_q8[1] + (int32_t)ih_mul_shift(step_q8, y, 20);
    centre_mm_q8[2] = ray->point_mm_q8[2] + (int32_t)step_q8;
}

static bool is_near(const int32_t a_mm_q8[3], const int32_t b_mm_q8[3], int32_t distance_mm)
{
    int64_t limit = (int64_t)distance_mm << 8;
    return ih_distance2_s32(a_mm_q8, b_mm_q8) <= limit * limit;
}

/* Of what is left, the place that seems best, the first of equals; IH_NONE when nothing is left. */
static int32_t best_left(const struct ih_scan_scratch *scratch, int32_t count)
{
    int32_t best = IH_NONE;
    int32_t best_q12 = INT32_MIN;
    for (int32_t i = 0; i < count; i++) {
        const bool is_better = scratch->tried[i].score_q12 > best_q12;
        if (is_better && scratch->state[i] != IH_SCAN_TAKEN) {
            best = i;
            best_q12 = scratch->tried[i].score_q12;
        }
    }
    return best;
}

/* A place is kept; nothing near it is looked at any more, nor is it itself. */
static void take(struct ih_scan_scratch *scratch, int32_t count, int32_t index, int32_t spacing_mm,
                 struct ih_scan *out)
{
    const struct ih_scan_place *kept = &scratch->tried[index];
    out->place[out->place_count++] = *kept;
    for (int32_t i = 0; i < count; i++) {
        if (is_near(kept->centre_mm_q8, scratch->tried[i].centre_mm_q8, spacing_mm)) {
            scratch->state[i] = IH_SCAN_TAKEN;
        }
    }
}

/* What is the same for all centres. */
static void prepare(const struct ih_space *space, struct ih_scan_scratch *scratch)
{
    struct ih_scan_half *half = &scratch->half;
    int32_t slope_most_q20[2];
    ih_space_slope_most(space, slope_most_q20);
    const struct ih_ellipsoid mean = ih_ellipsoid_mean(space->origin_mm_q8);
    const struct ih_ellipsoid_box box = ih_ellipsoid_box(&mean, slope_most_q20, RING_OUTER2_Q14);
    half->x_mm = (box.half_mm_q8[0] >> 8) + NEAR_MARGIN_MM;
    half->y_mm = (box.half_mm_q8[1] >> 8) + NEAR_MARGIN_MM;
    half->x_share = (1 << SHARE_BITS) / half->x_mm;
    half->y_share = (1 << SHARE_BITS) / half->y_mm;
    memset(scratch->slope_q12, 0, sizeof scratch->slope_q12); /* behind the last slot, too */
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        scratch->slope_q12[0][slot] = space->ray[slot].slope_x_q20 >> 8;
        scratch->slope_q12[1][slot] = space->ray[slot].slope_y_q20 >> 8;
        scratch->aim[slot] = ih_ellipsoid_aim(mean.semi_mm_q8, &space->ray[slot]);
    }
    ih_bound_prepare(space, &scratch->rays);
}

int32_t ih_scan_score_q12(const struct ih_space *space, struct ih_scan_scratch *scratch,
                          const int32_t centre_mm_q8[3])
{
    const struct ih_ellipsoid head = ih_ellipsoid_mean(centre_mm_q8);
    const int32_t score = score_q12(space, scratch, &head);
    IH_IN_RANGE(score, IH_RANGE_SCAN_MIN_Q12, IH_RANGE_SCAN_MAX_Q12);
    return score;
}

/* Bounds first: the score itself is worked out of what seems best and is not yet rated. What is rated
 * and still seems best is the best. */
void ih_scan_find(const struct ih_space *space, const struct ih_scan_params *params,
                  struct ih_scan_scratch *scratch, struct ih_scan *out)
{
    int32_t count = 0;
    prepare(space, scratch);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (space->ray[slot].state == IH_RAY_SEEN) {
            struct ih_scan_place *place = &scratch->tried[count];
            centre_behind(&space->ray[slot], params->deep_mm, place->centre_mm_q8);
            place->score_q12 = ih_bound_score_q12(space, &scratch->rays, place->centre_mm_q8);
            scratch->state[count++] = IH_SCAN_BOUND;
        }
    }
    out->place_count = 0;
    while (out->place_count < params->place_max) {
        const int32_t best = best_left(scratch, count);
        if (best == IH_NONE) {
            break;
        }
        if (scratch->state[best] == IH_SCAN_RATED) {
            take(scratch, count, best, params->spacing_mm, out);
        } else {
            struct ih_scan_place *place = &scratch->tried[best];
            place->score_q12 = ih_scan_score_q12(space, scratch, place->centre_mm_q8);
            scratch->state[best] = IH_SCAN_RATED;
        }
    }
}
