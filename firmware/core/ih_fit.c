#include "ih_fit.h"

#include <string.h>

#include "ih_fix.h"

#define ONE_Q14 (1 << 14)
#define ONE_Q16 (1 << 16)
/* Robust scale by step, mm. */
static const int8_t robust_mm[IH_FIT_STEPS] = {24, 16, 8, 8, 8, 8};
/* Points farther than this many robust scales weigh less than 1/4000 and are passed over. */
#define ROBUST_REACH 8
/* Places nearer to the centre than this have no direction. */
#define RADIUS_LEAST_Q14 819 /* 0.05 */
#define LOW_FROM_Q14 8192    /* 0.5 */
#define LOW_SPAN_Q14 4915    /* 0.3 */
#define LOW_LOSS_Q16 32768   /* 0.5 */
#define PUSH_MAX_MM_Q8 (30 << 8)
#define PUSH_WEIGHT_Q16 32768 /* 0.5 */
/* An entry may be off by this, see ih_ellipsoid. */
#define FRONT_MM_Q8 256
/* (6 mm)^2 over the priors' variances, Q16: 60 mm; 9 hundredths of ln. */
#define PRIOR_CENTRE_Q16 655
#define PRIOR_AXES_Q16 29127
#define STEP_MAX_MM_Q16 (40 << 16)
#define STEP_MAX_LN_Q16 (15 << 16) /* hundredths */
#define LN_MAX_Q16 (35 << 16)
/* Lengths inside a gradient are in units of this, so that it is of order one. */
#define GRADIENT_MM 64
#define SYSTEM_SCALE_BITS 11
#define RIGHT_BITS 20

void ih_fit_params_default(struct ih_fit_params *params)
{
    *params = (struct ih_fit_params){.see_through_mm = 60, .step_count = IH_FIT_STEPS};
}

/* One observation: how far off and how that changes with the unknowns. */
struct row {
    int32_t residual_mm_q8;
    int32_t slope_q14[IH_FIT_UNKNOWNS];
};

/* The gradient's direction and length at a place. */
struct gradient {
    int32_t radius_q14;
    int64_t component_q14[3]; /* s / a, per GRADIENT_MM */
    int64_t length_q14;
};

static bool find_gradient(const struct ih_ellipsoid *ellipsoid, const int32_t place_q14[3],
                          struct gradient *out)
{
    uint64_t radius2_q28 = 0;
    uint64_t length2_q28 = 0;
    for (int axis = 0; axis < 3; axis++) {
        int64_t s = place_q14[axis];
        out->component_q14[axis] =
            ih_div_round(s * (GRADIENT_MM << 8), ellipsoid->semi_mm_q8[axis]);
        radius2_q28 += (uint64_t)(s * s);
        length2_q28 += (uint64_t)(out->component_q14[axis] * out->component_q14[axis]);
    }
    out->radius_q14 = (int32_t)ih_isqrt_u64(radius2_q28);
    out->length_q14 = ih_isqrt_u64(length2_q28);
    return out->radius_q14 >= RADIUS_LEAST_Q14;
}

/* (f - 1) / |grad f|, grad f = (s / a) / f. */
static int32_t distance_mm_q8(const struct gradient *g)
{
    int64_t f = g->radius_q14;
    return ih_saturate_s32(
        ih_div_round(ih_mul_shift(f, f - ONE_Q14, 14) * (GRADIENT_MM << 8), g->length_q14));
}

bool ih_fit_distance(const struct ih_ellipsoid *ellipsoid, const int32_t place_q14[3],
                     int32_t *distance)
{
    struct gradient g;
    if (!find_gradient(ellipsoid, place_q14, &g)) {
        return false;
    }
    *distance = distance_mm_q8(&g);
    return true;
}

static void fill_row(const struct gradient *g, const int32_t place_q14[3], struct row *row)
{
    row->residual_mm_q8 = distance_mm_q8(g);
    for (int axis = 0; axis < 3; axis++) {
        int64_t s2_q14 = ih_mul_shift(place_q14[axis], place_q14[axis], 14);
        row->slope_q14[axis] =
            (int32_t)-ih_div_round(g->component_q14[axis] * ONE_Q14, g->length_q14);
        row->slope_q14[3 + axis] =
            (int32_t)-ih_div_round(s2_q14 * ONE_Q14 * GRADIENT_MM, g->length_q14 * 100);
    }
}

