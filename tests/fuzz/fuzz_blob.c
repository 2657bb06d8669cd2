/* Rigs as blobs (firmware/core/ih_rig_blob). Input: how the bytes come about, then they or what changes in
 * them. No engine finds a CRC: one flag has it put right, so that what lies behind it is reached. */
#include <string.h>

#include "rig/ih_rig_blob.h"

#include "fuzz_rig.h"

#define CHANGES_MAX 16
#define SIZE_MAX_BYTES (IH_RIG_BLOB_BYTES + 64)

static void put_word(uint8_t *at, uint32_t word)
{
    for (int i = 0; i < 4; i++) {
        at[i] = (uint8_t)(word >> 8 * i & 255);
    }
}

/* A good rig's blob, some of its bytes changed. */
static void change(struct fuzz_input *input, uint8_t flags, uint8_t *blob)
{
    const struct ih_rig *rig =
        (flags & 4) != 0 ? fuzz_rig_range(flags & 1) : fuzz_rig_dots(flags & 3);
    FUZZ_CHECK(ih_rig_blob_encode(&rig->calibration, blob) == IH_OK);
    for (int i = 0; i < CHANGES_MAX && input->left > 0; i++) {
        int32_t at = fuzz_within(input, 0, IH_RIG_BLOB_BYTES - 1);
        blob[at] = (uint8_t)(blob[at] ^ fuzz_byte(input));
    }
}

/* What was accepted has this blob and no other, or a newer one with the same numbers, and isohead_init has something to
 * say about it. */
static void check_accepted(const struct ih_calibration *calibration, const uint8_t *blob,
                           size_t length)
{
    static struct ih_rig rig;
    static uint8_t again[IH_RIG_BLOB_BYTES];
    int32_t bad_slot = IH_NONE;
    FUZZ_CHECK(calibration->kind == IH_RIG_DOTS || calibration->kind == IH_RIG_RANGE);
    FUZZ_CHECK(ih_rig_blob_encode(calibration, again) == IH_OK);
    size_t begin = length == IH_RIG_BLOB_1_BYTES ? 12 : 0;
    FUZZ_CHECK(memcmp(again + begin, blob + begin, length - 4 - begin) == 0);
    enum ih_err err = ih_rig_init(&rig, calibration, &bad_slot);
    FUZZ_CHECK(err <= 0 && strcmp(ih_err_text(err), "unknown error") != 0);
}

static void check_refused(enum ih_err err, const struct ih_calibration *calibration)
{
    const uint8_t *bytes = (const uint8_t *)calibration;
    FUZZ_CHECK(err == IH_ERR_BLOB_SHORT || err == IH_ERR_BLOB_MAGIC || err == IH_ERR_BLOB_VERSION ||
               err == IH_ERR_BLOB_LENGTH || err == IH_ERR_BLOB_LONG || err == IH_ERR_BLOB_CRC ||
               err == IH_ERR_BLOB_FIELD);
    FUZZ_CHECK(strcmp(ih_err_text(err), "unknown error") != 0);
    for (size_t i = 0; i < sizeof *calibration; i++) {
        FUZZ_CHECK(bytes[i] == 0xa5); /* it stayed as it was */
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fuzz_input input = {data, size};
    uint8_t flags = fuzz_byte(&input);
    struct ih_calibration calibration;
    uint8_t bytes[SIZE_MAX_BYTES] = {0};
    size_t length;
    if ((flags & 8) != 0) {
        length = input.left < SIZE_MAX_BYTES ? input.left : SIZE_MAX_BYTES;
        memcpy(bytes, input.at, length);
    } else {
        length =
            (flags & 16) != 0 ? (size_t)fuzz_within(&input, 0, SIZE_MAX_BYTES) : IH_RIG_BLOB_BYTES;
        change(&input, flags, bytes);
    }
    if ((flags & 64) != 0 && length >= IH_RIG_BLOB_1_BYTES) {
        length = IH_RIG_BLOB_1_BYTES;
        put_word(bytes + 4, 1);
        put_word(bytes + 8, IH_RIG_BLOB_1_BYTES);
    }
    if ((flags & 32) != 0 && length >= IH_RIG_BLOB_1_BYTES) {
        size_t at = (length < IH_RIG_BLOB_BYTES ? IH_RIG_BLOB_1_BYTES : IH_RIG_BLOB_BYTES) - 4;
        put_word(bytes + at, ih_rig_blob_crc32(bytes, at));
    }
    uint8_t *exact = malloc(length > 0 ? length : 1); /* a read beyond it is seen */
    FUZZ_CHECK(exact != NULL);
    memcpy(exact, bytes, length);
    memset(&calibration, 0xa5, sizeof calibration);
    enum ih_err err = ih_rig_blob_decode(exact, length, &calibration);
    if (err == IH_OK) {
        FUZZ_CHECK(length == IH_RIG_BLOB_BYTES || length == IH_RIG_BLOB_1_BYTES);
        check_accepted(&calibration, exact, length);
    } else {
        check_refused(err, &calibration);
    }
    free(exact);
    return 0;
}
