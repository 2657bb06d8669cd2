#include "rd_rig.h"

#include <stddef.h>

#include "rd_rng.h"

/* The camera of the paper, at its own picture size. */
#define PAPER_WIDTH_PX 752
#define PAPER_FX_PX 920.8
#define PAPER_FY_PX 943.8
/* A common depth camera, at 640 pixels. */
#define RANGE_WIDTH_PX 640
#define RANGE_FOCAL_PX 525.0
#define PAPER_BASELINE_MM 12.5
#define WIDE_BASELINE_MM 125.0
/* Where the pattern's middle crosses the camera's axis, nearly. */
#define MEET_MM 800.0
/* 1.7 degrees; turned by one dot in nineteen, so that no two dots share an epipolar line. */
#define PITCH_COSINE (1.7 * RD_RAD_PER_DEG)
#define TURN_TANGENT (1.0 / 19.0)
#define NEAR_MM 400.0
#define SEAT_FAR_MM 2600.0
#define ROOM_FAR_MM 6000.0
/* Outside this tangent of the field angle the distortion polynomial is meaningless. */
#define FIELD_TANGENT_MAX 0.8
#define UNDISTORT_STEPS 12
/* Typical errors of a calibration. */
#define FOCAL_ERROR 1e-3
#define CENTRE_ERROR_PX 1.0
#define ORIGIN_ERROR_MM 0.1
#define RAY_ERROR_DEG 0.01
/* How rigs differ from their plan. */
#define BUILT_FOCAL 0.01
#define BUILT_CENTRE_PX 6.0
#define BUILT_POSITION_MM 1.0
#define BUILT_TURN_DEG 0.4
#define BUILT_PITCH 0.004
#define BUILT_RAY_DEG 0.01

static void make_lens(struct rd_rig *rig, const struct rd_options *options)
{
    struct rd_rng rng = rd_rng_start(options->rig_seed, RD_STREAM_RIG);
    double k1 = rd_rng_uniform(&rng, -0.18, -0.14);
    double k2 = rd_rng_uniform(&rng, 0.045, 0.08);
    double p1 = rd_rng_uniform(&rng, -5.5e-4, 5.5e-4);
    double p2 = rd_rng_uniform(&rng, -5.5e-4, 5.5e-4);
    double strength = options->distortion == RD_LENS_NONE ? 0.0 : options->distortion == RD_LENS_STRONG ? 1.8 : 1.0;
    rig->k1 = strength * k1;
    rig->k2 = strength * k2;
    rig->p1 = strength * p1;
    rig->p2 = strength * p2;
    rig->k3 = 0.0;
}

static void make_dots(struct rd_rig *rig, double baseline_mm)
{
    double toe_in = atan(baseline_mm / MEET_MM);
    struct rd_rot towards = rd_rot_euler(-toe_in, 0.0, 0.0);
    double across = PITCH_COSINE / sqrt(1.0 + TURN_TANGENT * TURN_TANGENT);
    double down = across * TURN_TANGENT;
    rig->projector_mm = rd_v(baseline_mm * cos(toe_in), 0.0, baseline_mm * sin(toe_in));
    for (int i = 0; i < RD_DOT_COUNT; i++) {
        double row = i / RD_DOT_ROWS - RD_DOT_ROWS / 2, column = i % RD_DOT_ROWS - RD_DOT_ROWS / 2;
        double x = column * across - row * down, y = column * down + row * across;
        rig->dot_rays[i] = rd_turn(&towards, rd_v(x, y, sqrt(1.0 - x * x - y * y)));
    }
}

/* About an axis (unit), by Rodrigues. */
static struct rd_vec turned(struct rd_vec v, struct rd_vec axis, double angle)
{
    struct rd_vec along = rd_scale(axis, rd_dot(axis, v) * (1.0 - cos(angle)));
    return rd_along(rd_along(along, v, cos(angle)), rd_cross(axis, v), sin(angle));
}

static struct rd_vec draw_normal_vec(struct rd_rng *rng)
{
    struct rd_vec v;
    v.x = rd_rng_normal(rng);
    v.y = rd_rng_normal(rng);
    v.z = rd_rng_normal(rng);
    return v;
}

