#include "app_rig.h"

#include <math.h>

#define RAY_AXES 3

static double from_fixed(int32_t value, int fraction_bits)
{
    return ldexp((double)value, -fraction_bits);
}

static void explain_ray(const struct ih_calibration *calibration, int32_t slot,
                        struct hal_error *error)
{
    double ray[RAY_AXES];
    for (int i = 0; i < RAY_AXES; i++) {
        ray[i] = from_fixed(calibration->ray_q30[slot][i], 30);
    }
    (void)hal_fail(error,
                   "dot_rays[%ld]: (%.6g, %.6g, %.6g), length %.6g, expected a unit vector forward",
                   (long)slot, ray[0], ray[1], ray[2],
                   sqrt(ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]));
}

static void explain_baseline(const struct ih_calibration *calibration, struct hal_error *error)
{
    double origin_mm[RAY_AXES];
    for (int i = 0; i < RAY_AXES; i++) {
        origin_mm[i] = from_fixed(calibration->origin_mm_q16[i], 16);
    }
    (void)hal_fail(
        error, "projector_origin: (%g, %g, %g) mm, expected off the camera's centre and within %d",
        origin_mm[0], origin_mm[1], origin_mm[2], IH_RIG_BASELINE_MAX_MM);
}

static void explain_up(const struct ih_calibration *calibration, struct hal_error *error)
{
    double up[RAY_AXES];
    for (int i = 0; i < RAY_AXES; i++) {
        up[i] = from_fixed(calibration->up_q30[i], 30);
    }
    (void)hal_fail(error,
                   "up: (%.6g, %.6g, %.6g), length %.6g, expected a unit vector that is at least "
                   "10 degrees off "
                   "the optical axis",
                   up[0], up[1], up[2], sqrt(up[0] * up[0] + up[1] * up[1] + up[2] * up[2]));
}

static void explain_size(const struct ih_calibration *calibration, struct hal_error *error)
{
    bool range = calibration->kind == IH_RIG_RANGE;
    (void)hal_fail(error, "image_width, image_height: %ldx%ld, expected %dx%d to %dx%d",
                   (long)calibration->width, (long)calibration->height,
                   range ? IH_RANGE_SIDE_MIN : IH_FRAME_WIDTH_MIN,
                   range ? IH_RANGE_SIDE_MIN : IH_FRAME_HEIGHT_MIN, IH_FRAME_WIDTH_MAX,
                   range ? IH_FRAME_WIDTH_MAX : IH_FRAME_HEIGHT_MAX);
}

void app_rig_explain(const struct ih_calibration *calibration, enum ih_err err, int32_t bad_slot,
                     struct hal_error *error)
{
    const struct ih_calibration *c = calibration;
    switch (err) {
    case IH_ERR_SIZE:
        explain_size(c, error);
        break;
    case IH_ERR_FOCAL:
        (void)hal_fail(
            error, "camera_matrix: focal lengths %g and %g px, expected above 0 and at most %d",
            from_fixed(c->fx_px_q16, 16), from_fixed(c->fy_px_q16, 16), IH_RIG_FOCAL_MAX_PX);
        break;
    case IH_ERR_PRINCIPAL:
        (void)hal_fail(error,
                       "camera_matrix: principal point (%g, %g), too far off the %ldx%ld image",
                       from_fixed(c->cx_px_q16, 16), from_fixed(c->cy_px_q16, 16), (long)c->width,
                       (long)c->height);
        break;
    case IH_ERR_DISTORTION:
        (void)hal_fail(
            error,
            "distortion_coefficients: %g %g %g %g %g cannot be undone everywhere in the frame",
            from_fixed(c->k1_q24, 24), from_fixed(c->k2_q24, 24), from_fixed(c->p1_q24, 24),
            from_fixed(c->p2_q24, 24), from_fixed(c->k3_q24, 24));
        break;
    case IH_ERR_RANGE:
        (void)hal_fail(error, "near_mm, far_mm: %ld and %ld, expected %d <= near < far <= %d",
                       (long)c->near_mm, (long)c->far_mm, IH_DEPTH_MIN_MM, IH_DEPTH_MAX_MM);
        break;
    case IH_ERR_BASELINE:
        explain_baseline(c, error);
        break;
    case IH_ERR_RAY:
        if (bad_slot >= 0 && bad_slot < IH_SLOTS) {
            explain_ray(c, bad_slot, error);
            break;
        }
        (void)hal_fail(error,
                       "dot_rays: dots closer than 2 mrad, or out of view with this up, expected a "
                       "19x19 pattern");
        break;
    case IH_ERR_UP:
        explain_up(c, error);
        break;
    default:
        (void)hal_fail(error, "%s", ih_err_text(err));
        break;
    }
}
