/* ih_rig against float64: lens, epipolar lines, and every field that can be wrong. */
#include "base/ih_config.h"
#include "base/ih_types.h"
#include "rig/ih_camera.h"
#include "rig/ih_rig.h"

#include "ih_test.h"
#include "rigs.inc"

struct vector_line {
    int rig, slot;
    double infinity_u, infinity_v, dir_u, dir_v, length;
    double far_u, far_v, near_u, near_v;
};

struct vector_lens {
    int rig;
    int32_t u_px_q12, v_px_q12;
    double x, y;
};

#include "rig.inc"

#define RIG_COUNT IH_TEST_COUNT(vector_rigs)
#define LSB_Q12 (1.0 / 4096)

static struct ih_rig rigs[RIG_COUNT];
static struct ih_rig rig;
static struct ih_calibration calibration;
static int32_t bad_slot;

void setUp(void)
{
    int i;

    for (i = 0; i < RIG_COUNT; i++) {
        IH_TEST_EQUAL(IH_OK, ih_rig_init(&rigs[i], &vector_rigs[i], &bad_slot), "rig", i);
        IH_TEST_EQUAL(IH_NONE, bad_slot, "bad slot of rig", i);
    }
    calibration = vector_rigs[0];
    bad_slot = 12345;
}

void tearDown(void)
{
}

static double focal_max(const struct ih_rig *of)
{
    return fmax(of->calibration.fx_px_q16, of->calibration.fy_px_q16) / 65536;
}

/* |e| = focal * offset: the offset is rounded to Q16 mm twice, each component of e to Q8, the
 * length downwards to Q8. */
static double length_tolerance(const struct ih_rig *of)
{
    return focal_max(of) / 65536 + 2.0 / 256;
}

static void lines_match_float64(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_lines); i++) {
        const struct vector_line *v = &vector_lines[i];
        const struct ih_line *line = &rigs[v->rig].line[v->slot];
        const double length = length_tolerance(&rigs[v->rig]);
        const int32_t *ray = vector_rigs[v->rig].ray_q30[v->slot];

        IH_TEST_WITHIN(LSB_Q12, v->infinity_u, ih_test_from_q(line->infinity_u_px_q12, 12), "u", i);
        IH_TEST_WITHIN(LSB_Q12, v->infinity_v, ih_test_from_q(line->infinity_v_px_q12, 12), "v", i);
        IH_TEST_WITHIN(length, v->length, ih_test_from_q(line->length_px_mm_q8, 8), "length", i);
        IH_TEST_WITHIN(2 * length / v->length, v->dir_u, ih_test_from_q(line->dir_u_q30, 30),
                       "dir u", i);
        IH_TEST_WITHIN(2 * length / v->length, v->dir_v, ih_test_from_q(line->dir_v_q30, 30),
                       "dir v", i);
        IH_TEST_WITHIN(0.51, ldexp((double)ray[0] / ray[2], 20), line->slope_x_q20, "slope x", i);
        IH_TEST_WITHIN(0.51, ldexp((double)ray[1] / ray[2], 20), line->slope_y_q20, "slope y", i);
    }
}

/* Where a dot appears in the frame at a depth, px. */
static void dot_in_frame(const struct ih_rig *of, int32_t slot, int32_t depth_mm, double *u,
                         double *v)
{
    int32_t x_q28, y_q28, u_px_q12, v_px_q12;

    ih_rig_dot_at(of, slot, depth_mm << 8, &x_q28, &y_q28);
    ih_camera_distort(of, x_q28, y_q28, &u_px_q12, &v_px_q12);
    *u = ih_test_from_q(u_px_q12, 12);
    *v = ih_test_from_q(v_px_q12, 12);
}

static void working_range_matches_float64(void)
{
    double u, v_px;
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_lines); i++) {
        const struct vector_line *v = &vector_lines[i];
        const struct ih_calibration *c = &vector_rigs[v->rig];
        const struct ih_line *line = &rigs[v->rig].line[v->slot];
        /* The error of the length at this depth, and half a unit of Q12. */
        const double far = length_tolerance(&rigs[v->rig]) / c->far_mm + LSB_Q12;
        const double near = length_tolerance(&rigs[v->rig]) / c->near_mm + LSB_Q12;

        IH_TEST_WITHIN(far, v->length / c->far_mm, ih_test_from_q(line->t_far_px_q12, 12), "t far",
                       i);
        IH_TEST_WITHIN(near, v->length / c->near_mm, ih_test_from_q(line->t_near_px_q12, 12),
                       "t near", i);
        TEST_ASSERT_TRUE(line->t_far_px_q12 < line->t_near_px_q12);
        /* In the frame's own pixels; the lenses here magnify by less than 2. */
        dot_in_frame(&rigs[v->rig], v->slot, c->far_mm, &u, &v_px);
        IH_TEST_WITHIN(2 * far, v->far_u, u, "far u", i);
        IH_TEST_WITHIN(2 * far, v->far_v, v_px, "far v", i);
        dot_in_frame(&rigs[v->rig], v->slot, c->near_mm, &u, &v_px);
        IH_TEST_WITHIN(2 * near, v->near_u, u, "near u", i);
        IH_TEST_WITHIN(2 * near, v->near_v, v_px, "near v", i);
    }
}

static void all_directions_are_unit_vectors(void)
{
    int i, slot;

    for (i = 0; i < RIG_COUNT; i++) {
        for (slot = 0; slot < IH_SLOTS; slot++) {
            const struct ih_line *line = &rigs[i].line[slot];
            const double size =
                hypot(ih_test_from_q(line->dir_u_q30, 30), ih_test_from_q(line->dir_v_q30, 30));

            /* The length is rounded down by up to 1/256 px mm. */
            IH_TEST_WITHIN(1.0 / line->length_px_mm_q8 + 2e-9, 1.0, size, "unit vector", slot);
        }
    }
}

