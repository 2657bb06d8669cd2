/* ih_align_vote - where most dots lie across their lines, as a plane over the pattern. Private to align.
 *
 * In:    distances of dots across their lines, of every slot; most belong to other slots.
 * Method: a histogram for each block of slots. A plane shift + column + row (px at the pattern's edges) moves each
 *        block's histogram against the others; their sum has a peak where the plane is right. Columns are summed
 *        first, then rows. A peak counts by how much it rises above what lies three bins beside it: planes that are wrong
 *        give hills, right ones a peak. The fine vote tries rotations of depth, too.
 * Cost:  docs/performance.md; only when dots do not lie on their lines.
 */
#ifndef IH_ALIGN_VOTE_H
#define IH_ALIGN_VOTE_H

#include <stdint.h>

#include "align/ih_align_pairs.h"
#include "base/ih_config.h"

#define IH_ALIGN_SIDE_MAX 10 /* blocks in a row, and rows of blocks */
#define IH_ALIGN_BINS_MAX 64
/* Empty bins on both sides, so that a histogram that is moved needs no bounds; no plane moves one by more. */
#define IH_ALIGN_PAD 32
#define IH_ALIGN_PADDED (IH_ALIGN_BINS_MAX + 2 * IH_ALIGN_PAD)
/* Planes that a vote gives, at most. With three, the right one was not among them in a few frames of the wide rig. */
#define IH_ALIGN_PEAKS 5
/* Half columns from the pattern's middle to its edge. */
#define IH_ALIGN_EDGE (IH_GRID - 1)
/* Steps of columns and rows on one side of 0. */
#define IH_ALIGN_STEPS_MAX 12

/* A plane over the pattern, and a rotation of depth; px. */
struct ih_align_plane {
    int32_t shift_px_q12, column_px_q12, row_px_q12, depth_px_q12;
    int32_t score;
};

struct ih_align_votes {
    uint16_t block[IH_ALIGN_SIDE_MAX][IH_ALIGN_SIDE_MAX][IH_ALIGN_PADDED]; /* by row */
    uint16_t row[IH_ALIGN_SIDE_MAX][IH_ALIGN_PADDED];
    uint16_t sum[IH_ALIGN_PADDED]; /* whole vectors are read */
    /* Where blocks begin that steps of columns or rows move, with the padding; bins by which the rotation of depth that is
     * tried moves them. */
    int32_t plane_first[2 * IH_ALIGN_STEPS_MAX + 1][IH_ALIGN_SIDE_MAX];
    int8_t depth_bins[IH_ALIGN_SIDE_MAX][IH_ALIGN_SIDE_MAX];
};

/* What is tried. */
struct ih_align_grid {
    int32_t side, slots;           /* blocks of slots by slots */
    int32_t bin_count, bin_px_q12; /* count: 32 or 64 */
    int32_t peak_bins;             /* width of a peak */
    int32_t peak_count;            /* planes that the vote gives, at most IH_ALIGN_PEAKS */
    int32_t step_px_q12;
    int32_t column_steps, row_steps;        /* on both sides of 0 */
    int32_t depth_steps, depth_step_px_q12; /* the same */
};

/* The blocks that a grid uses. */
void ih_align_votes_clear(struct ih_align_votes *votes, const struct ih_align_grid *grid);

/* The histogram of a slot's block. */
static inline uint16_t *ih_align_votes_of(struct ih_align_votes *votes,
                                          const struct ih_align_grid *grid, int32_t slot)
{
    return &votes->block[slot / IH_GRID / grid->slots][slot % IH_GRID / grid->slots][IH_ALIGN_PAD];
}

static inline void ih_align_votes_add(uint16_t *histogram, const struct ih_align_grid *grid,
                                      int32_t across_px_q12)
{
    const int32_t half_px_q12 = grid->bin_count / 2 * grid->bin_px_q12;
    if (across_px_q12 >= -half_px_q12 && across_px_q12 < half_px_q12) {
        histogram[(across_px_q12 + half_px_q12) / grid->bin_px_q12]++;
    }
}

/* The grid's peak_count planes with the highest scores, best first, no two alike; if there are fewer: score 0. slope_q12:
 * of all slots. */
void ih_align_votes_count(struct ih_align_votes *votes, const struct ih_align_grid *grid,
                          const int16_t slope_q12[IH_SLOTS][IH_ALIGN_AXES],
                          struct ih_align_plane *peak);

/* Of a plane, without the rotation of depth. */
static inline int32_t ih_align_plane_px_q12(const struct ih_align_plane *plane, int32_t slot)
{
    return plane->shift_px_q12 + (plane->column_px_q12 * (2 * (slot % IH_GRID) - IH_ALIGN_EDGE) +
                                  plane->row_px_q12 * (2 * (slot / IH_GRID) - IH_ALIGN_EDGE)) /
                                     IH_ALIGN_EDGE;
}

#endif