struct system {
    int64_t normal_q16[IH_CHOLESKY_PACKED(IH_FIT_UNKNOWNS)];
    int64_t right_q16[IH_FIT_UNKNOWNS]; /* mm */
};

static void add_row(struct system *system, const struct row *row, int64_t weight_q16)
{
    int32_t at = 0;
    for (int i = 0; i < IH_FIT_UNKNOWNS; i++) {
        IH_IN_RANGE(row->slope_q14[i], -IH_RANGE_SLOPE_Q14, IH_RANGE_SLOPE_Q14);
        int64_t weighted_q16 = ih_mul_shift(weight_q16, row->slope_q14[i], 14);
        for (int j = 0; j <= i; j++) {
            system->normal_q16[at++] += ih_mul_shift(weighted_q16, row->slope_q14[j], 14);
        }
        system->right_q16[i] -= ih_mul_shift(weighted_q16, row->residual_mm_q8, 8);
    }
}

/* (1 + (r / k)^2)^-2; 0 where that is next to nothing. */
static int64_t robust_weight_q16(int32_t residual_mm_q8, int32_t scale_mm)
{
    if (ih_abs_s32(residual_mm_q8) > ROBUST_REACH * scale_mm << 8) {
        return 0;
    }
    int64_t ratio2_q16 =
        ih_div_round((int64_t)residual_mm_q8 * residual_mm_q8, (int64_t)scale_mm * scale_mm);
    int64_t sum_q16 = ONE_Q16 + ratio2_q16;
    return ih_div_round((int64_t)1 << 48, sum_q16 * sum_q16);
}

static int64_t low_weight_q16(int32_t down_q14)
{
    int32_t over_q14 = ih_clamp_s32(down_q14 - LOW_FROM_Q14, 0, LOW_SPAN_Q14);
    return ONE_Q16 - (int64_t)LOW_LOSS_Q16 * over_q14 / LOW_SPAN_Q14;
}

/* What a step's ellipsoid is asked for at every ray. */
struct step {
    struct ih_ellipsoid ellipsoid;
    struct ih_ellipsoid_box box; /* rays that may hit it pass through */
    int32_t scale_mm;
    int32_t reach_mm_q8[3]; /* points farther from the centre have no weight */
};

/* A residual is at least (f - 1) times the shortest semi-axis: it has no weight from f = 1 + 8 k / a
 * on. A 64th more for what is rounded. */
static void begin_step(struct step *step, const struct ih_ellipsoid *ellipsoid,
                       const int32_t slope_most_q20[2], int32_t scale_mm)
{
    const int32_t *semi_mm_q8 = ellipsoid->semi_mm_q8;
    int32_t shortest_q8 = ih_min_s32(ih_min_s32(semi_mm_q8[0], semi_mm_q8[1]), semi_mm_q8[2]);
    int64_t most_q14 =
        ONE_Q14 + ih_div_round((int64_t)ROBUST_REACH * scale_mm * (ONE_Q14 << 8), shortest_q8);
    step->ellipsoid = *ellipsoid;
    step->box = ih_ellipsoid_box(ellipsoid, slope_most_q20, ONE_Q14);
    step->scale_mm = scale_mm;
    for (int axis = 0; axis < 3; axis++) {
        step->reach_mm_q8[axis] =
            (int32_t)ih_mul_shift(most_q14 + most_q14 / 64, semi_mm_q8[axis], 14);
    }
}

static bool has_weight(const struct step *step, const int32_t point_mm_q8[3])
{
    bool near = true;
    for (int axis = 0; axis < 3; axis++) {
        int32_t off_q8 = ih_abs_s32(point_mm_q8[axis] - step->ellipsoid.centre_mm_q8[axis]);
        near = near && off_q8 <= step->reach_mm_q8[axis];
    }
    return near;
}

static void add_point(struct system *system, const struct step *step, const struct ih_ray *ray)
{
    const struct ih_ellipsoid *ellipsoid = &step->ellipsoid;
    int32_t place_q14[3];
    struct gradient g;
    struct row row;
    if (!has_weight(step, ray->point_mm_q8) ||
        !ih_ellipsoid_place(ellipsoid, ray->point_mm_q8, place_q14) ||
        !find_gradient(ellipsoid, place_q14, &g)) {
        return;
    }
    int64_t weight_q16 = robust_weight_q16(distance_mm_q8(&g), step->scale_mm);
    if (weight_q16 > 0) {
        fill_row(&g, place_q14, &row);
        add_row(system, &row, ih_mul_shift(weight_q16, low_weight_q16(place_q14[1]), 16));
    }
}

