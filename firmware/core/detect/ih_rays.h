/* ih_rays - the dots as rays and points in rays, for every stage that reasons about bodies.
 *
 * In:     points by slot, the dots' over-exposure map (NULL for a range image), rig.
 * Out:    per slot its ray and, where it was seen, its point in mm; where it was not, whether that
 *         says something. The same as columns of 16 bits, for vectors.
 * Method: a ray is the line from the projector through the slot's dot (from the camera, for a range
 *         image): at the depth Z it is at origin + (Z - origin_z) (slope_x, slope_y, 1). A seen
 *         point is where the camera saw it: its direction times its depth. A missing dot is
 *         "empty" when a surface near by would have shown it: its image, probe_mm behind the 8th
 *         percentile of the seen depths (ih_near_depth; 0 when nothing was seen), is inside the picture and not
 *         over-exposed. A missing point of a range image is always "empty": ih_points says
 *         "unknown" where it may only be outside. The spacing is the root of the area that a ray has, of the
 *         quadrilateral that four rays of the middle span.
 * Overflow: cross products of slopes' differences are below 2^48. A slope is 2^22, a depth 2^22 in Q8 and a direction 2^31 in Q28: points below 2^25.
 * Error:  half a step of each format (docs/numerics.md); columns are rounded down and clamped.
 * Cost:   361 products, 4 divisions and the lens for a missing dot, one selection of 361 depths.
 */
#ifndef IH_RAYS_H
#define IH_RAYS_H

#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_dots.h"
#include "points/ih_points.h"
#include "rig/ih_rig.h"

enum ih_ray_state {
    IH_RAY_UNKNOWN = 0, /* not seen, and that says nothing */
    IH_RAY_SEEN = 1,
    IH_RAY_EMPTY = 2 /* not seen, though something near would have been */
};

/* |slope| is limited to this: the field may reach beyond the frame, where nothing is seen. */
#define IH_RAYS_SLOPE_MAX 4

struct ih_ray {
    int32_t slope_x_q20, slope_y_q20; /* mm aside per mm of depth */
    int32_t point_mm_q8[3];           /* level frame; 0 when not seen */
    int32_t state;                    /* enum ih_ray_state */
};

/* The slots in whole words of 32 bits, a bit for each, and so in whole vectors. */
#define IH_RAYS_WORDS ((IH_SLOTS + 31) / 32)
#define IH_RAYS_COLUMN (32 * IH_RAYS_WORDS)
/* Slope of a ray of unknown state, and behind the last slot; depth of an empty ray's point. */
#define IH_RAYS_NOWHERE INT16_MAX

/* The rays as columns by slot, rounded down and clamped to 16 bits. */
struct ih_ray_table {
    int16_t slope_q12[2][IH_RAYS_COLUMN];
    int16_t point_mm_q1[3][IH_RAYS_COLUMN];
    int16_t seen[IH_RAYS_COLUMN]; /* all bits or none */
    int32_t slope_max_q20[2];     /* maximum |slope| of all rays, x and y */
    int32_t pitch_q20; /* the spacing of rays at a depth, over it; of the pattern's middle */
};

struct ih_rays {
    int32_t origin_mm_q8[3]; /* where the rays start, level frame */
    struct ih_ray ray[IH_SLOTS];
    struct ih_ray_table table;
};

struct ih_rays_params {
    int32_t probe_mm; /* "near by" is this far behind the 8th percentile of the depths; above 0 */
};

IH_BEGIN_DECLS

void ih_rays_params_default(struct ih_rays_params *params);

void ih_rays_make(const struct ih_points *points, const struct ih_dots *dots,
                  const struct ih_rig *rig, const struct ih_rays_params *params,
                  struct ih_rays *out);

/* Fill the table from the rays; ih_rays_make has done it. */
void ih_rays_fill_table(struct ih_rays *rays);

IH_END_DECLS

#endif
