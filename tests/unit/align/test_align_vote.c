/* ih_align_vote against every plane that is tried, counted vote by vote. */
#include "align/ih_align_vote.h"

#include <stdlib.h>

#include "ih_test.h"

#define VOTES_MAX 4000
#define BESIDE_BINS 3
#define ALIKE_PX_Q12 8192

static struct ih_align_votes votes;
static struct ih_align_plane peak[IH_ALIGN_PEAKS];
static int16_t slope_q12[IH_SLOTS][IH_ALIGN_AXES];
static struct ih_test_random random_source;

static struct {
    int32_t slot, across_px_q12;
} vote[VOTES_MAX];
static int vote_count;

/* As align uses them: blocks of 2 by 2 slots with bins of 0.5 px, and with bins of 0.2 px and rotations of depth. */
static const struct ih_align_grid grids[] = {
    {10, 2, 64, 2048, 2, IH_ALIGN_PEAKS, 3072, 4, 3, 0, 0},
    {10, 2, 32, 819, 3, 1, 1638, 2, 2, 2, 3000},
    {5, 4, 64, 2048, 2, 3, 3072, 5, 6, 0, 0},
    {7, 3, 32, 1000, 3, 2, 1500, 1, 4, 1, 8000},
};

void setUp(void)
{
    random_source.state = 23;
    memset(&votes, IH_TEST_FILL, sizeof votes);
    memset(peak, IH_TEST_FILL, sizeof peak);
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        for (int k = 0; k < IH_ALIGN_AXES; k++) {
            slope_q12[slot][k] = (int16_t)(slot / IH_GRID * (slot % IH_GRID) * 8 - 600);
        }
    }
}

void tearDown(void)
{
}

static void add(const struct ih_align_grid *grid, int32_t slot, int32_t across_px_q12)
{
    if (vote_count < VOTES_MAX) {
        vote[vote_count].slot = slot;
        vote[vote_count++].across_px_q12 = across_px_q12;
        ih_align_votes_add(ih_align_votes_of(&votes, grid, slot), grid, across_px_q12);
    }
}

/* Half columns from the pattern's middle to that of a block; the last one may be narrower. */
static int middle_of(const struct ih_align_grid *grid, int block)
{
    const int first = block * grid->slots;
    const int last = first + grid->slots > IH_GRID ? IH_GRID - 1 : first + grid->slots - 1;

    return first + last - (IH_GRID - 1);
}

/* Halves away from zero. */
static int bins_of(const struct ih_align_grid *grid, double px_q12)
{
    return (int)round(px_q12 / grid->bin_px_q12);
}

static int plane_bins(const struct ih_align_grid *grid, int32_t px_q12, int block)
{
    return bins_of(grid, trunc((double)px_q12 * middle_of(grid, block) / (IH_GRID - 1)));
}

static int depth_bins(const struct ih_align_grid *grid, int32_t depth_px_q12, int row, int column)
{
    const int slot = (middle_of(grid, row) + IH_GRID - 1) / 2 * IH_GRID +
                     (middle_of(grid, column) + IH_GRID - 1) / 2;

    return bins_of(grid,
                   floor((double)depth_px_q12 * slope_q12[slot][IH_ALIGN_DEPTH] / 4096 + 0.5));
}

/* The histogram of one plane: votes that columns or rows move out of it are lost. */
static void count_plane(const struct ih_align_grid *grid, const struct ih_align_plane *plane,
                        int32_t sum[IH_ALIGN_BINS_MAX])
{
    memset(sum, 0, IH_ALIGN_BINS_MAX * sizeof *sum);
    for (int i = 0; i < vote_count; i++) {
        const int row = vote[i].slot / IH_GRID / grid->slots;
        const int column = vote[i].slot % IH_GRID / grid->slots;
        int bin =
            (int)floor((double)vote[i].across_px_q12 / grid->bin_px_q12 + grid->bin_count / 2.0);

        if (bin >= 0 && bin < grid->bin_count) {
            bin -= plane_bins(grid, plane->column_px_q12, column) +
                   depth_bins(grid, plane->depth_px_q12, row, column);
            if (bin >= 0 && bin < grid->bin_count) {
                bin -= plane_bins(grid, plane->row_px_q12, row);
                if (bin >= 0 && bin < grid->bin_count) {
                    sum[bin]++;
                }
            }
        }
    }
}

static int32_t peak_of(const struct ih_align_grid *grid, const int32_t *sum)
{
    int32_t in_peak = 0;

    for (int i = 0; i < grid->peak_bins; i++) {
        in_peak += sum[i];
    }
    return in_peak;
}

/* The best score of a plane, and of a shift that is given (in half bins from the middle). */
static int32_t score_of(const struct ih_align_grid *grid, const struct ih_align_plane *plane,
                        bool is_any_shift)
{
    int32_t sum[IH_ALIGN_BINS_MAX], best = 0;

    count_plane(grid, plane, sum);
    for (int i = BESIDE_BINS; i + BESIDE_BINS + grid->peak_bins <= grid->bin_count; i++) {
        const int32_t shift =
            (int32_t)trunc((2 * i + grid->peak_bins - grid->bin_count) * grid->bin_px_q12 / 2.0);
        const int32_t score = 2 * peak_of(grid, &sum[i]) - peak_of(grid, &sum[i - BESIDE_BINS]) -
                              peak_of(grid, &sum[i + BESIDE_BINS]);

        if (score > best && (is_any_shift || shift == plane->shift_px_q12)) {
            best = score;
        }
    }
    return best;
}