/* A point seen behind the ellipsoid, through it; nothing is entered before its front. */
static void add_push(struct system *system, const struct step *step, const int32_t origin_mm_q8[3],
                     const struct ih_ray *ray, int32_t see_through_mm)
{
    const struct ih_ellipsoid *ellipsoid = &step->ellipsoid;
    const int32_t through_q8 = ray->point_mm_q8[2] - (see_through_mm << 8);
    struct ih_crossing crossing;
    struct gradient g;
    struct row row;
    if (through_q8 < ellipsoid->centre_mm_q8[2] - ellipsoid->semi_mm_q8[2] - FRONT_MM_Q8 ||
        !ih_ellipsoid_in_box(ellipsoid, &step->box, origin_mm_q8, ray) ||
        !ih_ellipsoid_cross(ellipsoid, origin_mm_q8, ray, &crossing) ||
        crossing.radius2_q14 >= ONE_Q14 || through_q8 <= crossing.entry_mm_q8 ||
        !find_gradient(ellipsoid, crossing.nearest_q14, &g)) {
        return;
    }
    fill_row(&g, crossing.nearest_q14, &row);
    row.residual_mm_q8 = ih_max_s32(row.residual_mm_q8, -PUSH_MAX_MM_Q8);
    add_row(system, &row, PUSH_WEIGHT_Q16);
}

/* The state of an iteration; the axes are the mean head's times exp(ln). */
struct state {
    struct ih_ellipsoid ellipsoid;
    int32_t ln_q16[3]; /* hundredths */
};

static void add_priors(struct system *system, const struct state *state,
                       const struct ih_ellipsoid *start)
{
    for (int axis = 0; axis < 3; axis++) {
        int64_t moved_q8 = (int64_t)state->ellipsoid.centre_mm_q8[axis] - start->centre_mm_q8[axis];
        system->normal_q16[IH_CHOLESKY_PACKED(axis + 1) - 1] += PRIOR_CENTRE_Q16;
        system->right_q16[axis] -= ih_mul_shift(PRIOR_CENTRE_Q16, moved_q8, 8);
        system->normal_q16[IH_CHOLESKY_PACKED(axis + 4) - 1] += PRIOR_AXES_Q16;
        system->right_q16[3 + axis] -= ih_mul_shift(PRIOR_AXES_Q16, state->ln_q16[axis], 16);
    }
}

/* Solve for the step, mm and hundredths of ln in Q16. */
static void solve(const struct system *system, int32_t step_q16[IH_FIT_UNKNOWNS])
{
    int32_t a_q30[IH_CHOLESKY_PACKED(IH_FIT_UNKNOWNS)];
    int32_t right[IH_FIT_UNKNOWNS];
    int32_t bad_pivot, exponent;
    for (int32_t i = 0; i < IH_CHOLESKY_PACKED(IH_FIT_UNKNOWNS); i++) {
        a_q30[i] = ih_saturate_s32(system->normal_q16[i] * (1 << (14 - SYSTEM_SCALE_BITS)));
    }
    for (int i = 0; i < IH_FIT_UNKNOWNS; i++) {
        right[i] = ih_saturate_s32(
            ih_shift_round(system->right_q16[i] * (1 << (RIGHT_BITS - 16)), SYSTEM_SCALE_BITS));
        IH_IN_RANGE(system->normal_q16[IH_CHOLESKY_PACKED(i + 1) - 1], 1, IH_RANGE_FIT_NORMAL_Q16);
    }
    memset(step_q16, 0, IH_FIT_UNKNOWNS * sizeof *step_q16);
    /* The priors keep it positive; if rounding should ever break that, the fit stays where it is. */
    if (ih_cholesky_factor(a_q30, IH_FIT_UNKNOWNS, &bad_pivot) != IH_OK) {
        return;
    }
    ih_cholesky_solve(a_q30, IH_FIT_UNKNOWNS, right, right, &exponent);
    for (int i = 0; i < IH_FIT_UNKNOWNS; i++) {
        int64_t scaled = exponent < 32 ? (int64_t)right[i] * ((int64_t)1 << exponent) : 0;
        step_q16[i] = ih_saturate_s32(ih_shift_round(scaled, RIGHT_BITS - 16));
    }
}

