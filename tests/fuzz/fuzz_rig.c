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

#define UNIT_MIN_Q28 ((1 << 28) / 1000)
#define UNIT_MAX_Q28 (1 << 25)
#define CENTRE_MAX_Q28 (1 << 29)
/* Of a head's centre, 1/256 mm: nearly the header's 2^26. */
#define PLACE_MAX_Q8 (60 << 20)

const struct ih_rig *fuzz_tables_rig(struct fuzz_input *input)
{
    uint8_t which = fuzz_byte(input) % (FUZZ_RIGS_DOTS + FUZZ_RIGS_RANGE);
    return which < FUZZ_RIGS_DOTS ? fuzz_rig_dots(which) : fuzz_rig_range(which - FUZZ_RIGS_DOTS);
}

void fuzz_tables_field(struct fuzz_input *input, struct ih_field *out)
{
    out->centre_x_q28 = fuzz_within(input, -CENTRE_MAX_Q28, CENTRE_MAX_Q28);
    out->centre_y_q28 = fuzz_within(input, -CENTRE_MAX_Q28, CENTRE_MAX_Q28);
    out->unit_q28 = fuzz_within(input, UNIT_MIN_Q28, UNIT_MAX_Q28);
}

static int32_t limited(int64_t value, int32_t low, int32_t high)
{
    return (int32_t)(value < low ? low : value > high ? high : value);
}

/* A place on a lattice of half the field, moved. */
static int32_t place_q16(int32_t index, int32_t pitch_q16, int32_t noise_q16)
{
    const int32_t max = (IH_SAMPLES_REACH << 16) - 1;
    return limited((int64_t)(index - (IH_GRID - 1) / 2) * pitch_q16 + noise_q16, -max, max);
}

void fuzz_tables_samples(struct fuzz_input *input, struct ih_samples *out)
{
    uint32_t seed = fuzz_byte(input);
    int32_t pitch_q16 = fuzz_within(input, 0, 5 << 16), off_q16 = fuzz_within(input, 0, 40 << 16);
    int32_t base_mm = fuzz_within(input, 1, 16000), span_mm = fuzz_within(input, 0, 16000);
    int32_t bent_mm = fuzz_within(input, -64, 63), missing = fuzz_within(input, 0, 127);
    memset(out, 0, sizeof *out);
    out->nearest_mm_q8 = INT32_MAX;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        int32_t x = slot % IH_GRID - IH_GRID / 2, y = slot / IH_GRID - IH_GRID / 2;
        int64_t depth_mm_q8 = (int64_t)(base_mm + bent_mm * (x * x + y * y)) * 256 +
                              (int64_t)span_mm * 256 * fuzz_noise(&seed) / 65536;
        if (fuzz_noise(&seed) % 128 < missing) {
            continue;
        }
        struct ih_sample *sample = &out->sample[out->sample_count++];
        sample->slot = slot;
        sample->x_q16 =
            place_q16(slot % IH_GRID, pitch_q16, off_q16 / 32768 * (fuzz_noise(&seed) - 32768));
        sample->y_q16 =
            place_q16(slot / IH_GRID, pitch_q16, off_q16 / 32768 * (fuzz_noise(&seed) - 32768));
        sample->depth_mm_q8 = limited(depth_mm_q8, 1 << 8, IH_DEPTH_MAX_MM << 8);
        sample->root_weight_q15 = 1 << 15;
    }
    for (int32_t count = fuzz_within(input, 0, 127); count > 0 && out->sample_count > 0; count--) {
        struct ih_sample *sample =
            &out->sample[fuzz_within(input, 0, IH_SLOTS - 1) % out->sample_count];
        sample->x_q16 =
            fuzz_within(input, -(IH_SAMPLES_REACH << 16) + 1, (IH_SAMPLES_REACH << 16) - 1);
        sample->y_q16 =
            fuzz_within(input, -(IH_SAMPLES_REACH << 16) + 1, (IH_SAMPLES_REACH << 16) - 1);
        sample->depth_mm_q8 = fuzz_within(input, 1 << 8, IH_DEPTH_MAX_MM << 8);
        sample->root_weight_q15 = fuzz_within(input, 1, 1 << 15);
        sample->is_filled = fuzz_byte(input) % 2 == 1;
    }
    for (int32_t i = 0; i < out->sample_count; i++) {
        out->filled_count += out->sample[i].is_filled;
        out->seen_count += !out->sample[i].is_filled;
        out->nearest_mm_q8 = out->sample[i].depth_mm_q8 < out->nearest_mm_q8
                                 ? out->sample[i].depth_mm_q8
                                 : out->nearest_mm_q8;
        out->clip_mm_q8 = out->sample[i].depth_mm_q8 > out->clip_mm_q8 ? out->sample[i].depth_mm_q8
                                                                       : out->clip_mm_q8;
    }
}

void fuzz_tables_head(struct fuzz_input *input, struct ih_ellipsoid *out)
{
    static const int32_t mean_mm[3] = {78, 113, 98};
    bool is_near = fuzz_byte(input) % 4 != 0;
    for (int axis = 0; axis < 3; axis++) {
        int32_t min = axis == 2 && is_near ? 200 << 8 : -(500 << 8);
        out->centre_mm_q8[axis] = is_near ? fuzz_within(input, min, 1500 << 8)
                                          : fuzz_within(input, -PLACE_MAX_Q8, PLACE_MAX_Q8);
        /* e^-0.35 and e^0.35 of the mean */
        out->semi_mm_q8[axis] =
            fuzz_within(input, mean_mm[axis] * 256 * 71 / 100, mean_mm[axis] * 256 * 141 / 100);
    }
}
