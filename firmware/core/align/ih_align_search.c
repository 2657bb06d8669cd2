#include "align/ih_align_search.h"

#include <stddef.h>
#include <string.h>

#include "align/ih_align_fit.h"
#include "base/ih_fix.h"

/* A search looks so much nearer than the working range, and beyond infinity: a rotation moves dots along their lines, too. */
#define SEARCH_MARGIN_PX_Q12 (10 * 4096)
/* Bins of the first vote on one side of a line, and how many of them are from dot to dot: with 28 px between dots they are
 * half a pixel wide, and a line's neighbours are beyond the last one. */
#define BAND_BINS 32
#define PITCH_BINS 56
#define BIN_MIN_PX_Q12 819         /* 0.2 px */
#define BIN_MAX_PX_Q12 2048        /* 0.5 px */
#define FIT_PX_Q12 4096            /* 1 px */
#define DEPTH_STEP_RAD_Q30 4685041 /* 0.25 degrees, from where the fit finds its way */
#define PLANE_SLOTS 5              /* of so many slots one shows a plane */
/* Before a wall just beyond the range every frame asks for depth. Of 328 such fits before right rigs, when less than half of
 * the dots had labels, 9 were beyond 3 times their uncertainty, and one beyond 5 times and 0.1 degrees. */
#define DEPTH_FAR_SIGMAS 5
/* Against this scale a plane's pairs weigh all the same. */
#define EQUAL_SCALE_PX_Q12 (64 * 4096)
/* So far a plane may be from the dots. If the fit began with the next scale, 840 of 7,344 single frames would be searched
 * in vain, not 790. */
#define PLANE_SCALE_PX_Q12 2048 /* 0.5 px */

static int32_t bin_of(const struct ih_rig *rig)
{
    const int64_t pitch_px_q12 =
        ih_mul_shift(2 * (int64_t)rig->half_pitch_q28, rig->calibration.fx_px_q16, 28 + 4);
    return (int32_t)ih_min_s64(ih_max_s64(pitch_px_q12 / PITCH_BINS, BIN_MIN_PX_Q12),
                               BIN_MAX_PX_Q12);
}

/* All dots within the band of a search, against the rig's lines. */
static void find_all(const struct ih_align_axes *axes, const struct ih_rig *rig,
                     const struct ih_dot_rows *rows, struct ih_align_scratch *out)
{
    const struct ih_align_band band = {BAND_BINS * bin_of(rig), SEARCH_MARGIN_PX_Q12};
    int32_t first = 0, total = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        struct ih_align_dot dot[IH_ALIGN_NEAR_MAX];
        const int32_t count = ih_align_near(rows, &rig->line[slot], band, &first, dot);
        ih_align_slopes(rig, axes, slot, out->slope_q12[slot]);
        out->found_count[slot] = (uint8_t)ih_min_s32(count, IH_ALIGN_FOUND_MAX - total);
        for (int32_t i = 0; i < out->found_count[slot]; i++) {
            out->found_px_q10[total++] = (int16_t)(dot[i].across_px_q12 >> 2);
        }
    }
}

/* Where a plane says that a slot's line is. */
static int32_t shift_of(const int16_t slope_q12[IH_ALIGN_AXES], int32_t slot,
                        const struct ih_align_plane *plane)
{
    return ih_align_plane_px_q12(plane, slot) +
           (int32_t)ih_mul_shift(plane->depth_px_q12, slope_q12[IH_ALIGN_DEPTH], 12);
}

/* Of what was found, the pairs around a plane. */
static void collect(const struct ih_align_plane *plane, const struct ih_align_scratch *scratch,
                    struct ih_align_pairs *out)
{
    const int16_t *found_px_q10 = scratch->found_px_q10;
    out->count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int16_t *end = &found_px_q10[scratch->found_count[slot]];
        const int32_t shift_px_q12 = shift_of(scratch->slope_q12[slot], slot, plane);
        for (; found_px_q10 < end; found_px_q10++) {
            const int32_t across = *found_px_q10 * 4;
            if (ih_abs_s32(across - shift_px_q12) < FIT_PX_Q12 && out->count < IH_ALIGN_PAIRS_MAX) {
                struct ih_align_pair *pair = &out->pair[out->count++];
                memcpy(pair->slope_q12, scratch->slope_q12[slot], sizeof pair->slope_q12);
                pair->across_px_q12 = across;
            }
        }
    }
}

