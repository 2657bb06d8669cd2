#include "rd_sensor.h"

#include <math.h>

#include "rd_rng.h"

#define HOT_PER_PIXEL 1.2e-4

void rd_sensor_make(struct rd_sensor *sensor, const struct rd_options *options)
{
    struct rd_rng rng = rd_rng_start(options->rig_seed, RD_STREAM_SENSOR);
    double read_grey = rd_rng_uniform(&rng, 1.0, 2.0);
    double photon_grey = rd_rng_uniform(&rng, 0.035, 0.065);
    sensor->offset_grey = (float)rd_rng_uniform(&rng, 2.0, 6.0);
    sensor->pixel_count = options->width * options->height;
    sensor->max_value = (1 << options->bits) - 1;
    sensor->scale = sensor->max_value / 255.0;
    sensor->seed = options->seed;
    for (int level = 0; level < 256; level++)
        sensor->noise_grey[level] = (float)sqrt(read_grey * read_grey + photon_grey * level);
    for (int i = 0; i < RD_NOISE_TABLE; i++)
        sensor->deviates[i] = (float)rd_rng_normal(&rng);
    sensor->hot_count = (int)(HOT_PER_PIXEL * sensor->pixel_count);
    for (int i = 0; i < sensor->hot_count; i++) {
        double heat = rd_rng_uniform(&rng, 0.0, 1.0);
        sensor->hot_pixels[i] = rd_rng_pick(&rng, sensor->pixel_count);
        sensor->hot_grey[i] = (float)(10.0 + 150.0 * heat * heat);
    }
}

static uint16_t quantised(const struct rd_sensor *sensor, float grey)
{
    double value = floor((double)grey * sensor->scale + 0.5);
    return value <= 0.0 ? 0 : value >= sensor->max_value ? (uint16_t)sensor->max_value : (uint16_t)value;
}

void rd_sensor_expose(const struct rd_sensor *sensor, const float *grey, int frame, uint16_t *samples)
{
    struct rd_rng rng = rd_rng_start(sensor->seed, RD_STREAM_NOISE + (uint64_t)frame);
    uint64_t bits = 0;
    for (int i = 0; i < sensor->pixel_count; i++) {
        /* Four deviates to a draw: noise is most of the work of a frame. */
        bits = i % 4 == 0 ? rd_rng_next(&rng) : bits >> 16;
        float light = grey[i] + sensor->offset_grey;
        float noise = sensor->noise_grey[light < 255.0f ? (int)light : 255];
        samples[i] = quantised(sensor, light + noise * sensor->deviates[bits % RD_NOISE_TABLE]);
    }
    for (int i = 0; i < sensor->hot_count; i++) {
        int pixel = sensor->hot_pixels[i];
        samples[pixel] = quantised(sensor, (float)(samples[pixel] / sensor->scale) + sensor->hot_grey[i]);
    }
}
