/* ih_surface - a smooth surface z = f(x, y) through the samples (paper, section 3.1).
 *
 * In:    samples.
 * Out:   depth on a regular grid of IH_SURFACE_GRID x IH_SURFACE_GRID nodes; the weight that each
 *        sample ended with.
 * Way:   z = mean + sum_n c_n B(x - x_n, y - y_n), B = sqrt(dx^2 + dy^2 + 1) in field units, on
 *        centres^2 centres; mean is the plain mean of the samples' depths. Weighted
 *        least squares by normal equations N = R^T R, R's rows being the basis rows times the root
 *        weight; ridge: N's diagonal times (1 + 1e-5). Then one Huber step: samples off by more
 *        than huber_mm get the weight huber / |residual| and the system is solved again. Or, by default, they
 *        are moved to where they are off by huber_mm, which pushes as much: then N and its factor stay as they are,
 *        and as many heads are found; the paper's nests alone lose some of them (226 instead of 231 of 276).
 *        N is summed from rows of 14 bits, scaled column by column, and only leads to the solution: what
 *        is left, R^T W (z - B c) less the ridge's share, is worked out from rows of full precision,
 *        solved for and added to c, once or more often after each of both systems, until it is small or
 *        does not become smaller. So its factor may be a little off too: all but 32 of its rows have
 *        16 bits; where that is not enough, which pivots or growing corrections tell, it is made again with 27 in all.
 *        Only samples that were farther off than 3/4 of huber_mm before the last correction are asked for
 *        their weight. The second N is made from the first by exchanging what samples brought whose weight
 *        changed, and so is the right side, of which the first system left nothing but the ridge's share. Of moved samples
 *        the right side alone changes.
 * Scaling and overflow: field units, samples within IH_SAMPLES_REACH, centres within 20: dx and
 *        dy below 60, B below 85 = 2^6.5, in Q20 below 2^26.5. Short rows: the farthest corner of the box
 *        around the samples is 2^14 - 2; ih_normal_equations has their sums. Weights are enlarged until the
 *        greatest is 1/2 or more. Residuals times weights are limited to 2^27, their products with B
 *        sum below 2^62. N is scaled by 0.995 / sqrt(N_ii) each way to diagonal 0.99 in Q30; the ridge keeps
 *        the least pivot above 2.6e-3 where weights are as ih_samples makes them. docs/numerics.md goes on.
 * Error: within 0.2 mm of the float64 solution of the same system, everywhere on the grid, for
 *        depths that span up to 1.5 m (ih_samples clips them); it grows with the span. 0.05 mm on frames.
 * Cost:  n = centres^2: samples x 3 n roots of ih_multiquadric, and of the far ones n more, as often multiplied twice;
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
#include "surface/ih_normal_equations.h"
#include "surface/ih_samples.h"

/* Nodes of the grid stand in steps of 10/11 field units: node k at (k - (IH_SURFACE_GRID - 1) / 2) steps. All
 * centres stand on nodes, 48 / centres steps apart, as many on both sides of the middle; so the basis on the grid
 * is a table of whole steps. */
#define IH_SURFACE_CENTRES_STEPS 48
/* The paper's nests need 12 centres, over +-20 field units (+-10 dot pitches): 144 find 231 heads of the six
 * sequences, 100 find 222 and 64 find 198. With a scan and a fit, which look at the points themselves, 8 over +-19
 * find as many as 12: docs/design.md. RAM is for 12. */
#define IH_SURFACE_CENTRES_MAX 12
#define IH_SURFACE_CENTRES_FEW 8
#define IH_SURFACE_TERMS_FEW (IH_SURFACE_CENTRES_FEW * IH_SURFACE_CENTRES_FEW)
#define IH_SURFACE_TERMS_MAX (IH_SURFACE_CENTRES_MAX * IH_SURFACE_CENTRES_MAX)
#define IH_SURFACE_GRID 47
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
    /* in a row and in a column: IH_SURFACE_CENTRES_MAX or IH_SURFACE_CENTRES_FEW */
    int32_t centres;
    bool is_moving; /* samples that are too far off are moved, instead of getting less weight */
};

struct ih_surface {
    bool valid;      /* false: too few samples, or none with weight */
    int32_t centres; /* in a row, as asked for */
    int32_t downweighted_count;
    int32_t mean_mm_q8;
    struct ih_field field;
    int32_t nearest_mm_q8; /* least node of the grid */
    /* By sample, after the Huber step. Of a moved one, the weight with which it would push as much where it was. */
    int32_t root_weight_q15[IH_SLOTS];
    int32_t depth_mm_q8[IH_SURFACE_GRID][IH_SURFACE_GRID]; /* [y][x] */
};

