/* rd_rng - reproducible random numbers (SplitMix64; integers only, so every machine draws the same).
 * Each purpose has its own stream: drawing one number more for the person does not move the room.
 * Draw at most one number in an expression: C does not say which of two arguments is worked out first.
 */
#ifndef RD_RNG_H
#define RD_RNG_H

#include <stdbool.h>
#include <stdint.h>

enum rd_stream {
    RD_STREAM_RIG,
    RD_STREAM_LIGHT,
    RD_STREAM_ROOM,
    RD_STREAM_SEAT,
    RD_STREAM_PERSON,
    RD_STREAM_MOTION,
    RD_STREAM_HANDS,
    RD_STREAM_SENSOR,
    RD_STREAM_LASER,
    RD_STREAM_SCHEDULE,
    RD_STREAM_NOISE /* the last: frame n uses RD_STREAM_NOISE + n */
};

struct rd_rng {
    uint64_t state;
};

struct rd_rng rd_rng_start(uint64_t seed, uint64_t stream);
uint64_t rd_rng_next(struct rd_rng *rng);
/* low <= value < high */
double rd_rng_uniform(struct rd_rng *rng, double low, double high);
/* 0 .. count - 1 */
int rd_rng_pick(struct rd_rng *rng, int count);
bool rd_rng_chance(struct rd_rng *rng, double probability);
double rd_rng_sign(struct rd_rng *rng);
/* Mean 0, standard deviation 1. */
double rd_rng_normal(struct rd_rng *rng);

/* A value in 0 <= x < 1 that depends on the arguments alone. */
double rd_hash_unit(uint64_t a, uint64_t b, uint64_t c);
/* Smooth noise over space, 0..1, features one unit wide. */
double rd_noise3(double x, double y, double z, uint64_t seed);

#endif