static void undistort_matches_the_exact_inverse(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_lens); i++) {
        const struct vector_lens *v = &vector_lens[i];
        /* 0.005 px as the header promises. */
        const double tolerance = 0.005 / focal_max(&rigs[v->rig]);
        int32_t x_q28, y_q28;

        ih_camera_undistort(&rigs[v->rig], v->u_px_q12, v->v_px_q12, &x_q28, &y_q28);
        IH_TEST_WITHIN(tolerance, v->x, ih_test_from_q(x_q28, 28), "x", i);
        IH_TEST_WITHIN(tolerance, v->y, ih_test_from_q(y_q28, 28), "y", i);
    }
}

static void distort_matches_float64(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_lens); i++) {
        const struct vector_lens *v = &vector_lens[i];
        int32_t u_px_q12, v_px_q12;

        ih_camera_distort(&rigs[v->rig], (int32_t)lround(ldexp(v->x, 28)),
                          (int32_t)lround(ldexp(v->y, 28)), &u_px_q12, &v_px_q12);
        /* Two roundings to Q12, of the product and of the principal point; the Q28 terms add less
         * than 1400 px * 8 * 2^-28 = 0.2 units. */
        IH_TEST_RANGE(v->u_px_q12 - 2, v->u_px_q12 + 2, u_px_q12, "u", i);
        IH_TEST_RANGE(v->v_px_q12 - 2, v->v_px_q12 + 2, v_px_q12, "v", i);
    }
}

static void distort_limits_what_is_far_outside(void)
{
    static const int32_t wild[] = {INT32_MIN, -(3 << 28), 0, 1, (2 << 28) + 1, INT32_MAX};
    int i, j, k;

    for (k = 0; k < RIG_COUNT; k++) {
        for (i = 0; i < IH_TEST_COUNT(wild); i++) {
            for (j = 0; j < IH_TEST_COUNT(wild); j++) {
                const int32_t limit = IH_RIG_TAN_MAX << 28;
                const int32_t x = wild[i] > limit ? limit : wild[i] < -limit ? -limit : wild[i];
                const int32_t y = wild[j] > limit ? limit : wild[j] < -limit ? -limit : wild[j];
                int32_t u, v, limited_u, limited_v;

                ih_camera_distort(&rigs[k], wild[i], wild[j], &u, &v);
                ih_camera_distort(&rigs[k], x, y, &limited_u, &limited_v);
                IH_TEST_EQUAL(limited_u, u, "u", k);
                IH_TEST_EQUAL(limited_v, v, "v", k);
            }
        }
    }
}

static void undistort_survives_any_pixel(void)
{
    static const int32_t wild[] = {INT32_MIN, -4096, 0, 4096 * 1280, INT32_MAX};
    int i, j, k;

    for (k = 0; k < RIG_COUNT; k++) {
        for (i = 0; i < IH_TEST_COUNT(wild); i++) {
            for (j = 0; j < IH_TEST_COUNT(wild); j++) {
                int32_t x, y;

                ih_camera_undistort(&rigs[k], wild[i], wild[j], &x, &y);
                IH_TEST_RANGE(-(IH_RIG_TAN_MAX << 28), IH_RIG_TAN_MAX << 28, x, "x", k);
                IH_TEST_RANGE(-(IH_RIG_TAN_MAX << 28), IH_RIG_TAN_MAX << 28, y, "y", k);
            }
        }
    }
}

/* Closed form: without distortion a pixel is a tangent. */
static void without_distortion_undistort_is_a_division(void)
{
    const struct ih_rig *plain = &rigs[2];
    const struct ih_calibration *c = &plain->calibration;
    int32_t u;

    for (u = 0; u < c->width; u += 7) {
        int32_t x, y;

        ih_camera_undistort(plain, u << 12, 50 << 12, &x, &y);
        /* Half a unit of Q28. */
        IH_TEST_WITHIN(0.51, ldexp((u * 65536.0 - c->cx_px_q16) / c->fx_px_q16, 28), x, "x", u);
        IH_TEST_WITHIN(0.51, ldexp((50 * 65536.0 - c->cy_px_q16) / c->fy_px_q16, 28), y, "y", u);
        /* And the pixel stays where it is: one unit of Q12 for roundings. */
        ih_camera_undistort_pixel(plain, u << 12, 50 << 12, &x, &y);
        IH_TEST_WITHIN(1, u << 12, x, "u", u);
        IH_TEST_WITHIN(1, 50 << 12, y, "v", u);
    }
}

/* X/Z of the ray O + s r at depth Z, straight from the definition. */
static double ray_at(const struct ih_calibration *c, int slot, int axis, double depth)
{
    const int32_t *ray = c->ray_q30[slot];
    const double along = (depth - c->origin_mm_q16[2] / 65536.0) / ray[2];

    return (c->origin_mm_q16[axis] / 65536.0 + along * ray[axis]) / depth;
}

static void dot_at_is_the_ray_at_that_depth(void)
{
    static const int32_t depth_mm_q8[] = {100 << 8, 25700, 400 << 8, 300007, 16000 << 8};
    int i, k, slot;

    for (k = 0; k < RIG_COUNT; k++) {
        for (slot = 0; slot < IH_SLOTS; slot++) {
            for (i = 0; i < IH_TEST_COUNT(depth_mm_q8); i++) {
                const double depth = depth_mm_q8[i] / 256.0;
                /* The offset is rounded to Q16 mm twice; the rest is half units of Q28. */
                const double tolerance = 1.0 / 65536 / depth + ldexp(2, -28);
                int32_t x, y;

                ih_rig_dot_at(&rigs[k], slot, depth_mm_q8[i], &x, &y);
                IH_TEST_WITHIN(tolerance, ray_at(&vector_rigs[k], slot, 0, depth),
                               ih_test_from_q(x, 28), "x", slot);
                IH_TEST_WITHIN(tolerance, ray_at(&vector_rigs[k], slot, 1, depth),
                               ih_test_from_q(y, 28), "y", slot);
            }
        }
    }
}

