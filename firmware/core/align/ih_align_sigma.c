#include "align/ih_align_sigma.h"

#include "base/ih_fix.h"

/* What no number of frames shows, about the baseline, of depth, about the camera's axis: 0.015, 0.012, 0.002 degrees. */
static const int32_t floor_rad_q30[3] = {281102, 224882, 37480};
#define DEPTH_KNOWN_RAD_Q30 1874016 /* 0.1 degrees */
/* 0.9 degrees: times the square of 32 m in Q8 it is below 2^62, and no track gets there: 16 m, and 3 m/s for 2 s. */
#define DEPTH_UNKNOWN_RAD_Q30 (1 << 24)

/* One of the five, against where the rig's lines are. */
static int64_t sigma_of(const struct ih_align *align, int axis, int32_t mean_px_q12,
                        int32_t sigma_px_q12, const struct ih_rig *rig)
{
    const int64_t own = ih_align_rad_q30(sigma_px_q12, rig);
    const int64_t lag = ih_align_rad_q30(mean_px_q12 - align->moved_px_q12[axis], rig);
    const int64_t floor = floor_rad_q30[axis];
    return ih_isqrt_u64((uint64_t)(own * own) + (uint64_t)(lag * lag) + (uint64_t)(floor * floor));
}

void ih_align_set_sigma(struct ih_align *align, const int32_t mean_px_q12[IH_ALIGN_AXES],
                        const int32_t sigma_px_q12[IH_ALIGN_AXES], const struct ih_rig *rig)
{
    int64_t sigma_rad_q30[3];
    struct ih_alignment *now = &align->now;
    for (int k = 0; k < 3; k++) {
        sigma_rad_q30[k] = sigma_of(align, k, mean_px_q12[k], sigma_px_q12[k], rig);
    }
    now->depth_sigma_rad_q30 = ih_saturate_s32(sigma_rad_q30[IH_ALIGN_DEPTH]);
    now->is_depth_known = now->depth_sigma_rad_q30 <= DEPTH_KNOWN_RAD_Q30;
    for (int axis = 0; axis < 2; axis++) {
        const int64_t a =
            ih_mul_shift(sigma_rad_q30[IH_ALIGN_BASELINE], align->axes.along_q14[axis], 14);
        const int64_t b =
            ih_mul_shift(sigma_rad_q30[IH_ALIGN_DEPTH], align->axes.along_q14[1 - axis], 14);
        now->sigma_rad_q30[axis] =
            ih_saturate_s32(ih_isqrt_u64((uint64_t)(a * a) + (uint64_t)(b * b)));
    }
    now->sigma_rad_q30[2] = ih_saturate_s32(sigma_rad_q30[IH_ALIGN_ROLL]);
}

int32_t ih_align_depth_sigma_mm_q8(const struct ih_align *align, const struct ih_rig *rig,
                                   int32_t depth_mm_q8)
{
    const int64_t x = rig->calibration.origin_mm_q16[0], y = rig->calibration.origin_mm_q16[1];
    const int64_t baseline_mm_q16 = (int64_t)ih_isqrt_u64((uint64_t)(x * x + y * y)) + 1;
    const int64_t depth2_mm2_q8 = ih_mul_shift(depth_mm_q8, depth_mm_q8, 8);
    const int64_t aside_mm2_q16 = ih_mul_shift(
        depth2_mm2_q8, ih_min_s32(align->now.depth_sigma_rad_q30, DEPTH_UNKNOWN_RAD_Q30), 30 - 8);
    return (int32_t)ih_min_s64(ih_div_round(aside_mm2_q16 * (1 << 8), baseline_mm_q16),
                               IH_DEPTH_MAX_MM << 8);
}
