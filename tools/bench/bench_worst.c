/* bench_worst [--save OUT.pgm] RIG.json FIRST COUNT [FRAME.pgm...]
 *
 * isohead over COUNT drawn frames from number FIRST on; or, where frames are named, over
 * those, the first of which has number 0, to the last. Each is processed within bench_worst_frame,
 * whose instructions are counted from outside (worst_count.c, callgrind). What came before FIRST in its
 * sequence is processed too, but outside. A line a frame of what was found; --save writes the last one.
 */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app_rig.h"
#include "bench_input.h"
#include "isohead.h"
#include "rig/ih_camera.h"
#include "rig/ih_rig.h"

/* Frames that are meant to cost much, the same on every machine: integers only.
 *
 * In:    a rig, a number.
 * Out:   an 8-bit frame: dots that a surface of many bumps sends back, all or some, with texture; dots
 *        at several depths of every line, or in rows along the lines; lattices and crowds of dots of all
 *        sizes and strengths, most of them near the threshold; noise, stripes and checks of all sizes.
 *        A hundred numbers on end are of one kind. Those of bumps are a sequence that changes little from
 *        frame to frame, so that tracks live; of all others each frame is drawn anew. */
#define WORST_SEQUENCE 100

#define ONE_Q12 4096

static uint32_t state;

static uint32_t random_32(void)
{
    state = state * 1664525U + 1013904223U;
    uint32_t x = state ^ (state >> 16);
    x *= 0x7feb352dU;
    x ^= x >> 15;
    return x;
}

/* 0 .. limit - 1 */
static int32_t random_below(int32_t limit)
{
    return (int32_t)(((uint64_t)random_32() * (uint32_t)limit) >> 32);
}

static int32_t random_between(int32_t min, int32_t max)
{
    return min + random_below(max - min + 1);
}

struct picture {
    const struct ih_rig *rig;
    int32_t width, height;
    int32_t step; /* number in the sequence */
    uint8_t *samples;
};

static void add_to_pixel(struct picture *p, int32_t u, int32_t v, int32_t grey)
{
    if (u >= 0 && v >= 0 && u < p->width && v < p->height) {
        uint8_t *sample = &p->samples[v * p->width + u];
        int32_t sum = *sample + grey;
        *sample = (uint8_t)(sum > 255 ? 255 : sum < 0 ? 0 : sum);
    }
}

/* A spot (1 - r^2 / R^2)^2 high. */
static void add_spot(struct picture *p, int64_t u_q12, int64_t v_q12, int32_t radius_q12,
                     int32_t grey)
{
    int32_t reach = (radius_q12 >> 12) + 1;
    int32_t u0 = (int32_t)(u_q12 >> 12), v0 = (int32_t)(v_q12 >> 12);
    int64_t radius2_q24 = (int64_t)radius_q12 * radius_q12;
    for (int32_t v = v0 - reach; v <= v0 + reach + 1; v++) {
        for (int32_t u = u0 - reach; u <= u0 + reach + 1; u++) {
            int64_t du = u * ONE_Q12 - u_q12, dv = v * ONE_Q12 - v_q12;
            int64_t left_q24 = radius2_q24 - du * du - dv * dv;
            if (left_q24 > 0) {
                int64_t fraction_q12 = left_q24 * ONE_Q12 / radius2_q24;
                add_to_pixel(p, u, v,
                             (int32_t)(grey * fraction_q12 / ONE_Q12 * fraction_q12 / ONE_Q12));
            }
        }
    }
}

static void fill(struct picture *p, int32_t grey, int32_t noise)
{
    for (int32_t i = 0; i < p->width * p->height; i++) {
        p->samples[i] = (uint8_t)(grey + (noise > 0 ? random_below(noise) : 0));
    }
}

/* 0 .. 4096 .. 0 over a period, in parabolas. */
static int32_t wave_q12(int32_t at, int32_t period)
{
    int32_t phase_q12 = (int32_t)((int64_t)(at % period + period) % period * ONE_Q12 / period);
    return (int32_t)((int64_t)phase_q12 * (ONE_Q12 - phase_q12) * 4 / ONE_Q12);
}