static double dot_distance(const struct ih_calibration *c, int slot, int other, double depth)
{
    return hypot(ray_at(c, slot, 0, depth) - ray_at(c, other, 0, depth),
                 ray_at(c, slot, 1, depth) - ray_at(c, other, 1, depth));
}

static void field_unit_is_half_the_pitch(void)
{
    int i, k;

    for (k = 0; k < RIG_COUNT; k++) {
        double sum = 0;

        for (i = 0; i < IH_SLOTS - IH_GRID; i++) {
            sum += dot_distance(&vector_rigs[k], i, i + IH_GRID, 1e9);
            sum += dot_distance(&vector_rigs[k], i / 18 * IH_GRID + i % 18,
                                i / 18 * IH_GRID + i % 18 + 1, 1e9);
        }
        /* Equal steps in angle are no equal steps in the image: means over all dots or over the
         * outer ones, at infinity or nearer, differ by a few percent. */
        IH_TEST_WITHIN(0.05, 1.0,
                       ih_test_from_q(rigs[k].field.unit_q28, 28) /
                           (sum / (4 * (IH_SLOTS - IH_GRID))),
                       "unit", k);
    }
}

/* To the last unit: the four outer sides of the pattern at 900 mm, 18 pitches each, or at the end of
 * the working range that is nearest to that. */
static void the_field_is_that_of_the_outer_dots(void)
{
    static const int sides[4][2] = {{0, 18}, {342, 360}, {0, 342}, {18, 360}};
    static const int32_t range_mm[][3] = {{400, 3000, 900}, {1200, 3000, 1200}, {300, 800, 800}};
    int i, k, side;

    for (k = 0; k < RIG_COUNT; k++) {
        for (i = 0; i < IH_TEST_COUNT(range_mm); i++) {
            double sum = 0;

            calibration = vector_rigs[k];
            calibration.near_mm = range_mm[i][0];
            calibration.far_mm = range_mm[i][1];
            TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &calibration, &bad_slot));
            for (side = 0; side < 4; side++) {
                sum += dot_distance(&calibration, sides[side][0], sides[side][1], range_mm[i][2]);
            }
            IH_TEST_WITHIN(1, ldexp(sum / (4 * 18 * 2), 28), rig.field.unit_q28, "unit", k);
        }
    }
}

static void field_centre_is_a_place_of_the_middle_dot(void)
{
    int k;

    for (k = 0; k < RIG_COUNT; k++) {
        const struct ih_calibration *c = &vector_rigs[k];
        const int middle = IH_SLOTS / 2;
        const double x = ih_test_from_q(rigs[k].field.centre_x_q28, 28);
        const double y = ih_test_from_q(rigs[k].field.centre_y_q28, 28);
        const double far_x = ray_at(c, middle, 0, c->far_mm);
        const double far_y = ray_at(c, middle, 1, c->far_mm);
        const double along_x = ray_at(c, middle, 0, c->near_mm) - far_x;
        const double along_y = ray_at(c, middle, 1, c->near_mm) - far_y;
        const double length = hypot(along_x, along_y);
        const double along = ((x - far_x) * along_x + (y - far_y) * along_y) / (length * length);

        TEST_ASSERT_TRUE(along > 0 && along < 1);
        /* Rounding of the offset, as in dot_at. */
        IH_TEST_WITHIN(1.0 / 65536 / c->near_mm, 0.0,
                       ((x - far_x) * along_y - (y - far_y) * along_x) / length, "beside", k);
    }
}

static void inside_ends_at_the_outer_pixel_centres(void)
{
    const int32_t right = (calibration.width - 1) * 4096;
    const int32_t bottom = (calibration.height - 1) * 4096;

    TEST_ASSERT_TRUE(ih_camera_sees(&rigs[0], 0, 0));
    TEST_ASSERT_TRUE(ih_camera_sees(&rigs[0], right, bottom));
    TEST_ASSERT_FALSE(ih_camera_sees(&rigs[0], -1, 0));
    TEST_ASSERT_FALSE(ih_camera_sees(&rigs[0], 0, -1));
    TEST_ASSERT_FALSE(ih_camera_sees(&rigs[0], right + 1, 0));
    TEST_ASSERT_FALSE(ih_camera_sees(&rigs[0], 0, bottom + 1));
    TEST_ASSERT_FALSE(ih_camera_sees(&rigs[0], INT32_MIN, INT32_MAX));
}

/* Each of these sets one field of a good calibration and expects a code. */
static void expect(enum ih_err err, int32_t slot, const char *what)
{
    IH_TEST_EQUAL(err, ih_rig_init(&rig, &calibration, &bad_slot), what, 0);
    IH_TEST_EQUAL(slot, bad_slot, what, 1);
}

