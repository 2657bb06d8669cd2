#include "sim_up.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define LABELS_MIN 60
#define FRAMES_MIN 5
/* Hardly any: fewer than one of so many. */
#define HARDLY_DIVISOR 10
/* How far heads lie apart along an axis; fits to a thing that stays differ by 10 mm. */
#define MOVED_MIN_MM_Q8 (20 * 256)
/* An up that is so near to the rig's is none other: the cosine of 25 degrees. */
#define SAME_COSINE 0.9063
#define ONE_Q30 1073741824.0
#define TEXT_MAX 4608

static const struct {
    const char *text;
    int sine, cosine; /* of the roll */
} sides[] = {
    {"top", 0, 1},
    {"right side", 1, 0},
    {"left side", -1, 0},
    {"bottom", 0, -1},
};
#define SIDES (int)(sizeof sides / sizeof sides[0])

static const struct {
    const char *text;
    double sine, cosine;
} tilts[] = {
    {"", 0.0, 1.0},
    {", the camera looks down by about 30 degrees", 0.5, 0.86602540378},
    {", the camera looks up by about 30 degrees", -0.5, 0.86602540378},
    {", the camera looks down by about 45 degrees", 0.70710678119, 0.70710678119},
    {", the camera looks up by about 45 degrees", -0.70710678119, 0.70710678119},
};
#define TILTS (int)(sizeof tilts / sizeof tilts[0])

#define TRIALS (SIDES * TILTS)

/* One up that is tried. */
struct trial {
    double up[3];
    int32_t hit_count, miss_count;
    int64_t probability_sum_q16;
    int32_t min_mm_q8[3], max_mm_q8[3]; /* of the heads' centres */
    bool is_over; /* it cannot come to half of the sample any more, or is the rig's own */
};

static bool has_enough(const struct isohead *head)
{
    return head->rig.calibration.kind == IH_RIG_RANGE || head->labels.labelled_count >= LABELS_MIN;
}

/* A full table keeps every other one. */
static void thin_out(struct sim_up *up)
{
    for (int32_t i = 0; i < SIM_UP_SAMPLES / 2; i++) {
        up->sample[i] = up->sample[2 * i];
    }
    up->sample_count = SIM_UP_SAMPLES / 2;
    up->step *= 2;
}

void sim_up_frame(struct sim_up *up, const struct isohead *head, size_t index)
{
    if (!has_enough(head)) {
        return;
    }
    up->step = up->step == 0 ? 1 : up->step;
    if (up->enough_count % up->step == 0 && up->sample_count == SIM_UP_SAMPLES) {
        thin_out(up);
    }
    if (up->enough_count % up->step == 0) {
        up->sample[up->sample_count++] = index;
    }
    up->enough_count++;
    up->head_count += head->result.selected != IH_NONE;
}

static void fill_trials(struct trial trials[TRIALS], const struct ih_calibration *rig)
{
    const int32_t *own = rig->up_q30;
    const bool is_level = own[0] == 0 && own[1] == 0 && own[2] == 0;
    for (int i = 0; i < TRIALS; i++) {
        const int side = i % SIDES, tilt = i / SIDES;
        const double up[3] = {
            tilts[tilt].cosine * sides[side].sine,
            -tilts[tilt].cosine * sides[side].cosine,
            -tilts[tilt].sine,
        };
        const double cosine =
            is_level ? -up[1] : (up[0] * own[0] + up[1] * own[1] + up[2] * own[2]) / ONE_Q30;
        trials[i] = (struct trial){.is_over = cosine > SAME_COSINE};
        memcpy(trials[i].up, up, sizeof up);
    }
}

static void add_head(struct trial *trial, const struct ih_result_entry *head)
{
    for (int axis = 0; axis < 3; axis++) {
        const int32_t mm_q8 = head->centre_mm_q8[axis];
        const bool is_first = trial->hit_count == 0;
        if (is_first || mm_q8 < trial->min_mm_q8[axis]) {
            trial->min_mm_q8[axis] = mm_q8;
        }
        if (is_first || mm_q8 > trial->max_mm_q8[axis]) {
            trial->max_mm_q8[axis] = mm_q8;
        }
    }
    trial->hit_count++;
    trial->probability_sum_q16 += head->probability_q16;
}

