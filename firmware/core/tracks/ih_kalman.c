#include "tracks/ih_kalman.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"

#define SPEED_MAX_MM_S_Q8 (3000 << 8)
#define VELOCITY_VARIANCE_MAX_Q8 ((int64_t)3000 * 3000 * 256)
#define POSITION_VARIANCE_MAX_Q8 ((int64_t)500 * 500 * 256)
/* Standard deviation of a new track's velocity. */
#define START_SPEED_MM_S 300
/* 262 m: no head is seen from so far. Bounds every predicted position. */
#define POSITION_MAX_MM_Q8 (1 << 26)
/* Gain of the semi-axes. */
#define AXES_GAIN_Q16 16384

void ih_kalman_start(const struct ih_ellipsoid *measured, int32_t measured_mm,
                     struct ih_kalman *filter)
{
    *filter = (struct ih_kalman){
        .head = *measured,
        .position_q8 = (int64_t)measured_mm * measured_mm * 256,
        .velocity_q8 = (int64_t)START_SPEED_MM_S * START_SPEED_MM_S * 256,
    };
}

/* Cross term when a variance is limited: reduced by the same factor, rounded towards 0, so that the
 * covariance stays positive. */
static int64_t limit_cross_q8(int64_t cross_q8, int64_t variance_q8, int64_t limit_q8)
{
    if (variance_q8 <= limit_q8) {
        return cross_q8;
    }
    return cross_q8 * (limit_q8 * (1 << 24) / variance_q8) / (1 << 24);
}

static void limit_covariance(struct ih_kalman *f)
{
    f->cross_q8 = limit_cross_q8(f->cross_q8, f->position_q8, POSITION_VARIANCE_MAX_Q8);
    f->cross_q8 = limit_cross_q8(f->cross_q8, f->velocity_q8, VELOCITY_VARIANCE_MAX_Q8);
    f->position_q8 = ih_min_s64(f->position_q8, POSITION_VARIANCE_MAX_Q8);
    f->velocity_q8 = ih_min_s64(f->velocity_q8, VELOCITY_VARIANCE_MAX_Q8);
    IH_IN_RANGE(f->position_q8, 0, POSITION_VARIANCE_MAX_Q8);
    IH_IN_RANGE(f->velocity_q8, 0, VELOCITY_VARIANCE_MAX_Q8);
    IH_IN_RANGE(f->cross_q8, -IH_RANGE_CROSS_Q8, IH_RANGE_CROSS_Q8);
}

void ih_kalman_predict(struct ih_kalman *filter, int64_t step_us, int32_t acceleration_mm_s2)
{
    int64_t dt_q20 = ih_div_round(step_us * (1 << 20), 1000000);
    int64_t spread_q8 = (int64_t)acceleration_mm_s2 * acceleration_mm_s2 * 256;
    int64_t dt2_q20 = ih_mul_shift(dt_q20, dt_q20, 20);
    int64_t added_velocity_q8 = ih_mul_shift(spread_q8, dt2_q20, 20);
    int64_t added_cross_q8 = ih_mul_shift(added_velocity_q8, dt_q20, 21);
    int64_t added_position_q8 = ih_mul_shift(added_cross_q8, dt_q20, 21);
    filter->position_q8 += 2 * ih_mul_shift(filter->cross_q8, dt_q20, 20) +
                           ih_mul_shift(filter->velocity_q8, dt2_q20, 20) + added_position_q8;
    filter->cross_q8 += ih_mul_shift(filter->velocity_q8, dt_q20, 20) + added_cross_q8;
    filter->velocity_q8 += added_velocity_q8;
    limit_covariance(filter);
    for (int axis = 0; axis < 3; axis++) {
        int32_t *centre_mm_q8 = &filter->head.centre_mm_q8[axis];
        int32_t moved_q8 = (int32_t)ih_mul_shift(filter->velocity_mm_s_q8[axis], dt_q20, 20);
        *centre_mm_q8 =
            ih_clamp_s32(*centre_mm_q8 + moved_q8, -POSITION_MAX_MM_Q8, POSITION_MAX_MM_Q8);
    }
}

void ih_kalman_correct(struct ih_kalman *filter, const struct ih_ellipsoid *measured,
                       int64_t variance_q8)
{
    int64_t sum_q8 = filter->position_q8 + variance_q8;
    int64_t gain_q16 = ih_div_round(filter->position_q8 * 65536, sum_q8);
    int64_t velocity_gain_q16 = ih_div_round(filter->cross_q8 * 65536, sum_q8); /* 1/s */
    struct ih_ellipsoid *head = &filter->head;
    for (int axis = 0; axis < 3; axis++) {
        int64_t innovation_q8 = (int64_t)measured->centre_mm_q8[axis] - head->centre_mm_q8[axis];
        int64_t velocity =
            filter->velocity_mm_s_q8[axis] + ih_mul_shift(innovation_q8, velocity_gain_q16, 16);
        filter->velocity_mm_s_q8[axis] =
            ih_clamp_s32(ih_saturate_s32(velocity), -SPEED_MAX_MM_S_Q8, SPEED_MAX_MM_S_Q8);
        head->centre_mm_q8[axis] += (int32_t)ih_mul_shift(innovation_q8, gain_q16, 16);
        int64_t grown_q8 = (int64_t)measured->semi_mm_q8[axis] - head->semi_mm_q8[axis];
        head->semi_mm_q8[axis] += (int32_t)ih_mul_shift(grown_q8, AXES_GAIN_Q16, 16);
    }
    filter->velocity_q8 -= ih_mul_shift(velocity_gain_q16, filter->cross_q8, 16);
    filter->cross_q8 -= ih_mul_shift(gain_q16, filter->cross_q8, 16);
    filter->position_q8 -= ih_mul_shift(gain_q16, filter->position_q8, 16);
    IH_IN_RANGE(filter->position_q8, 0, POSITION_VARIANCE_MAX_Q8);
    IH_IN_RANGE(filter->velocity_q8, 0, VELOCITY_VARIANCE_MAX_Q8);
}

void ih_kalman_slow_down(struct ih_kalman *filter, int64_t unseen_us)
{
    int64_t slowed_us = ih_min_s64(unseen_us, IH_KALMAN_SLOW_US);
    int64_t kept_q16 = 65536 - ih_div_round(slowed_us * 65536, IH_KALMAN_SLOW_US);
    for (int axis = 0; axis < 3; axis++) {
        filter->velocity_mm_s_q8[axis] =
            (int32_t)ih_mul_shift(filter->velocity_mm_s_q8[axis], kept_q16, 16);
    }
}

int32_t ih_kalman_sigma_mm_q8(const struct ih_kalman *filter)
{
    return (int32_t)ih_isqrt_u64((uint64_t)filter->position_q8 << 8);
}
