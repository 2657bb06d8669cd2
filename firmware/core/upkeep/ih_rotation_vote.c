#include "upkeep/ih_rotation_vote.h"

#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "rig/ih_camera.h"

/* Points of a dot by quarters of a pixel from where it is said to be: 0.7 px of error still count. */
#define NEAR_BINS 3
static const uint8_t points[2 * NEAR_BINS + 1] = {3, 10, 15, 16, 15, 10, 3};
#define BIN_SHIFT 10 /* Q12 px to quarters */

/* One step of the lattice about an axis; the limits stand at the ends. */
static int32_t step_rad_q30(int32_t steps)
{
    return IH_ROTATION_VOTE_MAX_RAD_Q30 * 2 / (steps - 1);
}

static int32_t slope_px_q4(const struct ih_calibration *c, const struct ih_line *line,
                           int64_t du_q20, int64_t dv_q20)
{
    /* A focal length of 2^29 in Q16 times 17 in Q20: below 2^53.1. */
    int64_t u_px_q4 = ih_mul_shift(c->fx_px_q16, du_q20, 32);
    int64_t v_px_q4 = ih_mul_shift(c->fy_px_q16, dv_q20, 32);
    return (int32_t)ih_shift_round(v_px_q4 * line->dir_u_q30 - u_px_q4 * line->dir_v_q30, 30);
}

void ih_rotation_vote_slopes(const struct ih_rig *rig, struct ih_rotation_vote_slopes *out)
{
    const int64_t one_q20 = 1 << 20;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_calibration *c = &rig->calibration;
        const struct ih_line *line = &rig->line[slot];
        const int32_t *ray = c->ray_q30[slot];
        int32_t *slope = out->px_q4[slot];
        int64_t x_q20 = ih_div_round(ray[0] * one_q20, ray[2]);
        int64_t y_q20 = ih_div_round(ray[1] * one_q20, ray[2]);
        int64_t xy_q20 = ih_mul_shift(x_q20, y_q20, 20);
        slope[0] = slope_px_q4(c, line, -xy_q20, -one_q20 - ih_mul_shift(y_q20, y_q20, 20));
        slope[1] = slope_px_q4(c, line, one_q20 + ih_mul_shift(x_q20, x_q20, 20), xy_q20);
        slope[2] = slope_px_q4(c, line, -y_q20, x_q20);
        for (int axis = 0; axis < 3; axis++) {
            IH_IN_RANGE(slope[axis], -IH_RANGE_ROTATION_SLOPE_PX_Q4, IH_RANGE_ROTATION_SLOPE_PX_Q4);
        }
    }
}

/* w x v; both below 2^30.1. */
static void cross_q30(const int32_t w_q30[3], const int32_t v_q30[3], int32_t out_q30[3])
{
    for (int axis = 0; axis < 3; axis++) {
        int next = (axis + 1) % 3;
        int last = (axis + 2) % 3;
        out_q30[axis] = (int32_t)ih_shift_round(
            (int64_t)w_q30[next] * v_q30[last] - (int64_t)w_q30[last] * v_q30[next], 30);
    }
}

void ih_rotation_vote_calibration(const struct ih_calibration *nominal,
                                  const int32_t rotation_rad_q30[3], struct ih_calibration *out)
{
    *out = *nominal;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        int32_t first_q30[3], second_q30[3];
        cross_q30(rotation_rad_q30, nominal->ray_q30[slot], first_q30);
        cross_q30(rotation_rad_q30, first_q30, second_q30);
        for (int axis = 0; axis < 3; axis++) {
            out->ray_q30[slot][axis] +=
                first_q30[axis] + (int32_t)ih_shift_round(second_q30[axis], 1);
        }
    }
}

static void undistort_dots(const struct ih_dots *dots, const struct ih_rig *rig,
                           struct ih_rotation_vote_scratch *scratch)
{
    for (int32_t i = 0; i < dots->dot_count; i++) {
        ih_camera_undistort_pixel(rig, dots->dot[i].u_px_q12, dots->dot[i].v_px_q12,
                                  &scratch->u_px_q12[i], &scratch->v_px_q12[i]);
    }
}

static void add_place(struct ih_rotation_vote_scratch *scratch, int32_t bin)
{
    for (int32_t k = -NEAR_BINS; k <= NEAR_BINS; k++) {
        uint8_t *there = &scratch->there[bin + k];
        *there = *there > points[k + NEAR_BINS] ? *there : points[k + NEAR_BINS];
    }
}

/* How far across a slot's line dots lie, near its working range. A turn moves a dot along the line,
 * too, by up to margin. Products as in ih_labels: below 2^59.4. */
static void look_across(const struct ih_dots *dots, const struct ih_line *line,
                        int64_t margin_px_q12, struct ih_rotation_vote_scratch *scratch)
{
    memset(scratch->there, 0, sizeof scratch->there);
    for (int32_t i = 0; i < dots->dot_count; i++) {
        int64_t du = scratch->u_px_q12[i] - (int64_t)line->infinity_u_px_q12;
        int64_t dv = scratch->v_px_q12[i] - (int64_t)line->infinity_v_px_q12;
        int64_t t = ih_shift_round(du * line->dir_u_q30 + dv * line->dir_v_q30, 30);
        int64_t bin =
            (ih_shift_round(dv * line->dir_u_q30 - du * line->dir_v_q30, 30) >> BIN_SHIFT) +
            IH_ROTATION_VOTE_REACH;
        if (t >= line->t_far_px_q12 - margin_px_q12 && t <= line->t_near_px_q12 + margin_px_q12 &&
            bin >= NEAR_BINS && bin < 2 * IH_ROTATION_VOTE_REACH - NEAR_BINS) {
            add_place(scratch, (int32_t)bin);
        }
    }
}

