/* ih_test_frame - frames that the unit tests and the reference (tools/oracle/frames.py) make by the
 * same formula, so that no picture is stored. A test includes it once. */
#ifndef IH_TEST_FRAME_H
#define IH_TEST_FRAME_H

#include "base/ih_config.h"
#include "base/ih_types.h"

#include "ih_test.h"

struct vector_spot {
    int32_t u_q4, v_q4, radius_q4, height;
};

struct vector_box {
    int32_t u_first, v_first, u_last, v_last, height;
};

/* Makes a frame: see pixel(). */
struct vector_spec {
    const char *name;
    int32_t width, height, maximum, background, noise, loud, slope_u, slope_v, seed;
    int32_t tile_width, tile_height;
    int32_t floor_grey_q4, noise_gain_q8;
    int32_t spot_count;
    const struct vector_spot *spot;
    int32_t box_count;
    const struct vector_box *box;
};

#define PIXELS_MAX (IH_FRAME_WIDTH_MAX * IH_FRAME_HEIGHT_MAX)

static int32_t marks[PIXELS_MAX];
static uint8_t grey8[PIXELS_MAX];
static uint16_t grey16[PIXELS_MAX];
static struct ih_frame frame;
static inline void mark_spots(const struct vector_spec *spec)
{
    int32_t i, u, v;

    for (i = 0; i < spec->spot_count; i++) {
        const struct vector_spot *s = &spec->spot[i];
        const int32_t radius2 = s->radius_q4 * s->radius_q4;

        for (v = (s->v_q4 - s->radius_q4) / 16; v <= (s->v_q4 + s->radius_q4) / 16; v++) {
            for (u = (s->u_q4 - s->radius_q4) / 16; u <= (s->u_q4 + s->radius_q4) / 16; u++) {
                const int32_t du = 16 * u - s->u_q4, dv = 16 * v - s->v_q4;

                if (u >= 0 && v >= 0 && u < spec->tile_width && v < spec->tile_height &&
                    du * du + dv * dv < radius2) {
                    marks[v * spec->tile_width + u] +=
                        s->height * (radius2 - du * du - dv * dv) / radius2;
                }
            }
        }
    }
}

static inline void mark_boxes(const struct vector_spec *spec)
{
    int32_t i, u, v;

    for (i = 0; i < spec->box_count; i++) {
        const struct vector_box *b = &spec->box[i];

        for (v = b->v_first; v <= b->v_last; v++) {
            for (u = b->u_first; u <= b->u_last; u++) {
                marks[v * spec->tile_width + u] += b->height;
            }
        }
    }
}

static inline int32_t hash_noise(const struct vector_spec *spec, int32_t u, int32_t v)
{
    uint32_t h =
        (uint32_t)u * 73856093u ^ (uint32_t)v * 19349663u ^ (uint32_t)spec->seed * 83492791u;
    int32_t noise;

    h ^= h >> 13;
    h *= 0x5bd1e995u;
    h ^= h >> 15;
    noise = (u / 128 + v / 128) % 2 == 1 ? spec->loud : spec->noise;
    return (int32_t)(h % (uint32_t)(2 * noise + 1)) - noise;
}

static inline int32_t pixel(const struct vector_spec *spec, int32_t u, int32_t v)
{
    const int32_t slope = spec->slope_u * u + spec->slope_v * v;
    const int32_t floor256 = (slope - (slope % 256 + 256) % 256) / 256;
    const int32_t mark = marks[v % spec->tile_height * spec->tile_width + u % spec->tile_width];
    const int32_t value = spec->background + floor256 + hash_noise(spec, u, v) + mark;

    return value < 0 ? 0 : value > spec->maximum ? spec->maximum : value;
}

static inline void view(int32_t width, int32_t height, int32_t maximum)
{
    const bool wide = maximum > 255;

    frame.samples = wide ? (const void *)grey16 : (const void *)grey8;
    frame.width = width;
    frame.height = height;
    frame.bytes_per_sample = wide ? 2 : 1;
    frame.stride_bytes = width * frame.bytes_per_sample;
    frame.maximum = maximum;
}

static inline void make_frame(const struct vector_spec *spec)
{
    int32_t u, v;

    memset(marks, 0, sizeof marks);
    mark_spots(spec);
    mark_boxes(spec);
    for (v = 0; v < spec->height; v++) {
        for (u = 0; u < spec->width; u++) {
            const int32_t value = pixel(spec, u, v);

            grey8[v * spec->width + u] = (uint8_t)value;
            grey16[v * spec->width + u] = (uint16_t)value;
        }
    }
    view(spec->width, spec->height, spec->maximum);
}

/* Does a grey level of this frame come to a whole number of the 12-bit ones? */
static inline bool exact_grey(const struct vector_spec *spec)
{
    return 4080 % spec->maximum == 0;
}

static inline void fill8(int32_t width, int32_t height, uint8_t value)
{
    memset(grey8, value, (size_t)(width * height));
    view(width, height, 255);
}

static inline void paint_block(int32_t u, int32_t v, int32_t width, int32_t height, uint8_t grey)
{
    int32_t i;

    for (i = v; i < v + height; i++) {
        memset(&grey8[i * frame.width + u], grey, (size_t)width);
    }
}

/* What frame shows, in a buffer of its own: the last frame without laser. */
static uint8_t ambient8[PIXELS_MAX];
static uint16_t ambient16[PIXELS_MAX];
static struct ih_frame ambient;

static inline void keep_ambient(void)
{
    memcpy(ambient8, grey8, sizeof ambient8);
    memcpy(ambient16, grey16, sizeof ambient16);
    ambient = frame;
    ambient.samples =
        frame.bytes_per_sample == 1 ? (const void *)ambient8 : (const void *)ambient16;
}

#endif
