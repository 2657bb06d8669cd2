#include "align/ih_align_vote.h"

#include <stdbool.h>
#include <string.h>

#include "base/ih_fix.h"
#include "simd/ih_simd.h"
#include "simd/ih_simd_cortexm.h"

/* Beside a peak of so many bins is what it must rise above. */
#define BESIDE_BINS 3

void ih_align_votes_clear(struct ih_align_votes *votes, const struct ih_align_grid *grid)
{
    memset(votes->sum, 0, sizeof votes->sum);
    for (int32_t row = 0; row < grid->side; row++) {
        memset(votes->row[row], 0, sizeof votes->row[row]);
        for (int32_t column = 0; column < grid->side; column++) {
            memset(votes->block[row][column], 0, sizeof votes->block[row][column]);
        }
    }
}

/* Half columns of a block's middle from the pattern's; the last block may have fewer columns. */
static int32_t middle_of(int32_t block, const struct ih_align_grid *grid)
{
    const int32_t first = block * grid->slots;
    return first + ih_min_s32(first + grid->slots, IH_GRID) - 1 - IH_ALIGN_EDGE;
}

static int32_t bins_of(int64_t px_q12, const struct ih_align_grid *grid)
{
    return (int32_t)ih_clamp_s64(ih_div_round(px_q12, grid->bin_px_q12), IH_ALIGN_PAD);
}

/* Sum of histograms, each from its own bin on; no sum of votes passes 16 bits. */
#if IH_I16_LANES > 0
static void sum_moved(const uint16_t from[IH_ALIGN_SIDE_MAX][IH_ALIGN_PADDED],
                      const int32_t first[IH_ALIGN_SIDE_MAX], const struct ih_align_grid *grid,
                      uint16_t *sum)
{
    for (int32_t i = 0; i < grid->bin_count; i += 32) {
        struct ih_u16_32 total = {0};
        for (int32_t k = 0; k < grid->side; k++) {
            const uint16_t *bin = &from[k][i + first[k]];
            total = ih_u16_32_add(total, ih_u16_32_next(&bin, 0));
        }
        ih_u16_32_put(&sum, i, &total);
    }
}
#else
/* Eight at a time, two in a word. */
static void sum_moved(const uint16_t from[IH_ALIGN_SIDE_MAX][IH_ALIGN_PADDED],
                      const int32_t first[IH_ALIGN_SIDE_MAX], const struct ih_align_grid *grid,
                      uint16_t *sum)
{
    for (int32_t i = 0; i < grid->bin_count; i += 8) {
        uint32_t a = 0, b = 0, c = 0, d = 0;
        for (int32_t k = 0; k < grid->side; k++) {
            const uint16_t *bin = &from[k][first[k] + i];
            a += ih_word_load(bin);
            b += ih_word_load(&bin[2]);
            c += ih_word_load(&bin[4]);
            d += ih_word_load(&bin[6]);
        }
        ih_word_store(a, &sum[i]);
        ih_word_store(b, &sum[i + 2]);
        ih_word_store(c, &sum[i + 4]);
        ih_word_store(d, &sum[i + 6]);
    }
}
#endif

/* The bins at which a peak may begin, up to this one. */
static int32_t end_of(const struct ih_align_grid *grid)
{
    return grid->bin_count - grid->peak_bins + 1 - BESIDE_BINS;
}

/* Votes in a peak. */
static int32_t peak_of(const uint16_t *sum, int32_t width)
{
    return sum[0] + sum[1] + (width > 2 ? sum[2] : 0);
}

/* Of the peak that begins at a bin. */
static int32_t score_of(const uint16_t *bin, int32_t width)
{
    return 2 * peak_of(bin, width) - peak_of(&bin[-BESIDE_BINS], width) -
           peak_of(&bin[BESIDE_BINS], width);
}