static int32_t best_of_all(const struct ih_align_grid *grid)
{
    int32_t best = 0;

    for (int depth = -grid->depth_steps; depth <= grid->depth_steps; depth++) {
        for (int column = -grid->column_steps; column <= grid->column_steps; column++) {
            for (int row = -grid->row_steps; row <= grid->row_steps; row++) {
                const struct ih_align_plane plane = {0, column * grid->step_px_q12,
                                                     row * grid->step_px_q12,
                                                     depth * grid->depth_step_px_q12, 0};
                const int32_t score = score_of(grid, &plane, true);

                best = score > best ? score : best;
            }
        }
    }
    return best;
}

/* Votes of chance, and some of a plane. */
static void cast_votes(const struct ih_align_grid *grid, const struct ih_align_plane *plane,
                       int chance_count, int every)
{
    const int32_t half_px_q12 = grid->bin_count / 2 * grid->bin_px_q12;

    vote_count = 0;
    ih_align_votes_clear(&votes, grid);
    for (int i = 0; i < chance_count; i++) {
        add(grid, (int32_t)ih_test_between(&random_source, 0, IH_SLOTS - 1),
            (int32_t)ih_test_between(&random_source, -half_px_q12 - 2000, half_px_q12 + 2000));
    }
    for (int slot = 0; slot < IH_SLOTS; slot += every) {
        add(grid, slot,
            ih_align_plane_px_q12(plane, slot) +
                (int32_t)lround(400 * ih_test_normal(&random_source)));
    }
}

static bool is_alike(const struct ih_align_plane *a, const struct ih_align_plane *b)
{
    return abs(a->shift_px_q12 - b->shift_px_q12) <= ALIKE_PX_Q12 &&
           abs(a->column_px_q12 - b->column_px_q12) <= ALIKE_PX_Q12 &&
           abs(a->row_px_q12 - b->row_px_q12) <= ALIKE_PX_Q12;
}

/* The first peak is the best of all planes; the others come after it, with the scores that they have, none like one
 * before. */
static void peaks_are_the_best_planes(void)
{
    for (int pass = 0; pass < 40; pass++) {
        const struct ih_align_grid *grid = &grids[pass % IH_TEST_COUNT(grids)];
        const int32_t steps = grid->step_px_q12;
        const struct ih_align_plane plane = {
            (int32_t)ih_test_between(&random_source, -4, 4) * grid->bin_px_q12,
            (int32_t)ih_test_between(&random_source, -grid->column_steps, grid->column_steps) *
                steps,
            (int32_t)ih_test_between(&random_source, -grid->row_steps, grid->row_steps) * steps, 0,
            0};

        cast_votes(grid, &plane, (int)ih_test_between(&random_source, 0, 900), 1 + pass % 5);
        ih_align_votes_count(&votes, grid, slope_q12, peak);
        IH_TEST_EQUAL(best_of_all(grid), peak[0].score, "best", pass);
        for (int i = 0; i < grid->peak_count && peak[i].score > 0; i++) {
            IH_TEST_EQUAL(score_of(grid, &peak[i], false), peak[i].score, "score", 10 * pass + i);
            TEST_ASSERT_TRUE(i == 0 || peak[i - 1].score >= peak[i].score);
            for (int k = 0; k < i; k++) {
                TEST_ASSERT_FALSE(is_alike(&peak[k], &peak[i]));
            }
        }
    }
}

/* Among few votes of chance: within a bin and a step of what was put there. */
static void the_plane_of_the_votes_is_found(void)
{
    for (int pass = 0; pass < 60; pass++) {
        const struct ih_align_grid *grid = &grids[pass % IH_TEST_COUNT(grids)];
        const int32_t reach = grid->bin_count / 8 * grid->bin_px_q12;
        const struct ih_align_plane plane = {
            (int32_t)ih_test_between(&random_source, -reach, reach),
            (int32_t)ih_test_between(&random_source, -grid->column_steps * grid->step_px_q12,
                                     grid->column_steps * grid->step_px_q12),
            (int32_t)ih_test_between(&random_source, -grid->row_steps * grid->step_px_q12,
                                     grid->row_steps * grid->step_px_q12),
            0, 0};

        cast_votes(grid, &plane, 200, 1);
        ih_align_votes_count(&votes, grid, slope_q12, peak);
        IH_TEST_WITHIN(2 * grid->bin_px_q12, plane.shift_px_q12, peak[0].shift_px_q12, "shift",
                       pass);
        IH_TEST_WITHIN(1.5 * grid->step_px_q12, plane.column_px_q12, peak[0].column_px_q12,
                       "column", pass);
        IH_TEST_WITHIN(1.5 * grid->step_px_q12, plane.row_px_q12, peak[0].row_px_q12, "row", pass);
    }
}

static void no_votes_give_no_plane(void)
{
    for (int i = 0; i < IH_TEST_COUNT(grids); i++) {
        vote_count = 0;
        ih_align_votes_clear(&votes, &grids[i]);
        ih_align_votes_count(&votes, &grids[i], slope_q12, peak);
        for (int k = 0; k < grids[i].peak_count; k++) {
            IH_TEST_EQUAL(0, peak[k].score, "score", k);
        }
    }
}

/* From edge to edge, by its definition; halves are cut off. */
static void a_plane_is_one(void)
{
    const struct ih_align_plane plane = {1000, -5000, 3000, 0, 0};

    for (int slot = 0; slot < IH_SLOTS; slot++) {
        IH_TEST_WITHIN(1,
                       1000 - 5000 * (slot % IH_GRID - 9) / 9.0 + 3000 * (slot / IH_GRID - 9) / 9.0,
                       ih_align_plane_px_q12(&plane, slot), "plane", slot);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(peaks_are_the_best_planes);
    RUN_TEST(the_plane_of_the_votes_is_found);
    RUN_TEST(no_votes_give_no_plane);
    RUN_TEST(a_plane_is_one);
    return UNITY_END();
}
