/* rig.json (firmware/app/app_rig), and what the core says about the calibration. Input: the file.
 *
 * A rig has 361 rays, too long for an engine to invent: "@" in the input stands for a good rig's
 * dot_rays, "~" for all its other fields. */
#include <string.h>

#include "app_rig.h"

#include "fuzz.h"
#include "fuzz_rig.h"

#define TEXT_MAX ((size_t)256 * 1024)
/* Of the fields that stand for one byte. */
#define MACRO_MAX ((size_t)32 * 1024)
/* More of them in one input are left as they are. */
#define MACROS_MAX 3

static const char fields[] =
    "\"image_width\":320,\"image_height\":240,\"near_mm\":400,\"far_mm\":2500,"
    "\"camera_matrix\":{\"type_id\":\"opencv-matrix\",\"rows\":3,\"cols\":3,\"dt\":\"d\","
    "\"data\":[330,0,159.5,0,330,119.5,0,0,1]},"
    "\"distortion_coefficients\":{\"type_id\":\"opencv-matrix\",\"rows\":1,\"cols\":5,\"dt\":\"d\","
    "\"data\":[0,0,0,0,0]},"
    "\"projector_origin\":{\"type_id\":\"opencv-matrix\",\"rows\":3,\"cols\":1,\"dt\":\"d\","
    "\"data\":[-12.5,0,0]}";

static const char *rays_field(void)
{
    static char text[MACRO_MAX];
    size_t length = 0;
    if (text[0] != 0) {
        return text;
    }
    length += (size_t)snprintf(text, sizeof text,
                               "\"dot_rays\":{\"type_id\":\"opencv-matrix\",\"rows\":361,"
                               "\"cols\":3,\"dt\":\"d\",\"data\":[");
    const struct ih_calibration *c = &fuzz_rig_dots(0)->calibration;
    for (int i = 0; i < 3 * IH_SLOTS; i++) {
        length += (size_t)snprintf(text + length, sizeof text - length, "%s%.9f", i == 0 ? "" : ",",
                                   c->ray_q30[i / 3][i % 3] / 1073741824.0);
        FUZZ_CHECK(length < sizeof text - 8);
    }
    snprintf(text + length, sizeof text - length, "]}");
    return text;
}

/* The input with its macros spelt out; returns the length. */
static size_t expand(const uint8_t *data, size_t size, uint8_t *text)
{
    size_t length = 0;
    int macros = 0;
    for (size_t i = 0; i < size && length < TEXT_MAX - MACRO_MAX; i++) {
        const char *macro = data[i] == '@' ? rays_field() : data[i] == '~' ? fields : NULL;
        if (macro != NULL && macros < MACROS_MAX) {
            memcpy(text + length, macro, strlen(macro));
            length += strlen(macro);
            macros++;
        } else {
            text[length++] = data[i];
        }
    }
    return length;
}

static bool has_text(const struct hal_error *error)
{
    return error->text[0] != 0 && memchr(error->text, 0, sizeof error->text) != NULL;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static uint8_t text[TEXT_MAX];
    static struct ih_rig rig;
    struct ih_calibration calibration;
    struct hal_error error = {""};
    int32_t bad_slot = IH_NONE;
    size_t length = expand(data, size, text);
    if (!app_rig_load(fuzz_file_path(text, length), &calibration, &error)) {
        FUZZ_CHECK(has_text(&error));
        return 0;
    }
    FUZZ_CHECK(calibration.kind == IH_RIG_DOTS || calibration.kind == IH_RIG_RANGE);
    enum ih_err err = ih_rig_init(&rig, &calibration, &bad_slot);
    if (err != IH_OK) {
        app_rig_explain(&calibration, err, bad_slot, &error);
        FUZZ_CHECK(has_text(&error));
    }
    return 0;
}
