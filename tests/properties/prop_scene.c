#include "prop_scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DOT_GREY 90
#define DOT_SIGMA_PX 1.3
#define BACKGROUND_GREY 30

struct prop_scene prop_person(double x_mm, double y_mm, double z_mm, double size, double wall_mm)
{
    struct prop_scene scene = {
        .body = {{{0, 0, 0}, {78, 113, 98}},
                 {{0, 140, 25}, {58, 90, 58}},
                 {{0, 400, 40}, {230, 230, 120}}},
    };
    const double place[3] = {x_mm, y_mm, z_mm};

    scene = prop_scaled(&scene, size);
    scene = prop_moved(&scene, place);
    scene.wall_mm = wall_mm;
    return scene;
}

struct prop_scene prop_random_person(struct ih_test_random *random, double aside_mm)
{
    const double x = (2 * ih_test_unit(random) - 1) * aside_mm;
    const double y = (2 * ih_test_unit(random) - 1) * aside_mm;
    const double z = 650 + 450 * ih_test_unit(random);
    const double size = 0.9 + 0.2 * ih_test_unit(random);

    return prop_person(x, y, z, size, z + 400 + 800 * ih_test_unit(random));
}

struct prop_scene prop_scaled(const struct prop_scene *scene, double factor)
{
    struct prop_scene out = *scene;

    for (int i = 0; i < PROP_BODIES; i++) {
        for (int axis = 0; axis < 3; axis++) {
            out.body[i].centre_mm[axis] *= factor;
            out.body[i].semi_mm[axis] *= factor;
        }
    }
    out.wall_mm *= factor;
    return out;
}

struct prop_scene prop_moved(const struct prop_scene *scene, const double by_mm[3])
{
    struct prop_scene out = *scene;

    for (int i = 0; i < PROP_BODIES; i++) {
        for (int axis = 0; axis < 3; axis++) {
            out.body[i].centre_mm[axis] += by_mm[axis];
        }
    }
    out.wall_mm += by_mm[2];
    return out;
}

/* Where a line enters an ellipsoid: the smallest s > 0; HUGE_VAL where it does not. */
static double enter(const struct prop_body *body, const double from[3], const double towards[3])
{
    double a = 0, b = 0, c = -1;

    for (int axis = 0; axis < 3; axis++) {
        const double p = (from[axis] - body->centre_mm[axis]) / body->semi_mm[axis];
        const double d = towards[axis] / body->semi_mm[axis];

        a += d * d;
        b += p * d;
        c += p * p;
    }
    const double inside = b * b - a * c;
    const double s = inside < 0 ? -1 : (-b - sqrt(inside)) / a;

    return s > 0 ? s : HUGE_VAL;
}

/* How far a head's surface lies before its ellipsoid: brow, nose, lips and hair, made of waves: a twelfth of its depth high. A
 * surface without any is a ball's. */
static double relief_mm(const struct prop_body *head, double x_mm, double y_mm)
{
    const double x = (x_mm - head->centre_mm[0]) / head->semi_mm[0];
    const double y = (y_mm - head->centre_mm[1]) / head->semi_mm[1];

    return head->semi_mm[2] / 12 * sin(12.5 * y) * cos(5.5 * x);
}

double prop_depth_mm(const struct prop_scene *scene, const double from_mm[3],
                     const double towards[3], int *body)
{
    double nearest = (scene->wall_mm - from_mm[2]) / towards[2];
    int which = PROP_BODIES;

    for (int i = 0; i < PROP_BODIES; i++) {
        const double s = enter(&scene->body[i], from_mm, towards);

        if (s < nearest) {
            nearest = s;
            which = i;
        }
    }
    if (body != NULL) {
        *body = which;
    }
    if (which == 0) {
        nearest -= relief_mm(&scene->body[0], from_mm[0] + nearest * towards[0],
                             from_mm[1] + nearest * towards[1]) /
                   towards[2];
    }
    return from_mm[2] + nearest * towards[2];
}

void prop_project(const struct ih_calibration *c, const double point_mm[3], double *u_px,
                  double *v_px)
{
    const double x = point_mm[0] / point_mm[2], y = point_mm[1] / point_mm[2];
    const double r2 = x * x + y * y;
    const double k1 = ih_test_from_q(c->k1_q24, 24), k2 = ih_test_from_q(c->k2_q24, 24);
    const double k3 = ih_test_from_q(c->k3_q24, 24);
    const double p1 = ih_test_from_q(c->p1_q24, 24), p2 = ih_test_from_q(c->p2_q24, 24);
    const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
    const double bent_x = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
    const double bent_y = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;

    *u_px = ih_test_from_q(c->fx_px_q16, 16) * bent_x + ih_test_from_q(c->cx_px_q16, 16);
    *v_px = ih_test_from_q(c->fy_px_q16, 16) * bent_y + ih_test_from_q(c->cy_px_q16, 16);
}

/* Does the camera see this point, or something before it? Of a head it may see the same relief a little nearer. */
static bool is_hidden(const struct prop_scene *scene, const double point_mm[3])
{
    static const double camera[3] = {0, 0, 0};
    int body;
    const double z_mm = prop_depth_mm(scene, camera, point_mm, &body);
    const double nearer_mm = body == 0 ? scene->body[0].semi_mm[2] / 12 : point_mm[2] * 0.0005;

    return z_mm < point_mm[2] - nearer_mm;
}

