#include "golden_scene.h"

#include <string.h>

#include "rig/ih_camera.h"

#define DOT_HEIGHT 200
#define DOT_REACH_PX 3
#define DOT_RADIUS2_Q8 (5 * 256 / 2) /* (1.6 px)^2 */
#define WALL_MM 1200
#define HEAD_MM 800
#define SPARSE_PX 7

/* Numerical Recipes' generator; its upper bits. */
static int32_t next_noise(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (int32_t)(*state >> 16);
}

static void fill_noise(uint8_t *grey, int32_t count, int32_t levels)
{
    uint32_t state = 1;
    for (int32_t i = 0; i < count; i++) {
        grey[i] = (uint8_t)(next_noise(&state) % levels);
    }
}

/* Samples of 12 bits in 16. */
static void fill_noise16(uint16_t *samples, struct ih_frame *frame)
{
    uint32_t state = 2;
    frame->bytes_per_sample = 2;
    frame->stride_bytes = 2 * frame->width;
    frame->maximum = 4095;
    for (int32_t i = 0; i < frame->width * frame->height; i++) {
        samples[i] = (uint16_t)(next_noise(&state) & 4095);
    }
}

/* A paraboloid; what is not in the frame is left out. */
static void draw_dot(uint8_t *grey, const struct ih_frame *frame, int32_t u_px_q12,
                     int32_t v_px_q12)
{
    int32_t u_px = u_px_q12 / 4096, v_px = v_px_q12 / 4096;
    for (int32_t v = v_px - DOT_REACH_PX; v <= v_px + DOT_REACH_PX; v++) {
        for (int32_t u = u_px - DOT_REACH_PX; u <= u_px + DOT_REACH_PX; u++) {
            int32_t du_q4 = (u * 4096 - u_px_q12) / 256, dv_q4 = (v * 4096 - v_px_q12) / 256;
            int32_t inside_q8 = DOT_RADIUS2_Q8 - du_q4 * du_q4 - dv_q4 * dv_q4;
            if (inside_q8 > 0 && u >= 0 && v >= 0 && u < frame->width && v < frame->height) {
                int32_t value =
                    grey[v * frame->width + u] + DOT_HEIGHT * inside_q8 / DOT_RADIUS2_Q8;
                grey[v * frame->width + u] = (uint8_t)(value < 255 ? value : 255);
            }
        }
    }
}

static void draw_lattice(uint8_t *grey, const struct ih_frame *frame)
{
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        int32_t column = slot % IH_GRID + 1, row = slot / IH_GRID + 1;
        draw_dot(grey, frame, frame->width * 4096 / (IH_GRID + 1) * column,
                 frame->height * 4096 / (IH_GRID + 1) * row);
    }
}

/* Every 20 px along all four sides, from 3 px inside the border to 2 px beyond it. */
static void draw_border(uint8_t *grey, const struct ih_frame *frame)
{
    for (int32_t at = 0; at < frame->width; at += 20) {
        int32_t beyond_q12 = at * 20480 / frame->width - 3 * 4096;
        draw_dot(grey, frame, at * 4096, -beyond_q12);
        draw_dot(grey, frame, at * 4096, (frame->height - 1) * 4096 + beyond_q12);
        draw_dot(grey, frame, -beyond_q12, at * 4096);
        draw_dot(grey, frame, (frame->width - 1) * 4096 + beyond_q12, at * 4096);
    }
}

/* The pattern on a wall; with a bump, of a head's size, before it. */
static void draw_pattern(uint8_t *grey, const struct ih_frame *frame, const struct ih_rig *rig,
                         bool with_bump)
{
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        int32_t x = slot % IH_GRID - IH_GRID / 2, y = slot / IH_GRID - IH_GRID / 2;
        int32_t bent_mm = (x * x * 3 + y * y * 2) * 2;
        int32_t depth_mm = with_bump && bent_mm < 90 ? HEAD_MM + bent_mm : WALL_MM;
        int32_t x_q28 = 0, y_q28 = 0, u_px_q12 = 0, v_px_q12 = 0;
        ih_rig_dot_at(rig, slot, depth_mm * 256, &x_q28, &y_q28);
        ih_camera_distort(rig, x_q28, y_q28, &u_px_q12, &v_px_q12);
        draw_dot(grey, frame, u_px_q12, v_px_q12);
    }
}