/* A thing of the room, that looks like a head from this side, stays where it is. */
static bool has_moved(const struct trial *trial)
{
    bool moved = false;
    for (int axis = 0; axis < 3; axis++) {
        moved = moved || trial->max_mm_q8[axis] - trial->min_mm_q8[axis] >= MOVED_MIN_MM_Q8;
    }
    return moved;
}

/* The frame by itself, as if this were up. */
static void try_up(struct trial *trial, struct isohead *head, struct ih_calibration rig,
                   const struct ih_frame *view)
{
    int32_t bad_slot = IH_NONE;
    for (int axis = 0; axis < 3; axis++) {
        rig.up_q30[axis] = (int32_t)lround(trial->up[axis] * ONE_Q30);
    }
    bool good = isohead_init(head, &rig, &bad_slot) == IH_OK;
    head->params.tracks.gap_us = -1; /* accepted by its own probability */
    good = good && isohead_frame(head, view, NULL, 0) == IH_OK;
    if (good && head->result.selected != IH_NONE) {
        add_head(trial, &head->result.entry[head->result.selected]);
    } else {
        trial->miss_count++;
    }
}

/* The best one of so many sides, the top first, or NULL. */
static const struct trial *find_best(const struct trial trials[TRIALS], int side_count)
{
    const struct trial *best = NULL;
    for (int i = 0; i < TRIALS; i++) {
        const struct trial *trial = &trials[i];
        const bool is_good =
            i % SIDES < side_count && !trial->is_over && trial->hit_count >= FRAMES_MIN;
        if (is_good && (best == NULL || trial->hit_count > best->hit_count ||
                        (trial->hit_count == best->hit_count &&
                         trial->probability_sum_q16 > best->probability_sum_q16))) {
            best = trial;
        }
    }
    return best;
}

/* Most cameras have the picture's top up: a head that lies on its side looks much like one. */
static const struct trial *find_likely(const struct trial trials[TRIALS])
{
    const struct trial *best = find_best(trials, SIDES);
    const struct trial *top = find_best(trials, 1);
    if (best == NULL || top == NULL) {
        return best;
    }
    return 4 * top->probability_sum_q16 >= 3 * best->probability_sum_q16 ? top : best;
}

/* A frame of the sample with every up that may still be right. */
static void try_frame(struct trial trials[TRIALS], const struct sim_up *up, size_t index,
                      const struct sim_up_source *source, const struct ih_rig *rig)
{
    struct hal_camera *camera = &source->replay->camera;
    struct hal_frame frame;
    struct hal_error error;
    struct ih_frame view;
    source->replay->next_index = index;
    if (camera->next(camera->context, &frame, &error) != HAL_NEXT_FRAME) {
        return; /* read before, and gone now */
    }
    bool good = sim_cloud_view(source->cloud, &frame, rig, &view, &error);
    for (int i = 0; good && i < TRIALS; i++) {
        if (!trials[i].is_over) {
            try_up(&trials[i], source->head, rig->calibration, &view);
            trials[i].is_over = 2 * trials[i].miss_count > up->sample_count;
        }
    }
    camera->release(camera->context, &frame);
}

void sim_up_report(const struct sim_up *up, const struct sim_up_source *source,
                   struct sim_report *report)
{
    const struct ih_rig rig = source->head->rig;
    struct trial trials[TRIALS];
    char text[TEXT_MAX];
    if (up->enough_count < FRAMES_MIN || up->head_count * HARDLY_DIVISOR >= up->enough_count) {
        return;
    }
    fill_trials(trials, &rig.calibration);
    for (int32_t i = 0; i < up->sample_count; i++) {
        try_frame(trials, up, up->sample[i], source, &rig);
    }
    const struct trial *best = find_likely(trials);
    if (best == NULL || !has_moved(best)) {
        return;
    }
    const int index = (int)(best - trials);
    snprintf(text, sizeof text,
             "%" PRId32 " of %" PRId32 " frames have a head, but %" PRId32 " of %" PRId32
             " would with \"up\": [%.4g, %.4g, %.4g] (the picture's %s is up%s): if the camera "
             "hangs so, enter that in %s (docs/calibration.md)",
             up->head_count, up->enough_count, best->hit_count, best->hit_count + best->miss_count,
             best->up[0] + 0.0, best->up[1] + 0.0, best->up[2] + 0.0, sides[index % SIDES].text,
             tilts[index / SIDES].text, source->rig);
    sim_report_hint(report, source->dir, text);
}