#define EXPECT_WITH(field, value, err)               \
    do {                                             \
        calibration = vector_rigs[0];                \
        calibration.field = (value);                 \
        expect((err), IH_NONE, #field " = " #value); \
    } while (0)

static void sizes_are_checked(void)
{
    EXPECT_WITH(width, IH_FRAME_WIDTH_MIN - 1, IH_ERR_SIZE);
    EXPECT_WITH(width, IH_FRAME_WIDTH_MAX + 1, IH_ERR_SIZE);
    EXPECT_WITH(height, IH_FRAME_HEIGHT_MIN - 1, IH_ERR_SIZE);
    EXPECT_WITH(height, IH_FRAME_HEIGHT_MAX + 1, IH_ERR_SIZE);
    EXPECT_WITH(width, 0, IH_ERR_SIZE);
    EXPECT_WITH(width, INT32_MIN, IH_ERR_SIZE);
    EXPECT_WITH(height, INT32_MAX, IH_ERR_SIZE);
    EXPECT_WITH(width, IH_FRAME_WIDTH_MIN, IH_OK);
    EXPECT_WITH(height, IH_FRAME_HEIGHT_MIN, IH_OK);
}

static void focal_lengths_are_checked(void)
{
    EXPECT_WITH(fx_px_q16, 0, IH_ERR_FOCAL);
    EXPECT_WITH(fy_px_q16, 0, IH_ERR_FOCAL);
    EXPECT_WITH(fx_px_q16, -1, IH_ERR_FOCAL);
    EXPECT_WITH(fy_px_q16, INT32_MIN, IH_ERR_FOCAL);
    EXPECT_WITH(fx_px_q16, (IH_RIG_FOCAL_MAX_PX << 16) + 1, IH_ERR_FOCAL);
    EXPECT_WITH(fy_px_q16, INT32_MAX, IH_ERR_FOCAL);
    EXPECT_WITH(fx_px_q16, IH_RIG_FOCAL_MAX_PX << 16, IH_OK);
}

static void the_view_is_at_most_as_wide_as_it_may_be(void)
{
    /* 752 px wide with the principal point at 375.5: 376.5 px to the right, 188.25 px at tan 2. */
    EXPECT_WITH(fx_px_q16, 1, IH_ERR_PRINCIPAL);
    EXPECT_WITH(fx_px_q16, 100 << 16, IH_ERR_PRINCIPAL);
    EXPECT_WITH(fy_px_q16, 100 << 16, IH_ERR_PRINCIPAL);
    EXPECT_WITH(cx_px_q16, 1900 << 16, IH_ERR_PRINCIPAL);
    EXPECT_WITH(cx_px_q16, -(1200 << 16), IH_ERR_PRINCIPAL);
    EXPECT_WITH(cy_px_q16, INT32_MAX, IH_ERR_PRINCIPAL);
    EXPECT_WITH(cy_px_q16, INT32_MIN, IH_ERR_PRINCIPAL);
}

static void lenses_that_fold_the_picture_are_refused(void)
{
    EXPECT_WITH(k1_q24, -2 * (1 << 24), IH_ERR_DISTORTION);
    EXPECT_WITH(k2_q24, -20 * (1 << 24), IH_ERR_DISTORTION);
    EXPECT_WITH(k1_q24, INT32_MIN, IH_ERR_DISTORTION);
    EXPECT_WITH(k3_q24, INT32_MIN, IH_ERR_DISTORTION);
    EXPECT_WITH(p1_q24, 127 << 24, IH_ERR_DISTORTION);
    EXPECT_WITH(p2_q24, -(127 << 24), IH_ERR_DISTORTION);
}

static void the_working_range_is_checked(void)
{
    EXPECT_WITH(near_mm, IH_DEPTH_MIN_MM - 1, IH_ERR_RANGE);
    EXPECT_WITH(far_mm, IH_DEPTH_MAX_MM + 1, IH_ERR_RANGE);
    EXPECT_WITH(near_mm, 2600, IH_ERR_RANGE);
    EXPECT_WITH(far_mm, 399, IH_ERR_RANGE);
    EXPECT_WITH(near_mm, -400, IH_ERR_RANGE);
    EXPECT_WITH(far_mm, INT32_MAX, IH_ERR_RANGE);
    EXPECT_WITH(near_mm, IH_DEPTH_MIN_MM, IH_OK);
    EXPECT_WITH(far_mm, IH_DEPTH_MAX_MM, IH_OK);
    EXPECT_WITH(near_mm, 2599, IH_OK);
}

static void the_baseline_is_checked(void)
{
    calibration.origin_mm_q16[0] = calibration.origin_mm_q16[1] = calibration.origin_mm_q16[2] = 0;
    TEST_ASSERT_EQUAL_INT(IH_ERR_BASELINE, ih_rig_init(&rig, &calibration, &bad_slot));
    EXPECT_WITH(origin_mm_q16[0], (IH_RIG_BASELINE_MAX_MM << 16) + 1, IH_ERR_BASELINE);
    EXPECT_WITH(origin_mm_q16[1], INT32_MAX, IH_ERR_BASELINE);
    EXPECT_WITH(origin_mm_q16[2], INT32_MIN, IH_ERR_BASELINE);
    EXPECT_WITH(origin_mm_q16[1], -(IH_RIG_BASELINE_MAX_MM << 16), IH_OK);
}

/* A dot whose ray passes through the camera's centre stands still at every depth: slot 200 here. */
static void a_dot_that_does_not_move_is_refused(void)
{
    int axis;

    for (axis = 0; axis < 3; axis++) {
        const double part = vector_rigs[0].ray_q30[200][axis] / 1073741824.0;

        calibration.origin_mm_q16[axis] = (int32_t)lround(300 * 65536 * part);
    }
    expect(IH_ERR_BASELINE, 200, "dot on the camera's centre");
}

/* Focal length times offset must stay below 2^22 px mm: at 8192 px an offset of 512 mm is too far,
 * sideways and down, where 511 mm is not. All rays go straight ahead, so that the offset is the
 * origin itself; then they are no pattern. */
static void lines_that_move_too_fast_are_refused(void)
{
    int axis, slot, mm;

    for (axis = 0; axis < 2; axis++) {
        for (mm = 511; mm <= 512; mm++) {
            calibration = vector_rigs[2];
            calibration.fx_px_q16 = calibration.fy_px_q16 = IH_RIG_FOCAL_MAX_PX << 16;
            memset(calibration.origin_mm_q16, 0, sizeof calibration.origin_mm_q16);
            calibration.origin_mm_q16[axis] = mm << 16;
            for (slot = 0; slot < IH_SLOTS; slot++) {
                calibration.ray_q30[slot][0] = calibration.ray_q30[slot][1] = 0;
                calibration.ray_q30[slot][2] = 1 << 30;
            }
            TEST_ASSERT_EQUAL_INT(mm == 512 ? IH_ERR_BASELINE : IH_ERR_RAY,
                                  ih_rig_init(&rig, &calibration, &bad_slot));
            IH_TEST_EQUAL(mm == 512 ? 0 : IH_NONE, bad_slot, "slot", axis);
        }
    }
}

static void rays_are_checked_one_by_one(void)
{
    static const int slots[] = {0, 17, 180, IH_SLOTS - 1};
    int i, axis;

    for (i = 0; i < IH_TEST_COUNT(slots); i++) {
        int32_t *ray = calibration.ray_q30[slots[i]];

        calibration = vector_rigs[0];
        ray[2] = -ray[2];
        expect(IH_ERR_RAY, slots[i], "backwards");
        calibration = vector_rigs[0];
        ray[0] = ray[1] = ray[2] = 0;
        expect(IH_ERR_RAY, slots[i], "no direction");
        calibration = vector_rigs[0];
        ray[2] = INT32_MAX;
        expect(IH_ERR_RAY, slots[i], "too long");
        calibration = vector_rigs[0];
        for (axis = 0; axis < 3; axis++) {
            ray[axis] = ray[axis] / 100 * 99;
        }
        expect(IH_ERR_RAY, slots[i], "too short");
        calibration = vector_rigs[0];
        ray[0] = INT32_MIN;
        ray[1] = INT32_MIN;
        ray[2] = INT32_MIN;
        expect(IH_ERR_RAY, slots[i], "least integers");
        calibration = vector_rigs[0];
        ray[0] = 1 << 30;
        ray[1] = ray[2] = 0;
        expect(IH_ERR_RAY, slots[i], "sideways");
    }
}

static void equal_rays_are_no_pattern(void)
{
    int slot, axis;

    for (slot = 1; slot < IH_SLOTS; slot++) {
        for (axis = 0; axis < 3; axis++) {
            calibration.ray_q30[slot][axis] = calibration.ray_q30[0][axis];
        }
    }
    TEST_ASSERT_EQUAL_INT(IH_ERR_RAY, ih_rig_init(&rig, &calibration, &bad_slot));
}

static void kinds_are_checked(void)
{
    EXPECT_WITH(kind, (enum ih_rig_kind)2, IH_ERR_KIND);
    EXPECT_WITH(kind, (enum ih_rig_kind) - 1, IH_ERR_KIND);
}

/* A range rig may be smaller and has no projector: its rays and origin do not matter. */
static void a_range_rig_needs_no_projector(void)
{
    memset(calibration.ray_q30, 0, sizeof calibration.ray_q30);
    memset(calibration.origin_mm_q16, 0, sizeof calibration.origin_mm_q16);
    calibration.kind = IH_RIG_RANGE;
    expect(IH_OK, IH_NONE, "range");
    calibration.width = calibration.height = IH_RANGE_SIDE_MIN;
    calibration.cx_px_q16 = calibration.cy_px_q16 = 32 << 16;
    expect(IH_OK, IH_NONE, "least range image");
    calibration.width = IH_RANGE_SIDE_MIN - 1;
    expect(IH_ERR_SIZE, IH_NONE, "narrower than the minimum");
    calibration.width = IH_RANGE_SIDE_MIN;
    calibration.height = IH_RANGE_SIDE_MIN - 1;
    expect(IH_ERR_SIZE, IH_NONE, "lower than the minimum");
    calibration.height = 320; /* higher than wide */
    expect(IH_OK, IH_NONE, "portrait");
}

/* Each line's place at infinity and direction rebuild the dot at any depth. */
static void a_line_gives_the_dot_at_any_depth(void)
{
    int k, slot;

    for (k = 0; k < RIG_COUNT; k++) {
        const struct ih_calibration *c = &vector_rigs[k];

        for (slot = 0; slot < IH_SLOTS; slot++) {
            const struct ih_line *line = &rigs[k].line[slot];
            const double depth = c->near_mm + (c->far_mm - c->near_mm) * slot / 360.0;
            const double t = ih_test_from_q(line->length_px_mm_q8, 8) / depth;
            const double u = ih_test_from_q(line->infinity_u_px_q12, 12) +
                             t * ih_test_from_q(line->dir_u_q30, 30);
            const double exact =
                ray_at(c, slot, 0, depth) * c->fx_px_q16 / 65536 + ih_test_from_q(c->cx_px_q16, 16);

            IH_TEST_WITHIN(LSB_Q12 + 2 * length_tolerance(&rigs[k]) / depth, exact, u, "u", slot);
        }
    }
}

/* --- each limit from both sides --- */

static void use_range_rig(int32_t width, int32_t height, int32_t focal_px)
{
    memset(&calibration, 0, sizeof calibration);
    calibration.kind = IH_RIG_RANGE;
    calibration.width = width;
    calibration.height = height;
    calibration.fx_px_q16 = calibration.fy_px_q16 = focal_px << 16;
    calibration.cx_px_q16 = width << 15;
    calibration.cy_px_q16 = height << 15;
    calibration.near_mm = 400;
    calibration.far_mm = 8000;
}

/* Brown's model in float64, pixels. */
static void distort_float64(const struct ih_calibration *c, double x, double y, double *u,
                            double *v)
{
    const double k1 = ldexp(c->k1_q24, -24), k2 = ldexp(c->k2_q24, -24), k3 = ldexp(c->k3_q24, -24);
    const double p1 = ldexp(c->p1_q24, -24), p2 = ldexp(c->p2_q24, -24), r2 = x * x + y * y;
    const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));

    *u = (c->cx_px_q16 + c->fx_px_q16 * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x))) /
         65536;
    *v = (c->cy_px_q16 + c->fy_px_q16 * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y)) /
         65536;
}

