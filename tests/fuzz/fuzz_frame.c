/* The whole core on camera frames. Input: the rig and how it is used, then commands that paint a frame
 * and commands that have it looked at, so that one input shows several frames, as tracks need.
 *
 * A command is a byte and its arguments:
 *   0  look at the frame          4  rectangle of one grey
 *   1  noise all over             5  bytes as they are, repeated, from a place on
 *   2  one dot                    6  the frame as it is becomes the ambient one
 *   3  the pattern on a scene     7  look at a frame whose view is malformed
 */
#include <cjson/cJSON.h>
#include <string.h>

#include "app_record.h"
#include "app_view.h"

#include "fuzz_check.h"
#include "fuzz_rig.h"
#include "rig/ih_camera.h"

/* Frames that one input may have looked at, and commands: bounds its time. */
#define LOOKS_MAX 4
#define COMMANDS_MAX 64
#define RAW_MAX 256
#define COMMANDS 8

struct canvas {
    struct isohead *core;
    struct isohead *twin; /* the same frames, from other scratch, in two halves */
    bool has_twin, is_wide, has_ambient;
    int32_t padding; /* samples behind each row */
    int32_t maximum; /* of a sample */
    int64_t time_us;
    uint16_t grey[FUZZ_RIG_PIXELS_MAX], ambient[FUZZ_RIG_PIXELS_MAX];
};

static int32_t width_of(const struct canvas *canvas)
{
    return canvas->core->rig.calibration.width;
}

static int32_t height_of(const struct canvas *canvas)
{
    return canvas->core->rig.calibration.height;
}

static void put(struct canvas *canvas, int32_t u, int32_t v, int32_t grey)
{
    if (u >= 0 && v >= 0 && u < width_of(canvas) && v < height_of(canvas)) {
        int32_t max = canvas->is_wide ? 65535 : 255;
        canvas->grey[v * width_of(canvas) + u] = (uint16_t)(grey < max ? grey : max);
    }
}

/* A paraboloid on top of what is there. */
static void draw_dot(struct canvas *canvas, int32_t u_px_q12, int32_t v_px_q12, int32_t height,
                     int32_t radius_q4)
{
    int32_t u_px = u_px_q12 >> 12, v_px = v_px_q12 >> 12;
    int32_t reach = radius_q4 / 16 + 1;
    for (int32_t v = v_px - reach; v <= v_px + reach; v++) {
        for (int32_t u = u_px - reach; u <= u_px + reach; u++) {
            int64_t du_q4 = (u * 4096 - u_px_q12) / 256, dv_q4 = (v * 4096 - v_px_q12) / 256;
            int64_t radius2 = (int64_t)radius_q4 * radius_q4 + 1;
            int64_t inside = radius2 - du_q4 * du_q4 - dv_q4 * dv_q4;
            if (inside > 0 && u >= 0 && v >= 0 && u < width_of(canvas) && v < height_of(canvas)) {
                int32_t below = canvas->grey[v * width_of(canvas) + u];
                put(canvas, u, v, below + (int32_t)(height * inside / radius2));
            }
        }
    }
}

static void paint_noise(struct canvas *canvas, struct fuzz_input *input)
{
    uint32_t seed = fuzz_byte(input);
    int32_t base = fuzz_within(input, 0, canvas->maximum);
    int32_t levels = fuzz_within(input, 0, canvas->maximum) + 1;
    for (int32_t i = 0; i < width_of(canvas) * height_of(canvas); i++) {
        put(canvas, i % width_of(canvas), i / width_of(canvas), base + fuzz_noise(&seed) % levels);
    }
}

static void paint_dot(struct canvas *canvas, struct fuzz_input *input)
{
    int32_t u = fuzz_within(input, -4 * 4096, (width_of(canvas) + 4) * 4096);
    int32_t v = fuzz_within(input, -4 * 4096, (height_of(canvas) + 4) * 4096);
    int32_t height = fuzz_within(input, 0, canvas->maximum);
    draw_dot(canvas, u, v, height, fuzz_within(input, 0, 160));
}

/* A wall, a head before it, and shoulders below. */
struct scene {
    int32_t wall_mm, head_mm, bent_mm; /* bent_mm: the head's depth one slot aside */
    int32_t column, row;               /* of its middle, Q4 slots */
    int32_t size2;                     /* slots */
    int32_t body_mm;
};

static int32_t depth_at(const struct scene *scene, int32_t slot)
{
    int32_t x_q4 = slot % IH_GRID * 16 - scene->column, y_q4 = slot / IH_GRID * 16 - scene->row;
    int32_t distance2 = (x_q4 * x_q4 * 3 + y_q4 * y_q4 * 2) / 256;
    if (distance2 <= scene->size2) {
        return scene->head_mm + distance2 * scene->bent_mm;
    }
    bool is_below = y_q4 > 0 && 2 * y_q4 > abs(x_q4);
    return is_below && scene->body_mm > 0 ? scene->head_mm + scene->body_mm : scene->wall_mm;
}

