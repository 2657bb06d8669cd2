#include "rd_light.h"

#include "rd_rng.h"

/* A lamp of about 3 degrees, halo included. */
#define GLARE_EXPONENT 4000.0
/* No thing farther off throws a shadow; and none on the very point it hangs on. */
#define SHADOW_MM 3000.0
#define SHADOW_SLACK_MM 1.0

static enum rd_ambient_kind draw_kind(struct rd_rng *rng)
{
    double kind = rd_rng_uniform(rng, 0.0, 1.0);
    return kind < 0.40 ? RD_AMBIENT_DIM : kind < 0.85 ? RD_AMBIENT_NORMAL : RD_AMBIENT_BRIGHT;
}

/* Low or high, from the side: a window of a car. Its light alone brings white surfaces beyond what the sensor shows. */
static void make_sunlight(struct rd_light *light, uint64_t seed)
{
    struct rd_rng rng = rd_rng_start(seed, RD_STREAM_LIGHT + ((uint64_t)1 << 32));
    double side = rd_rng_sign(&rng), azimuth = rd_rng_uniform(&rng, 0.4, 1.4), height = rd_rng_uniform(&rng, 0.3, 1.0);
    light->key_dir = rd_v(side * sin(azimuth) * cos(height), -sin(height), -cos(azimuth) * cos(height));
    light->key_grey = rd_rng_uniform(&rng, 380.0, 620.0);
    light->sky_grey = rd_rng_uniform(&rng, 50.0, 110.0);
    light->bars = rd_rng_chance(&rng, 0.5);
    light->shadows = true;
}

void rd_light_make(struct rd_light *light, const struct rd_options *options)
{
    struct rd_rng rng = rd_rng_start(options->seed, RD_STREAM_LIGHT);
    enum rd_ambient_kind drawn = draw_kind(&rng);
    enum rd_ambient_kind kind = options->ambient == RD_AMBIENT_VARIED ? drawn : options->ambient;
    double strength = kind == RD_AMBIENT_DIM      ? rd_rng_uniform(&rng, 0.3, 0.9)
                      : kind == RD_AMBIENT_NORMAL ? rd_rng_uniform(&rng, 1.0, 2.0)
                                                  : rd_rng_uniform(&rng, 1.6, 2.6);
    double azimuth = rd_rng_uniform(&rng, -1.3, 1.3), height = rd_rng_uniform(&rng, 0.1, 1.1);
    light->sky_grey = strength * rd_rng_uniform(&rng, 25.0, 60.0);
    light->key_grey = strength * rd_rng_uniform(&rng, 20.0, 70.0);
    if (kind == RD_AMBIENT_BRIGHT)
        light->key_grey *= rd_rng_uniform(&rng, 2.0, 4.0);
    light->lamp_grey = strength * rd_rng_uniform(&rng, 0.0, 25.0);
    light->key_dir = rd_v(sin(azimuth) * cos(height), -sin(height), -cos(azimuth) * cos(height));
    light->bars = rd_rng_chance(&rng, kind == RD_AMBIENT_BRIGHT ? 0.4 : 0.1);
    light->bars_mm = rd_rng_uniform(&rng, 60.0, 250.0);
    light->slope.x = rd_rng_uniform(&rng, -0.5, 0.5);
    light->slope.y = rd_rng_uniform(&rng, -0.4, 0.4);
    light->slope.z = rd_rng_uniform(&rng, -0.25, 0.1);
    light->nothing_grey = strength * rd_rng_uniform(&rng, 0.0, 14.0);
    light->shadows = false;
    if (kind == RD_AMBIENT_SUNLIGHT)
        make_sunlight(light, options->seed);
    light->sky_grey *= options->exposure;
    light->key_grey *= options->exposure;
    light->lamp_grey *= options->exposure;
    light->nothing_grey *= options->exposure;
}

/* Fraction of the key light that reaches a point between the bars. */
static double through_bars(const struct rd_light *light, struct rd_vec point_mm)
{
    struct rd_rot across = rd_rot_frame(light->key_dir, rd_v(0.0, 1.0, 0.0));
    double x = rd_dot(across.x, point_mm) / light->bars_mm, z = rd_dot(across.z, point_mm) / light->bars_mm;
    double wave = 0.6 * sin(2.0 * RD_PI * x) + 0.4 * sin(2.0 * RD_PI * (0.6 * z + 0.2 * x));
    return 0.1 + 0.9 * rd_smoothstep(-0.15, 0.15, wave);
}

static bool in_shadow(const struct rd_light *light, const struct rd_scene *scene, const struct rd_hit *hit)
{
    struct rd_vec from = rd_along(hit->point_mm, hit->normal, SHADOW_SLACK_MM);
    return light->shadows && rd_dot(hit->normal, light->key_dir) > 0.0 &&
           rd_scene_blocked(scene, from, rd_along(from, light->key_dir, SHADOW_MM));
}

double rd_light_grey(const struct rd_light *light, const struct rd_scene *scene, const struct rd_hit *hit,
                     struct rd_vec view)
{
    struct rd_vec n = hit->normal;
    double sky = light->sky_grey * (0.65 - 0.35 * n.y);
    double key = light->key_grey;
    if (in_shadow(light, scene, hit))
        key = 0.0;
    if (light->bars)
        key *= through_bars(light, hit->point_mm);
    double metres = fmax(0.3, 1e-3 * hit->point_mm.z);
    double lamp = light->lamp_grey * fmax(0.0, -rd_dot(n, view)) / (metres * metres);
    struct rd_vec position_m = rd_sub(rd_scale(hit->point_mm, 1e-3), rd_v(0.0, 0.0, 1.0));
    double even = rd_clamp(1.0 + rd_dot(light->slope, position_m), 0.25, 2.0);
    double diffuse = hit->albedo * (sky + key * fmax(0.0, rd_dot(n, light->key_dir)) + lamp);
    double shine = 0.0;
    if (hit->gloss > 0.0) {
        struct rd_vec half_vector = rd_unit(rd_sub(light->key_dir, view));
        double s = fmax(0.0, rd_dot(n, half_vector));
        s *= s;
        s *= s;
        s *= s;
        shine = hit->gloss * key * s * s * s;
    }
    if (light->glare_grey > 0.0)
        shine += hit->gloss * light->glare_grey *
                 pow(fmax(0.0, rd_dot(n, rd_unit(rd_sub(light->glare_dir, view)))), GLARE_EXPONENT);
    return even * (diffuse + shine);
}
