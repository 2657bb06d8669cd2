#include "worst_frames.h"
#include "rig/ih_camera.h"

#include <stdbool.h>

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

const char *worst_frame_kind(int32_t number)
{
    return kinds[number / WORST_SEQUENCE % KINDS].name;
}

void worst_frame_draw(const struct ih_rig *rig, int32_t number, uint8_t *samples)
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
