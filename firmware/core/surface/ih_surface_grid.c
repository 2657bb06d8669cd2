#include "surface/ih_surface_grid.h"

#include "base/ih_fix.h"
#include "surface/ih_multiquadric.h"
#include "surface/ih_surface_rows.h"

#define CENTRES_MAX IH_SURFACE_CENTRES_MAX
/* Steps of the table are padded to whole lines of ih_multiquadric. */
#define TABLE_LINE 8
#define TABLE_WIDTH (6 * TABLE_LINE)
/* Differences of the basis at two nodes are stored without sign. Their size is below the distance of the nodes, 2^25.4. */
#define DIFFERENCE_BIAS_Q20 (1 << 26)

_Static_assert(TABLE_WIDTH >= IH_SURFACE_STEPS && IH_SURFACE_STEPS % 2 == 0, "all steps");

/* B for whole grid steps: sqrt((a^2 + b^2) 100 / 121 + 1) in Q20, b down and a to both sides, so that what a centre
 * adds to a row of nodes is contiguous. */
void ih_surface_grid_fill_table(struct ih_surface_scratch *scratch)
{
    const int64_t numerator2 = IH_SURFACE_STEP_NUMERATOR * IH_SURFACE_STEP_NUMERATOR;
    const int64_t denominator2 = IH_SURFACE_STEP_DENOMINATOR * IH_SURFACE_STEP_DENOMINATOR;
    uint32_t square_q18[TABLE_WIDTH], one_more_q18[TABLE_WIDTH];
    for (int64_t a = 0; a < TABLE_WIDTH; a++) {
        square_q18[a] = (uint32_t)ih_div_round(a * a * numerator2 * (1 << 18), denominator2);
        one_more_q18[a] = square_q18[a] + (1 << 18);
    }
    for (int32_t b = 0; b < IH_SURFACE_STEPS; b += 2) {
        for (int32_t first = 0; first < TABLE_WIDTH; first += TABLE_LINE) {
            const int32_t count = ih_min_s32(TABLE_LINE, IH_SURFACE_STEPS - first);
            uint32_t root_q20[2][TABLE_LINE];
            ih_multiquadric_roots(&square_q18[first], TABLE_LINE, &one_more_q18[b], 2, root_q20[0]);
            for (int32_t k = 0; k < 2; k++) {
                int32_t *middle = &scratch->of.grid.table_q20[b + k][IH_SURFACE_STEPS - 1];
                for (int32_t a = 0; a < count; a++) {
                    middle[first + a] = (int32_t)root_q20[k][a];
                    middle[-first - a] = (int32_t)root_q20[k][a];
                }
            }
        }
    }
}

/* Grid steps from the grid's first node to a centre. */
static int32_t centre_node(const struct ih_surface_scratch *scratch, int32_t centre)
{
    const int32_t steps = ih_surface_centre_steps(scratch);
    return (IH_SURFACE_GRID - 1) / 2 - steps * (scratch->centres - 1) / 2 + steps * centre;
}

/* Centres k and centres - 1 - k of a row are symmetric about the middle, and so are nodes x and GRID - 1 - x. With p and
 * q the basis of a centre at both nodes, and c and d the coefficients of both centres, c p + d q at one node and
 * c q + d p at the other are half of (c + d) (p + q) plus and minus (c - d) (p - q). */
static void fold_table(struct ih_surface_scratch *scratch)
{
    for (int32_t b = 0; b < IH_SURFACE_STEPS; b++) {
        const int32_t *middle = &scratch->of.grid.table_q20[b][IH_SURFACE_STEPS - 1];
        for (int32_t k = 0; k < scratch->centres / 2; k++) {
            const int32_t *here = &middle[-centre_node(scratch, k)];
            const int32_t *there = &middle[-centre_node(scratch, scratch->centres - 1 - k)];
            for (int32_t x = 0; x < IH_SURFACE_HALF; x++) {
                scratch->of.grid.sum_q20[b][k][x] = (uint32_t)(here[x] + there[x]);
                scratch->of.grid.difference_q20[b][k][x] =
                    (uint32_t)(here[x] - there[x] + DIFFERENCE_BIAS_Q20);
            }
        }
    }
}

/* Sums and differences of both centres' coefficients replace the solution, which is no longer needed. */
static void fold_coefficients(struct ih_surface_scratch *scratch, int32_t **between)
{
    const int32_t centres = scratch->centres, half = centres / 2;
    int32_t *both = scratch->solution;
    *between = &both[centres * half];
    for (int32_t row = 0; row < centres; row++) {
        const int32_t *coefficient = &scratch->coefficient[row * centres];
        for (int32_t k = 0; k < half; k++) {
            const int32_t other = coefficient[centres - 1 - k];
            both[row * half + k] = coefficient[k] + other;
            (*between)[row * half + k] = coefficient[k] - other;
        }
    }
}