/* Votes of all that was found, against a plane; the best planes. */
static void vote(const struct ih_align_grid *grid, const struct ih_align_plane *around,
                 struct ih_align_scratch *scratch, struct ih_align_plane *peak)
{
    const int16_t *found_px_q10 = scratch->found_px_q10;
    ih_align_votes_clear(&scratch->at.votes, grid);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int16_t *end = &found_px_q10[scratch->found_count[slot]];
        const int32_t shift_px_q12 = ih_align_plane_px_q12(around, slot);
        uint16_t *histogram = ih_align_votes_of(&scratch->at.votes, grid, slot);
        for (; found_px_q10 < end; found_px_q10++) {
            ih_align_votes_add(histogram, grid, *found_px_q10 * 4 - shift_px_q12);
        }
    }
    ih_align_votes_count(&scratch->at.votes, grid, scratch->slope_q12, peak);
}

/* How many steps a rig that is as wrong as may be moves one edge of the pattern against its middle. */
static int32_t steps_of(const int32_t prior_px_q12[IH_ALIGN_AXES],
                        const int16_t first_q12[IH_ALIGN_AXES],
                        const int16_t last_q12[IH_ALIGN_AXES], int32_t step_px_q12)
{
    int64_t range_q24 = 0;
    for (int k = IH_ALIGN_ROLL; k <= IH_ALIGN_FOCAL; k++) {
        range_q24 += (int64_t)prior_px_q12[k] * ih_abs_s32(last_q12[k] - first_q12[k]) / 2;
    }
    const int32_t steps = (int32_t)ih_shift_round(range_q24, 12) / step_px_q12 + 1;
    return ih_min_s32(steps, IH_ALIGN_STEPS_MAX);
}

/* The best plane of all that was found. */
static void search_plane(const int32_t prior_px_q12[IH_ALIGN_AXES], const struct ih_rig *rig,
                         struct ih_align_scratch *scratch, struct ih_align_plane *best)
{
    const int32_t middle = IH_GRID / 2;
    const int16_t(*slope_q12)[IH_ALIGN_AXES] = scratch->slope_q12;
    struct ih_align_grid coarse = {.side = 10,
                                   .slots = 2,
                                   .bin_count = 2 * BAND_BINS,
                                   .bin_px_q12 = bin_of(rig),
                                   .peak_bins = 2,
                                   .peak_count = IH_ALIGN_PEAKS,
                                   .step_px_q12 = 3072};
    coarse.column_steps = steps_of(prior_px_q12, slope_q12[middle * IH_GRID],
                                   slope_q12[middle * IH_GRID + IH_GRID - 1], coarse.step_px_q12);
    coarse.row_steps = steps_of(prior_px_q12, slope_q12[middle],
                                slope_q12[(IH_GRID - 1) * IH_GRID + middle], coarse.step_px_q12);
    const struct ih_align_grid fine = {.side = 5,
                                       .slots = 4,
                                       .bin_count = 32,
                                       .bin_px_q12 = 819,
                                       .peak_bins = 3,
                                       .peak_count = 1,
                                       .step_px_q12 = 1638,
                                       .column_steps = 2,
                                       .row_steps = 2,
                                       .depth_steps = 2,
                                       .depth_step_px_q12 =
                                           ih_align_px_q12(DEPTH_STEP_RAD_Q30, rig)};
    static const struct ih_align_plane none;
    struct ih_align_plane peak[IH_ALIGN_PEAKS], fine_peak;
    vote(&coarse, &none, scratch, peak);
    best->score = 0;
    /* A plane with less than half of the best one's score is not tried. */
    for (int32_t i = 0; i < IH_ALIGN_PEAKS && 2 * peak[i].score > peak[0].score; i++) {
        vote(&fine, &peak[i], scratch, &fine_peak);
        if (fine_peak.score > best->score) {
            *best = fine_peak;
            best->shift_px_q12 += peak[i].shift_px_q12;
            best->column_px_q12 += peak[i].column_px_q12;
            best->row_px_q12 += peak[i].row_px_q12;
        }
    }
}

