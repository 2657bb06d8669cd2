/* How far the firmware's undistortion is from OpenCV's in float64, over the whole frame of each rig.json that is named.
 *
 *     test_undistort RIG.json...
 *
 * rig.json is read with cv::FileStorage: it has to be OpenCV's JSON. A line per rig; exit status 1 from 0.02 px on.
 */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "base/ih_config.h"
#include "base/ih_types.h"
#include "rig/ih_camera.h"
#include "rig/ih_rig.h"

static const double limit_px = 0.02;

static int32_t fixed(double value, int bits)
{
    return static_cast<int32_t>(std::lround(std::ldexp(value, bits)));
}

struct Calibrated {
    cv::Mat camera, lens, origin, rays;
    ih_calibration fixed_point{};
};

static bool read_rig(const char *path, Calibrated &rig)
{
    cv::FileStorage file(path, cv::FileStorage::READ | cv::FileStorage::FORMAT_JSON);
    if (!file.isOpened())
        return false;
    file["camera_matrix"] >> rig.camera;
    file["distortion_coefficients"] >> rig.lens;
    file["projector_origin"] >> rig.origin;
    file["dot_rays"] >> rig.rays;
    ih_calibration &c = rig.fixed_point;
    c.kind = IH_RIG_DOTS;
    c.width = static_cast<int>(file["image_width"]);
    c.height = static_cast<int>(file["image_height"]);
    c.near_mm = static_cast<int32_t>(static_cast<double>(file["near_mm"]));
    c.far_mm = static_cast<int32_t>(static_cast<double>(file["far_mm"]));
    c.fx_px_q16 = fixed(rig.camera.at<double>(0, 0), 16);
    c.fy_px_q16 = fixed(rig.camera.at<double>(1, 1), 16);
    c.cx_px_q16 = fixed(rig.camera.at<double>(0, 2), 16);
    c.cy_px_q16 = fixed(rig.camera.at<double>(1, 2), 16);
    int32_t *lens[5] = {&c.k1_q24, &c.k2_q24, &c.p1_q24, &c.p2_q24, &c.k3_q24};
    for (int i = 0; i < 5; i++)
        *lens[i] = fixed(rig.lens.at<double>(i), 24);
    for (int axis = 0; axis < 3; axis++)
        c.origin_mm_q16[axis] = fixed(rig.origin.at<double>(axis), 16);
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        for (int axis = 0; axis < 3; axis++)
            c.ray_q30[slot][axis] = fixed(rig.rays.at<double>(slot, axis), 30);
    }
    return true;
}

/* Every fourth pixel and the last ones, at places between pixel centres too. */
static double largest_error_px(const Calibrated &calibrated, const ih_rig &rig, double &undone_px)
{
    std::vector<cv::Point2d> positions, expected;
    int last_u = rig.calibration.width - 1, last_v = rig.calibration.height - 1;
    for (int v = 0; v <= last_v + 3; v += 4) {
        for (int u = 0; u <= last_u + 3; u += 4)
            positions.emplace_back(std::min<double>(u + 0.25 * (v % 3), last_u),
                                   std::min<double>(v + 0.25 * (u % 3), last_v));
    }
    cv::undistortPoints(positions, expected, calibrated.camera, calibrated.lens, cv::noArray(),
                        cv::noArray(),
                        {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 500, 1e-14});
    double largest_px = 0.0, fx = calibrated.camera.at<double>(0, 0),
           fy = calibrated.camera.at<double>(1, 1);
    double cx = calibrated.camera.at<double>(0, 2), cy = calibrated.camera.at<double>(1, 2);
    undone_px = 0.0;
    for (size_t i = 0; i < positions.size(); i++) {
        int32_t x_q28, y_q28;
        ih_camera_undistort(&rig, fixed(positions[i].x, 12), fixed(positions[i].y, 12), &x_q28,
                            &y_q28);
        double du = fx * (std::ldexp(x_q28, -28) - expected[i].x),
               dv = fy * (std::ldexp(y_q28, -28) - expected[i].y);
        largest_px = std::max(largest_px, std::hypot(du, dv));
        undone_px = std::max(undone_px, std::hypot(fx * expected[i].x + cx - positions[i].x,
                                                   fy * expected[i].y + cy - positions[i].y));
    }
    return largest_px;
}

int main(int argc, char **argv)
{
    bool good = argc > 1;
    for (int i = 1; i < argc; i++) {
        static ih_rig rig;
        Calibrated calibrated;
        int32_t bad_slot;
        if (!read_rig(argv[i], calibrated)) {
            std::fprintf(stderr, "%s: could not be read\n", argv[i]);
            return 1;
        }
        ih_err status = ih_rig_init(&rig, &calibrated.fixed_point, &bad_slot);
        if (status != IH_OK) {
            std::fprintf(stderr, "%s: refused by the firmware: %d\n", argv[i],
                         static_cast<int>(status));
            return 1;
        }
        double undone_px, error_px = largest_error_px(calibrated, rig, undone_px);
        std::printf("%s: lens moves pixels by up to %.2f px; undone within %.5f px\n", argv[i],
                    undone_px, error_px);
        good = good && error_px < limit_px;
    }
    return good ? 0 : 1;
}