static void add_dot(struct picture *p, int32_t slot, int32_t depth_mm, int32_t radius_q12,
                    int32_t grey)
{
    int32_t x_q28, y_q28, u_q12, v_q12;
    ih_rig_dot_at(p->rig, slot, depth_mm * 256, &x_q28, &y_q28);
    ih_camera_distort(p->rig, x_q28, y_q28, &u_q12, &v_q12);
    add_spot(p, u_q12, v_q12, radius_q12, grey);
}

/* Dots on a surface of bumps; some are missing. */
static void draw_bumps(struct picture *p)
{
    int32_t period_x = random_between(2, 12), period_y = random_between(2, 12);
    int32_t base_mm = random_between(p->rig->calibration.near_mm + 100, 1200);
    int32_t height_mm = random_between(20, 500), radius_q12 = random_between(6000, 16000);
    int32_t grey = random_between(15, 150), missing = random_below(3) * random_below(40);
    int32_t noise = random_below(2) * random_below(30);
    fill(p, random_below(80), noise);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        int32_t x = slot % IH_GRID * 10 + p->step, y = slot / IH_GRID * 10;
        int32_t bump_q12 = (wave_q12(x, period_x * 10) + wave_q12(y, period_y * 10)) / 2;
        if (random_below(100) >= missing) {
            add_dot(p, slot, base_mm + (int32_t)((int64_t)height_mm * bump_q12 / ONE_Q12),
                    radius_q12, grey);
        }
    }
}

/* Several dots on every line. */
static void draw_lines(struct picture *p)
{
    int32_t count = random_between(2, 16), radius_q12 = random_between(5000, 9000);
    int32_t grey = random_between(10, 120);
    const struct ih_calibration *c = &p->rig->calibration;
    fill(p, random_below(60), random_below(8));
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        for (int32_t i = 0; i < count; i++) {
            /* equal steps of 1 / Z */
            int64_t near = c->near_mm, far = c->far_mm;
            int64_t depth_mm = near * far * count / (near * count + (far - near) * (i + 1));
            add_dot(p, slot, (int32_t)(depth_mm < near ? near : depth_mm), radius_q12, grey);
        }
    }
}

/* Dots at equal steps of columns along every line, so that each is a candidate of all slots of its row: what
 * seeding hates most. */
static void draw_rows(struct picture *p)
{
    int32_t pitch_px = random_between(6, 24), radius_q12 = random_between(5000, 8000);
    int32_t grey = random_between(20, 120);
    const struct ih_calibration *c = &p->rig->calibration;
    fill(p, random_below(40), random_below(6));
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        int32_t last_u = -1;
        for (int32_t i = 0; i <= 400; i++) {
            int64_t near = c->near_mm, far = c->far_mm;
            int64_t depth_mm = near * far * 400 / (near * 400 + (far - near) * i);
            int32_t x_q28, y_q28, u_q12, v_q12;
            ih_rig_dot_at(p->rig, slot, (int32_t)depth_mm * 256, &x_q28, &y_q28);
            ih_camera_distort(p->rig, x_q28, y_q28, &u_q12, &v_q12);
            int32_t u = (u_q12 >> 12) + p->step, v = v_q12 >> 12;
            bool is_free = u >= 0 && v >= 0 && u < p->width && v < p->height &&
                           p->samples[v * p->width + u] < 60;
            if (u % pitch_px == 0 && u != last_u && is_free) {
                add_spot(p, u * ONE_Q12, v_q12, radius_q12, grey);
                last_u = u;
            }
        }
    }
}

static void draw_lattice(struct picture *p)
{
    int32_t pitch_q12 = random_between(4 * ONE_Q12, 30 * ONE_Q12);
    int32_t radius_q12 = random_between(5000, 20000), grey = random_between(3, 200);
    int32_t jitter_q12 = 1 + random_below(2) * random_below(pitch_q12);
    fill(p, random_below(100), 1 + random_below(6));
    for (int64_t v = p->step * 100; v < (int64_t)p->height * ONE_Q12; v += pitch_q12) {
        for (int64_t u = 0; u < (int64_t)p->width * ONE_Q12; u += pitch_q12) {
            add_spot(p, u + random_below(jitter_q12), v + random_below(jitter_q12), radius_q12,
                     grey);
        }
    }
}