/* What was undistorted is distorted to where it was, over the frame. */
static void check_undistorted(int32_t width, int32_t height, double max_px, int index)
{
    int32_t row, column;

    for (row = 0; row < height; row += 13) {
        for (column = 0; column < width; column += 11) {
            double u, v;
            int32_t x, y;

            ih_camera_undistort(&rig, column * 4096, row * 4096, &x, &y);
            distort_float64(&calibration, ldexp(x, -28), ldexp(y, -28), &u, &v);
            IH_TEST_WITHIN(max_px, column, u, "u", index);
            IH_TEST_WITHIN(max_px, row, v, "v", index);
        }
    }
}

/* Lenses up to nearly folding the picture, over the whole frame: 0.001 px. */
static void strong_lenses_are_undone_all_over_the_frame(void)
{
    static const struct {
        double k1, k2, p1, p2, k3;
    } lenses[] = {{0, 0, 0, 0, 0},
                  {-0.16, 0.06, 4e-5, 3.5e-4, 0},
                  {-0.4, 0.17, 0.002, -0.003, -0.03},
                  {0.3, -0.1, -0.01, 0.01, 0},
                  {0.4, 0.2, 0, 0, 0.1},
                  {-0.27, 0, 0, 0, 0},
                  {0, 0, 0.03, -0.03, 0},
                  {-0.5, 0.3, 0, 0.002, -0.1}};
    int i;

    for (i = 0; i < IH_TEST_COUNT(lenses); i++) {
        use_range_rig(1025, 1025, 1024);
        calibration.k1_q24 = (int32_t)lround(ldexp(lenses[i].k1, 24));
        calibration.k2_q24 = (int32_t)lround(ldexp(lenses[i].k2, 24));
        calibration.p1_q24 = (int32_t)lround(ldexp(lenses[i].p1, 24));
        calibration.p2_q24 = (int32_t)lround(ldexp(lenses[i].p2, 24));
        calibration.k3_q24 = (int32_t)lround(ldexp(lenses[i].k3, 24));
        calibration.cx_px_q16 = 500 << 16;
        IH_TEST_EQUAL(IH_OK, ih_rig_init(&rig, &calibration, &bad_slot), "a strong lens", i);
        check_undistorted(1025, 1025, 0.001, i);
    }
}

