#include "rd_rng.h"

#include <math.h>

#include "rd_vec.h"

static uint64_t mix(uint64_t value)
{
    value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9u;
    value = (value ^ (value >> 27)) * 0x94d049bb133111ebu;
    return value ^ (value >> 31);
}

static double unit(uint64_t bits)
{
    return (double)(bits >> 11) * 0x1p-53;
}

struct rd_rng rd_rng_start(uint64_t seed, uint64_t stream)
{
    return (struct rd_rng){mix(mix(seed + 0x9e3779b97f4a7c15u) ^ (stream * 0xd1342543de82ef95u))};
}

uint64_t rd_rng_next(struct rd_rng *rng)
{
    rng->state += 0x9e3779b97f4a7c15u;
    return mix(rng->state);
}

double rd_rng_uniform(struct rd_rng *rng, double low, double high)
{
    return low + (high - low) * unit(rd_rng_next(rng));
}

int rd_rng_pick(struct rd_rng *rng, int count)
{
    return (int)(rd_rng_next(rng) % (uint64_t)count);
}

bool rd_rng_chance(struct rd_rng *rng, double probability)
{
    return unit(rd_rng_next(rng)) < probability;
}

double rd_rng_sign(struct rd_rng *rng)
{
    return rd_rng_chance(rng, 0.5) ? 1.0 : -1.0;
}

/* Box-Muller, one of its two values: speed does not matter where this is used. */
double rd_rng_normal(struct rd_rng *rng)
{
    double radius = sqrt(-2.0 * log(1.0 - unit(rd_rng_next(rng))));
    return radius * cos(2.0 * RD_PI * unit(rd_rng_next(rng)));
}

double rd_hash_unit(uint64_t a, uint64_t b, uint64_t c)
{
    return unit(mix(a * 0x9e3779b97f4a7c15u + mix(b * 0xd1342543de82ef95u + mix(c + 0x632be59bd9b4e019u))));
}

/* A cheap hash for lattice corners; its 24 bits are plenty for a grey value. */
static double corner(uint64_t x, uint64_t y, uint64_t z, uint64_t seed)
{
    uint64_t h = x * 0x9e3779b97f4a7c15u ^ y * 0xc2b2ae3d27d4eb4fu ^ z * 0x165667b19e3779f9u ^ seed;
    h = (h ^ (h >> 29)) * 0xbf58476d1ce4e5b9u;
    return (double)(h >> 40) * 0x1p-24;
}

double rd_noise3(double x, double y, double z, uint64_t seed)
{
    double fx = floor(x), fy = floor(y), fz = floor(z);
    uint64_t ix = (uint64_t)(int64_t)fx, iy = (uint64_t)(int64_t)fy, iz = (uint64_t)(int64_t)fz;
    double value[2];
    x -= fx;
    y -= fy;
    z -= fz;
    for (uint64_t k = 0; k < 2; k++) {
        double top = corner(ix, iy, iz + k, seed) * (1.0 - x) + corner(ix + 1, iy, iz + k, seed) * x;
        double low = corner(ix, iy + 1, iz + k, seed) * (1.0 - x) + corner(ix + 1, iy + 1, iz + k, seed) * x;
        value[k] = top * (1.0 - y) + low * y;
    }
    return value[0] * (1.0 - z) + value[1] * z;
}
