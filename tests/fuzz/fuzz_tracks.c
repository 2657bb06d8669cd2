/* Tracks and the result from any detections, over several frames. Input: parameters, then frames: the
 * step in time, detections, views. */
#include <string.h>

#include "detect/ih_score.h"
#include "fuzz_check.h"
#include "fuzz_rig.h"

#define FRAMES_MAX 32
#define FRONT_MIN_MM 150
#define LOGIT_MAX_Q10 (1 << 14)

static void fill_params(struct fuzz_input *input, struct ih_tracks_params *params)
{
    uint8_t flags = fuzz_byte(input);
    ih_tracks_params_default(params);
    params->side = fuzz_byte(input) % 3;
    if ((flags & 1) != 0) {
        params->gap_us = fuzz_within(input, -1, 2000000);
        params->coast_us = fuzz_within(input, 0, 2000000);
    }
    if ((flags & 2) != 0) {
        params->measured_mm = fuzz_within(input, 4, 500);
        params->acceleration_mm_s2 = fuzz_within(input, 0, 8191);
    }
    if ((flags & 4) != 0) {
        params->gate_mm = fuzz_within(input, 0, 1000);
        params->gate_mm_per_s = fuzz_within(input, 0, 3000);
        params->switch_frames = fuzz_within(input, 0, 8);
    }
    if ((flags & 8) != 0) {
        params->blind_us = fuzz_within(input, 0, 2000000);
    }
}

/* As ih_detections leaves them: sorted by their log-odds, none before front_min_mm. */
static void fill_detections(struct fuzz_input *input, struct ih_detections *out)
{
    memset(out, 0xa5, sizeof *out);
    ih_detections_begin(out);
    out->seen_count = fuzz_within(input, 0, 8 * IH_SLOTS);
    int32_t count = fuzz_byte(input) % (IH_DETECTIONS_MAX + 1);
    int32_t logit_q10 = LOGIT_MAX_Q10;
    for (int32_t i = 0; i < count; i++) {
        struct ih_detection *detection = &out->detection[out->detection_count++];
        memset(detection, 0, sizeof *detection);
        fuzz_tables_head(input, &detection->head);
        int32_t nearest_q8 = FRONT_MIN_MM * 256 + detection->head.semi_mm_q8[2];
        if (detection->head.centre_mm_q8[2] < nearest_q8) {
            detection->head.centre_mm_q8[2] = nearest_q8;
        }
        logit_q10 -= fuzz_within(input, 0, 8 << 10);
        detection->logit_q10 = logit_q10 > -LOGIT_MAX_Q10 ? logit_q10 : -LOGIT_MAX_Q10;
        detection->probability_q16 = ih_score_probability_q16(detection->logit_q10);
        detection->source = IH_SOURCE_SCAN;
    }
    for (int32_t i = 0; i < IH_DETECTIONS_EXPECTED_MAX; i++) {
        uint8_t rays = fuzz_byte(input);
        out->view[i] = (struct ih_view){rays % 8 * 5, rays / 8 % 8 * 5, rays / 64 * 10};
    }
}

static void check_expected(const struct ih_expected *expected, const struct ih_tracks *tracks)
{
    FUZZ_CHECK(expected->count == tracks->track_count);
    for (int32_t i = 0; i < expected->count; i++) {
        FUZZ_CHECK(memcmp(&expected->head[i], &tracks->track[i].filter.head,
                          sizeof expected->head[i]) == 0);
    }
    FUZZ_CHECK(expected->last_sure_count >= 0 && expected->last_sure_count <= expected->count);
    for (int32_t i = 0; i < expected->last_sure_count; i++) {
        for (int axis = 0; axis < 3; axis++) {
            const int32_t centre_mm_q8 = expected->last_sure[i].centre_mm_q8[axis];
            FUZZ_CHECK(centre_mm_q8 > -(1 << 27) && centre_mm_q8 < 1 << 27);
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct ih_tracks tracks;
    static struct ih_detections detections;
    static struct ih_predicted predicted;
    static struct ih_result result;
    struct fuzz_input input = {data, size};
    struct ih_tracks_params params;
    struct ih_expected expected;
    int64_t time_us = 0;
    const struct ih_rig *rig = fuzz_tables_rig(&input);
    fill_params(&input, &params);
    ih_tracks_init(&tracks);
    tracks.last_id = fuzz_byte(&input) % 4 == 3 ? INT32_MAX - 2 : 0;
    for (int frame = 0; frame < FRAMES_MAX && input.left > 0; frame++) {
        time_us = fuzz_next_time_us(&input, time_us);
        ih_tracks_expect(&tracks, &params, time_us, &expected);
        check_expected(&expected, &tracks);
        fill_detections(&input, &detections);
        ih_tracks_update(&tracks, &params, rig, &detections, &predicted);
        fuzz_check_tracks(&tracks, &detections, &predicted);
        ih_result_from_tracks(&detections, &tracks, &predicted, rig, &result);
        fuzz_check_result(&result, FUZZ_SIGMA_MAX_MM);
        FUZZ_CHECK(result.selected == tracks.selected);
    }
    return 0;
}