struct prop_dot prop_dot_of(const struct prop_scene *scene, const struct ih_calibration *c,
                            int32_t slot)
{
    struct prop_dot dot = {.seen = false};
    double origin[3], ray[3];

    for (int axis = 0; axis < 3; axis++) {
        origin[axis] = ih_test_from_q(c->origin_mm_q16[axis], 16);
        ray[axis] = ih_test_from_q(c->ray_q30[slot][axis], 30);
    }
    const double z = prop_depth_mm(scene, origin, ray, &dot.body);

    for (int axis = 0; axis < 3; axis++) {
        dot.point_mm[axis] = origin[axis] + (z - origin[2]) / ray[2] * ray[axis];
    }
    prop_project(c, dot.point_mm, &dot.u_px, &dot.v_px);
    dot.seen = z > c->near_mm && z < c->far_mm && !is_hidden(scene, dot.point_mm) && dot.u_px > 6 &&
               dot.v_px > 6 && dot.u_px < c->width - 7 && dot.v_px < c->height - 7;
    return dot;
}

void prop_sort(struct ih_dots *dots, int16_t slot_of_dot[IH_DOTS_MAX])
{
    for (int32_t i = 1; i < dots->dot_count; i++) {
        const struct ih_dot dot = dots->dot[i];
        const int16_t slot = slot_of_dot[i];
        int32_t at = i;

        for (; at > 0 && (dots->dot[at - 1].v_px_q12 > dot.v_px_q12 ||
                          (dots->dot[at - 1].v_px_q12 == dot.v_px_q12 &&
                           dots->dot[at - 1].u_px_q12 > dot.u_px_q12));
             at--) {
            dots->dot[at] = dots->dot[at - 1];
            slot_of_dot[at] = slot_of_dot[at - 1];
        }
        dots->dot[at] = dot;
        slot_of_dot[at] = slot;
    }
}

void prop_dots(const struct prop_scene *scene, const struct ih_calibration *c,
               struct ih_test_random *random, double sigma_px, struct ih_dots *dots,
               int16_t slot_of_dot[IH_DOTS_MAX])
{
    memset(dots, 0, sizeof *dots);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct prop_dot dot = prop_dot_of(scene, c, slot);
        const double du = sigma_px * ih_test_normal(random), dv = sigma_px * ih_test_normal(random);

        if (dot.seen) {
            slot_of_dot[dots->dot_count] = (int16_t)slot;
            dots->dot[dots->dot_count++] =
                (struct ih_dot){(int32_t)lround((dot.u_px + du) * 4096),
                                (int32_t)lround((dot.v_px + dv) * 4096), 5000};
        }
    }
    prop_sort(dots, slot_of_dot);
}

static void paint_dot(const struct prop_dot *dot, uint8_t *grey, const struct ih_frame *frame)
{
    for (int32_t y = (int32_t)dot->v_px - 5; y <= (int32_t)dot->v_px + 6; y++) {
        for (int32_t x = (int32_t)dot->u_px - 5; x <= (int32_t)dot->u_px + 6; x++) {
            if (x >= 0 && y >= 0 && x < frame->width && y < frame->height) {
                const double r2 =
                    (x - dot->u_px) * (x - dot->u_px) + (y - dot->v_px) * (y - dot->v_px);
                const long added = lround(DOT_GREY * exp(-r2 / (2 * DOT_SIGMA_PX * DOT_SIGMA_PX)));

                grey[y * frame->width + x] = (uint8_t)(grey[y * frame->width + x] + added);
            }
        }
    }
}

void prop_paint(const struct prop_scene *scene, const struct ih_calibration *c,
                struct ih_test_random *random, uint8_t *grey, struct ih_frame *frame)
{
    *frame = (struct ih_frame){grey, c->width, c->height, c->width, 1, 255};
    for (int32_t i = 0; i < c->width * c->height; i++) {
        grey[i] = (uint8_t)(BACKGROUND_GREY + ih_test_u64(random) % 4);
    }
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct prop_dot dot = prop_dot_of(scene, c, slot);

        if (dot.seen) {
            paint_dot(&dot, grey, frame);
        }
    }
}

void prop_range_rig(struct ih_calibration *c, int32_t width, int32_t height, double focal_px)
{
    memset(c, 0, sizeof *c);
    c->kind = IH_RIG_RANGE;
    c->width = width;
    c->height = height;
    c->fx_px_q16 = c->fy_px_q16 = (int32_t)lround(focal_px * 65536);
    c->cx_px_q16 = (width - 1) * 32768;
    c->cy_px_q16 = (height - 1) * 32768;
    c->near_mm = 300;
    c->far_mm = 6000;
}

void prop_paint_range(const struct prop_scene *scene, const struct ih_calibration *c,
                      uint16_t *depth_mm, struct ih_frame *frame)
{
    static const double camera[3] = {0, 0, 0};
    const double focal = ih_test_from_q(c->fx_px_q16, 16);

    *frame = (struct ih_frame){depth_mm, c->width, c->height, 2 * c->width, 2, 65535};
    for (int32_t i = 0; i < c->width * c->height; i++) {
        const double towards[3] = {
            (i % c->width - ih_test_from_q(c->cx_px_q16, 16)) / focal,
            ((double)(i / c->width) - ih_test_from_q(c->cy_px_q16, 16)) / focal, 1};

        depth_mm[i] = (uint16_t)lround(prop_depth_mm(scene, camera, towards, NULL));
    }
}

int32_t prop_seeds(int32_t count)
{
    const char *times = getenv("ISOHEAD_SEEDS");
    const long factor = times == NULL ? 1 : strtol(times, NULL, 10);

    TEST_ASSERT_TRUE_MESSAGE(factor >= 1 && factor <= 10000,
                             "ISOHEAD_SEEDS is no number from 1 to 10000");
    return count * (int32_t)factor;
}