/* The slope of the series that Newton's steps begin with, of the square of the radius. */
static double slope_of_series(double k1, double r2)
{
    return 1 + r2 * (-3 * k1 + r2 * (15 * k1 * k1 - r2 * 84 * k1 * k1 * k1));
}

/* Where the series has slope 0 there are no steps, however far off its place is: 0.2 px about that ring. */
static void no_pixel_is_left_where_the_series_has_no_slope(void)
{
    const double k1 = 0.386, focal_px = 750;
    double low = 0.2, high = 1;
    int32_t middle, u_q12;
    int i;

    for (i = 0; i < 50; i++) {
        const double r2 = (low + high) / 2;

        if (slope_of_series(k1, r2) > 0) {
            low = r2;
        } else {
            high = r2;
        }
    }
    use_range_rig(1280, 1280, (int32_t)focal_px);
    calibration.k1_q24 = (int32_t)lround(ldexp(k1, 24));
    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &calibration, &bad_slot));
    middle = (int32_t)lround((640 + focal_px * sqrt(low)) * 4096);
    IH_TEST_RANGE(640 * 4096, 1279 * 4096, middle, "in the frame", 0);
    for (u_q12 = middle - 820; u_q12 <= middle + 820; u_q12++) {
        double u, v;
        int32_t x, y;

        ih_camera_undistort(&rig, u_q12, 640 * 4096, &x, &y);
        distort_float64(&calibration, ldexp(x, -28), ldexp(y, -28), &u, &v);
        IH_TEST_WITHIN(0.001, ldexp(u_q12, -12), u, "u", u_q12 - middle);
    }
}

/* Mild lenses with so great a k3 that r^6 in Q22 has steps of up to 0.015 px: Newton's steps end within one of them,
 * not where the lens comes back. */
static void lenses_of_great_k3_are_no_reason_to_refuse(void)
{
    static const struct {
        int32_t width, height, focal_px;
        double cx_px, k1, k2, k3;
    } lenses[] = {{877, 764, 2936, 494, 0.28, -0.245, -128},
                  {1090, 653, 4172, -390, -0.038, -0.71, -17.5},
                  {1280, 537, 4051, 555, 0.029, -3.57, -128}};
    int i;

    for (i = 0; i < IH_TEST_COUNT(lenses); i++) {
        use_range_rig(lenses[i].width, lenses[i].height, lenses[i].focal_px);
        calibration.cx_px_q16 = (int32_t)(lenses[i].cx_px * 65536);
        calibration.k1_q24 = (int32_t)lround(ldexp(lenses[i].k1, 24));
        calibration.k2_q24 = (int32_t)lround(ldexp(lenses[i].k2, 24));
        calibration.k3_q24 = (int32_t)fmax(INT32_MIN, ldexp(lenses[i].k3, 24));
        IH_TEST_EQUAL(IH_OK, ih_rig_init(&rig, &calibration, &bad_slot), "a great k3", i);
        check_undistorted(lenses[i].width, lenses[i].height, 0.02, i);
    }
}

