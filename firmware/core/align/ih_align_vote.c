#include "align/ih_align_vote.h"

#include <stdbool.h>
#include <string.h>

#include "base/ih_fix.h"
#include "simd/ih_simd.h"

/* Beside a peak of so many bins is what it must rise above. */
#define BESIDE_BINS 3
/* Half columns from the pattern's middle to its edge. */
#define EDGE 18

void ih_align_votes_clear(struct ih_align_votes *votes)
{
    memset(votes, 0, sizeof *votes);
}

/* Half columns of a block's middle from the pattern's; the last block may have fewer columns. */
static int32_t middle_of(int32_t block, const struct ih_align_grid *grid)
{
    const int32_t first = block * grid->slots;
    return first + ih_min_s32(first + grid->slots, IH_GRID) - 1 - EDGE;
}

static int8_t bins_of(int64_t px_q12, const struct ih_align_grid *grid)
{
    return (int8_t)ih_clamp_s64(ih_div_round(px_q12, grid->bin_px_q12), IH_ALIGN_PAD);
}

#if IH_I16_LANES > 0
static void add_bins(const uint16_t *from, int32_t count, uint16_t *sum)
{
    for (int32_t i = 0; i < count; i += IH_I16_LANES) {
        ih_u16_store(&sum[i], ih_u16_load(&sum[i]) + ih_u16_load(&from[i]));
    }
}
#else
/* Two at a time; no sum of votes passes 16 bits. */
static void add_bins(const uint16_t *from, int32_t count, uint16_t *sum)
{
    for (int32_t i = 0; i < count; i += 2) {
        uint32_t a, b;
        memcpy(&a, &sum[i], sizeof a);
        memcpy(&b, &from[i], sizeof b);
        a += b;
        memcpy(&sum[i], &a, sizeof a);
    }
}
#endif

/* Add a histogram, with its padding, that is moved by so many bins. */
static void add_moved(const uint16_t *from, int32_t bins, int32_t bin_count, uint16_t *sum)
{
    add_bins(&from[IH_ALIGN_PAD + ih_clamp_s32(bins, -IH_ALIGN_PAD, IH_ALIGN_PAD)], bin_count, sum);
}

/* The best shift of a plane whose sum is known. */
static void find_shift(const uint16_t *sum, const struct ih_align_grid *grid,
                       struct ih_align_plane *plane)
{
    const int32_t width = grid->peak_bins;
    const int32_t count = grid->bin_count - width + 1;
    int32_t in_peak[IH_ALIGN_BINS_MAX];
    for (int32_t i = 0; i < count; i++) {
        in_peak[i] = sum[i] + sum[i + 1] + (width > 2 ? sum[i + 2] : 0);
    }
    plane->score = 0;
    for (int32_t i = BESIDE_BINS; i < count - BESIDE_BINS; i++) {
        /* All are set; NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult) */
        const int32_t score = 2 * in_peak[i] - in_peak[i - BESIDE_BINS] - in_peak[i + BESIDE_BINS];
        if (score > plane->score) {
            plane->score = score;
            plane->shift_px_q12 = (2 * i + width - grid->bin_count) * grid->bin_px_q12 / 2;
        }
    }
}

static bool is_alike(const struct ih_align_plane *a, const struct ih_align_plane *b)
{
    return ih_abs_s32(a->shift_px_q12 - b->shift_px_q12) <= 2 * 4096 &&
           ih_abs_s32(a->column_px_q12 - b->column_px_q12) <= 2 * 4096 &&
           ih_abs_s32(a->row_px_q12 - b->row_px_q12) <= 2 * 4096;
}

/* Of planes that are alike the best alone stays. */
static void keep(const struct ih_align_plane *plane, struct ih_align_plane peak[IH_ALIGN_PEAKS])
{
    struct ih_align_plane before[IH_ALIGN_PEAKS];
    int32_t at = 0;
    while (at < IH_ALIGN_PEAKS && peak[at].score >= plane->score) {
        if (is_alike(&peak[at], plane)) {
            return;
        }
        at++;
    }
    if (at == IH_ALIGN_PEAKS) {
        return;
    }
    memcpy(before, peak, sizeof before);
    peak[at] = *plane;
    int32_t kept = at + 1;
    for (int32_t i = at; i < IH_ALIGN_PEAKS && kept < IH_ALIGN_PEAKS; i++) {
        if (!is_alike(&before[i], plane)) {
            peak[kept++] = before[i];
        }
    }
    for (; kept < IH_ALIGN_PEAKS; kept++) {
        peak[kept].score = 0;
    }
}