static int64_t sum_of(const int32_t *number, int32_t count)
{
    int64_t sum = 0;
    for (int32_t i = 0; i < count; i++) {
        sum += number[i];
    }
    return sum;
}

/* Twice sum_n c_n B_n along half a row of nodes: the part that both halves share, and the part whose sign differs. */
static void sum_row(const struct ih_surface_scratch *scratch, const int32_t *between,
                    int64_t odd_begin, int32_t y, int64_t even[IH_SURFACE_HALF],
                    int64_t odd[IH_SURFACE_HALF])
{
    const int32_t centres = scratch->centres;
    const uint32_t *sum_q20[CENTRES_MAX], *difference_q20[CENTRES_MAX];
    for (int32_t row = 0; row < centres; row++) {
        const int32_t b = ih_abs_s32(y - centre_node(scratch, row));
        sum_q20[row] = scratch->of.grid.sum_q20[b][0];
        difference_q20[row] = scratch->of.grid.difference_q20[b][0];
    }
    ih_multiquadric_lines(scratch->solution, sum_q20, centres, centres / 2, IH_SURFACE_HALF, 0,
                          even);
    ih_multiquadric_lines(between, difference_q20, centres, centres / 2, IH_SURFACE_HALF, odd_begin,
                          odd);
}

/* How sums become depths: sum_n c_n B_n in Q8 is 2^-shift of a sum. */
struct depth_scale {
    int shift;
    int32_t mean_mm_q8, min_mm_q8, max_mm_q8;
};

static inline int32_t depth_of_sum(const struct depth_scale *scale, int64_t sum)
{
    const int64_t off_q8 = scale->shift > 0 ? ih_shift_round(sum, scale->shift) : INT32_MAX;
    const int64_t depth_q8 = scale->mean_mm_q8 + off_q8;
    if (depth_q8 < scale->min_mm_q8) {
        return scale->min_mm_q8;
    }
    return depth_q8 > scale->max_mm_q8 ? scale->max_mm_q8 : (int32_t)depth_q8;
}

/* Set the depths of a row of nodes from the sums of both halves. Returns the nearest one. */
static int32_t set_depths(const struct depth_scale *scale, const int64_t even[IH_SURFACE_HALF],
                          const int64_t odd[IH_SURFACE_HALF], int32_t *depth_mm_q8)
{
    int32_t nearest_q8 = INT32_MAX;
    for (int32_t x = 0; x < IH_SURFACE_HALF; x++) {
        const int32_t mirrored = IH_SURFACE_GRID - 1 - x;
        depth_mm_q8[x] = depth_of_sum(scale, even[x] + odd[x]);
        depth_mm_q8[mirrored] = depth_of_sum(scale, even[x] - odd[x]);
        nearest_q8 = ih_min_s32(nearest_q8, ih_min_s32(depth_mm_q8[x], depth_mm_q8[mirrored]));
    }
    return nearest_q8;
}

void ih_surface_grid_evaluate(const struct ih_samples *samples, struct ih_surface_scratch *scratch,
                              struct ih_surface *out)
{
    const struct depth_scale scale = {
        .shift = ih_min_s32(20 + scratch->coefficient_shift - 7, 62), /* sums are twice as great */
        .mean_mm_q8 = out->mean_mm_q8,
        .min_mm_q8 = ih_max_s32(samples->nearest_mm_q8 - (IH_SURFACE_OVERSHOOT_MM << 8), 1 << 8),
        .max_mm_q8 = IH_SURFACE_DEPTH_MAX_MM << 8,
    };
    int32_t *between;
    int32_t nearest_q8 = INT32_MAX;
    ih_surface_grid_fill_table(scratch);
    fold_table(scratch);
    fold_coefficients(scratch, &between);
    const int64_t odd_begin = -DIFFERENCE_BIAS_Q20 * sum_of(between, scratch->terms / 2);
    for (int32_t y = 0; y < IH_SURFACE_GRID; y++) {
        int64_t even[IH_SURFACE_HALF], odd[IH_SURFACE_HALF];
        sum_row(scratch, between, odd_begin, y, even, odd);
        nearest_q8 = ih_min_s32(nearest_q8, set_depths(&scale, even, odd, out->depth_mm_q8[y]));
    }
    out->nearest_mm_q8 = nearest_q8;
}