/* The grid is evaluated in two halves that are mirrored, with the middle one, and so are the centres. */
#define IH_SURFACE_HALF ((IH_SURFACE_GRID + 1) / 2)
#define IH_SURFACE_HALF_CENTRES_MAX (IH_SURFACE_CENTRES_MAX / 2)

/* As many of the samples' rows as fill what the smaller system leaves of the other's room. */
#define IH_SURFACE_ROWS_KEPT                               \
    ((2 * IH_NORMAL_EQUATIONS_LINE(IH_SURFACE_TERMS_MAX) - \
      IH_NORMAL_EQUATIONS_LINE(IH_SURFACE_TERMS_FEW)) /    \
     IH_SURFACE_TERMS_FEW)

struct ih_surface_scratch {
    union {
        struct {
            int32_t normal[IH_NORMAL_EQUATIONS_LINE(IH_SURFACE_TERMS_MAX)];
            int32_t factor[IH_NORMAL_EQUATIONS_LINE(IH_SURFACE_TERMS_MAX)];
        } many;
        struct {
            int32_t normal[IH_NORMAL_EQUATIONS_LINE(IH_SURFACE_TERMS_FEW)];
            uint32_t row_q20[IH_SURFACE_ROWS_KEPT][IH_SURFACE_TERMS_FEW];
        } few; /* where samples are moved sums need not outlive the factor, and their rows are kept */
        struct {
            int32_t table_q20[IH_SURFACE_STEPS][2 * IH_SURFACE_STEPS - 1];
            uint32_t sum_q20[IH_SURFACE_STEPS][IH_SURFACE_HALF_CENTRES_MAX][IH_SURFACE_HALF];
            uint32_t difference_q20[IH_SURFACE_STEPS][IH_SURFACE_HALF_CENTRES_MAX][IH_SURFACE_HALF];
        } grid; /* the basis in whole steps, and folded */
    } of;
    int32_t *normal;    /* sums of products of short rows: many's or few's */
    int32_t *factor;    /* them, scaled, Q30, then factored: in few's in their place */
    int32_t kept_count; /* rows of the first samples that few.row_q20 has */
    /* R^T W (z - B c), less the ridge's share: Q20 more than off */
    int64_t right[IH_SURFACE_TERMS_MAX];
    uint32_t basis_q20[IH_SURFACE_TERMS_MAX]; /* a sample's row that is not kept */
    /* Such rows, weighted and short. */
    uint32_t pair[IH_NORMAL_EQUATIONS_WORK][IH_SURFACE_TERMS_MAX]
        __attribute__((aligned(IH_NORMAL_EQUATIONS_ALIGNMENT)));
    uint32_t row_scale_q17[IH_SURFACE_TERMS_MAX];     /* of a short row */
    uint32_t norm_q10[IH_SURFACE_TERMS_MAX];          /* diagonal of R^T W R */
    uint32_t unknown_scale_q29[IH_SURFACE_TERMS_MAX]; /* coefficient = unknown * scale */
    int32_t solution[IH_SURFACE_TERMS_MAX];           /* the right side before */
    int32_t coefficient[IH_SURFACE_TERMS_MAX]; /* times 2^coefficient_shift, mm per field unit */
    int32_t coefficient_shift;
    /* Weights are taken for 2^weight_shift times as great: the greatest is 1/2 .. 1. */
    int32_t weight_shift;
    int32_t normal_shift;          /* a unit of normal[] is 2^normal_shift */
    int32_t off_fraction;          /* fraction bits of z - B c, mm */
    int32_t samples_log2;          /* an eighth of the samples: as many are below 2^it */
    int32_t squares_log2;          /* of the last correction, see ih_surface.c */
    int32_t limit_log2;            /* of the next one, at the most */
    bool is_fine;                  /* all rows of the factor have 27 bits */
    bool is_far[IH_SLOTS];         /* before the last correction */
    int32_t moved_mm_q8[IH_SLOTS]; /* what is taken from a sample's depth */
    int32_t centres, terms;        /* in a row, and all */
    int32_t centre_q16[IH_SURFACE_CENTRES_MAX]; /* places of the centres in a row, field units */
};

IH_BEGIN_DECLS

void ih_surface_params_default(struct ih_surface_params *params);

void ih_surface_fit(const struct ih_samples *samples, const struct ih_field *field,
                    const struct ih_surface_params *params, struct ih_surface_scratch *scratch,
                    struct ih_surface *out);

IH_END_DECLS

#endif
