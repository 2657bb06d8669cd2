#include "rd_dots.h"

#include <stddef.h>

#include "rd_rng.h"

/* The bundle: one ray in the middle and two rings. Radii (in sigmas) and weights reproduce a Gaussian's variance. */
#define INNER_COUNT 6
#define OUTER_COUNT 8
#define SUB_COUNT (1 + INNER_COUNT + OUTER_COUNT)
#define INNER_SIGMAS 1.12
#define OUTER_SIGMAS 2.13
#define MIDDLE_FRACTION 0.20
#define INNER_FRACTION 0.50
#define OUTER_FRACTION 0.30
/* The spot that power_grey speaks of. */
#define NOMINAL_SIGMA_PX 1.2
/* A spot is drawn out to this many pixels. */
#define SPOT_REACH_PX 7
/* Beam width is taken at this distance when the middle ray meets nothing. */
#define NOWHERE_MM 1500.0
/* Surfaces finer than this have the same speckle pattern. */
#define SPECKLE_MM 0.5

struct spot {
    double u_px, v_px;
    double sum_grey; /* over all its pixels */
    double sigma_px;
};

void rd_laser_make(struct rd_laser *laser, const struct rd_options *options, const struct rd_rig *rig)
{
    struct rd_rng rng = rd_rng_start(options->rig_seed, RD_STREAM_LASER);
    double zoom = options->width / 752.0;
    laser->power_grey = options->exposure * rd_rng_uniform(&rng, 105.0, 180.0);
    laser->optics_px = rd_rng_uniform(&rng, 0.80, 0.98) * fmax(0.9, sqrt(zoom));
    laser->field_blur = rd_rng_uniform(&rng, 0.05, 0.35);
    laser->beam_mm = rd_rng_uniform(&rng, 0.45, 0.75);
    laser->divergence = rd_rng_uniform(&rng, 1e-4, 3e-4);
    laser->speckle = rd_rng_uniform(&rng, 0.15, 0.45);
    laser->seed = rd_rng_next(&rng);
    laser->missing = options->missing;
    laser->reach_mm = options->range_dir != NULL ? rig->far_mm : RD_FAR_AWAY_MM;
    for (int i = 0; i < RD_DOT_COUNT; i++) {
        double row = i / RD_DOT_ROWS - RD_DOT_ROWS / 2, column = i % RD_DOT_ROWS - RD_DOT_ROWS / 2;
        double outwards = (row * row + column * column) / 162.0;
        laser->gain[i] = rd_rng_uniform(&rng, 0.85, 1.15) * (1.0 - 0.2 * outwards);
    }
    laser->gain[RD_DOT_COUNT / 2] *= 1.4; /* the undiffracted beam */
}

static void draw_spot(const struct rd_rig *rig, const struct spot *spot, float *grey)
{
    double across[2 * SPOT_REACH_PX + 1];
    int u0 = (int)floor(spot->u_px + 0.5), v0 = (int)floor(spot->v_px + 0.5);
    double narrow = -0.5 / (spot->sigma_px * spot->sigma_px);
    double peak = spot->sum_grey / (2.0 * RD_PI * spot->sigma_px * spot->sigma_px);
    for (int i = -SPOT_REACH_PX; i <= SPOT_REACH_PX; i++) {
        double du = u0 + i - spot->u_px;
        across[i + SPOT_REACH_PX] = exp(narrow * du * du);
    }
    for (int v = v0 - SPOT_REACH_PX; v <= v0 + SPOT_REACH_PX; v++) {
        if (v < 0 || v >= rig->height)
            continue;
        double dv = v - spot->v_px, row_peak = peak * exp(narrow * dv * dv);
        for (int i = -SPOT_REACH_PX; i <= SPOT_REACH_PX; i++) {
            int u = u0 + i;
            if (u >= 0 && u < rig->width)
                grey[v * rig->width + u] += (float)(row_peak * across[i + SPOT_REACH_PX]);
        }
    }
}

/* What the camera gets from one hit of a sub-ray. False: it does not see the point. */
static bool spot_of(const struct rd_laser *laser, const struct rd_rig *rig, const struct rd_scene *scene,
                    const struct rd_hit *hit, double power, struct spot *spot)
{
    const struct rd_vec camera = {0.0, 0.0, 0.0};
    struct rd_vec to_camera = rd_unit(rd_scale(hit->point_mm, -1.0));
    double cosine = rd_dot(hit->normal, to_camera);
    if (cosine <= 0.02 || !rd_rig_project(rig, hit->point_mm, &spot->u_px, &spot->v_px) ||
        rd_scene_blocked(scene, camera, hit->point_mm))
        return false;
    double metres = 1e-3 * rd_length(hit->point_mm);
    double x = (spot->u_px - rig->cx_px) / rig->cx_px, y = (spot->v_px - rig->cy_px) / rig->cx_px;
    spot->sum_grey = power * hit->albedo * cosine / (metres * metres);
    spot->sigma_px = laser->optics_px * (1.0 + laser->field_blur * (x * x + y * y));
    return spot->u_px > -SPOT_REACH_PX && spot->u_px < rig->width + SPOT_REACH_PX && spot->v_px > -SPOT_REACH_PX &&
           spot->v_px < rig->height + SPOT_REACH_PX;
}

