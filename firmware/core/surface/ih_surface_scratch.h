/* ih_surface_scratch - the memory that a fit of the surface works in. */
#ifndef IH_SURFACE_SCRATCH_H
#define IH_SURFACE_SCRATCH_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "surface/ih_normal_equations.h"
#include "surface/ih_surface.h"

/* The grid is evaluated in two mirrored halves, which share the middle, and so are the centres. */
#define IH_SURFACE_HALF ((IH_SURFACE_GRID + 1) / 2)
#define IH_SURFACE_HALF_CENTRES_MAX (IH_SURFACE_CENTRES_MAX / 2)

/* As many of the samples' rows as fit beside the smaller system in the memory of the other. */
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
        } few; /* with moved samples: the factor replaces the sums, and rows are kept */
        struct {
            int32_t table_q20[IH_SURFACE_STEPS][2 * IH_SURFACE_STEPS - 1];
            uint32_t sum_q20[IH_SURFACE_STEPS][IH_SURFACE_HALF_CENTRES_MAX][IH_SURFACE_HALF];
            uint32_t difference_q20[IH_SURFACE_STEPS][IH_SURFACE_HALF_CENTRES_MAX][IH_SURFACE_HALF];
        } grid; /* the basis in whole steps, and folded */
    } of;
    int32_t *normal;    /* sums of products of short rows: many's or few's */
    int32_t *factor;    /* the sums scaled, Q30, then factored; few's replaces them */
    int32_t kept_count; /* number of samples whose rows few.row_q20 has */
    /* R^T W (z - B c), minus the ridge's part: off_fraction + 20 fraction bits */
    int64_t right[IH_SURFACE_TERMS_MAX];
    uint32_t basis_q20[IH_SURFACE_TERMS_MAX]; /* a row that is not kept */
    /* Rows, weighted and short. */
    uint32_t pair[IH_NORMAL_EQUATIONS_WORK][IH_SURFACE_TERMS_MAX]
        __attribute__((aligned(IH_NORMAL_EQUATIONS_ALIGNMENT)));
    uint32_t row_scale_q17[IH_SURFACE_TERMS_MAX];     /* of a short row */
    uint32_t norm_q10[IH_SURFACE_TERMS_MAX];          /* diagonal of R^T W R */
    uint32_t unknown_scale_q29[IH_SURFACE_TERMS_MAX]; /* coefficient = unknown * scale */
    int32_t solution[IH_SURFACE_TERMS_MAX];           /* first the right side */
    int32_t coefficient[IH_SURFACE_TERMS_MAX]; /* times 2^coefficient_shift, mm per field unit */
    int32_t coefficient_shift;
    /* Weights are enlarged by 2^weight_shift: the largest is 1/2 .. 1. */
    int32_t weight_shift;
    int32_t normal_shift;          /* a unit of normal[] is 2^normal_shift */
    int32_t off_fraction;          /* fraction bits of z - B c, mm */
    int32_t samples_log2;          /* an eighth of the samples is below 2^samples_log2 */
    int32_t squares_log2;          /* of the last correction, see ih_surface.c */
    int32_t limit_log2;            /* maximum of the next one */
    bool is_fine;                  /* all rows of the factor have 27 bits */
    bool is_far[IH_SLOTS];         /* before the last correction */
    int32_t moved_mm_q8[IH_SLOTS]; /* subtracted from a sample's depth */
    int32_t centres, terms;        /* in a row, and all */
    int32_t centre_q16[IH_SURFACE_CENTRES_MAX]; /* positions of the centres in a row, field units */
};

#endif
