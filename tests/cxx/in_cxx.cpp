// A C++ program that uses isohead: it makes a rig and a frame, finds the head in it, and compares with C.
#include "isohead.h"
#include "points/ih_cloud.h"
#include "rig/ih_rig_blob.h"
#include "upkeep/ih_exposure.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include "in_c.h"

namespace
{

constexpr int width = 640, height = 480;
constexpr double focal_px = 800, middle_u = 319.5, middle_v = 239.5;
constexpr double baseline_mm = 12.5, pitch = 0.03, wall_mm = 1500, sigma_px = 1.3;

struct ellipsoid {
    double centre_mm[3], semi_axes_mm[3];
};
constexpr ellipsoid head_shape = {{30, -20, 900}, {76, 112, 96}};
constexpr ellipsoid shoulders = {{30, 290, 950}, {220, 170, 120}};

int failures = 0;

void check(bool is_right, const char *what)
{
    if (!is_right) {
        std::fprintf(stderr, "cxx: %s\n", what);
        failures++;
    }
}

int32_t fixed(double value, int bits)
{
    return static_cast<int32_t>(std::lround(std::ldexp(value, bits)));
}

void ray_of(int slot, double ray[3])
{
    ray[0] = pitch * (slot % IH_GRID - IH_GRID / 2);
    ray[1] = pitch * (slot / IH_GRID - IH_GRID / 2);
    ray[2] = 1;
}

ih_calibration make_rig()
{
    ih_calibration rig{};
    rig.kind = IH_RIG_DOTS;
    rig.width = width;
    rig.height = height;
    rig.fx_px_q16 = rig.fy_px_q16 = fixed(focal_px, 16);
    rig.cx_px_q16 = fixed(middle_u, 16);
    rig.cy_px_q16 = fixed(middle_v, 16);
    rig.near_mm = 400;
    rig.far_mm = 2000;
    rig.origin_mm_q16[0] = fixed(baseline_mm, 16);
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        double ray[3];
        ray_of(slot, ray);
        const double length = std::hypot(ray[0], ray[1], ray[2]);
        for (int axis = 0; axis < 3; axis++) {
            rig.ray_q30[slot][axis] = fixed(ray[axis] / length, 30);
        }
    }
    return rig;
}

// The depth at which a ray meets an ellipsoid; the wall's if it does not.
double depth_on(const ellipsoid &body, const double ray[3])
{
    double a = 0, b = 0, c = -1;
    for (int axis = 0; axis < 3; axis++) {
        const double origin = axis == 0 ? baseline_mm : 0;
        const double from = (origin - body.centre_mm[axis]) / body.semi_axes_mm[axis];
        const double along = ray[axis] / body.semi_axes_mm[axis];
        a += along * along;
        b += along * from;
        c += from * from;
    }
    const double root = b * b - a * c;
    return root < 0 ? wall_mm : (-b - std::sqrt(root)) / a;
}

// Brow, nose and hair before the ellipsoid: a surface without any is a ball's.
double head_depth(const double ray[3])
{
    const double depth = depth_on(head_shape, ray);
    const double y = depth * ray[1] - head_shape.centre_mm[1];
    return depth == wall_mm ? wall_mm : depth - 8 * std::sin(y / 9);
}

std::vector<uint8_t> make_samples()
{
    std::vector<double> light(width * height, 40);
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        double ray[3];
        ray_of(slot, ray);
        const double depth = std::fmin(head_depth(ray), depth_on(shoulders, ray));
        const double u = middle_u + focal_px * (ray[0] + baseline_mm / depth);
        const double v = middle_v + focal_px * ray[1];
        for (int y = static_cast<int>(v) - 6; y <= static_cast<int>(v) + 7; y++) {
            for (int x = static_cast<int>(u) - 6; x <= static_cast<int>(u) + 7; x++) {
                const double distance = std::hypot(x - u, y - v) / sigma_px;
                light[y * width + x] += 120 * std::exp(-distance * distance / 2);
            }
        }
    }
    std::vector<uint8_t> samples;
    for (const double grey : light) {
        samples.push_back(static_cast<uint8_t>(std::lround(grey)));
    }
    return samples;
}

