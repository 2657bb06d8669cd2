#include "fuzz_rig.h"

#include <math.h>
#include <string.h>

#define AXES 3

struct dots_rig {
    double focal_px, k1, p1;
    double origin_mm[AXES];
    double pitch, rotation, tilt; /* of the pattern: slope from dot to dot, radians, slope */
    int32_t near_mm, far_mm;
    double up[AXES]; /* all 0: level */
};

static const struct dots_rig dots_rig[FUZZ_RIGS_DOTS] = {
    {330, 0, 0, {-12.5, 0, 0}, 0.030, 0, 0, 400, 2500, {0}},
    {300, -0.15, 0.001, {-125, 3, 5}, 0.032, 0.05, 0.1, 500, 3000, {0}},
    {250, 0.05, 0, {2, -60, -10}, 0.055, -0.1, 0, 100, 16000, {0}},
    {420, 0, 0, {-20, 15, 60}, 0.025, 0.3, -0.1, 300, 4000, {0.36, 0.48, -0.8}},
};

static int32_t fixed(double value, int fraction_bits)
{
    return (int32_t)lround(ldexp(value, fraction_bits));
}

static void make_ray(const struct dots_rig *from, int32_t slot, int32_t ray_q30[AXES])
{
    double column = slot % IH_GRID - (IH_GRID - 1) / 2;
    double row = slot / IH_GRID - (IH_GRID - 1) / 2;
    double x =
        from->pitch * (cos(from->rotation) * column - sin(from->rotation) * row) + from->tilt;
    double y = from->pitch * (sin(from->rotation) * column + cos(from->rotation) * row);
    double length = sqrt(x * x + y * y + 1);
    ray_q30[0] = fixed(x / length, 30);
    ray_q30[1] = fixed(y / length, 30);
    ray_q30[2] = fixed(1 / length, 30);
}

static void make_dots(int index, struct ih_calibration *c)
{
    const struct dots_rig *from = &dots_rig[index];
    *c = (struct ih_calibration){
        .kind = IH_RIG_DOTS,
        .width = 320,
        .height = 240,
        .fx_px_q16 = fixed(from->focal_px, 16),
        .fy_px_q16 = fixed(from->focal_px * 1.01, 16),
        .cx_px_q16 = fixed(159.5 + index, 16),
        .cy_px_q16 = fixed(119.5 - index, 16),
        .k1_q24 = fixed(from->k1, 24),
        .p1_q24 = fixed(from->p1, 24),
        .near_mm = from->near_mm,
        .far_mm = from->far_mm,
    };
    for (int axis = 0; axis < AXES; axis++) {
        c->origin_mm_q16[axis] = fixed(from->origin_mm[axis], 16);
        c->up_q30[axis] = fixed(from->up[axis], 30);
    }
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        make_ray(from, slot, c->ray_q30[slot]);
    }
}

static void make_range(int index, struct ih_calibration *c)
{
    *c = (struct ih_calibration){
        .kind = IH_RIG_RANGE,
        .width = index == 0 ? 64 : 128,
        .height = index == 0 ? 64 : 72,
        .fx_px_q16 = fixed(index == 0 ? 60 : 140, 16),
        .fy_px_q16 = fixed(index == 0 ? 60 : 135, 16),
        .cx_px_q16 = fixed(index == 0 ? 31.5 : 70, 16),
        .cy_px_q16 = fixed(index == 0 ? 31.5 : 30, 16),
        .k1_q24 = fixed(index == 0 ? 0 : -0.1, 24),
        .near_mm = index == 0 ? 100 : 400,
        .far_mm = index == 0 ? 16000 : 4000,
        .up_q30 = {fixed(index == 0 ? 0 : 0.8, 30), 0, fixed(index == 0 ? 0 : 0.6, 30)},
    };
}

static void start(struct isohead *core, const struct ih_calibration *calibration)
{
    int32_t bad_slot = IH_NONE;
    FUZZ_CHECK(isohead_init(core, calibration, &bad_slot) == IH_OK);
}

const struct isohead *fuzz_rig_dots_core(int index)
{
    static struct isohead core[FUZZ_RIGS_DOTS];
    static bool is_made[FUZZ_RIGS_DOTS];
    if (!is_made[index]) {
        struct ih_calibration calibration;
        make_dots(index, &calibration);
        start(&core[index], &calibration);
        is_made[index] = true;
    }
    return &core[index];
}

const struct isohead *fuzz_rig_range_core(int index)
{
    static struct isohead core[FUZZ_RIGS_RANGE];
    static bool is_made[FUZZ_RIGS_RANGE];
    if (!is_made[index]) {
        struct ih_calibration calibration;
        make_range(index, &calibration);
        start(&core[index], &calibration);
        is_made[index] = true;
    }
    return &core[index];
}

const struct ih_rig *fuzz_rig_dots(int index)
{
    return &fuzz_rig_dots_core(index)->rig;
}

const struct ih_rig *fuzz_rig_range(int index)
{
    return &fuzz_rig_range_core(index)->rig;
}