const char *golden_scene_dots(int index, const struct ih_rig *rig, uint16_t *samples,
                              uint16_t *ambient_samples, struct ih_frame *frame, bool *has_ambient)
{
    static const char *const name[GOLDEN_DOT_SCENES] = {"black", "white",   "noise",  "noise16",
                                                        "one",   "lattice", "border", "wall",
                                                        "bump",  "ambient"};
    uint8_t *grey = (uint8_t *)samples;
    int32_t width = rig->calibration.width, height = rig->calibration.height;
    *frame = (struct ih_frame){samples, width, height, width, 1, 255};
    *has_ambient = index == 9;
    memset(grey, index == 1 ? 255 : 0, (size_t)(width * height));
    switch (index) {
    case 2:
        fill_noise(grey, width * height, 256);
        break;
    case 3:
        fill_noise16(samples, frame);
        break;
    case 4:
        draw_dot(grey, frame, width * 2048 + 1234, height * 2048 + 567);
        break;
    case 5:
        draw_lattice(grey, frame);
        break;
    case 6:
        draw_border(grey, frame);
        break;
    case 7:
    case 8:
        draw_pattern(grey, frame, rig, index == 8);
        break;
    case 9:
        fill_noise(grey, width * height, 50);
        memcpy(ambient_samples, grey, (size_t)(width * height));
        draw_pattern(grey, frame, rig, true);
        break;
    default: /* black, white */
        break;
    }
    return name[index];
}

void golden_scene_range_rig(struct ih_calibration *calibration)
{
    memset(calibration, 0, sizeof *calibration);
    calibration->kind = IH_RIG_RANGE;
    calibration->width = 640;
    calibration->height = 480;
    calibration->fx_px_q16 = calibration->fy_px_q16 = 525 * 65536;
    calibration->cx_px_q16 = 639 * 32768;
    calibration->cy_px_q16 = 479 * 32768;
    calibration->near_mm = 400;
    calibration->far_mm = 4000;
}

/* A head, 160 x 230 mm at HEAD_MM, on a neck above shoulders, before a wall. */
static int32_t depth_of_person(int32_t du_px, int32_t dv_px)
{
    int32_t bent_q10 = du_px * du_px * 1024 / (52 * 52) + dv_px * dv_px * 1024 / (75 * 75);
    if (bent_q10 < 1024) {
        return HEAD_MM - 90 + 90 * bent_q10 / 1024;
    }
    if (dv_px > 0 && dv_px < 120 && du_px > -35 && du_px < 35) {
        return HEAD_MM + 20;
    }
    if (dv_px >= 120 && du_px > -150 && du_px < 150) {
        return HEAD_MM + 30 + du_px * du_px / 250;
    }
    return 2 * WALL_MM;
}

/* With a measurement's noise of 4 mm, and one in 16 pixels missing. */
static void fill_person(uint16_t *samples, const struct ih_frame *frame, int32_t moved_px)
{
    uint32_t state = (uint32_t)moved_px;
    for (int32_t v = 0; v < frame->height; v++) {
        for (int32_t u = 0; u < frame->width; u++) {
            int32_t noise = next_noise(&state);
            int32_t depth_mm = depth_of_person(u - 300 - moved_px, v - 200) + noise % 4;
            samples[v * frame->width + u] = noise / 4 % 16 == 0 ? 0 : (uint16_t)depth_mm;
        }
    }
}

/* Only every SPARSE_PXth pixel of every SPARSE_PXth row was measured. */
static void thin_out(uint16_t *samples, const struct ih_frame *frame)
{
    for (int32_t i = 0; i < frame->width * frame->height; i++) {
        if (i % frame->width % SPARSE_PX != 0 || i / frame->width % SPARSE_PX != 0) {
            samples[i] = 0;
        }
    }
}

static void fill_border(uint16_t *samples, const struct ih_frame *frame)
{
    for (int32_t i = 0; i < frame->width * frame->height; i++) {
        int32_t u = i % frame->width, v = i / frame->width;
        bool inside = u > 0 && v > 0 && u < frame->width - 1 && v < frame->height - 1;
        samples[i] = inside ? 0 : HEAD_MM;
    }
}

const char *golden_scene_range(int index, const struct ih_calibration *calibration,
                               uint16_t *samples, struct ih_frame *frame)
{
    static const char *const name[GOLDEN_RANGE_SCENES] = {
        "empty", "full", "noise", "wall", "one", "border", "sparse", "head0", "head1", "head2"};
    static const uint16_t all[GOLDEN_RANGE_SCENES] = {[1] = 65535, [3] = WALL_MM};
    uint32_t state = 3;
    int32_t width = calibration->width, height = calibration->height;
    *frame = (struct ih_frame){samples, width, height, 2 * width, 2, 65535};
    for (int32_t i = 0; i < width * height; i++) {
        samples[i] = (uint16_t)(index == 2 ? next_noise(&state) % 5000 : all[index]);
    }
    switch (index) {
    case 4:
        samples[height / 2 * width + width / 2] = HEAD_MM;
        break;
    case 5:
        fill_border(samples, frame);
        break;
    case 6:
        fill_person(samples, frame, 0);
        thin_out(samples, frame);
        break;
    case 7:
    case 8:
    case 9:
        fill_person(samples, frame, (index - 7) * 5);
        break;
    default: /* empty, full, noise, wall */
        break;
    }
    return name[index];
}
