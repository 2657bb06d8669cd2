/* rd_sensor - from light to numbers: offset, noise, hot pixels, clipping, bits.
 */
#ifndef RD_SENSOR_H
#define RD_SENSOR_H

#include <stdint.h>

#include "rd_options.h"

#define RD_NOISE_TABLE 16384
#define RD_HOT_MAX 512

struct rd_sensor {
    int pixel_count;
    double scale; /* numbers per grey level of 255 */
    int max_value;
    float offset_grey;
    float noise_grey[256];          /* standard deviation by grey level: reading and photons */
    float deviates[RD_NOISE_TABLE]; /* normally distributed */
    int hot_pixels[RD_HOT_MAX];
    float hot_grey[RD_HOT_MAX]; /* added there */
    int hot_count;
    uint64_t seed;
};

void rd_sensor_make(struct rd_sensor *sensor, const struct rd_options *options);

/* Samples of frame `frame`; `grey` is the light that falls on each pixel. */
void rd_sensor_expose(const struct rd_sensor *sensor, const float *grey, int frame, uint16_t *samples);

#endif
