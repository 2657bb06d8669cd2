#include "fuzz_tables.h"

#include <string.h>

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
