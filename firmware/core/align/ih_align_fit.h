/* ih_align_fit - the five numbers that explain how far dots lie across their lines. Private to align.
 *
 * Method: least squares with weights (1 + (r / s)^2)^-2 and a prior about zero; s falls from step to step. The prior is
 *         as wide as a rig may be wrong, and narrow for what dots hardly show.
 */
#ifndef IH_ALIGN_FIT_H
#define IH_ALIGN_FIT_H

#include <stdint.h>

#include "align/ih_align_pairs.h"
#include "rig/ih_rig.h"

/* Noise of a dot across its line; the scales of a fit's first and last steps. */
#define IH_ALIGN_NOISE_PX_Q12 614        /* 0.15 px */
#define IH_ALIGN_FIRST_SCALE_PX_Q12 1229 /* 0.3 px */
#define IH_ALIGN_SCALE_PX_Q12 819        /* 0.2 px */

#define IH_ALIGN_ENTRIES (IH_ALIGN_AXES * (IH_ALIGN_AXES + 1) / 2)

/* Sums over pairs, packed triangle: w s_k s_l, w s_k r in px. */
struct ih_align_sums {
    int64_t normal_q24[IH_ALIGN_ENTRIES];
    int64_t right_px_q24[IH_ALIGN_AXES];
    int64_t weight_q14;
};

/* Entry of the symmetric matrix. */
static inline int64_t ih_align_entry(const struct ih_align_sums *sums, int row, int column)
{
    const int low = row < column ? row : column, high = row < column ? column : row;
    return sums->normal_q24[high * (high + 1) / 2 + low];
}

/* The numbers in pixels, and as angles or relative changes. */
int32_t ih_align_rad_q30(int32_t px_q12, const struct ih_rig *rig);
int32_t ih_align_px_q12(int32_t rad_q30, const struct ih_rig *rig);

/* A prior of the five, one standard deviation, px. */
void ih_align_prior(const struct ih_rig *rig, int32_t sigma_px_q12[IH_ALIGN_AXES]);

/* Add what pairs show, with weights against what a guess leaves; the right side is of the five themselves. */
void ih_align_sums_add(const struct ih_align_pairs *pairs,
                       const int32_t guess_px_q12[IH_ALIGN_AXES], int32_t scale_px_q12,
                       struct ih_align_sums *sums);

/* As if one of the five were known. */
void ih_align_sums_hold(struct ih_align_sums *sums, enum ih_align_axis axis, int32_t value_px_q12);

/* Solve with that prior. sigma_px_q12 may be NULL; noise_px_q12: of one dot across its line. */
void ih_align_solve(const struct ih_align_sums *sums, const int32_t prior_px_q12[IH_ALIGN_AXES],
                    int32_t noise_px_q12, int32_t moved_px_q12[IH_ALIGN_AXES],
                    int32_t sigma_px_q12[IH_ALIGN_AXES]);

/* One step: weights against what the last one left, then solved. sigma_px_q12 may be NULL. */
void ih_align_step(const struct ih_align_pairs *pairs, const int32_t prior_px_q12[IH_ALIGN_AXES],
                   int32_t scale_px_q12, struct ih_align_sums *sums,
                   int32_t moved_px_q12[IH_ALIGN_AXES], int32_t sigma_px_q12[IH_ALIGN_AXES]);

/* Root mean square, over those pairs, of what the five move dots by. */
int32_t ih_align_rms_px_q12(const struct ih_align_sums *sums,
                            const int32_t moved_px_q12[IH_ALIGN_AXES]);

#endif