static void paint_pattern(struct canvas *canvas, struct fuzz_input *input)
{
    const struct ih_rig *rig = &canvas->core->rig;
    struct scene scene;
    scene.wall_mm = fuzz_within(input, 100, 4000);
    scene.head_mm = fuzz_within(input, 100, 2000);
    scene.bent_mm = fuzz_within(input, 0, 16);
    scene.column = fuzz_within(input, 0, IH_GRID * 16);
    scene.row = fuzz_within(input, 0, IH_GRID * 16);
    scene.size2 = fuzz_within(input, 0, 127);
    scene.body_mm = fuzz_within(input, 0, 127);
    int32_t height = fuzz_within(input, 0, canvas->maximum);
    int32_t radius_q4 = fuzz_within(input, 0, 127);
    uint32_t seed = fuzz_byte(input);
    int32_t missing = fuzz_within(input, 0, 127); /* of 128 */
    int32_t off_px_q12 = fuzz_within(input, 0, 2 * 4096);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        int32_t x_q28 = 0, y_q28 = 0, u = 0, v = 0;
        ih_rig_dot_at(rig, slot, depth_at(&scene, slot) * 256, &x_q28, &y_q28);
        ih_camera_distort(rig, x_q28, y_q28, &u, &v);
        u += off_px_q12 * (fuzz_noise(&seed) % 257 - 128) / 128;
        v += off_px_q12 * (fuzz_noise(&seed) % 257 - 128) / 128;
        if (fuzz_noise(&seed) % 128 >= missing && ih_camera_sees(rig, u, v)) {
            draw_dot(canvas, u, v, height, radius_q4);
        }
    }
}

static void paint_rectangle(struct canvas *canvas, struct fuzz_input *input)
{
    int32_t left = fuzz_within(input, 0, width_of(canvas));
    int32_t top = fuzz_within(input, 0, height_of(canvas));
    int32_t right = left + fuzz_within(input, 0, width_of(canvas));
    int32_t bottom = top + fuzz_within(input, 0, height_of(canvas));
    int32_t grey = fuzz_within(input, 0, canvas->maximum);
    for (int32_t v = top; v < bottom && v < height_of(canvas); v++) {
        for (int32_t u = left; u < right; u++) {
            put(canvas, u, v, grey);
        }
    }
}

static void paint_bytes(struct canvas *canvas, struct fuzz_input *input)
{
    int32_t pixels = width_of(canvas) * height_of(canvas);
    int32_t from = fuzz_within(input, 0, pixels - 1);
    int32_t length = fuzz_within(input, 1, RAW_MAX);
    int32_t times = fuzz_within(input, 1, RAW_MAX);
    uint8_t byte[RAW_MAX] = {0};
    for (int32_t i = 0; i < length; i++) {
        byte[i] = fuzz_byte(input);
    }
    for (int32_t i = from; i < pixels && (i - from) / length < times; i++) {
        canvas->grey[i] = (uint16_t)(byte[(i - from) % length] * (canvas->is_wide ? 257 : 1));
    }
}

/* Samples as a camera would hand them over, in memory that ends with the last row; to be freed. */
static struct ih_frame frame_of(const struct canvas *canvas, const uint16_t *grey)
{
    int32_t width = width_of(canvas), height = height_of(canvas);
    int32_t bytes = canvas->is_wide ? 2 : 1;
    int32_t stride = (width + canvas->padding) * bytes;
    uint8_t *samples = malloc((size_t)(stride * (height - 1) + width * bytes));
    FUZZ_CHECK(samples != NULL);
    for (int32_t v = 0; v < height; v++) {
        for (int32_t u = 0; u < width; u++) {
            uint16_t sample = grey[v * width + u];
            uint8_t *at = samples + v * stride + u * bytes;
            if (canvas->is_wide) {
                memcpy(at, &sample, sizeof sample);
            } else {
                *at = (uint8_t)sample;
            }
        }
    }
    return (struct ih_frame){samples, width, height, stride, bytes, canvas->maximum};
}

static void check_record(const struct isohead *core, const struct ih_frame *frame)
{
    static struct app_record record;
    const struct hal_frame from = {
        .samples = frame->samples, .width = frame->width, .height = frame->height, .name = "fuzz"};
    FUZZ_CHECK(app_record_frame(&record, &from, core, NULL));
    FUZZ_CHECK(record.length > 1 && record.text[record.length - 1] == '\n');
    cJSON *json = cJSON_ParseWithLength(record.text, record.length);
    FUZZ_CHECK(cJSON_IsObject(json));
    cJSON_Delete(json);
}

