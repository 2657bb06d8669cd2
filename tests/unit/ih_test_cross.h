/* Cross an ellipsoid with a ray, everything that the core works out before included. */
#ifndef IH_TEST_CROSS_H
#define IH_TEST_CROSS_H

#include "detect/ih_ellipsoid.h"
#include "detect/ih_rays.h"

static inline bool ih_test_cross(const struct ih_ellipsoid *ellipsoid,
                                 const int32_t origin_mm_q8[3], const struct ih_ray *ray,
                                 struct ih_crossing *out)
{
    const struct ih_fractions fractions = ih_ellipsoid_fractions(ellipsoid->semi_mm_q8);
    const struct ih_aim aim = ih_ellipsoid_aim(ellipsoid->semi_mm_q8, &fractions, ray);

    return ih_ellipsoid_cross(ellipsoid, &fractions, origin_mm_q8, ray, &aim, out);
}

#endif
