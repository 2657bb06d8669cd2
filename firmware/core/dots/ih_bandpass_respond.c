#include "dots/ih_bandpass_respond.h"

#include <stdbool.h>
#include <stddef.h>

#include "base/ih_fix.h"
#include "simd/ih_simd.h"
#include "simd/ih_simd_cortexm.h"

#define INNER IH_BANDPASS_INNER
#define OUTER IH_BANDPASS_OUTER
#define SIDE IH_BANDPASS_SIDE
#define GROUP IH_BANDPASS_GROUP
#define RESPONSE_SHIFT 8

#if IH_CORTEXM
#include "dots/ih_bandpass_cortexm.h"
#else
static inline bool is_any_above(const int16_t *response, int16_t limit)
{
    int16_t max = 0;
    for (int32_t i = 0; i < GROUP; i++) {
        max = (int16_t)(response[i] > max ? response[i] : max);
    }
    return max > limit;
}

#if IH_I16_LANES > 0
/* Where sums and R of the next group are. */
struct place {
    const uint16_t *above, *middle, *below;
    const uint16_t *left, *centre, *right; /* sums of nine */
    uint16_t *response;
};

static inline struct place place_of(const struct ih_bandpass_rows *rows, const uint16_t *nine,
                                    int32_t u, int16_t *response)
{
    return (struct place){&rows->above[u], &rows->middle[u],    &rows->below[u],         &nine[u],
                          &nine[u + SIDE], &nine[u + 2 * SIDE], (uint16_t *)&response[u]};
}

/* (81 i + 8) / 16 - b of a group. The larger R of each few lanes. */
__attribute__((always_inline)) static inline ih_i16 respond_group(struct place *at, int32_t u)
{
    const struct ih_u16_32 sides =
        ih_u16_32_add(ih_u16_32_next(&at->above, u), ih_u16_32_next(&at->below, u));
    const struct ih_u16_32 sum = ih_u16_32_add_twice(sides, ih_u16_32_next(&at->middle, u));
    const struct ih_u16_32 box =
        ih_u16_32_add(ih_u16_32_next(&at->left, u), ih_u16_32_next(&at->centre, u));
    struct ih_u16_32 response =
        ih_u16_32_add(ih_u16_32_add_81_16ths(box, sum), ih_u16_32_next(&at->right, u));
    ih_u16_32_put(&at->response, u, &response);
    return ih_u16_32_max(response);
}

/* The last group ends with the row; some of its lanes are there already. */
static void respond_bytes(const struct ih_bandpass_rows *rows, const uint16_t *nine, int32_t first,
                          int32_t width, int16_t *response)
{
    const struct ih_bandpass_rows in = *rows;
    for (int32_t u = first; u < width; u += GROUP) {
        struct place at = place_of(&in, nine, ih_min_s32(u, width - GROUP), response);
        (void)respond_group(&at, 0);
    }
}
#else
static void respond_bytes(const struct ih_bandpass_rows *rows, const uint16_t *nine, int32_t first,
                          int32_t width, int16_t *restrict response)
{
    const uint16_t *above = rows->above;
    const uint16_t *middle = rows->middle;
    const uint16_t *below = rows->below;
    for (int32_t u = first; u < width; u++) {
        const uint16_t sum = (uint16_t)(above[u] + 2 * middle[u] + below[u]);
        const uint16_t half_up = (uint16_t)(sum + OUTER / 2);
        const uint16_t box = (uint16_t)(nine[u] + nine[u + SIDE] + nine[u + 2 * SIDE]);
        response[u] = (int16_t)(INNER / OUTER * sum + half_up / OUTER - box);
    }
}
#endif
#endif

/* Groups from pixel u on join the listed ones, without a branch: a group that is not above its limit is
 * overwritten by the next. A misprediction costs more than a group. */
static void list_groups(struct ih_bandpass_row *out, int32_t u, int32_t width, int32_t listed)
{
    int32_t count = listed;
    if (out->limit == NULL) {
        return;
    }
    for (int32_t first = u; first < width; first += GROUP) {
        out->first[count] = (int16_t)first;
        count += is_any_above(&out->response[first], out->limit[first / GROUP]);
    }
    out->count = count;
}

#if !IH_CORTEXM && IH_I16_LANES > 0
/* Whole groups are listed while their R is in registers. */
__attribute__((always_inline)) static inline int32_t
respond_and_list(const struct ih_bandpass_rows *rows, const uint16_t *restrict nine, int32_t groups,
                 const int16_t *restrict limit, int16_t *restrict response, int16_t *restrict first)
{
    struct place at = place_of(rows, nine, 0, response);
    size_t group = 0, listed = 0;
    for (int32_t u = 0; u < GROUP * groups; u += GROUP) {
        const ih_i16 max = respond_group(&at, u);
        first[listed] = (int16_t)u;
        listed += ih_i16_any_above(max, limit[group]);
        group++;
    }
    return (int32_t)listed;
}

void ih_bandpass_respond_bytes(const struct ih_bandpass_rows *rows, const uint16_t *nine,
                               int32_t width, struct ih_bandpass_row *out)
{
    const int32_t groups = out->limit != NULL ? width / GROUP : 0;
    const int32_t listed =
        respond_and_list(rows, nine, groups, out->limit, out->response, out->first);
    respond_bytes(rows, nine, GROUP * groups, width, out->response);
    list_groups(out, GROUP * groups, width, listed);
}
#else
void ih_bandpass_respond_bytes(const struct ih_bandpass_rows *rows, const uint16_t *nine,
                               int32_t width, struct ih_bandpass_row *out)
{
    respond_bytes(rows, nine, 0, width, out->response);
    list_groups(out, 0, width, 0);
}
#endif

void ih_bandpass_respond_grey(const struct ih_bandpass_rows *rows_q4, const uint32_t *nine_q4,
                              int32_t width, struct ih_bandpass_row *out)
{
    int16_t *restrict response = out->response;
    for (int32_t u = 0; u < width; u++) {
        const int32_t sum = rows_q4->above[u] + 2 * rows_q4->middle[u] + rows_q4->below[u];
        const int32_t box = (int32_t)(nine_q4[u] + nine_q4[u + SIDE] + nine_q4[u + 2 * SIDE]);
        response[u] =
            (int16_t)((INNER * sum - OUTER * box + (1 << (RESPONSE_SHIFT - 1))) >> RESPONSE_SHIFT);
    }
    list_groups(out, 0, width, 0);
}
