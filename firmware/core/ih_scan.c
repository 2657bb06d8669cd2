#include "ih_scan.h"

#include <string.h>

#include "ih_fix.h"

#define ONE_Q12 4096
#define ON_SURFACE_MM_Q8 (28 << 8)
#define BEHIND_FULL_MM_Q8 (60 << 8)
#define BEHIND_CENTRE_MM_Q8 (60 << 8)
#define VALUE_NEARER_Q12 (-614) /* -0.15 */
#define VALUE_EMPTY_Q12 (-2458) /* -0.6 */
#define VALUE_UNKNOWN_Q12 VALUE_NEARER_Q12
#define RING_EMPTY_Q12 2867   /* 0.7 */
#define RING_NEAR_Q12 (-2458) /* -0.6 */
#define RING_INNER2_Q14 27689 /* 1.3^2 */
#define RING_OUTER2_Q14 59146 /* 1.9^2 */
#define RING_SHARE_PERCENT 60
#define RAYS_LEAST 8
#define RANK_PLACES 512 /* more than there are places, a power of two */
#define RANK_NONE INT32_MIN
#define BLOCKS ((IH_GRID + 1) / 2) /* of two by two slots, along a side */

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

/* What the rays through a head and around it say. */
struct sums {
    int32_t inside, inside_count;
    int32_t ring, ring_count;
};