/* Direction of sub-ray `sub`; sigma is the beam's angular width. Sub-ray 0 is the middle. */
static struct rd_vec sub_ray(struct rd_vec dir, int sub, double sigma, double *fraction)
{
    if (sub == 0) {
        *fraction = MIDDLE_FRACTION;
        return dir;
    }
    bool inner = sub <= INNER_COUNT;
    double angle = inner ? 2.0 * RD_PI * sub / INNER_COUNT : 2.0 * RD_PI * (sub + 0.5) / OUTER_COUNT;
    double away = sigma * (inner ? INNER_SIGMAS : OUTER_SIGMAS);
    struct rd_rot across = rd_rot_frame(dir, rd_v(1.0, 0.0, 0.0));
    *fraction = inner ? INNER_FRACTION / INNER_COUNT : OUTER_FRACTION / OUTER_COUNT;
    dir = rd_along(dir, across.x, away * cos(angle));
    return rd_unit(rd_along(dir, across.z, away * sin(angle)));
}

/* A rough surface sends some sub-rays' light elsewhere; which ones depends on the position alone. */
static double speckle_gain(const struct rd_laser *laser, int dot, int sub, struct rd_vec point_mm)
{
    uint64_t position = (uint64_t)(int64_t)floor(point_mm.z / SPECKLE_MM);
    double flat = rd_hash_unit(laser->seed + position, (uint64_t)dot, (uint64_t)sub);
    return 1.0 - laser->speckle - laser->speckle * log(1.0 - flat);
}

/* The brightest of the 3x3 pixels around a position, as far as the sensor can show it. */
static double peak_near(const struct rd_rig *rig, const float *grey, double u_px, double v_px)
{
    int u0 = (int)floor(u_px + 0.5), v0 = (int)floor(v_px + 0.5);
    double peak = 0.0;
    for (int v = v0 - 1; v <= v0 + 1; v++) {
        for (int u = u0 - 1; u <= u0 + 1; u++) {
            if (u >= 0 && v >= 0 && u < rig->width && v < rig->height)
                peak = fmax(peak, (double)grey[v * rig->width + u]);
        }
    }
    return fmin(peak, RD_FULL_GREY);
}

/* Does the position belong to one of the frame's pixels? */
static bool in_frame(const struct rd_rig *rig, double u_px, double v_px)
{
    return u_px >= -0.5 && v_px >= -0.5 && u_px <= rig->width - 0.5 && v_px <= rig->height - 0.5;
}

/* Beam width as an angle, where the beam lands. */
static double beam_sigma(const struct rd_laser *laser, const struct rd_scene *scene, const struct rd_ray *ray)
{
    struct rd_hit hit;
    double reach_mm = rd_scene_hit(scene, ray, laser->reach_mm, &hit) ? hit.t_mm : NOWHERE_MM;
    return laser->beam_mm / reach_mm + laser->divergence;
}

/* Draws one dot. True: the camera sees the point of its middle ray, at *dot. */
static bool cast_dot(const struct rd_laser *laser, const struct rd_rig *rig, const struct rd_scene *scene, int index,
                     float *grey, struct rd_dot *dot)
{
    double power = laser->power_grey * laser->gain[index] * 2.0 * RD_PI * NOMINAL_SIGMA_PX * NOMINAL_SIGMA_PX;
    struct rd_ray ray = {rig->projector_mm, rig->dot_rays[index]};
    double sigma = beam_sigma(laser, scene, &ray), before_grey = 0.0;
    bool middle_seen = false;
    for (int sub = 0; sub < SUB_COUNT; sub++) {
        double fraction;
        struct spot spot;
        struct rd_hit hit;
        ray.dir = sub_ray(rig->dot_rays[index], sub, sigma, &fraction);
        if (!rd_scene_hit(scene, &ray, laser->reach_mm, &hit))
            continue;
        fraction *= speckle_gain(laser, index, sub, hit.point_mm);
        if (!spot_of(laser, rig, scene, &hit, fraction * power, &spot))
            continue;
        if (sub == 0) {
            middle_seen = in_frame(rig, spot.u_px, spot.v_px);
            before_grey = peak_near(rig, grey, spot.u_px, spot.v_px);
            *dot = (struct rd_dot){index, false, spot.u_px, spot.v_px, hit.point_mm.z};
        }
        draw_spot(rig, &spot, grey);
    }
    dot->is_dim = middle_seen && peak_near(rig, grey, dot->u_px, dot->v_px) - before_grey < RD_VISIBLE_GREY;
    return middle_seen;
}

void rd_dots_cast(const struct rd_laser *laser, const struct rd_rig *rig, const struct rd_scene *scene, int frame,
                  float *grey, struct rd_dot_list *seen)
{
    seen->dot_count = 0;
    for (int i = 0; i < RD_DOT_COUNT; i++) {
        bool missing = rd_hash_unit(laser->seed, (uint64_t)i, (uint64_t)frame) < laser->missing;
        if (!missing && cast_dot(laser, rig, scene, i, grey, &seen->dots[seen->dot_count]))
            seen->dot_count++;
    }
}
