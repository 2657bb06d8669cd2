/* The whole core on depth images. Input: the rig and how it is used, then commands that paint a depth
 * image and commands that have it looked at.
 *
 * A command is a byte and its arguments:
 *   0  look at the image           3  a list of points, drawn
 *   1  one depth, with noise       4  bytes as they are, repeated, from a place on
 *   2  an ellipsoid, and a body    5  nothing measured in a fraction of the pixels
 */
#include <string.h>

#include "points/ih_cloud.h"

#include "fuzz_check.h"
#include "fuzz_rig.h"

#define LOOKS_MAX 4
#define COMMANDS_MAX 64
#define RAW_MAX 256
#define POINTS_MAX 64
#define COMMANDS 6

struct image {
    struct isohead *core;
    struct isohead *twin; /* the same images from other scratch */
    bool has_twin;
    int64_t time_us;
    uint16_t depth_mm[FUZZ_RIG_PIXELS_MAX];
};

static const struct ih_calibration *calibration_of(const struct image *image)
{
    return &image->core->rig.calibration;
}

static void paint_wall(struct image *image, struct fuzz_input *input)
{
    int32_t depth_mm = fuzz_within(input, 0, 16383);
    int32_t slope = fuzz_within(input, -64, 63);
    int32_t noise = fuzz_within(input, 0, 127) + 1;
    uint32_t seed = fuzz_byte(input);
    int32_t width = calibration_of(image)->width;
    for (int32_t i = 0; i < width * calibration_of(image)->height; i++) {
        int32_t value = depth_mm + slope * (i % width) + fuzz_noise(&seed) % noise;
        image->depth_mm[i] = (uint16_t)(value < 0 ? 0 : value);
    }
}

static void paint_person(struct image *image, struct fuzz_input *input)
{
    const struct ih_calibration *c = calibration_of(image);
    int32_t depth_mm = fuzz_within(input, 50, 5000);
    int32_t middle_u = fuzz_within(input, 0, c->width), middle_v = fuzz_within(input, 0, c->height);
    int32_t size_percent = fuzz_within(input, 10, 300), body_mm = fuzz_within(input, -127, 128);
    int32_t across_px = 78 * (c->fx_px_q16 >> 16) / depth_mm * size_percent / 100 + 1;
    int32_t up_px = 113 * (c->fy_px_q16 >> 16) / depth_mm * size_percent / 100 + 1;
    for (int32_t v = 0; v < c->height; v++) {
        for (int32_t u = 0; u < c->width; u++) {
            int32_t du = u - middle_u, dv = v - middle_v;
            int32_t bent_q10 =
                du * du * 1024 / (across_px * across_px) + dv * dv * 1024 / (up_px * up_px);
            uint16_t *pixel = &image->depth_mm[v * c->width + u];
            if (bent_q10 < 1024) {
                *pixel = (uint16_t)(depth_mm + 98 * bent_q10 / 1024);
            } else if (body_mm > 0 && dv > up_px / 2 && abs(du) < 2 * across_px) {
                *pixel = (uint16_t)(depth_mm + body_mm);
            }
        }
    }
}

static void paint_points(struct image *image, struct fuzz_input *input)
{
    int32_t point_mm_q8[POINTS_MAX][3];
    struct ih_cloud count;
    const struct ih_rig *rig = &image->core->rig;
    int32_t point_count = fuzz_within(input, 0, POINTS_MAX);
    for (int32_t i = 0; i < point_count; i++) {
        for (int axis = 0; axis < 3; axis++) {
            point_mm_q8[i][axis] = fuzz_int32(input);
        }
    }
    FUZZ_CHECK(ih_cloud_draw((const int32_t(*)[3])point_mm_q8, point_count, rig, image->depth_mm,
                             &count) == IH_OK);
    FUZZ_CHECK(count.drawn + count.hidden + count.near + count.far + count.outside == point_count);
}

static void paint_bytes(struct image *image, struct fuzz_input *input)
{
    int32_t pixels = calibration_of(image)->width * calibration_of(image)->height;
    int32_t from = fuzz_within(input, 0, pixels - 1);
    int32_t length = fuzz_within(input, 1, RAW_MAX);
    int32_t times = fuzz_within(input, 1, RAW_MAX);
    uint16_t sample[RAW_MAX] = {0};
    for (int32_t i = 0; i < length; i++) {
        int32_t high = fuzz_byte(input);
        sample[i] = (uint16_t)(high * 256 + fuzz_byte(input));
    }
    for (int32_t i = from; i < pixels && (i - from) / length < times; i++) {
        image->depth_mm[i] = sample[(i - from) % length];
    }
}

static void erase(struct image *image, struct fuzz_input *input)
{
    uint32_t seed = fuzz_byte(input);
    int32_t fraction = fuzz_within(input, 0, 127);
    for (int32_t i = 0; i < calibration_of(image)->width * calibration_of(image)->height; i++) {
        if (fuzz_noise(&seed) % 128 < fraction) {
            image->depth_mm[i] = 0;
        }
    }
}

static void look(struct image *image, struct fuzz_input *input)
{
    const struct ih_calibration *c = calibration_of(image);
    image->time_us = fuzz_next_time_us(input, image->time_us);
    size_t bytes = (size_t)(c->width * c->height) * sizeof image->depth_mm[0];
    uint16_t *samples = malloc(bytes);
    FUZZ_CHECK(samples != NULL);
    memcpy(samples, image->depth_mm, bytes);
    struct ih_frame frame = {samples, c->width, c->height, 2 * c->width, 2, fuzz_byte(input)};
    FUZZ_CHECK(isohead_frame(image->core, &frame, NULL, image->time_us) == IH_OK);
    fuzz_check_core(image->core);
    if (image->has_twin) {
        memset(&image->twin->scratch, 0xa5, sizeof image->twin->scratch);
        FUZZ_CHECK(isohead_label(image->twin, &frame, NULL) == IH_ERR_KIND);
        fuzz_check_empty(image->twin);
        FUZZ_CHECK(isohead_frame(image->twin, &frame, &frame, image->time_us) == IH_OK);
        fuzz_check_same(image->core, image->twin);
    }
    free(samples);
}

static void start(struct image *image, struct fuzz_input *input)
{
    static struct isohead core, twin;
    uint8_t flags = fuzz_byte(input);
    memset(image, 0, sizeof *image);
    core = *fuzz_rig_range_core(flags & 1);
    if ((flags & 4) != 0) {
        ih_params_paper(&core.params);
    }
    core.params.tracks.side =
        (flags & 8) != 0 ? fuzz_within(input, IH_SIDE_NEAREST, IH_SIDE_RIGHT) : IH_SIDE_NEAREST;
    image->core = &core;
    image->twin = &twin;
    image->has_twin = (flags & 16) != 0;
    if (image->has_twin) {
        twin = core;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct image image;
    static void (*const paint[COMMANDS])(struct image *, struct fuzz_input *) = {
        look, paint_wall, paint_person, paint_points, paint_bytes, erase};
    struct fuzz_input input = {data, size};
    int looks = 0;
    start(&image, &input);
    for (int i = 0; i < COMMANDS_MAX && input.left > 0 && looks < LOOKS_MAX; i++) {
        uint8_t command = fuzz_byte(&input) % COMMANDS;
        looks += command == 0;
        paint[command](&image, &input);
    }
    if (looks == 0) {
        look(&image, &input);
    }
    return 0;
}