/* Draws what the hands that built the rig did not get quite right. */
static void assemble(struct rd_rig *rig, const struct rd_options *options)
{
    struct rd_rng rng = rd_rng_start(options->rig_seed, RD_STREAM_RIG + ((uint64_t)3 << 32));
    double much = options->assembly, focal = 1.0 + much * BUILT_FOCAL * rd_rng_normal(&rng);
    rig->fx_px *= focal;
    rig->fy_px *= focal * (1.0 + 0.1 * much * BUILT_FOCAL * rd_rng_normal(&rng));
    rig->cx_px += much * BUILT_CENTRE_PX * rd_rng_normal(&rng);
    rig->cy_px += much * BUILT_CENTRE_PX * rd_rng_normal(&rng);
    rig->projector_mm = rd_along(rig->projector_mm, draw_normal_vec(&rng), much * BUILT_POSITION_MM);
    struct rd_vec turn = rd_scale(draw_normal_vec(&rng), much * BUILT_TURN_DEG * RD_RAD_PER_DEG);
    struct rd_vec middle = rig->dot_rays[RD_DOT_COUNT / 2];
    double pitch = 1.0 + much * BUILT_PITCH * rd_rng_normal(&rng);
    for (int i = 0; i < RD_DOT_COUNT; i++) {
        struct rd_vec ray = rig->dot_rays[i];
        struct rd_vec aside = rd_along(ray, middle, -rd_dot(ray, middle));
        struct rd_vec error = rd_scale(draw_normal_vec(&rng), much * BUILT_RAY_DEG * RD_RAD_PER_DEG);
        ray = rd_unit(rd_add(rd_along(ray, aside, pitch - 1.0), error));
        rig->dot_rays[i] = rd_unit(turned(ray, rd_unit(turn), rd_length(turn)));
    }
}

void rd_rig_make(struct rd_rig *rig, const struct rd_options *options)
{
    double zoom = options->focal * options->width / PAPER_WIDTH_PX;
    bool open_room = options->scene == RD_SCENE_TABLE || options->scene == RD_SCENE_ROOM || options->range_dir != NULL;
    rig->width = options->width;
    rig->height = options->height;
    rig->fx_px = PAPER_FX_PX * zoom;
    rig->fy_px = PAPER_FY_PX * zoom;
    rig->cx_px = 0.5 * (options->width - 1);
    rig->cy_px = 0.5 * (options->height - 1);
    rig->near_mm = NEAR_MM;
    rig->far_mm = (open_room ? ROOM_FAR_MM : SEAT_FAR_MM) + options->away_mm;
    rig->is_range = options->rig == RD_RIG_RANGE;
    if (rig->is_range) {
        rig->fx_px = rig->fy_px = RANGE_FOCAL_PX * options->focal * options->width / RANGE_WIDTH_PX;
        rig->far_mm = ROOM_FAR_MM;
        return;
    }
    make_lens(rig, options);
    make_dots(rig, options->rig == RD_RIG_WIDE ? WIDE_BASELINE_MM : PAPER_BASELINE_MM);
    if (options->assembly > 0.0)
        assemble(rig, options);
}

/* Rays of `from` about an axis (unit) into the rig. */
static void rotate_rays(struct rd_rig *rig, const struct rd_rig *from, struct rd_vec axis, double angle_deg)
{
    for (int i = 0; angle_deg > 0.0 && i < RD_DOT_COUNT; i++)
        rig->dot_rays[i] = rd_unit(turned(from->dot_rays[i], axis, angle_deg * RD_RAD_PER_DEG));
}

static struct rd_vec vec_of(const double xyz[3])
{
    return rd_v(xyz[0], xyz[1], xyz[2]);
}

void rd_rig_knock(struct rd_rig *rig, const struct rd_options *options)
{
    struct rd_rng rng = rd_rng_start(options->rig_seed, RD_STREAM_RIG + ((uint64_t)1 << 32));
    struct rd_vec rotation_deg = vec_of(options->knock_xyz_deg);
    double focal = 1.0 + options->knock_camera[0] / 100.0;
    rotate_rays(rig, rig, rd_unit(draw_normal_vec(&rng)), options->knock_deg);
    rotate_rays(rig, rig, rd_unit(rotation_deg), rd_length(rotation_deg));
    rig->projector_mm = rd_add(rig->projector_mm, vec_of(options->knock_shift_mm));
    rig->fx_px *= focal;
    rig->fy_px *= focal;
    rig->cx_px += options->knock_camera[1];
    rig->cy_px += options->knock_camera[2];
}