/* exp(x) for |x| <= 0.35, x in hundredths: the series to x^5, its rest is below 3e-6. */
static int32_t exp_q16(int32_t ln_q16)
{
    int64_t x_q24 = ih_div_round((int64_t)ln_q16 * 256, 100);
    int64_t sum_q24 = 1 << 24;
    for (int n = 5; n >= 1; n--) {
        sum_q24 = (1 << 24) + ih_div_round(ih_mul_shift(sum_q24, x_q24, 24), n);
    }
    return (int32_t)ih_shift_round(sum_q24, 8);
}

static void take_step(struct state *state, const int32_t step_q16[IH_FIT_UNKNOWNS])
{
    const struct ih_ellipsoid mean = ih_ellipsoid_mean(state->ellipsoid.centre_mm_q8);
    for (int axis = 0; axis < 3; axis++) {
        int32_t move_q16 = ih_clamp_s32(step_q16[axis], -STEP_MAX_MM_Q16, STEP_MAX_MM_Q16);
        state->ellipsoid.centre_mm_q8[axis] += (int32_t)ih_shift_round(move_q16, 8);
        int32_t grow_q16 = ih_clamp_s32(step_q16[3 + axis], -STEP_MAX_LN_Q16, STEP_MAX_LN_Q16);
        state->ln_q16[axis] = ih_clamp_s32(state->ln_q16[axis] + grow_q16, -LN_MAX_Q16, LN_MAX_Q16);
        state->ellipsoid.semi_mm_q8[axis] =
            (int32_t)ih_mul_shift(mean.semi_mm_q8[axis], exp_q16(state->ln_q16[axis]), 16);
        IH_IN_RANGE(state->ellipsoid.centre_mm_q8[axis], -IH_RANGE_CENTRE_MM_Q8,
                    IH_RANGE_CENTRE_MM_Q8);
        IH_IN_RANGE(state->ellipsoid.semi_mm_q8[axis], IH_ELLIPSOID_SEMI_MIN_MM << 8,
                    IH_ELLIPSOID_SEMI_MAX_MM << 8);
    }
}

/* 100 ln(a / m) = 200 (x + x^3/3 + x^5/5), x = (a - m) / (a + m); its rest is below 3e-4 at 35 %. */
static int32_t ln_ratio_q16(int32_t a_mm_q8, int32_t m_mm_q8)
{
    int64_t x_q24 = ih_div_round(((int64_t)a_mm_q8 - m_mm_q8) * (1 << 24), a_mm_q8 + m_mm_q8);
    int64_t xx_q24 = ih_mul_shift(x_q24, x_q24, 24);
    int64_t series_q24 = ih_div_round(xx_q24, 5) + ih_div_round(1 << 24, 3);
    series_q24 = (1 << 24) + ih_mul_shift(series_q24, xx_q24, 24);
    int64_t ln_q16 = ih_mul_shift(200 * x_q24, series_q24, 32);
    return ih_clamp_s32(ih_saturate_s32(ln_q16), -LN_MAX_Q16, LN_MAX_Q16);
}

void ih_fit_ellipsoid(const struct ih_space *space, const struct ih_fit_params *params,
                      const struct ih_ellipsoid *start, struct ih_ellipsoid *out)
{
    const struct ih_ellipsoid mean = ih_ellipsoid_mean(start->centre_mm_q8);
    struct state state = {.ellipsoid = *start};
    for (int axis = 0; axis < 3; axis++) {
        state.ln_q16[axis] = ln_ratio_q16(start->semi_mm_q8[axis], mean.semi_mm_q8[axis]);
    }
    int32_t slope_most_q20[2];
    ih_space_slope_most(space, slope_most_q20);
    for (int i = 0; i < params->step_count; i++) {
        struct step step;
        struct system system;
        int32_t step_q16[IH_FIT_UNKNOWNS];
        begin_step(&step, &state.ellipsoid, slope_most_q20, robust_mm[i]);
        memset(&system, 0, sizeof system);
        for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
            const struct ih_ray *ray = &space->ray[slot];
            if (ray->state == IH_RAY_SEEN) {
                add_point(&system, &step, ray);
                add_push(&system, &step, space->origin_mm_q8, ray, params->see_through_mm);
            }
        }
        add_priors(&system, &state, start);
        solve(&system, step_q16);
        take_step(&state, step_q16);
    }
    *out = state.ellipsoid;
}