static void set_plane_bins(struct ih_align_votes *votes, const struct ih_align_grid *grid)
{
    const int32_t max_steps = ih_max_s32(grid->column_steps, grid->row_steps);
    for (int32_t steps = -max_steps; steps <= max_steps; steps++) {
        for (int32_t block = 0; block < grid->side; block++) {
            votes->plane_bins[IH_ALIGN_STEPS_MAX + steps][block] =
                bins_of(steps * grid->step_px_q12 * middle_of(block, grid) / EDGE, grid);
        }
    }
}

/* The slot in the middle of a block shows what a rotation of depth does to it. */
static void set_depth_bins(struct ih_align_votes *votes, const struct ih_align_grid *grid,
                           int32_t depth_px_q12, const int16_t slope_q12[IH_SLOTS][IH_ALIGN_AXES])
{
    for (int32_t row = 0; row < grid->side; row++) {
        for (int32_t column = 0; column < grid->side; column++) {
            const int32_t slot =
                (middle_of(row, grid) + EDGE) / 2 * IH_GRID + (middle_of(column, grid) + EDGE) / 2;
            const int64_t px_q12 = ih_mul_shift(depth_px_q12, slope_q12[slot][IH_ALIGN_DEPTH], 12);
            votes->depth_bins[row][column] = bins_of(px_q12, grid);
        }
    }
}

static void sum_columns(struct ih_align_votes *votes, const struct ih_align_grid *grid,
                        int32_t column_steps)
{
    const int8_t *bins = votes->plane_bins[IH_ALIGN_STEPS_MAX + column_steps];
    memset(votes->row, 0, sizeof votes->row);
    for (int32_t row = 0; row < grid->side; row++) {
        for (int32_t column = 0; column < grid->side; column++) {
            add_moved(votes->block[row][column], bins[column] + votes->depth_bins[row][column],
                      grid->bin_count, &votes->row[row][IH_ALIGN_PAD]);
        }
    }
}

static void sum_rows(struct ih_align_votes *votes, const struct ih_align_grid *grid,
                     int32_t row_steps)
{
    const int8_t *bins = votes->plane_bins[IH_ALIGN_STEPS_MAX + row_steps];
    memset(votes->sum, 0, sizeof votes->sum);
    for (int32_t row = 0; row < grid->side; row++) {
        add_moved(votes->row[row], bins[row], grid->bin_count, votes->sum);
    }
}

void ih_align_votes_count(struct ih_align_votes *votes, const struct ih_align_grid *grid,
                          const int16_t slope_q12[IH_SLOTS][IH_ALIGN_AXES],
                          struct ih_align_plane peak[IH_ALIGN_PEAKS])
{
    struct ih_align_plane plane = {0};
    memset(peak, 0, IH_ALIGN_PEAKS * sizeof *peak);
    set_plane_bins(votes, grid);
    for (int32_t depth = -grid->depth_steps; depth <= grid->depth_steps; depth++) {
        plane.depth_px_q12 = depth * grid->depth_step_px_q12;
        set_depth_bins(votes, grid, plane.depth_px_q12, slope_q12);
        for (int32_t column = -grid->column_steps; column <= grid->column_steps; column++) {
            plane.column_px_q12 = column * grid->step_px_q12;
            sum_columns(votes, grid, column);
            for (int32_t row = -grid->row_steps; row <= grid->row_steps; row++) {
                plane.row_px_q12 = row * grid->step_px_q12;
                sum_rows(votes, grid, row);
                find_shift(votes->sum, grid, &plane);
                keep(&plane, peak);
            }
        }
    }
}

int32_t ih_align_plane_px_q12(const struct ih_align_plane *plane, int32_t slot)
{
    return plane->shift_px_q12 + (plane->column_px_q12 * (2 * (slot % IH_GRID) - EDGE) +
                                  plane->row_px_q12 * (2 * (slot / IH_GRID) - EDGE)) /
                                     EDGE;
}
