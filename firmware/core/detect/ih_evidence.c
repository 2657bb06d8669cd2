#include "detect/ih_evidence.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"

#define ONE_Q28 ((int64_t)1 << 28)
#define INSIDE_Q14 14746 /* radius2 below 0.9: through the head, not along its edge */
#define ON_MM_Q8 (20 << 8)
#define THROUGH_MM_Q8 (50 << 8)
#define FRONT_MM_Q8 (30 << 8)
#define PLANE_POINTS_MIN 6
/* Hair, nose and chin lie outside of the ellipsoid: 1.4 of its radii, squared. */
#define FACE2_Q28 ((196 * ONE_Q28 + 50) / 100)
/* So that one step, as from a nose to the cheek behind it, is not the whole mean. */
#define BEND_MAX_MM_Q8 (20 << 8)
/* Says neither way: about between the medians of heads and of what is taken for one (E025). */
#define BEND_MIDDLE_MM_Q8 (12 << 8)

/* The candidate, and what is the same for all rays. */
struct candidate {
    const struct ih_ellipsoid *ellipsoid;
    const int32_t *origin_mm_q8;
    int32_t depth_mm_q8; /* of its centre, from the origin */
    struct ih_fractions fractions;
    struct ih_ellipsoid_box box; /* rays through it pass here */
};

struct sums {
    int32_t on, through, front;
    int64_t on_square_q16; /* sum of squared distances, mm^2 */
    /* For the plane through the points on the ellipsoid: sums of x, y, z and of their products,
     * mm in Q4 from the centre. */
    int64_t sum_q4[3], product_q8[3][3];
};

/* Does a ray pass near enough to go through the head? */
static bool may_hit(const struct candidate *candidate, const struct ih_ray *ray)
{
    const int32_t slope_q20[2] = {ray->slope_x_q20, ray->slope_y_q20};
    for (int axis = 0; axis < 2; axis++) {
        const int64_t off_q8 = candidate->origin_mm_q8[axis] +
                               ih_mul_shift(candidate->depth_mm_q8, slope_q20[axis], 20) -
                               candidate->ellipsoid->centre_mm_q8[axis];
        if (ih_abs_s64(off_q8) > candidate->box.half_mm_q8[axis]) {
            return false;
        }
    }
    return true;
}

static void add_on(const struct ih_ray *ray, const struct ih_ellipsoid *ellipsoid, int32_t off_q8,
                   struct sums *sums)
{
    int64_t at_q4[3];
    sums->on++;
    sums->on_square_q16 += (int64_t)off_q8 * off_q8;
    for (int axis = 0; axis < 3; axis++) {
        at_q4[axis] = ih_shift_round(ray->point_mm_q8[axis] - ellipsoid->centre_mm_q8[axis], 4);
        sums->sum_q4[axis] += at_q4[axis];
        IH_IN_RANGE(at_q4[axis], -IH_RANGE_ON_MM_Q4, IH_RANGE_ON_MM_Q4);
        for (int other = 0; other <= axis; other++) {
            sums->product_q8[axis][other] += at_q4[axis] * at_q4[other];
        }
    }
}

/* A ray of known state that may go through the head. */
static void add_ray(const struct candidate *candidate, const struct ih_ray *ray, struct sums *sums)
{
    const struct ih_ellipsoid *ellipsoid = candidate->ellipsoid;
    struct ih_crossing crossing;
    int32_t position_q14[3], off_q8;
    const struct ih_aim aim = ih_ellipsoid_aim(ellipsoid->semi_mm_q8, &candidate->fractions, ray);
    if (!ih_ellipsoid_cross(ellipsoid, &candidate->fractions, candidate->origin_mm_q8, ray, &aim,
                            &crossing) ||
        crossing.radius2_q14 >= INSIDE_Q14) {
        return;
    }
    if (ray->state == IH_RAY_EMPTY) {
        sums->through++;
        return;
    }
    int32_t behind_q8 = ray->point_mm_q8[2] - crossing.entry_mm_q8;
    sums->through += behind_q8 > THROUGH_MM_Q8;
    sums->front += behind_q8 < -FRONT_MM_Q8;
    if (ih_ellipsoid_position(ellipsoid, &candidate->fractions, ray->point_mm_q8, position_q14) &&
        ih_ellipsoid_distance(&candidate->fractions, position_q14, &off_q8) &&
        ih_abs_s32(off_q8) < ON_MM_Q8) {
        add_on(ray, ellipsoid, off_q8, sums);
    }
}

/* Variance of the points' depths that no plane explains, mm^2 in Q8: szz - b^T S^-1 b, S and b the
 * central moments of x, y and with z, each below 2^24. */