/* The five numbers that come nearest to a plane, and from there those of the pairs around it. Depth is 0 unless it is so
 * many times its uncertainty. */
static void fit_plane(const int32_t prior_px_q12[IH_ALIGN_AXES], const struct ih_rig *rig,
                      const struct ih_align_plane *plane, int32_t depth_sigmas,
                      struct ih_align_scratch *scratch, int32_t moved_px_q12[IH_ALIGN_AXES])
{
    struct ih_align_pairs *pairs = &scratch->at.pairs;
    struct ih_align_sums sums;
    int32_t sigma_px_q12[IH_ALIGN_AXES];
    pairs->count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot += PLANE_SLOTS) {
        struct ih_align_pair *pair = &pairs->pair[pairs->count++];
        memcpy(pair->slope_q12, scratch->slope_q12[slot], sizeof pair->slope_q12);
        pair->across_px_q12 = shift_of(scratch->slope_q12[slot], slot, plane);
    }
    memset(moved_px_q12, 0, IH_ALIGN_AXES * sizeof *moved_px_q12);
    ih_align_step(pairs, prior_px_q12, EQUAL_SCALE_PX_Q12, &sums, moved_px_q12, NULL);
    collect(plane, scratch, pairs);
    ih_align_step(pairs, prior_px_q12, PLANE_SCALE_PX_Q12, &sums, moved_px_q12, NULL);
    ih_align_step(pairs, prior_px_q12, IH_ALIGN_FIRST_SCALE_PX_Q12, &sums, moved_px_q12, NULL);
    ih_align_step(pairs, prior_px_q12, IH_ALIGN_SCALE_PX_Q12, &sums, moved_px_q12, sigma_px_q12);
    const int32_t depth_min_px_q12 = ih_max_s32(depth_sigmas * sigma_px_q12[IH_ALIGN_DEPTH],
                                                ih_align_px_q12(IH_ALIGN_DEPTH_MIN_RAD_Q30, rig));
    if (ih_abs_s32(moved_px_q12[IH_ALIGN_DEPTH]) <= depth_min_px_q12) {
        ih_align_sums_hold(&sums, IH_ALIGN_DEPTH, 0);
        ih_align_solve(&sums, prior_px_q12, IH_ALIGN_NOISE_PX_Q12, moved_px_q12, NULL);
    }
}

bool ih_align_search_depth(const struct ih_align_axes *axes,
                           const int32_t prior_px_q12[IH_ALIGN_AXES], const struct ih_rig *rig,
                           const struct ih_dot_rows *rows, struct ih_align_scratch *scratch,
                           int32_t moved_px_q12[IH_ALIGN_AXES])
{
    static const struct ih_align_plane none;
    find_all(axes, rig, rows, scratch);
    fit_plane(prior_px_q12, rig, &none, DEPTH_FAR_SIGMAS, scratch, moved_px_q12);
    return ih_abs_s32(moved_px_q12[IH_ALIGN_DEPTH]) >
           ih_align_px_q12(IH_ALIGN_DEPTH_FAR_RAD_Q30, rig);
}

bool ih_align_search(const struct ih_align_axes *axes, const int32_t prior_px_q12[IH_ALIGN_AXES],
                     const struct ih_rig *rig, const struct ih_dot_rows *rows,
                     struct ih_align_scratch *scratch, int32_t moved_px_q12[IH_ALIGN_AXES])
{
    struct ih_align_plane plane;
    find_all(axes, rig, rows, scratch);
    search_plane(prior_px_q12, rig, scratch, &plane);
    if (plane.score <= 0) {
        return false;
    }
    fit_plane(prior_px_q12, rig, &plane, IH_ALIGN_DEPTH_SIGMAS, scratch, moved_px_q12);
    return true;
}