void ih_rotation_vote_axes(const struct ih_rig *rig, int32_t axis_q30[2][2])
{
    const struct ih_line *middle = &rig->line[IH_SLOTS / 2];
    axis_q30[0][0] = middle->dir_u_q30;
    axis_q30[0][1] = middle->dir_v_q30;
    axis_q30[1][0] = -middle->dir_v_q30;
    axis_q30[1][1] = middle->dir_u_q30;
}

/* Of a slot, the points of every turn of the lattice. */
static void add_votes(const struct ih_rotation_vote_scratch *scratch, const int64_t step_px_q34[3],
                      struct ih_rotation_vote_votes *votes)
{
    uint16_t *vote = votes->vote;
    for (int32_t roll = -(IH_ROTATION_VOTE_STEPS_ROLL / 2); roll <= IH_ROTATION_VOTE_STEPS_ROLL / 2;
         roll++) {
        for (int32_t across = -(IH_ROTATION_VOTE_STEPS_ACROSS / 2);
             across <= IH_ROTATION_VOTE_STEPS_ACROSS / 2; across++) {
            int64_t place_px_q34 = roll * step_px_q34[2] + across * step_px_q34[1] -
                                   IH_ROTATION_VOTE_STEPS_ALONG / 2 * step_px_q34[0];
            for (int32_t along = 0; along < IH_ROTATION_VOTE_STEPS_ALONG; along++) {
                int64_t bin = (place_px_q34 >> (34 - 12 + BIN_SHIFT)) + IH_ROTATION_VOTE_REACH;
                if (bin >= 0 && bin < 2 * IH_ROTATION_VOTE_REACH) {
                    *vote = (uint16_t)(*vote + scratch->there[bin]);
                }
                vote++;
                place_px_q34 += step_px_q34[0];
            }
        }
    }
}

void ih_rotation_vote_vote(const struct ih_dots *dots, const struct ih_rig *rig,
                           const struct ih_rotation_vote_slopes *slopes,
                           struct ih_rotation_vote_scratch *scratch,
                           struct ih_rotation_vote_votes *votes)
{
    const struct ih_calibration *c = &rig->calibration;
    int64_t margin_px_q12 =
        ih_mul_shift(ih_max_s32(c->fx_px_q16, c->fy_px_q16), IH_ROTATION_VOTE_MAX_RAD_Q30, 34);
    int32_t axis_q30[2][2];
    ih_rotation_vote_axes(rig, axis_q30);
    undistort_dots(dots, rig, scratch);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int32_t *slope = slopes->px_q4[slot];
        int64_t step_px_q34[3];
        for (int k = 0; k < 2; k++) {
            int64_t along_px_q4 = ih_shift_round(
                (int64_t)slope[0] * axis_q30[k][0] + (int64_t)slope[1] * axis_q30[k][1], 30);
            step_px_q34[k] = along_px_q4 * step_rad_q30(k == 0 ? IH_ROTATION_VOTE_STEPS_ALONG
                                                               : IH_ROTATION_VOTE_STEPS_ACROSS);
        }
        step_px_q34[2] = (int64_t)slope[2] * step_rad_q30(IH_ROTATION_VOTE_STEPS_ROLL);
        look_across(dots, &rig->line[slot], margin_px_q12, scratch);
        add_votes(scratch, step_px_q34, votes);
    }
}

void ih_rotation_vote_elect(const struct ih_rotation_vote_votes *votes, const struct ih_rig *rig,
                            struct ih_rotation_vote_winner *out)
{
    int32_t best = 0;
    int32_t sum = 0;
    for (int32_t i = 0; i < IH_ROTATION_VOTE_VOTES; i++) {
        best = votes->vote[i] > votes->vote[best] ? i : best;
        sum += votes->vote[i];
    }
    int64_t along = best % IH_ROTATION_VOTE_STEPS_ALONG - IH_ROTATION_VOTE_STEPS_ALONG / 2;
    int64_t across = best / IH_ROTATION_VOTE_STEPS_ALONG % IH_ROTATION_VOTE_STEPS_ACROSS -
                     IH_ROTATION_VOTE_STEPS_ACROSS / 2;
    int32_t roll = best / (IH_ROTATION_VOTE_STEPS_ALONG * IH_ROTATION_VOTE_STEPS_ACROSS) -
                   IH_ROTATION_VOTE_STEPS_ROLL / 2;
    int64_t along_rad_q30 = along * step_rad_q30(IH_ROTATION_VOTE_STEPS_ALONG);
    int64_t across_rad_q30 = across * step_rad_q30(IH_ROTATION_VOTE_STEPS_ACROSS);
    int32_t axis_q30[2][2];
    ih_rotation_vote_axes(rig, axis_q30);
    for (int k = 0; k < 2; k++) {
        out->rotation_rad_q30[k] = (int32_t)ih_shift_round(
            along_rad_q30 * axis_q30[0][k] + across_rad_q30 * axis_q30[1][k], 30);
    }
    out->rotation_rad_q30[2] = roll * step_rad_q30(IH_ROTATION_VOTE_STEPS_ROLL);
    out->vote = votes->vote[best];
    out->vote_of_none = votes->vote[IH_ROTATION_VOTE_VOTES / 2];
    out->vote_mean = sum / IH_ROTATION_VOTE_VOTES;
}