void check_same(const ih_result &a, const ih_result &b)
{
    check(a.entry_count == b.entry_count && a.head_count == b.head_count &&
              a.selected == b.selected && std::memcmp(a.head, b.head, sizeof a.head) == 0,
          "another result than in C");
    for (int i = 0; i < a.entry_count && i < b.entry_count; i++) {
        const ih_result_entry &x = a.entry[i], &y = b.entry[i];
        check(std::memcmp(x.centre_mm_q8, y.centre_mm_q8, sizeof x.centre_mm_q8) == 0 &&
                  x.probability_q16 == y.probability_q16 && x.track_id == y.track_id &&
                  x.u_px_q12 == y.u_px_q12 && x.v_px_q12 == y.v_px_q12,
              "another hypothesis than in C");
    }
}

// The position error stays within the contract's 100 mm for a match.
void check_head(const ih_result &result)
{
    check(result.head_count == 1 && result.selected >= 0, "no head, or several");
    if (result.selected >= 0) {
        const int32_t *found = result.entry[result.selected].centre_mm_q8;
        const double error = std::hypot(found[0] / 256.0 - head_shape.centre_mm[0],
                                        found[1] / 256.0 - head_shape.centre_mm[1],
                                        found[2] / 256.0 - head_shape.centre_mm[2]);
        check(error < 100, "a head elsewhere");
    }
}

// The headers beside isohead.h: each one's functions are found by the linker.
void use_others(const isohead &head, const ih_calibration &calibration)
{
    uint8_t blob[IH_RIG_BLOB_BYTES];
    auto decoded = std::make_unique<ih_calibration>();
    check(ih_rig_blob_encode(&calibration, blob) == IH_OK &&
              ih_rig_blob_decode(blob, sizeof blob, decoded.get()) == IH_OK &&
              std::memcmp(decoded->ray_q30, calibration.ray_q30, sizeof calibration.ray_q30) == 0,
          "a rig blob that changes the rig");

    struct ih_exposure_look look; // a function has this name too
    ih_exposure_look(&head.dots, &head.labels, width, height, &look);
    check(look.labelled_count == head.labels.labelled_count,
          "labels that the exposure does not see");

    check(head.align.now.state == IH_ALIGN_FITS, "a rig that has not moved and does not fit");

    ih_cloud cloud;
    uint16_t depth_mm = 0;
    const int32_t point_mm_q8[1][3] = {{0, 0, 256000}};
    check(ih_cloud_draw(point_mm_q8, 1, &head.rig, &depth_mm, &cloud) == IH_ERR_KIND,
          "a cloud drawn for a rig of dots");
}

} // namespace

int main()
{
    check(sizeof(isohead) == in_c_size() && alignof(isohead) == in_c_alignment() &&
              offsetof(isohead, result) == in_c_offset_of_result(),
          "another layout than in C");

    const ih_calibration calibration = make_rig();
    const std::vector<uint8_t> samples = make_samples();
    const ih_frame frame = {samples.data(), width, height, width, 1, 255};
    int32_t bad_slot = 0;
    auto head = std::make_unique<isohead>();
    check(isohead_init(head.get(), &calibration, &bad_slot) == IH_OK, "a rig that is refused");
    check(isohead_frame(head.get(), &frame, nullptr, 0) == IH_OK, "a frame that is refused");
    check_head(head->result);

    auto in_c = std::make_unique<ih_result>();
    check(in_c_find(&calibration, &frame, in_c.get()) == IH_OK, "a frame that C refuses");
    check_same(head->result, *in_c);

    use_others(*head, calibration);
    if (failures == 0) {
        std::printf("cxx: %d dots, %d labels, %d head, as in C\n", head->dots.dot_count,
                    head->labels.labelled_count, head->result.head_count);
    }
    return failures == 0 ? 0 : 1;
}
