#include "dots/ih_dot_centre.h"

#include "base/ih_fix.h"
#include "simd/ih_simd.h"

/* Pixels to each side of the peak. */
#define REACH 2
#define PLATEAU_REACH 4
#define SIDE (2 * REACH + 1)
/* Columns of a loop: those of the centre, or as many as make whole vectors. */
#if IH_I16_LANES > 0
#define COLUMNS 8
#else
#define COLUMNS SIDE
#endif

static inline int32_t weigh(int16_t response, int32_t min)
{
    const int32_t above = ih_max_s32(0, response - min);
    return above * above;
}

static struct ih_dot dot_at(const int16_t *const *near, int32_t u, int32_t v, int64_t weight_sum,
                            int64_t sum_u, int64_t sum_v)
{
    return (struct ih_dot){
        .u_px_q12 = u * 4096 + (int32_t)ih_div_round(sum_u * 4096, weight_sum),
        .v_px_q12 = v * 4096 + (int32_t)ih_div_round(sum_v * 4096, weight_sum),
        .peak = near[0][u],
    };
}

/* R <= 18,648, and the peak may be the largest of nine only: squared 2^28.4, five of them 2^30.8. Columns
 * behind the fifth fill vectors and are not used. */
struct ih_dot ih_dot_centre(const int16_t *const *near, int32_t u, int32_t v)
{
    const int16_t *row[SIDE];
    int32_t column[COLUMNS];
    int32_t moment[COLUMNS];
    for (int32_t i = 0; i < SIDE; i++) {
        row[i] = &near[i - REACH][u - REACH];
    }
    const int32_t min = row[REACH][REACH] / 4;
    for (int32_t i = 0; i < COLUMNS; i++) {
        const int32_t first = weigh(row[0][i], min);
        const int32_t second = weigh(row[1][i], min);
        const int32_t fourth = weigh(row[3][i], min);
        const int32_t fifth = weigh(row[4][i], min);
        column[i] = first + second + weigh(row[2][i], min) + fourth + fifth;
        moment[i] = 2 * (fifth - first) + fourth - second;
    }
    int64_t weight_sum = 0;
    int64_t sum_v = 0;
    for (int32_t i = 0; i < SIDE; i++) {
        weight_sum += column[i];
        sum_v += moment[i];
    }
    const int64_t sum_u = 2 * ((int64_t)column[4] - column[0]) + column[3] - column[1];
    return dot_at(near, u, v, weight_sum, sum_u, sum_v);
}

/* A row of nine weights is below 2^30.8, 81 below 2^34; offsets of 4 in Q12 2^48. */
struct ih_dot ih_dot_centre_plateau(const int16_t *const *near, int32_t u, int32_t v)
{
    const int32_t min = near[0][u] / 4;
    int64_t weight_sum = 0;
    int64_t sum_u = 0;
    int64_t sum_v = 0;
    for (int32_t dv = -PLATEAU_REACH; dv <= PLATEAU_REACH; dv++) {
        const int16_t *row = &near[dv][u];
        int64_t row_sum = 0;
        for (int32_t du = -PLATEAU_REACH; du <= PLATEAU_REACH; du++) {
            const int32_t weight = weigh(row[du], min);
            row_sum += weight;
            sum_u += (int64_t)weight * du;
        }
        weight_sum += row_sum;
        sum_v += row_sum * dv;
    }
    return dot_at(near, u, v, weight_sum, sum_u, sum_v);
}