/* In two halves, the first of them twice: the same outputs. With the same frames, as the rig may move in each. */
static void look_again(const struct canvas *canvas, const struct ih_frame *frame,
                       const struct ih_frame *ambient)
{
    struct isohead *twin = canvas->twin;
    memset(&twin->scratch, 0xa5, sizeof twin->scratch);
    FUZZ_CHECK(isohead_label(twin, frame, ambient) == IH_OK);
    FUZZ_CHECK(isohead_label(twin, frame, ambient) == IH_OK);
    isohead_find(twin, canvas->time_us);
    fuzz_check_same(canvas->core, twin);
}

static void look(struct canvas *canvas, struct fuzz_input *input)
{
    canvas->time_us = fuzz_next_time_us(input, canvas->time_us);
    struct ih_frame frame = frame_of(canvas, canvas->grey);
    struct ih_frame ambient = frame_of(canvas, canvas->ambient);
    const struct ih_frame *subtracted = canvas->has_ambient ? &ambient : NULL;
    FUZZ_CHECK(isohead_frame(canvas->core, &frame, subtracted, canvas->time_us) == IH_OK);
    fuzz_check_core(canvas->core);
    check_record(canvas->core, &frame);
    if (canvas->has_twin) {
        look_again(canvas, &frame, subtracted);
    }
    free((void *)frame.samples);
    free((void *)ambient.samples);
}

/* One member of the view is wrong: the frame is refused, and what is known from before stays. */
static void look_malformed(struct canvas *canvas, struct fuzz_input *input)
{
    struct ih_frame frame = frame_of(canvas, canvas->grey);
    struct ih_frame good = frame;
    static struct ih_tracks before;
    int32_t *member[5] = {&frame.width, &frame.height, &frame.stride_bytes, &frame.bytes_per_sample,
                          &frame.maximum};
    uint8_t which = fuzz_byte(input) % 7;
    if (which < 5) {
        *member[which] = fuzz_int32(input);
    } else {
        frame.samples = which == 5 ? NULL : (const uint8_t *)frame.samples + 1;
    }
    /* A greater stride or maximum, or fewer bytes, may be right. */
    bool may_be_right =
        (which == 2 && frame.stride_bytes >= good.stride_bytes - canvas->padding * 2) ||
        (which == 3 && frame.bytes_per_sample <= good.bytes_per_sample) || which == 4 ||
        (which == 6 && !canvas->is_wide) || (which == 0 && frame.width == good.width) ||
        (which == 1 && frame.height == good.height);
    before = canvas->core->tracks;
    if (!may_be_right) {
        FUZZ_CHECK(isohead_frame(canvas->core, &frame, NULL, canvas->time_us) < 0);
        fuzz_check_empty(canvas->core);
        FUZZ_CHECK(isohead_frame(canvas->core, &good, &frame, canvas->time_us) < 0);
        fuzz_check_empty(canvas->core);
        FUZZ_CHECK(memcmp(&before, &canvas->core->tracks, sizeof before) == 0);
    }
    free((void *)good.samples);
}

static void start(struct canvas *canvas, struct fuzz_input *input)
{
    static struct isohead core, twin;
    uint8_t flags = fuzz_byte(input);
    memset(canvas, 0, sizeof *canvas);
    core = *fuzz_rig_dots_core(flags & 3);
    if ((flags & 4) != 0) {
        ih_params_paper(&core.params);
    }
    core.params.tracks.side =
        (flags & 8) != 0 ? fuzz_within(input, IH_SIDE_NEAREST, IH_SIDE_RIGHT) : IH_SIDE_NEAREST;
    canvas->core = &core;
    canvas->twin = &twin;
    canvas->has_twin = (flags & 16) != 0;
    if (canvas->has_twin) {
        twin = core;
    }
    canvas->is_wide = (flags & 32) != 0;
    canvas->padding = (flags & 64) != 0 ? 3 : 0;
    canvas->maximum = canvas->is_wide ? 4095 : 255;
    if ((flags & 128) != 0) {
        canvas->maximum = fuzz_within(input, 1, canvas->is_wide ? 65535 : 255);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct canvas canvas;
    static void (*const paint[COMMANDS])(struct canvas *, struct fuzz_input *) = {
        look,        paint_noise, paint_dot,     paint_pattern, paint_rectangle,
        paint_bytes, NULL,        look_malformed};
    struct fuzz_input input = {data, size};
    int looks = 0;
    start(&canvas, &input);
    for (int i = 0; i < COMMANDS_MAX && input.left > 0 && looks < LOOKS_MAX; i++) {
        uint8_t command = fuzz_byte(&input) % COMMANDS;
        looks += command == 0;
        if (paint[command] != NULL) {
            paint[command](&canvas, &input);
        } else {
            memcpy(canvas.ambient, canvas.grey, sizeof canvas.ambient);
            canvas.has_ambient = true;
        }
    }
    if (looks == 0) {
        look(&canvas, &input);
    }
    return 0;
}