static int64_t plane_residual_q8(const struct sums *sums)
{
    int64_t c[3][3];
    int64_t n = sums->on;
    for (int axis = 0; axis < 3; axis++) {
        for (int other = 0; other <= axis; other++) {
            int64_t mean_q8 = ih_div_round(sums->sum_q4[axis] * sums->sum_q4[other], n);
            c[axis][other] = ih_div_round(sums->product_q8[axis][other] - mean_q8, n);
            IH_IN_RANGE(c[axis][other], -IH_RANGE_CENTRAL_Q8, IH_RANGE_CENTRAL_Q8);
        }
    }
    int64_t det_q16 = c[0][0] * c[1][1] - c[1][0] * c[1][0];
    if (det_q16 <= 0) {
        return 0; /* all in a line: any plane through it fits */
    }
    int64_t zx = c[2][0];
    int64_t zy = c[2][1];
    int64_t top_x_q16 = zx * c[1][1] - zy * c[1][0];
    int64_t top_y_q16 = zy * c[0][0] - zx * c[1][0];
    /* slopes in Q12; a camera sees no surface steeper than 64 */
    const int64_t steep = 64 << 12;
    const int64_t slope_x = ih_clamp_s64(ih_div_round(top_x_q16 * 4096, det_q16 + 1), steep);
    const int64_t slope_y = ih_clamp_s64(ih_div_round(top_y_q16 * 4096, det_q16 + 1), steep);
    int64_t residual = c[2][2] - ih_shift_round(slope_x * zx + slope_y * zy, 12);
    return residual > 0 ? residual : 0;
}

static int32_t root_mm_q8(int64_t square_q16)
{
    return (int32_t)ih_isqrt_u64((uint64_t)square_q16);
}

static int32_t moved_mm_q8(const struct ih_ellipsoid *ellipsoid, const int32_t start_mm_q8[3])
{
    int64_t distance2_q16 = ih_distance2_s32(ellipsoid->centre_mm_q8, start_mm_q8);
    return ih_saturate_s32(ih_isqrt_u64((uint64_t)distance2_q16));
}

/* 100 (a - m) / m */
static int32_t taller_q8(const struct ih_ellipsoid *ellipsoid)
{
    int32_t mean_q8 = ih_ellipsoid_mean(ellipsoid->centre_mm_q8).semi_mm_q8[1];
    return (int32_t)ih_div_round((int64_t)(ellipsoid->semi_mm_q8[1] - mean_q8) * 25600, mean_q8);
}

static void summarise(const struct sums *sums, int32_t value_q8[])
{
    int32_t on = ih_max_s32(sums->on, 1);
    int32_t rough_q8 = root_mm_q8(sums->on_square_q16 / on);
    int32_t plane_q8 = sums->on >= PLANE_POINTS_MIN ? root_mm_q8(plane_residual_q8(sums) * 256) : 0;
    value_q8[IH_EVIDENCE_ON] = sums->on << 8;
    value_q8[IH_EVIDENCE_ROUGH] = rough_q8;
    value_q8[IH_EVIDENCE_BULGE] = plane_q8 - rough_q8;
}

_Static_assert(IH_ELLIPSOID_SEMI_MAX_MM < 256, "a height of half a semi-axis has 16 bits");

/* The points before the centre and near the ellipsoid, where a face is. */
struct face {
    uint32_t mark[IH_RAYS_WORDS];   /* a bit for each slot */
    int16_t height_mm_q8[IH_SLOTS]; /* where there is one; within half a semi-axis */
};

static bool is_marked(const struct face *face, int32_t slot)
{
    return face->mark[slot / 32] >> slot % 32 & 1;
}

/* Most points end here: within one and a half semi-axes, and before the centre. */
static bool is_before(const struct ih_ellipsoid *ellipsoid, const int32_t point_mm_q8[3])
{
    const int32_t *centre_mm_q8 = ellipsoid->centre_mm_q8, *semi_mm_q8 = ellipsoid->semi_mm_q8;
    return point_mm_q8[2] < centre_mm_q8[2] &&
           2 * (centre_mm_q8[2] - point_mm_q8[2]) < 3 * semi_mm_q8[2] &&
           2 * ih_abs_s32(point_mm_q8[1] - centre_mm_q8[1]) < 3 * semi_mm_q8[1] &&
           2 * ih_abs_s32(point_mm_q8[0] - centre_mm_q8[0]) < 3 * semi_mm_q8[0];
}