static void sizes_may_be_as_large_as_their_limits(void)
{
    use_range_rig(IH_FRAME_WIDTH_MAX, IH_FRAME_WIDTH_MAX, 1000);
    expect(IH_OK, IH_NONE, "largest range image");
    calibration.height++;
    expect(IH_ERR_SIZE, IH_NONE, "higher than the largest range image");
    calibration = vector_rigs[0];
    calibration.width = IH_FRAME_WIDTH_MAX;
    calibration.height = IH_FRAME_HEIGHT_MAX;
    expect(IH_OK, IH_NONE, "largest frame");
    EXPECT_WITH(fy_px_q16, IH_RIG_FOCAL_MAX_PX << 16, IH_OK);
    EXPECT_WITH(fy_px_q16, (IH_RIG_FOCAL_MAX_PX << 16) + 1, IH_ERR_FOCAL);
}

/* A side's end may be seen at tan 2, twice the focal length from the principal point, and no farther. */
static void sides_may_be_seen_at_the_widest_angle(void)
{
    static const int32_t size_px[2] = {320, 240};
    int axis;

    for (axis = 0; axis < 2; axis++) {
        int32_t *principal_px_q16 = axis == 0 ? &calibration.cx_px_q16 : &calibration.cy_px_q16;
        const int32_t min = (size_px[axis] - 2 * 200) * 65536, max = 2 * 200 << 16;

        use_range_rig(size_px[0], size_px[1], 200);
        *principal_px_q16 = max;
        expect(IH_OK, IH_NONE, "largest principal point");
        *principal_px_q16 = max + 1;
        expect(IH_ERR_PRINCIPAL, IH_NONE, "a greater one");
        *principal_px_q16 = min;
        expect(IH_OK, IH_NONE, "least principal point");
        *principal_px_q16 = min - 1;
        expect(IH_ERR_PRINCIPAL, IH_NONE, "a lesser one");
    }
}

static void the_projector_may_be_a_metre_away(void)
{
    const int32_t max = IH_RIG_BASELINE_MAX_MM << 16;
    int axis, sign;

    for (axis = 0; axis < 3; axis++) {
        for (sign = -1; sign <= 1; sign += 2) {
            calibration = vector_rigs[0];
            calibration.origin_mm_q16[axis] = sign * max;
            expect(IH_OK, IH_NONE, "a metre");
            calibration.origin_mm_q16[axis] = sign * (max + 1);
            expect(IH_ERR_BASELINE, IH_NONE, "more than a metre");
        }
    }
}

/* A ray may lean until its Z is a quarter of its length, and be 6e-5, 2^16 of 2^30, too long or short. */
static void rays_are_good_up_to_their_limits(void)
{
    static const int32_t lengths[] = {1 << 16, -(1 << 16)};
    const int32_t forward = 1 << 28, aside = (int32_t)lround(ldexp(sqrt(15.0 / 16), 30));
    int32_t *ray = calibration.ray_q30[200];
    int i;

    calibration.origin_mm_q16[2] = 0;
    ray[0] = aside;
    ray[1] = 0;
    ray[2] = forward;
    expect(IH_OK, IH_NONE, "leans as much as it may");
    ray[2] = forward - 1;
    expect(IH_ERR_RAY, 200, "leans more");
    ray[0] = 0;
    for (i = 0; i < IH_TEST_COUNT(lengths); i++) {
        ray[2] = (1 << 30) + lengths[i];
        expect(IH_OK, IH_NONE, "longest and shortest");
        ray[2] += lengths[i] < 0 ? -2 : 2;
        expect(IH_ERR_RAY, 200, "longer and shorter");
    }
}

/* Dots must be 2 mrad apart. All rays leave one place, 100 mm beside the camera, so that the pitch is
 * the same at any depth. */
static void dots_may_be_two_milliradians_apart(void)
{
    static const double pitch[] = {0.0019999, 0.0020001};
    int i, slot;

    for (i = 0; i < IH_TEST_COUNT(pitch); i++) {
        calibration = vector_rigs[2];
        memset(calibration.origin_mm_q16, 0, sizeof calibration.origin_mm_q16);
        calibration.origin_mm_q16[0] = 100 << 16;
        for (slot = 0; slot < IH_SLOTS; slot++) {
            const double x = (slot % IH_GRID - 9) * pitch[i], y = (slot / IH_GRID - 9) * pitch[i];
            const double z = 1 / sqrt(1 + x * x + y * y);

            calibration.ray_q30[slot][0] = (int32_t)lround(ldexp(x * z, 30));
            calibration.ray_q30[slot][1] = (int32_t)lround(ldexp(y * z, 30));
            calibration.ray_q30[slot][2] = (int32_t)lround(ldexp(z, 30));
        }
        expect(i == 0 ? IH_ERR_RAY : IH_OK, IH_NONE, "pitch");
    }
}

/* A dot must move by 100 px mm / Z: 0.1 px at a metre. Of a camera of 1024 px the projector must be
 * 100/1024 mm = 6400 / 65536 mm aside. */