/* Dots anywhere, of all strengths down to below the threshold. */
static void draw_crowd(struct picture *p)
{
    int32_t count = random_between(100, 8000), max = random_between(4, 250);
    fill(p, random_below(150), 1 + random_below(10));
    for (int32_t i = 0; i < count; i++) {
        add_spot(p, random_below(p->width * ONE_Q12), random_below(p->height * ONE_Q12),
                 random_between(4500, 20000), random_between(2, max));
    }
}

static void draw_noise(struct picture *p)
{
    fill(p, 0, random_between(2, 256));
}

/* Stripes or checks. */
static void draw_checks(struct picture *p)
{
    int32_t across = random_between(1, 16), down = random_below(2) * random_between(1, 16);
    int32_t grey = random_between(4, 255), noise = 1 + random_below(6);
    for (int32_t v = 0; v < p->height; v++) {
        for (int32_t u = 0; u < p->width; u++) {
            int32_t odd = (u + p->step) / across + (down > 0 ? v / down : 0);
            int32_t sum = (odd & 1) * grey + random_below(noise);
            p->samples[v * p->width + u] = (uint8_t)(sum > 255 ? 255 : sum);
        }
    }
}

static const struct {
    const char *name;
    void (*draw)(struct picture *p);
    bool is_sequence;
} kinds[] = {{"bumps", draw_bumps, true},      {"lines", draw_lines, false},
             {"lattice", draw_lattice, false}, {"crowd", draw_crowd, false},
             {"rows", draw_rows, false},       {"noise", draw_noise, false},
             {"checks", draw_checks, false},   {"bumps", draw_bumps, true}};
#define KINDS ((int32_t)(sizeof kinds / sizeof kinds[0]))

/* The name of the frame's kind. */
static const char *kind_of(int32_t number)
{
    return kinds[number / WORST_SEQUENCE % KINDS].name;
}

static void draw_frame(const struct ih_rig *rig, int32_t number, uint8_t *samples)
{
    struct picture picture = {.rig = rig,
                              .width = rig->calibration.width,
                              .height = rig->calibration.height,
                              .step = number % WORST_SEQUENCE};
    picture.samples = samples;
    int32_t sequence = number / WORST_SEQUENCE;
    bool is_sequence = kinds[sequence % KINDS].is_sequence;
    state = (uint32_t)(is_sequence ? sequence * WORST_SEQUENCE : number) * 2654435761U + 12345U;
    kinds[sequence % KINDS].draw(&picture);
}

#define FRAME_US 40000

static struct isohead head;
static uint8_t drawn[IH_FRAME_WIDTH_MAX * IH_FRAME_HEIGHT_MAX];

/* Not inlined, so that they can be found; the second ends what the first began. */
enum ih_err bench_worst_frame(const struct ih_frame *frame, int64_t time_us);
void bench_worst_end(int32_t number, const char *kind);

__attribute__((noinline)) enum ih_err bench_worst_frame(const struct ih_frame *frame,
                                                        int64_t time_us)
{
    return isohead_frame(&head, frame, NULL, time_us);
}

__attribute__((noinline)) void bench_worst_end(int32_t number, const char *kind)
{
    int32_t slices = 0;
    for (int32_t i = 0; i < head.nests.nest_count; i++) {
        slices += head.nests.nest[i].slice_count;
    }
    printf(
        "%d %s dots %d edges %d hot %d dropped %d labels %d lost %d samples %d nests %d slices %d "
        "detections %d expected %d\n",
        (int)number, kind, (int)head.dots.dot_count, (int)head.dots.edge_count,
        (int)head.dots.hot_count, (int)head.dots.dots_dropped, (int)head.labels.labelled_count,
        (int)head.labels.candidates_dropped, (int)head.samples.sample_count,
        (int)head.nests.nest_count, (int)slices, (int)head.detections.detection_count,
        (int)head.expected.count);
}

static bool load_rig(const char *path, struct ih_calibration *calibration)
{
    struct hal_error error;
    if (!app_rig_load(path, calibration, &error)) {
        fprintf(stderr, "bench_worst: %s: %s\n", path, error.text);
        return false;
    }
    return true;
}

static bool start(const struct ih_calibration *calibration)
{
    int32_t bad_slot;
    enum ih_err err = isohead_init(&head, calibration, &bad_slot);
    if (err != IH_OK) {
        fprintf(stderr, "bench_worst: the rig: %s\n", ih_err_text(err));
    }
    return err == IH_OK;
}

