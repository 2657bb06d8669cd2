/* One mistake of each kind that a build with ISOHEAD_RANGE_CHECKS must end at: tests/checks/ranges.sh.
 *
 *   ranges_planted KIND    makes the mistake; status 0 if nothing stopped it, 2 for an unknown kind
 *
 * Compiled as the core is. The last two are made inside the core. */
#include <stdio.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_rays.h"

/* Nothing that a compiler knows. */
static volatile int32_t big = 70000;
static volatile int32_t none = 0;
static volatile int32_t stored;
static int32_t table[4];

static void divide_by_nothing(void)
{
    stored = stored / none;
}

/* A head with a semi-axis of a millimetre. */
static void make_stage_fail(void)
{
    const int32_t origin_mm_q8[3] = {0};
    const struct ih_ray ray = {.state = IH_RAY_UNKNOWN};
    const struct ih_ellipsoid thin = {{0, 0, 1000 << 8}, {1 << 8, 100 << 8, 100 << 8}};
    const struct ih_fractions fractions = ih_ellipsoid_fractions(thin.semi_mm_q8);
    const struct ih_aim aim = ih_ellipsoid_aim(thin.semi_mm_q8, &fractions, &ray);
    struct ih_crossing crossing;
    (void)ih_ellipsoid_cross(&thin, &fractions, origin_mm_q8, &ray, &aim, &crossing);
}

static int make(const char *kind)
{
    if (strcmp(kind, "range") == 0) {
        IH_IN_RANGE(big, 0, 69999);
    } else if (strcmp(kind, "cast") == 0) {
        stored = (int16_t)big;
    } else if (strcmp(kind, "sign") == 0) {
        stored = (uint32_t)-big != 0;
    } else if (strcmp(kind, "implicit") == 0) {
        uint8_t byte = big;
        stored = byte;
    } else if (strcmp(kind, "wrap") == 0) {
        stored = (uint32_t)none - (uint32_t)big != 0;
    } else if (strcmp(kind, "overflow") == 0) {
        stored = big * big;
    } else if (strcmp(kind, "shift") == 0) {
        stored = 1 << big;
    } else if (strcmp(kind, "index") == 0) {
        stored = table[big];
    } else if (strcmp(kind, "divide") == 0) {
        divide_by_nothing();
    } else if (strcmp(kind, "argument") == 0) {
        stored = ih_mul_wide_shift(big, 1, 31) != 0;
    } else if (strcmp(kind, "stage") == 0) {
        make_stage_fail();
    } else {
        return strcmp(kind, "nothing") == 0 ? 0 : 2;
    }
    return 0;
}

int main(int count, char **arguments)
{
    int status = count == 2 ? make(arguments[1]) : 2;
    if (status != 0) {
        fprintf(stderr, "usage: ranges_planted KIND\n");
    }
    return status;
}