static void dots_must_move_by_a_tenth_of_a_pixel(void)
{
    int32_t off;

    for (off = -1; off <= 0; off++) {
        calibration = vector_rigs[2];
        calibration.fx_px_q16 = calibration.fy_px_q16 = 1024 << 16;
        memset(calibration.origin_mm_q16, 0, sizeof calibration.origin_mm_q16);
        calibration.origin_mm_q16[1] =
            6400 + 16 * off; /* e is rounded to Q8: 16 units are 1/4 px mm */
        expect(off < 0 ? IH_ERR_BASELINE : IH_OK, off < 0 ? 0 : IH_NONE, "the smallest baseline");
    }
}

/* Pixels beyond 16384 are taken for it. A principal point at 16000 is 384 px from there. */
static void pixels_beyond_16384_are_limited(void)
{
    const int32_t max = 16384 * 4096;
    int32_t x, y, off_x, off_y;

    use_range_rig(64, 64, IH_RIG_FOCAL_MAX_PX);
    calibration.cx_px_q16 = calibration.cy_px_q16 = 16000 << 16;
    expect(IH_OK, IH_NONE, "principal point far to the right");
    ih_camera_undistort(&rig, max, max - 4096, &x, &y);
    IH_TEST_WITHIN(1, ldexp(384.0 / 8192, 28), x, "x", 0);
    IH_TEST_WITHIN(1, ldexp(383.0 / 8192, 28), y, "y", 0);
    ih_camera_undistort(&rig, max + 4096, INT32_MAX, &off_x, &off_y);
    IH_TEST_EQUAL(x, off_x, "x beyond", 0);
    IH_TEST_EQUAL(x, off_y, "y beyond", 0);
    calibration.cx_px_q16 = calibration.cy_px_q16 = -16000 * 65536;
    expect(IH_OK, IH_NONE, "principal point far to the left");
    ih_camera_undistort(&rig, -max, -max + 4096, &x, &y);
    IH_TEST_WITHIN(1, ldexp(-384.0 / 8192, 28), x, "x", 1);
    IH_TEST_WITHIN(1, ldexp(-383.0 / 8192, 28), y, "y", 1);
    ih_camera_undistort(&rig, -max - 4096, INT32_MIN, &off_x, &off_y);
    IH_TEST_EQUAL(x, off_x, "x beyond", 1);
    IH_TEST_EQUAL(x, off_y, "y beyond", 1);
}

/* The lens is tried up to the frame's last row and column: k1 r^2 folds the picture only there.
 * With x = y = 0.5 at the corners of a square, r (1 + k1 r^2) has its turning point, 3 k1 r^2 = -1,
 * inside the corner or outside it. */
static void the_lens_is_tried_in_the_corners(void)
{
    int32_t k1_q24;

    use_range_rig(1025, 1025, 1024);
    calibration.cx_px_q16 = calibration.cy_px_q16 = 512 << 16;
    /* The corner, at 0.5 x 0.5 in the picture, is r_d^2 = 1/2 of the lens; the turning point is at
     * r_d = 2/3 r, r^2 = -1 / (3 k1): r_d^2 = 4 / 27 / -k1, k1 = -8/27. */
    k1_q24 = (int32_t)lround(-8.0 / 27 * (1 << 24));
    calibration.k1_q24 = k1_q24 / 100 * 97;
    expect(IH_OK, IH_NONE, "the corners are before the fold");
    calibration.k1_q24 = k1_q24 / 100 * 101;
    expect(IH_ERR_DISTORTION, IH_NONE, "the corners are behind the fold");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(lines_match_float64);
    RUN_TEST(working_range_matches_float64);
    RUN_TEST(all_directions_are_unit_vectors);
    RUN_TEST(a_line_gives_the_dot_at_any_depth);
    RUN_TEST(undistort_matches_the_exact_inverse);
    RUN_TEST(strong_lenses_are_undone_all_over_the_frame);
    RUN_TEST(no_pixel_is_left_where_the_series_has_no_slope);
    RUN_TEST(lenses_of_great_k3_are_no_reason_to_refuse);
    RUN_TEST(undistort_survives_any_pixel);
    RUN_TEST(without_distortion_undistort_is_a_division);
    RUN_TEST(distort_matches_float64);
    RUN_TEST(distort_limits_what_is_far_outside);
    RUN_TEST(dot_at_is_the_ray_at_that_depth);
    RUN_TEST(field_unit_is_half_the_pitch);
    RUN_TEST(the_field_is_that_of_the_outer_dots);
    RUN_TEST(field_centre_is_a_place_of_the_middle_dot);
    RUN_TEST(inside_ends_at_the_outer_pixel_centres);
    RUN_TEST(sizes_are_checked);
    RUN_TEST(focal_lengths_are_checked);
    RUN_TEST(the_view_is_at_most_as_wide_as_it_may_be);
    RUN_TEST(lenses_that_fold_the_picture_are_refused);
    RUN_TEST(the_working_range_is_checked);
    RUN_TEST(the_baseline_is_checked);
    RUN_TEST(a_dot_that_does_not_move_is_refused);
    RUN_TEST(lines_that_move_too_fast_are_refused);
    RUN_TEST(rays_are_checked_one_by_one);
    RUN_TEST(equal_rays_are_no_pattern);
    RUN_TEST(kinds_are_checked);
    RUN_TEST(a_range_rig_needs_no_projector);
    RUN_TEST(sizes_may_be_as_large_as_their_limits);
    RUN_TEST(sides_may_be_seen_at_the_widest_angle);
    RUN_TEST(the_projector_may_be_a_metre_away);
    RUN_TEST(rays_are_good_up_to_their_limits);
    RUN_TEST(dots_may_be_two_milliradians_apart);
    RUN_TEST(dots_must_move_by_a_tenth_of_a_pixel);
    RUN_TEST(pixels_beyond_16384_are_limited);
    RUN_TEST(the_lens_is_tried_in_the_corners);
    return UNITY_END();
}