void rd_rig_drift(struct rd_rig *rig, const struct rd_rig *start, const struct rd_options *options, double fraction)
{
    struct rd_vec rotation_deg = vec_of(options->drift_deg);
    rotate_rays(rig, start, rd_unit(rotation_deg), fraction * rd_length(rotation_deg));
}

void rd_rig_misjudge(struct rd_rig *rig, const struct rd_options *options)
{
    struct rd_rng rng = rd_rng_start(options->rig_seed, RD_STREAM_RIG + ((uint64_t)2 << 32));
    double noise = options->calibration_noise;
    if (noise <= 0.0)
        return;
    rig->fx_px *= 1.0 + noise * FOCAL_ERROR * rd_rng_normal(&rng);
    rig->fy_px *= 1.0 + noise * FOCAL_ERROR * rd_rng_normal(&rng);
    rig->cx_px += noise * CENTRE_ERROR_PX * rd_rng_normal(&rng);
    rig->cy_px += noise * CENTRE_ERROR_PX * rd_rng_normal(&rng);
    rig->projector_mm = rd_along(rig->projector_mm, draw_normal_vec(&rng), noise * ORIGIN_ERROR_MM);
    for (int i = 0; i < RD_DOT_COUNT; i++) {
        struct rd_vec error = rd_scale(draw_normal_vec(&rng), noise * RAY_ERROR_DEG * RD_RAD_PER_DEG);
        rig->dot_rays[i] = rd_unit(rd_add(rig->dot_rays[i], error));
    }
}

static void distort(const struct rd_rig *rig, double x, double y, double *xd, double *yd)
{
    double r2 = x * x + y * y;
    double radial = 1.0 + r2 * (rig->k1 + r2 * (rig->k2 + r2 * rig->k3));
    *xd = x * radial + 2.0 * rig->p1 * x * y + rig->p2 * (r2 + 2.0 * x * x);
    *yd = y * radial + rig->p1 * (r2 + 2.0 * y * y) + 2.0 * rig->p2 * x * y;
}

bool rd_rig_project(const struct rd_rig *rig, struct rd_vec point_mm, double *u_px, double *v_px)
{
    if (point_mm.z < 1.0)
        return false;
    double x = point_mm.x / point_mm.z, y = point_mm.y / point_mm.z, xd, yd;
    if (x * x + y * y > FIELD_TANGENT_MAX * FIELD_TANGENT_MAX)
        return false;
    distort(rig, x, y, &xd, &yd);
    *u_px = rig->fx_px * xd + rig->cx_px;
    *v_px = rig->fy_px * yd + rig->cy_px;
    return true;
}

/* The middle dot's neighbours on both sides give the grating's two axes, as long as one step of direction cosine. */
bool rd_rig_pattern_place(const struct rd_rig *rig, struct rd_vec point_mm, double *row, double *column)
{
    if (rig->is_range) {
        double half = 0.5 * RD_DOT_ROWS;
        *row = rig->fy_px * point_mm.y / point_mm.z / (0.5 * rig->height) * half;
        *column = rig->fx_px * point_mm.x / point_mm.z / (0.5 * rig->width) * half;
        return point_mm.z > 0.0;
    }
    const struct rd_vec *middle = &rig->dot_rays[RD_DOT_COUNT / 2];
    struct rd_vec across = rd_scale(rd_sub(middle[1], middle[-1]), 0.5);
    struct rd_vec down = rd_scale(rd_sub(middle[RD_DOT_ROWS], middle[-RD_DOT_ROWS]), 0.5);
    struct rd_vec dir = rd_unit(rd_sub(point_mm, rig->projector_mm));
    *row = rd_dot(dir, down) / rd_dot(down, down);
    *column = rd_dot(dir, across) / rd_dot(across, across);
    return rd_dot(dir, *middle) > 0.0;
}

struct rd_vec rd_rig_pixel_ray(const struct rd_rig *rig, double u_px, double v_px)
{
    double xd = (u_px - rig->cx_px) / rig->fx_px, yd = (v_px - rig->cy_px) / rig->fy_px;
    double x = xd, y = yd;
    for (int step = 0; step < UNDISTORT_STEPS; step++) {
        double bent_x, bent_y;
        distort(rig, x, y, &bent_x, &bent_y);
        x += xd - bent_x;
        y += yd - bent_y;
    }
    return rd_unit(rd_v(x, y, 1.0));
}
