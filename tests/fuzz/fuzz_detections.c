/* Samples, rays, scan, fits, evidence, scores and detections from any points. Input: rig, points, over-exposed
 * blocks, expected heads, hypotheses. */
#include <string.h>

#include "fuzz_check.h"
#include "fuzz_rig.h"

#define NORMALISED_MAX_Q28 INT32_MAX
#define CHANGES_MAX 64

/* A scene of noise, plane and head, in slots; then points as the input says. */
static void fill_points(struct fuzz_input *input, const struct ih_rig *rig, struct ih_points *out)
{
    const int32_t far_q8 = rig->calibration.far_mm << 8;
    int32_t base_mm = fuzz_within(input, 100, 4000), wall_mm = fuzz_within(input, 100, 4000);
    int32_t pitch_q28 = fuzz_within(input, 1 << 20, 1 << 26), noise_mm = fuzz_within(input, 0, 127);
    int32_t bent_mm = fuzz_within(input, 0, 31), size2 = fuzz_within(input, 0, 127);
    int32_t missing = fuzz_within(input, 0, 127);
    uint32_t seed = fuzz_byte(input);
    memset(out, 0, sizeof *out);
    fuzz_tables_field(input, &out->field);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        struct ih_point *point = &out->point[slot];
        int32_t x = slot % IH_GRID - IH_GRID / 2, y = slot / IH_GRID - IH_GRID / 2;
        int32_t distance2 = 3 * x * x + 2 * y * y;
        int64_t depth_q8 =
            distance2 <= size2 ? (base_mm + bent_mm * distance2) * 256 : wall_mm * 256;
        depth_q8 += (int64_t)noise_mm * fuzz_noise(&seed) / 256;
        point->x_q28 = pitch_q28 / 19 * x * 2;
        point->y_q28 = pitch_q28 / 19 * y * 2;
        if (fuzz_noise(&seed) % 128 >= missing) {
            point->state = IH_POINT_SEEN;
            point->depth_mm_q8 = (int32_t)(depth_q8 > far_q8 ? far_q8 : depth_q8);
        }
    }
    for (int32_t count = fuzz_byte(input) % CHANGES_MAX; count > 0; count--) {
        struct ih_point *point = &out->point[fuzz_within(input, 0, IH_SLOTS - 1)];
        point->x_q28 = fuzz_within(input, -NORMALISED_MAX_Q28, NORMALISED_MAX_Q28);
        point->y_q28 = fuzz_within(input, -NORMALISED_MAX_Q28, NORMALISED_MAX_Q28);
        point->state = fuzz_byte(input) % 3;
        point->depth_mm_q8 = point->state == IH_POINT_SEEN ? fuzz_within(input, 1 << 8, far_q8) : 0;
    }
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        out->seen_count += out->point[slot].state == IH_POINT_SEEN;
    }
}

static void fill_heads(struct fuzz_input *input, struct ih_hypotheses *out)
{
    memset(out, 0, sizeof *out);
    out->hypothesis_count = fuzz_byte(input) % (IH_NESTS_MAX + 1);
    for (int32_t i = 0; i < out->hypothesis_count; i++) {
        struct ih_hypothesis *h = &out->hypothesis[i];
        struct ih_ellipsoid head;
        fuzz_tables_head(input, &head);
        memcpy(h->centre_mm_q8, head.centre_mm_q8, sizeof h->centre_mm_q8);
        h->extent_mm_q8 = fuzz_within(input, 0, 110 << 8);
        h->upright_q16 = fuzz_within(input, 0, INT32_MAX);
        h->nest = i;
    }
}

static void select_samples(const struct ih_points *points, const struct ih_dots *dots,
                           const struct ih_rig *rig)
{
    static struct ih_samples samples;
    struct ih_samples_params params;
    ih_samples_params_default(&params);
    ih_samples_select(points, dots, rig, &params, &samples);
    fuzz_check_samples(&samples, points);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct ih_points points;
    static struct ih_dots dots;
    static struct ih_hypotheses hypotheses;
    static struct ih_detections_scratch scratch;
    static struct ih_detections detections;
    struct ih_expected expected = {0};
    struct ih_detections_params params;
    struct fuzz_input input = {data, size};
    const struct ih_rig *rig = fuzz_tables_rig(&input);
    bool is_range = rig->calibration.kind == IH_RIG_RANGE;
    int32_t windows = is_range ? fuzz_within(&input, 1, 3) : 1;
    ih_detections_params_default(&params);
    expected.count = fuzz_byte(&input) % (IH_DETECTIONS_EXPECTED_MAX + 1);
    for (int32_t i = 0; i < expected.count; i++) {
        fuzz_tables_head(&input, &expected.head[i]);
    }
    expected.last_sure_count = fuzz_byte(&input) % (IH_DETECTIONS_EXPECTED_MAX + 1);
    for (int32_t i = 0; i < expected.last_sure_count; i++) {
        fuzz_tables_head(&input, &expected.last_sure[i]);
    }
    memset(&detections, 0xa5, sizeof detections);
    memset(&scratch, 0xa5, sizeof scratch);
    memset(&dots, fuzz_byte(&input) % 8 == 7 ? 0xff : 0, sizeof dots);
    ih_detections_begin(&detections);
    for (int32_t i = 0; i < windows; i++) {
        fill_points(&input, rig, &points);
        fill_heads(&input, &hypotheses);
        select_samples(&points, is_range ? NULL : &dots, rig);
        ih_detections_add(&points, is_range ? NULL : &dots, &hypotheses, &expected, rig, &params,
                          &scratch, &detections);
        fuzz_check_detections(&detections);
    }
    return 0;
}
