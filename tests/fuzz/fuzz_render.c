/* The range directories that tools/render starts from (rd_range): its own readers of JSON and PGM.
 * Input: the first byte says which file the rest is, rig.json, truth.jsonl or the image; the other two
 * are good. */
#include <string.h>

#include "rd_range.h"

#include "fuzz.h"

#define SIDE 64
#define HEADER "P5 64 64 65535\n"

static const char rig[] =
    "{\"kind\":\"range\",\"image_width\":64,\"image_height\":64,\"near_mm\":400,\"far_mm\":4000,"
    "\"camera_matrix\":{\"data\":[60,0,31.5,0,60,31.5,0,0,1]},"
    "\"distortion_coefficients\":{\"data\":[0,0,0,0,0]}}";
static const char truth[] = "{\"file\":\"0.pgm\",\"head\":null}\n";

static void write_image(void)
{
    static uint8_t image[sizeof HEADER - 1 + 2 * SIDE * SIDE];
    memset(image, 4, sizeof image); /* 1028 mm */
    memcpy(image, HEADER, sizeof HEADER - 1);
    fuzz_file_write("0.pgm", image, sizeof image);
}

static void check(const struct rd_range *range)
{
    FUZZ_CHECK(range->frame_count == 1);
    const struct rd_range_frame *frame = &range->frames[0];
    FUZZ_CHECK(frame->head_count >= 0 && frame->head_count <= RD_RANGE_HEADS_MAX);
    FUZZ_CHECK(frame->camera.width >= 64 && frame->camera.width <= 1280);
    FUZZ_CHECK(frame->camera.height >= 64 && frame->camera.height <= 1280);
    FUZZ_CHECK(frame->near_mm > 0 && frame->far_mm > frame->near_mm);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const name[3] = {"rig.json", "truth.jsonl", "0.pgm"};
    struct fuzz_input input = {data, size};
    struct rd_range range;
    uint8_t which = fuzz_byte(&input) % 3;
    fuzz_quiet();
    fuzz_file_write("rig.json", (const uint8_t *)rig, sizeof rig - 1);
    fuzz_file_write("truth.jsonl", (const uint8_t *)truth, sizeof truth - 1);
    write_image();
    fuzz_file_write(name[which], input.at, input.left);
    if (rd_range_open(&range, fuzz_file_directory())) {
        check(&range);
        struct rd_relief *relief = rd_range_load(&range.frames[0]);
        if (relief != NULL) {
            rd_relief_free(relief);
        }
    }
    rd_range_close(&range);
    return 0;
}
