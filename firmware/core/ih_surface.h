/* ih_surface - a smooth surface z = f(x, y) through the samples (paper, section 3.1).
 *
 * In:    samples.
 * Out:   depth on a regular grid of IH_SURFACE_GRID x IH_SURFACE_GRID nodes; the weight that each
 *        sample ended with.
 * Way:   z = mean + sum_n c_n B(x - x_n, y - y_n), B = sqrt(dx^2 + dy^2 + 1) in field units, on
 *        IH_SURFACE_CENTRES^2 centres; mean is the plain mean of the samples' depths. Weighted
 *        least squares by normal equations N = R^T R, R's rows being the basis rows times the root
 *        weight; ridge: N's diagonal times (1 + 1e-5). Then one Huber step: samples off by more
 *        than huber_mm get the weight huber / |residual| and the system is solved again.
 * Scaling and overflow: field units, samples within IH_SAMPLES_REACH, centres within 20: dx and
 *        dy below 60, B below 85 = 2^6.5, in Q20 below 2^26.5; products below 2^53, sums over 361
 *        rows below 2^61.5. N is scaled by r_i r_j (r = 0.995 / sqrt(N_ii)) to diagonal 0.99 and
 *        rounded to Q30; the ridge keeps the least pivot above 3e-3.
 * Error: within 0.2 mm of the float64 solution of the same system, everywhere on the grid, for
 *        depths that span up to 1.5 m (ih_samples clips them); it grows with the span.
 * Cost:  samples x 288 square roots; samples x 10,944 multiply-adds, and once more about half of
 *        that; two factorisations of n = 144; grid x 72 multiply-adds.
 */
#ifndef IH_SURFACE_H
#define IH_SURFACE_H

#include "ih_basis.h"
#include "ih_cholesky.h"
#include "ih_normal.h"
#include "ih_samples.h"

/* Centres in a row and in a column, over +-20 field units (+-10 dot pitches). */
#define IH_SURFACE_CENTRES 12
#define IH_SURFACE_TERMS (IH_SURFACE_CENTRES * IH_SURFACE_CENTRES)
/* Grid step = a quarter of the centres' step, so that the basis on the grid is a table of whole
 * steps: 40/11/4 = 10/11 field units. Node k stands at (k - (IH_SURFACE_GRID - 1) / 2) steps. */
#define IH_SURFACE_GRID 47
#define IH_SURFACE_STEPS_PER_CENTRE 4
#define IH_SURFACE_STEP_NUMERATOR 10
#define IH_SURFACE_STEP_DENOMINATOR 11
/* Whole steps between a node and a centre: 0 .. 23 + 22. */
#define IH_SURFACE_STEPS (IH_SURFACE_GRID - 1)
/* Where there are no samples the surface is an extrapolation and can dive; the cuts count from its
 * nearest node. So nodes are limited to this far before the nearest sample, to at least 1 mm, and
 * to DEPTH_MAX. Between samples it overshoots by less than half of that. */
#define IH_SURFACE_OVERSHOOT_MM 200
#define IH_SURFACE_DEPTH_MAX_MM (2 * IH_DEPTH_MAX_MM)
/* Fewer samples than this make no surface. */
#define IH_SURFACE_SAMPLES_MIN 16

struct ih_surface_params {
    int32_t ridge_q30; /* added to the diagonal, relative */
    int32_t huber_mm;
};

struct ih_surface {
    bool valid; /* false: too few samples, or no positive definite system */
    int32_t downweighted_count;
    int32_t mean_mm_q8;
    struct ih_field field;
    int32_t nearest_mm_q8;                                 /* least node of the grid */
    int32_t root_weight_q15[IH_SLOTS];                     /* by sample, after the Huber step */
    int32_t depth_mm_q8[IH_SURFACE_GRID][IH_SURFACE_GRID]; /* [y][x] */
};

/* Lines of the normal equations that outlive the first factor: for the second, only the samples whose
 * weight changed are taken away from them and added again. The other lines are summed anew, the factor
 * stands in their place. 8 lines more cost 8 kB and save a tenth of the second sum; from 104 on a line
 * that is scaled in place is never in the way of one that is not yet. */
#define IH_SURFACE_KEPT 120

/* The grid is evaluated in two halves that are mirrored, with the middle one, and so are the centres. */
#define IH_SURFACE_HALF ((IH_SURFACE_GRID + 1) / 2)
#define IH_SURFACE_HALF_CENTRES (IH_SURFACE_CENTRES / 2)

struct ih_surface_scratch {
    union {
        uint64_t q40[IH_NORMAL_LINE(IH_SURFACE_KEPT)]; /* lower triangle, line by line */
        struct {
            int32_t sum_q20[IH_SURFACE_STEPS][IH_SURFACE_HALF_CENTRES][IH_SURFACE_HALF];
            int32_t difference_q20[IH_SURFACE_STEPS][IH_SURFACE_HALF_CENTRES][IH_SURFACE_HALF];
        } folded; /* of table_q20 */
    } kept;
    union {
        uint64_t others_q40[IH_NORMAL_LINE(IH_SURFACE_TERMS) - IH_NORMAL_LINE(IH_SURFACE_KEPT)];
        int32_t factor_q30[IH_CHOLESKY_PACKED(IH_SURFACE_TERMS)]; /* scaled, then factored */
        int32_t table_q20[IH_SURFACE_STEPS][2 * IH_SURFACE_STEPS - 1];
    } of;
    int64_t right_q28[IH_SURFACE_TERMS];
    uint64_t square_q32[IH_SURFACE_TERMS]; /* of its distances from the centres, and 1 */
    uint32_t basis_q20[IH_SURFACE_TERMS];  /* a sample's row */
    ih_normal_entry row_q20[IH_NORMAL_ROWS][IH_SURFACE_TERMS]; /* such rows, weighted */
    uint32_t scale[IH_SURFACE_TERMS];   /* 0.995 * 2^51 / sqrt(N_ii), N in Q40 */
    int32_t solution[IH_SURFACE_TERMS]; /* the right side before */
    int32_t solution_shift; /* coefficient = solution / 2^solution_shift, mm per field unit */
    int32_t centre_q16[IH_SURFACE_CENTRES]; /* places of the centres in a row, field units */
};

void ih_surface_params_default(struct ih_surface_params *params);

void ih_surface_fit(const struct ih_samples *samples, const struct ih_field *field,
                    const struct ih_surface_params *params, struct ih_surface_scratch *scratch,
                    struct ih_surface *out);

#endif