/* The first bin from one on, or the end, where the score is above that. Scores are below 2^14. */
#if IH_I16_LANES > 0
static ih_u16 peaks_of(const uint16_t *sum, int32_t width)
{
    const ih_u16 two = ih_u16_load(sum) + ih_u16_load(&sum[1]);
    return width > 2 ? two + ih_u16_load(&sum[2]) : two;
}

static ih_i16 are_above(const uint16_t *bin, int32_t width, int32_t limit)
{
    const ih_u16 peaks = peaks_of(bin, width);
    const ih_u16 beside = peaks_of(&bin[-BESIDE_BINS], width) + peaks_of(&bin[BESIDE_BINS], width);
    return (ih_i16)(peaks + peaks - beside) > ih_i16_all((int16_t)limit);
}

static int32_t next_above(const uint16_t *sum, const struct ih_align_grid *grid, int32_t from,
                          int32_t limit)
{
    const int32_t width = grid->peak_bins, end = end_of(grid);
    for (int32_t i = from; i < end; i += 2 * IH_I16_LANES) {
        const uint32_t above = ih_i16_bits(are_above(&sum[i], width, limit),
                                           are_above(&sum[i + IH_I16_LANES], width, limit));
        if (above != 0) {
            return ih_min_s32(i + __builtin_ctz(above), end);
        }
    }
    return end;
}
#else
/* Twice what is in a peak is no less than its score. */
static int32_t next_above(const uint16_t *sum, const struct ih_align_grid *grid, int32_t from,
                          int32_t limit)
{
    const int32_t width = grid->peak_bins, end = end_of(grid);
    int32_t in_peak = peak_of(&sum[from], width);
    for (int32_t i = from; i < end; i++) {
        if (2 * in_peak > limit && score_of(&sum[i], width) > limit) {
            return i;
        }
        in_peak += sum[i + width] - sum[i];
    }
    return end;
}
#endif

/* The best shift of a plane whose sum is known, if it is better than the plane's score. Where the plane before had its best
 * one is looked at first: mostly there is hardly a better one. */
static bool find_shift(const uint16_t *sum, const struct ih_align_grid *grid, int32_t *best,
                       struct ih_align_plane *plane)
{
    const int32_t end = end_of(grid), width = grid->peak_bins;
    bool is_found = false;
    plane->score = ih_max_s32(plane->score, score_of(&sum[*best], width) - 1);
    for (int32_t i = next_above(sum, grid, BESIDE_BINS, plane->score); i < end;
         i = next_above(sum, grid, i + 1, plane->score)) {
        plane->score = score_of(&sum[i], width);
        *best = i;
        is_found = true;
    }
    plane->shift_px_q12 = (2 * *best + width - grid->bin_count) * grid->bin_px_q12 / 2;
    return is_found;
}

static bool is_alike(const struct ih_align_plane *a, const struct ih_align_plane *b)
{
    return ih_abs_s32(a->shift_px_q12 - b->shift_px_q12) <= 2 * 4096 &&
           ih_abs_s32(a->column_px_q12 - b->column_px_q12) <= 2 * 4096 &&
           ih_abs_s32(a->row_px_q12 - b->row_px_q12) <= 2 * 4096;
}

/* Of planes that are alike the best alone stays. */
static void keep(const struct ih_align_plane *plane, int32_t peak_count,
                 struct ih_align_plane *peak)
{
    int32_t at = 0;
    while (at < peak_count && peak[at].score >= plane->score) {
        if (is_alike(&peak[at], plane)) {
            return;
        }
        at++;
    }
    if (at == peak_count) {
        return;
    }
    int32_t kept = at;
    for (int32_t i = at; i < peak_count; i++) {
        if (!is_alike(&peak[i], plane)) {
            peak[kept++] = peak[i];
        }
    }
    for (int32_t i = ih_min_s32(kept, peak_count - 1); i > at; i--) {
        peak[i] = peak[i - 1];
    }
    peak[at] = *plane;
    for (int32_t i = kept + 1; i < peak_count; i++) {
        peak[i].score = 0;
    }
}

