/* ih_ellipsoid_distance - how far a point is from an ellipsoid's surface, to first order (ours).
 *
 * In:     a point's position in semi-axes, s; its norm f = |s|.
 * Out:    its distance (f - 1) / |grad f| = (f - 1) f / |s / a|, negative inside; none near the centre.
 * Method: quotients by a semi-axis are products with an inverse of 32 bits. f and 1 / |s / a| come from the table
 *         of ih_fix: of a square v 2^n from 2^30 on, with r a little below 1 / root, v r is the root but for
 *         2^-13.7 of it, and half of the square's residual times r is nearly all of that. For 1 / |s / a|
 *         r itself is good enough: slopes have 14 bits.
 * Error:  f within a unit of Q14, 1 / |s / a| within 2^-13.7 of it.
 * Overflow: positions within 8 semi-axes: squares of Q22 below 2^32.
 */
#ifndef IH_ELLIPSOID_DISTANCE_H
#define IH_ELLIPSOID_DISTANCE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_fix.h"
#include "detect/ih_ellipsoid.h"

/* Lengths inside a gradient are in units of this, so that it is of order one. 64 mm in Q8 are 2^14:
 * s / a is an ih_fraction of s, too. */
#define IH_GRADIENT_MM 64
/* Positions nearer to the centre than this have no direction: 0.05 squared. */
#define IH_RADIUS_MIN2_Q22 10481

/* 2^43 / a by semi-axis: makes a position of an offset in Q8, and s / a per IH_GRADIENT_MM of a position. */
struct ih_inverses {
    uint32_t axis[3];
};

/* A point's distance, and 2^17 / |s / a|: below 2^17.4 where the point has a weight in a fit. */
struct ih_distance {
    int32_t residual_mm_q8;
    uint32_t inverse;
};

static inline struct ih_inverses ih_inverses_of(const struct ih_fractions *fractions)
{
    struct ih_inverses inverses;
    for (int axis = 0; axis < 3; axis++) {
        inverses.axis[axis] = (uint32_t)(fractions->inverse_q50[axis] >> 7);
    }
    return inverses;
}

/* a * b / 2^bits, rounded, where a 2^((33 - bits) / 2) and b 2^((32 - bits) / 2) are below 2^31: the upper
 * word of their product, which small processors have in one instruction. */
static inline uint32_t ih_product_shift(uint32_t a, uint32_t b, int bits)
{
    const int64_t a_up = (int32_t)(a << ((33 - bits) / 2));
    const int64_t b_up = (int32_t)(b << ((32 - bits) / 2));
    return (uint32_t)((a_up * b_up + ((int64_t)1 << 31)) >> 32);
}

static inline int32_t ih_with_sign_of(uint32_t size, int32_t sign)
{
    return sign < 0 ? -(int32_t)size : (int32_t)size;
}

static inline uint32_t ih_radius2_q22(const int32_t position_q14[3])
{
    uint32_t sum_q22 = 0;
    for (int axis = 0; axis < 3; axis++) {
        const uint32_t size = (uint32_t)ih_abs_s32(position_q14[axis]);
        sum_q22 += ih_product_shift(size, size, 6);
    }
    return sum_q22;
}

/* The gradient's direction, s / a per IH_GRADIENT_MM, and its square. */
static inline uint32_t ih_gradient_q22(const struct ih_inverses *inverses,
                                       const int32_t position_q14[3], int32_t component_q14[3])
{
    uint32_t sum_q22 = 0;
    for (int axis = 0; axis < 3; axis++) {
        const uint32_t size = (uint32_t)ih_abs_s32(position_q14[axis]);
        const uint32_t component = ih_product_shift(size, inverses->axis[axis], 29);
        sum_q22 += ih_product_shift(component, component, 6);
        component_q14[axis] = ih_with_sign_of(component, position_q14[axis]);
    }
    return sum_q22;
}

/* False: the position has no direction. */
static inline bool ih_distance_of(uint32_t radius2_q22, uint32_t length2_q22,
                                  struct ih_distance *out)
{
    if (radius2_q22 < IH_RADIUS_MIN2_Q22) {
        return false;
    }
    const int half = __builtin_clz(radius2_q22) / 2;
    const uint32_t square = radius2_q22 << (2 * half);
    const uint32_t r_q15 = ih_inverse_root_q15(square);
    const uint32_t root_q16 = (square >> 16) * r_q15 >> 15;
    const uint32_t residual =
        square - root_q16 * root_q16; /* below 2^19.7: the root is short by 10 */
    const uint32_t root_q20 = root_q16 * 16 + ((residual >> 4) * r_q15 >> 24);
    const int32_t radius_q14 = (int32_t)(((root_q20 >> half) + 1) / 2);
    const int length_half = __builtin_clz(length2_q22) / 2;
    out->inverse = (ih_inverse_root_q15(length2_q22 << (2 * length_half)) << length_half) >> 3;
    /* (f - 1) f over the length, for f up to 5.9 below 2^19.4 */
    const int64_t over_q14 = ih_mul_shift(radius_q14, radius_q14 - (1 << 14), 14);
    out->residual_mm_q8 = (int32_t)ih_mul_shift(over_q14, out->inverse, 17);
    return true;
}

IH_BEGIN_DECLS

/* Both at once: the gradient's direction and the distance. False: the position has no direction. */
bool ih_ellipsoid_gradient(const struct ih_inverses *inverses, const int32_t position_q14[3],
                           int32_t component_q14[3], struct ih_distance *out);

IH_END_DECLS

#endif