static struct ih_frame view_of(const uint8_t *samples)
{
    const struct ih_calibration *c = &head.rig.calibration;
    return (struct ih_frame){samples, c->width, c->height, c->width, 1, 255};
}

static bool save(const char *path, const struct ih_frame *frame)
{
    FILE *file = fopen(path, "wb");
    if (file == NULL) {
        perror(path);
        return false;
    }
    fprintf(file, "P5\n%d %d\n255\n", (int)frame->width, (int)frame->height);
    fwrite(frame->samples, 1, (size_t)frame->width * (size_t)frame->height, file);
    bool good = ferror(file) == 0;
    return fclose(file) == 0 && good;
}

/* Frames that are drawn. */
static bool run_drawn(const struct ih_calibration *calibration, int32_t first, int32_t count,
                      const char *save_path)
{
    struct ih_frame frame = {0};
    for (int32_t i = first - first % WORST_SEQUENCE; i < first + count; i++) {
        if (i % WORST_SEQUENCE == 0 && !start(calibration)) {
            return false;
        }
        draw_frame(&head.rig, i, drawn);
        frame = view_of(drawn);
        int64_t time_us = (int64_t)(i % WORST_SEQUENCE) * FRAME_US;
        if (i < first) {
            if (isohead_frame(&head, &frame, NULL, time_us) != IH_OK) {
                return false;
            }
            continue;
        }
        if (bench_worst_frame(&frame, time_us) != IH_OK) {
            return false;
        }
        bench_worst_end(i, kind_of(i));
    }
    return save_path == NULL || (frame.samples != NULL && save(save_path, &frame));
}

/* Frames that are named, a sequence; those from `first` on count. */
static bool run_named(const struct ih_calibration *calibration, int32_t first,
                      const struct bench_set *set)
{
    if (!start(calibration)) {
        return false;
    }
    for (int32_t i = 0; i < set->frame_count; i++) {
        struct ih_frame frame = view_of(set->frame[i].samples);
        int64_t time_us = (int64_t)i * FRAME_US;
        if (set->frame[i].width != frame.width || set->frame[i].height != frame.height ||
            set->frame[i].bytes_per_sample != 1) {
            fprintf(stderr, "bench_worst: frame %d is not 8-bit and of the rig's size\n", (int)i);
            return false;
        }
        enum ih_err err = i < first ? isohead_frame(&head, &frame, NULL, time_us)
                                    : bench_worst_frame(&frame, time_us);
        if (err != IH_OK) {
            return false;
        }
        if (i >= first) {
            bench_worst_end(i, "rendered");
        }
    }
    return true;
}

static bool parse(const char *text, int32_t *number)
{
    char *end;
    long value = strtol(text, &end, 10);
    if (end == text || *end != 0 || value < 0 || value > 100000000) {
        fprintf(stderr, "bench_worst: %s: expected a number from 0 to 100000000\n", text);
        return false;
    }
    *number = (int32_t)value;
    return true;
}

int main(int argument_count, char **arguments)
{
    static struct ih_calibration calibration;
    const char *save_path = NULL;
    int at = 1;
    if (argument_count > 3 && strcmp(arguments[1], "--save") == 0) {
        save_path = arguments[2];
        at = 3;
    }
    if (argument_count < at + 3) {
        fputs("usage: bench_worst [--save OUT.pgm] RIG.json FIRST COUNT [FRAME.pgm...]\n", stderr);
        return 2;
    }
    int32_t first, count;
    if (!parse(arguments[at + 1], &first) || !parse(arguments[at + 2], &count)) {
        return 2;
    }
    if (!load_rig(arguments[at], &calibration)) {
        return 1;
    }
    bool good;
    if (argument_count > at + 3) {
        struct bench_input input;
        arguments[at + 2] = arguments[at]; /* the rig, before its frames */
        good = bench_input_load(argument_count - at - 2, &arguments[at + 2], &input) &&
               run_named(&calibration, first, &input.sets[0]);
    } else {
        good = run_drawn(&calibration, first, count, save_path);
    }
    return good && fflush(stdout) == 0 ? 0 : 1;
}