static void set_plane_first(struct ih_align_votes *votes, const struct ih_align_grid *grid)
{
    const int32_t max_steps = ih_max_s32(grid->column_steps, grid->row_steps);
    for (int32_t steps = -max_steps; steps <= max_steps; steps++) {
        for (int32_t block = 0; block < grid->side; block++) {
            votes->plane_first[IH_ALIGN_STEPS_MAX + steps][block] =
                IH_ALIGN_PAD +
                bins_of(steps * grid->step_px_q12 * middle_of(block, grid) / IH_ALIGN_EDGE, grid);
        }
    }
}

/* The slot in the middle of a block shows what a rotation of depth does to it. */
static void set_depth_bins(struct ih_align_votes *votes, const struct ih_align_grid *grid,
                           int32_t depth_px_q12, const int16_t slope_q12[IH_SLOTS][IH_ALIGN_AXES])
{
    for (int32_t row = 0; row < grid->side; row++) {
        for (int32_t column = 0; column < grid->side; column++) {
            const int32_t slot = (middle_of(row, grid) + IH_ALIGN_EDGE) / 2 * IH_GRID +
                                 (middle_of(column, grid) + IH_ALIGN_EDGE) / 2;
            const int64_t px_q12 = ih_mul_shift(depth_px_q12, slope_q12[slot][IH_ALIGN_DEPTH], 12);
            votes->depth_bins[row][column] = (int8_t)bins_of(px_q12, grid);
        }
    }
}

/* Where blocks of a row begin that a rotation of depth moves, too. */
static void set_first(const int8_t depth_bins[IH_ALIGN_SIDE_MAX],
                      const int32_t plane_first[IH_ALIGN_SIDE_MAX], int32_t side,
                      int32_t first[IH_ALIGN_SIDE_MAX])
{
    for (int32_t column = 0; column < side; column++) {
        const int32_t at = plane_first[column] + depth_bins[column];
        first[column] = ih_min_s32(ih_max_s32(at, 0), 2 * IH_ALIGN_PAD);
    }
}

static void sum_columns(struct ih_align_votes *votes, const struct ih_align_grid *grid,
                        const int32_t plane_first[IH_ALIGN_SIDE_MAX])
{
    int32_t first[IH_ALIGN_SIDE_MAX];
    for (int32_t row = 0; row < grid->side; row++) {
        if (row == 0 || grid->depth_steps > 0) {
            set_first(votes->depth_bins[row], plane_first, grid->side, first);
        }
        sum_moved(votes->block[row], first, grid, &votes->row[row][IH_ALIGN_PAD]);
    }
}

void ih_align_votes_count(struct ih_align_votes *votes, const struct ih_align_grid *grid,
                          const int16_t slope_q12[IH_SLOTS][IH_ALIGN_AXES],
                          struct ih_align_plane *peak)
{
    struct ih_align_plane plane = {0};
    int32_t best = BESIDE_BINS;
    memset(peak, 0, (size_t)grid->peak_count * sizeof *peak);
    set_plane_first(votes, grid);
    for (int32_t depth = -grid->depth_steps; depth <= grid->depth_steps; depth++) {
        plane.depth_px_q12 = depth * grid->depth_step_px_q12;
        set_depth_bins(votes, grid, plane.depth_px_q12, slope_q12);
        for (int32_t column = -grid->column_steps; column <= grid->column_steps; column++) {
            plane.column_px_q12 = column * grid->step_px_q12;
            sum_columns(votes, grid, votes->plane_first[IH_ALIGN_STEPS_MAX + column]);
            for (int32_t row = -grid->row_steps; row <= grid->row_steps; row++) {
                plane.row_px_q12 = row * grid->step_px_q12;
                sum_moved(votes->row, votes->plane_first[IH_ALIGN_STEPS_MAX + row], grid,
                          votes->sum);
                plane.score = peak[grid->peak_count - 1].score;
                if (find_shift(votes->sum, grid, &best, &plane)) {
                    keep(&plane, grid->peak_count, peak);
                }
            }
        }
    }
}
