/* Lists of points (hal/replay/hal_xyz), drawn into a depth image (ih_cloud). Input: the file. */
#include <string.h>

#include "points/ih_cloud.h"
#include "replay/hal_xyz.h"

#include "fuzz_rig.h"

static void draw(const struct hal_xyz *xyz)
{
    static uint16_t depth_mm[FUZZ_RIG_PIXELS_MAX];
    const struct ih_rig *rig = fuzz_rig_range(0);
    const struct ih_calibration *c = &rig->calibration;
    struct ih_cloud count;
    FUZZ_CHECK(ih_cloud_draw((const int32_t(*)[3])xyz->point_mm_q8, xyz->point_count, rig, depth_mm,
                             &count) == IH_OK);
    FUZZ_CHECK(count.drawn + count.hidden + count.near + count.far + count.outside ==
               xyz->point_count);
    int32_t drawn = 0;
    for (int32_t i = 0; i < c->width * c->height; i++) {
        FUZZ_CHECK(depth_mm[i] == 0 || (depth_mm[i] >= c->near_mm && depth_mm[i] <= c->far_mm));
        drawn += depth_mm[i] != 0;
    }
    FUZZ_CHECK(drawn == count.drawn);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct hal_xyz xyz = {0};
    struct hal_error error = {""};
    char *text = malloc(size + 1);
    FUZZ_CHECK(text != NULL);
    memcpy(text, data, size);
    text[size] = 0;
    if (hal_xyz_decode(text, size, &xyz, &error)) {
        FUZZ_CHECK(xyz.point_count >= 0 && (size_t)xyz.point_count <= size / 5 + 1);
        for (int32_t i = 0; i < 3 * xyz.point_count; i++) {
            FUZZ_CHECK(abs(xyz.point_mm_q8[i / 3][i % 3]) <= HAL_XYZ_MAX_MM * 256);
        }
        draw(&xyz);
        free(xyz.point_mm_q8);
    } else {
        FUZZ_CHECK(xyz.point_mm_q8 == NULL && xyz.point_count == 0);
        FUZZ_CHECK(error.text[0] != 0 && memchr(error.text, 0, sizeof error.text) != NULL);
    }
    free(text);
    return 0;
}