static void find_face(const struct ih_rays *rays, const struct candidate *candidate,
                      struct face *face)
{
    const struct ih_ellipsoid *ellipsoid = candidate->ellipsoid;
    int32_t position_q14[3];
    memset(face->mark, 0, sizeof face->mark);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_ray *ray = &rays->ray[slot];
        if (ray->state != IH_RAY_SEEN || !is_before(ellipsoid, ray->point_mm_q8) ||
            !ih_ellipsoid_position(ellipsoid, &candidate->fractions, ray->point_mm_q8,
                                   position_q14)) {
            continue;
        }
        const int64_t radius2_q28 = (int64_t)position_q14[0] * position_q14[0] +
                                    (int64_t)position_q14[1] * position_q14[1] +
                                    (int64_t)position_q14[2] * position_q14[2];
        if (radius2_q28 < FACE2_Q28) {
            face->mark[slot / 32] |= (uint32_t)1 << slot % 32;
            face->height_mm_q8[slot] =
                (int16_t)ih_mul_shift(radius2_q28 - ONE_Q28, ellipsoid->semi_mm_q8[2], 29);
        }
    }
}

/* Of three slots that are step apart; column_max: of the first one. */
static int32_t bend_mm_q8(const struct face *face, int32_t step, int32_t column_max)
{
    int32_t sum_q8 = BEND_MIDDLE_MM_Q8, count = 1;
    for (int32_t word = 0; word < IH_RAYS_WORDS; word++) {
        for (uint32_t left = face->mark[word]; left != 0; left &= left - 1) {
            const int32_t slot = 32 * word + __builtin_ctz(left);
            if (slot + 2 * step < IH_SLOTS && slot % IH_GRID <= column_max &&
                is_marked(face, slot + step) && is_marked(face, slot + 2 * step)) {
                const int32_t bend_q8 = face->height_mm_q8[slot] -
                                        2 * face->height_mm_q8[slot + step] +
                                        face->height_mm_q8[slot + 2 * step];
                sum_q8 += ih_min_s32(ih_abs_s32(bend_q8), BEND_MAX_MM_Q8);
                count++;
            }
        }
    }
    return (sum_q8 + count / 2) / count;
}

/* A camera on its side has the pattern's rows downwards. */
static void bends(const struct ih_rays *rays, const struct candidate *candidate, int32_t value_q8[])
{
    const struct ih_ray *middle = &rays->ray[IH_SLOTS / 2];
    const bool is_rotated = ih_abs_s32(middle[1].slope_y_q20 - middle->slope_y_q20) >
                            ih_abs_s32(middle[1].slope_x_q20 - middle->slope_x_q20);
    struct face face;
    find_face(rays, candidate, &face);
    const int32_t by_rows_q8 = bend_mm_q8(&face, IH_GRID, IH_GRID - 1);
    const int32_t by_columns_q8 = bend_mm_q8(&face, 1, IH_GRID - 3);
    value_q8[IH_EVIDENCE_BEND_DOWN] = is_rotated ? by_columns_q8 : by_rows_q8;
    value_q8[IH_EVIDENCE_BEND_ACROSS] = is_rotated ? by_rows_q8 : by_columns_q8;
}

/* Begins: the candidate, and the sums over the rays through it. */
static struct ih_view look(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid,
                           struct candidate *candidate, struct sums *sums)
{
    *candidate = (struct candidate){
        .ellipsoid = ellipsoid,
        .origin_mm_q8 = rays->origin_mm_q8,
        .depth_mm_q8 = ellipsoid->centre_mm_q8[2] - rays->origin_mm_q8[2],
        .fractions = ih_ellipsoid_fractions(ellipsoid->semi_mm_q8),
        .box = ih_ellipsoid_box(ellipsoid, rays->table.slope_max_q20, INSIDE_Q14),
    };
    memset(sums, 0, sizeof *sums);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_ray *ray = &rays->ray[slot];
        if (ray->state != IH_RAY_UNKNOWN && may_hit(candidate, ray)) {
            add_ray(candidate, ray, sums);
        }
    }
    return (struct ih_view){sums->through, sums->on, sums->front};
}

struct ih_view ih_evidence_view(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid)
{
    struct candidate candidate;
    struct sums sums;
    return look(rays, ellipsoid, &candidate, &sums);
}

void ih_evidence_collect(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid,
                         const int32_t start_mm_q8[3], struct ih_evidence *out)
{
    struct candidate candidate;
    struct sums sums;
    out->view = look(rays, ellipsoid, &candidate, &sums);
    summarise(&sums, out->value_q8);
    bends(rays, &candidate, out->value_q8);
    out->value_q8[IH_EVIDENCE_TALL] = taller_q8(ellipsoid);
    out->value_q8[IH_EVIDENCE_MOVED] = moved_mm_q8(ellipsoid, start_mm_q8);
    out->value_q8[IH_EVIDENCE_DISTANCE] = ellipsoid->centre_mm_q8[2];
}