static void add_ray(const struct ih_space *space, const struct ih_ellipsoid *head,
                    const struct ih_shares *shares, const struct ih_ray *ray, struct sums *sums)
{
    const struct ih_aim aim = ih_ellipsoid_aim(head->semi_mm_q8, shares, ray);
    struct ih_crossing crossing;
    if (!ih_ellipsoid_cross(head, shares, space->origin_mm_q8, ray, &aim, &crossing)) {
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

/* Rays of which the bound's 16 bits can tell what they are worth are counted by them; the others, some
 * seven, are crossed with the head. */
static int32_t score_q12(const struct ih_space *space, struct ih_scan_scratch *scratch,
                         const struct ih_ellipsoid *head)
{
    struct ih_bound_verdict *sure = &scratch->verdict;
    const struct ih_shares shares = ih_ellipsoid_shares(head->semi_mm_q8);
    ih_bound_judge(space, &scratch->rays, head->centre_mm_q8, sure);
    struct sums sums = {
        .inside = (sure->on - sure->far) * ONE_Q12 + sure->nearer * VALUE_NEARER_Q12 +
                  sure->empty * VALUE_EMPTY_Q12,
        .inside_count = sure->on + sure->far + sure->nearer + sure->empty,
        .ring =
            sure->open * ONE_Q12 + sure->open_empty * RING_EMPTY_Q12 + sure->closed * RING_NEAR_Q12,
        .ring_count = sure->open + sure->open_empty + sure->closed + sure->unknown,
    };
    for (int32_t i = 0; i < sure->unsure_count; i++) {
        add_ray(space, head, &shares, &space->ray[sure->unsure[i]], &sums);
    }
    return sums.inside / ih_max_s32(sums.inside_count, RAYS_LEAST) +
           sums.ring * RING_SHARE_PERCENT / (100 * ih_max_s32(sums.ring_count, RAYS_LEAST));
}

/* The place `deep` behind a point, along its ray. */
static void centre_behind(const struct ih_ray *ray, int32_t deep_mm, int32_t centre_mm_q8[3])
{
    int64_t x = ray->slope_x_q20;
    int64_t y = ray->slope_y_q20;
    int64_t length_q20 = ih_isqrt_u54((uint64_t)(x * x + y * y) + ((uint64_t)1 << 40));
    int64_t deep_q8 = (int64_t)deep_mm << 8;
    int64_t step_q8 = ih_div_round(deep_q8 * (1 << 20), length_q20);
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

/* A score and a place's number in one, so that the greatest is the best, the first of equals. */
static int32_t rank_of(int32_t score_q12, int32_t index)
{
    return score_q12 * RANK_PLACES + RANK_PLACES - 1 - index;
}

/* Of what is left, the place that seems best; IH_NONE when nothing is left. A loop without a branch:
 * compilers turn it into vectors. */
static int32_t best_left(const struct ih_scan_scratch *scratch, int32_t count)
{
    int32_t best = RANK_NONE;
    for (int32_t i = 0; i < count; i++) {
        best = ih_max_s32(best, scratch->rank[i]);
    }
    return best == RANK_NONE ? IH_NONE
                             : RANK_PLACES - 1 - (int32_t)(IH_WRAPS(uint32_t, best) % RANK_PLACES);
}

/* A place is kept; nothing near it is looked at any more, nor is it itself. */
static void take(struct ih_scan_scratch *scratch, int32_t count, int32_t index, int32_t spacing_mm,
                 struct ih_scan *out)
{
    const struct ih_scan_place *kept = &scratch->tried[index];
    int32_t at = out->place_count++;
    for (; at > 0 && out->place[at - 1].score_q12 < kept->score_q12; at--) {
        out->place[at] = out->place[at - 1]; /* what is found late may be better */
    }
    out->place[at] = *kept;
    for (int32_t i = 0; i < count; i++) {
        if (is_near(kept->centre_mm_q8, scratch->tried[i].centre_mm_q8, spacing_mm)) {
            scratch->state[i] = IH_SCAN_TAKEN;
            scratch->rank[i] = RANK_NONE;
        }
    }
}

int32_t ih_scan_score_q12(const struct ih_space *space, struct ih_scan_scratch *scratch,
                          const int32_t centre_mm_q8[3])
{
    const struct ih_ellipsoid head = ih_ellipsoid_mean(centre_mm_q8);
    const int32_t score = score_q12(space, scratch, &head);
    IH_IN_RANGE(score, IH_RANGE_SCAN_MIN_Q12, IH_RANGE_SCAN_MAX_Q12);
    return score;
}

static void bound(const struct ih_space *space, struct ih_scan_scratch *scratch, int32_t index)
{
    struct ih_scan_place *place = &scratch->tried[index];
    place->score_q12 = ih_bound_score_q12(space, &scratch->rays, place->centre_mm_q8);
    scratch->rank[index] = rank_of(place->score_q12, index);
    scratch->state[index] = IH_SCAN_BOUND;
}

/* Places behind all seen points, of which the first of each block of two by two slots is bounded. */
static int32_t begin(const struct ih_space *space, const struct ih_scan_params *params,
                     struct ih_scan_scratch *scratch)
{
    bool is_begun[BLOCKS * BLOCKS];
    int32_t count = 0;
    memset(is_begun, 0, sizeof is_begun);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int32_t block = slot / IH_GRID / 2 * BLOCKS + slot % IH_GRID / 2;
        scratch->index[slot] = IH_NONE;
        if (space->ray[slot].state == IH_RAY_SEEN) {
            struct ih_scan_place *place = &scratch->tried[count];
            centre_behind(&space->ray[slot], params->deep_mm, place->centre_mm_q8);
            place->score_q12 = IH_BOUND_MOST_Q12;
            scratch->rank[count] = RANK_NONE;
            scratch->state[count] = IH_SCAN_LEFT;
            scratch->slot[count] = (int16_t)slot;
            scratch->index[slot] = (int16_t)count;
            if (!is_begun[block]) {
                is_begun[block] = true;
                bound(space, scratch, count);
            }
            count++;
        }
    }
    return count;
}

/* A place is worth its score, and the up to 8 places around it a bound. */
static void rate(const struct ih_space *space, struct ih_scan_scratch *scratch, int32_t index)
{
    struct ih_scan_place *place = &scratch->tried[index];
    place->score_q12 = ih_scan_score_q12(space, scratch, place->centre_mm_q8);
    scratch->rank[index] = rank_of(place->score_q12, index);
    scratch->state[index] = IH_SCAN_RATED;
    const int32_t row = scratch->slot[index] / IH_GRID;
    const int32_t column = scratch->slot[index] % IH_GRID;
    for (int32_t y = ih_max_s32(row - 1, 0); y <= ih_min_s32(row + 1, IH_GRID - 1); y++) {
        for (int32_t x = ih_max_s32(column - 1, 0); x <= ih_min_s32(column + 1, IH_GRID - 1); x++) {
            const int32_t other = scratch->index[y * IH_GRID + x];
            if (other != IH_NONE && scratch->state[other] == IH_SCAN_LEFT) {
                bound(space, scratch, other);
            }
        }
    }
}

/* Bounds first: the score itself is worked out of what seems best and is not yet rated. What is rated
 * and still seems best is the best of those that were looked at. */
void ih_scan_find(const struct ih_space *space, const struct ih_scan_params *params,
                  struct ih_scan_scratch *scratch, struct ih_scan *out)
{
    ih_bound_prepare(space, &scratch->rays);
    const int32_t count = begin(space, params, scratch);
    out->place_count = 0;
    while (out->place_count < params->place_max) {
        const int32_t best = best_left(scratch, count);
        if (best == IH_NONE) {
            break;
        }
        if (scratch->state[best] == IH_SCAN_RATED) {
            take(scratch, count, best, params->spacing_mm, out);
        } else {
            rate(space, scratch, best);
        }
    }
}
