/* ih_surface - a smooth surface z = f(x, y) through the samples (paper, section 3.1).
 *
 * In:    samples.
 * Out:   depth on a regular grid of IH_SURFACE_GRID x IH_SURFACE_GRID nodes; the final weight of each sample.
 * Method: z = mean + sum_n c_n B(x - x_n, y - y_n), B = sqrt(dx^2 + dy^2 + 1) in field units, on
 *        centres^2 centres; mean is the plain mean of the samples' depths. Weighted least squares by normal equations
 *        N = R^T R, R's rows being the basis rows times the root weight; ridge: N's diagonal times (1 + 1e-5). Then one
 *        Huber step: samples off by more than huber_mm get the weight huber / |residual| and the system is solved
 *        again. Or, by default, they are moved to where their residual is huber_mm, which has the same effect: then N
 *        and its factor stay, and as many heads are found; the paper's nests alone miss some of them (226 instead of
 *        231 of 276).
 *        N is summed from rows of 14 bits, scaled column by column, and only leads to the solution: the residual,
 *        R^T W (z - B c) minus the ridge's part, is computed from rows of full precision, solved for and added to c,
 *        after each of both systems, until it is small or stops shrinking. So the factor may be inexact, too: all but
 *        32 of its rows have 16 bits. Where that is not enough, which pivots or growing corrections show, it is made
 *        again with 27 bits in all rows.
 *        Only samples that were farther off than 3/4 of huber_mm before the last correction get a new weight. The second
 *        N is the first one with the rows of samples exchanged whose weight changed. So is the right side, of which the
 *        first system left the ridge's part only. Moved samples change the right side alone.
 * Scaling and overflow: field units, samples within IH_SAMPLES_REACH, centres within 20: dx and dy below 60, B below
 *        85 = 2^6.5, in Q20 below 2^26.5. Short rows: the farthest corner of the box around the samples is 2^14 - 2;
 *        ih_normal_equations has their sums. Weights are enlarged until the largest is at least 1/2. Residuals times
 *        weights are limited to 2^27, their products with B sum below 2^62. N is scaled by 0.995 / sqrt(N_ii) on both
 *        sides to diagonal 0.99 in Q30; the ridge keeps the smallest pivot above 2.6e-3 with weights as ih_samples
 *        makes them. docs/numerics.md continues.
 * Error: within 0.2 mm of the float64 solution of the same system, everywhere on the grid, for depths that span up to
 *        1.5 m (ih_samples clips them); it grows with the span. 0.05 mm on frames.
 * Cost:  n = centres^2: samples x 3 n roots of ih_multiquadric, n more for each far one, as often multiplied twice;
 *        samples x n (n + 8) / 2 short multiply-adds, a factorisation, four solutions; grid x n / 2 multiply-adds.
 *        With weights instead of moves twice as many multiply-adds of samples whose weight changed, and a second
 *        factorisation. So 64 centres cost a third of 144.
 */
#ifndef IH_SURFACE_H
#define IH_SURFACE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "rig/ih_rig.h"
#include "surface/ih_samples.h"

/* The grid's step is 10/11 field units: node k is at (k - (IH_SURFACE_GRID - 1) / 2) steps. All centres are on nodes,
 * 48 / centres steps apart, symmetric about the middle; so the basis on the grid is a table of whole steps. */
#define IH_SURFACE_CENTRES_STEPS 48
/* The paper's nests need 12 centres, over +-20 field units (+-10 dot pitches): 144 find 231 heads of the six
 * sequences, 100 find 222 and 64 find 198. With a scan and a fit, which use the points themselves, 8 over +-19 find as
 * many as 12: docs/design.md. RAM suffices for 12. */
#define IH_SURFACE_CENTRES_MAX 12
#define IH_SURFACE_CENTRES_FEW 8
#define IH_SURFACE_TERMS_FEW (IH_SURFACE_CENTRES_FEW * IH_SURFACE_CENTRES_FEW)
#define IH_SURFACE_TERMS_MAX (IH_SURFACE_CENTRES_MAX * IH_SURFACE_CENTRES_MAX)
#define IH_SURFACE_GRID 47
#define IH_SURFACE_STEP_NUMERATOR 10
#define IH_SURFACE_STEP_DENOMINATOR 11
/* Whole steps between a node and a centre: 0 .. 23 + 22. */
#define IH_SURFACE_STEPS (IH_SURFACE_GRID - 1)
/* Away from the samples the surface is an extrapolation and can dive, and contours count from its nearest node. So nodes
 * are at most this far before the nearest sample, at least 1 mm away, and at most DEPTH_MAX. Between samples the
 * overshoot is below half of this. */
#define IH_SURFACE_OVERSHOOT_MM 200
#define IH_SURFACE_DEPTH_MAX_MM (2 * IH_DEPTH_MAX_MM)
/* Minimum number of samples of a surface. */
#define IH_SURFACE_SAMPLES_MIN 16

struct ih_surface_params {
    int32_t ridge_q30; /* added to the diagonal, relative */
    int32_t huber_mm;
    /* in a row and in a column: IH_SURFACE_CENTRES_MAX or IH_SURFACE_CENTRES_FEW */
    int32_t centres;
    bool is_moving; /* samples too far off are moved, instead of getting a smaller weight */
};

struct ih_surface {
    bool valid;      /* false: too few samples, or none with weight */
    int32_t centres; /* in a row, as in the parameters */
    int32_t downweighted_count;
    int32_t mean_mm_q8;
    struct ih_field field;
    int32_t nearest_mm_q8; /* of all nodes of the grid */
    /* By sample, after the Huber step. Of a moved one, the weight that has the same effect without the move. */
    int32_t root_weight_q15[IH_SLOTS];
    int32_t depth_mm_q8[IH_SURFACE_GRID][IH_SURFACE_GRID]; /* [y][x] */
};

struct ih_surface_scratch; /* ih_surface_scratch.h */

IH_BEGIN_DECLS

void ih_surface_params_default(struct ih_surface_params *params);

void ih_surface_fit(const struct ih_samples *samples, const struct ih_field *field,
                    const struct ih_surface_params *params, struct ih_surface_scratch *scratch,
                    struct ih_surface *out);

IH_END_DECLS

#endif
