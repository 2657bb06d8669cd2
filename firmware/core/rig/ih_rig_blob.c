#include "rig/ih_rig_blob.h"

#include <stdbool.h>
#include <string.h>

#include "base/ih_range.h"

#define WORD_BYTES 4
/* Where things stand; between KIND and CRC all are int32_t. */
#define AT_MAGIC 0
#define AT_VERSION 4
#define AT_LENGTH 8
#define AT_KIND 12
#define AT_CAMERA 16
#define AT_PROJECTOR 68
#define AT_RAYS 80
#define AT_UP 4412
#define AT_CRC (IH_RIG_BLOB_BYTES - WORD_BYTES)
#define HEADER_BYTES AT_KIND
#define CAMERA_WORDS ((AT_PROJECTOR - AT_CAMERA) / WORD_BYTES)
#define AXES 3
#define POLYNOMIAL 0xedb88320u /* x^32 + x^26 + .. + 1, lowest power first */

static const int32_t level_q30[AXES] = {0, -(1 << 30), 0};
static const uint8_t magic[WORD_BYTES] = {'I', 'H', 'R', 'B'};

/* The camera's fields in the order of the blob. */
static const uint8_t camera_field[CAMERA_WORDS] = {
    offsetof(struct ih_calibration, width),     offsetof(struct ih_calibration, height),
    offsetof(struct ih_calibration, fx_px_q16), offsetof(struct ih_calibration, fy_px_q16),
    offsetof(struct ih_calibration, cx_px_q16), offsetof(struct ih_calibration, cy_px_q16),
    offsetof(struct ih_calibration, k1_q24),    offsetof(struct ih_calibration, k2_q24),
    offsetof(struct ih_calibration, p1_q24),    offsetof(struct ih_calibration, p2_q24),
    offsetof(struct ih_calibration, k3_q24),    offsetof(struct ih_calibration, near_mm),
    offsetof(struct ih_calibration, far_mm)};

static uint32_t get_u32(const uint8_t *at)
{
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static void put_u32(uint8_t *at, uint32_t word)
{
    for (int i = 0; i < WORD_BYTES; i++) {
        at[i] = (uint8_t)(word >> (8 * i) & 0xff);
    }
}

/* Two's complement, without a conversion that C leaves to the compiler. */
static int32_t get_s32(const uint8_t *at)
{
    uint32_t word = get_u32(at);
    return word <= INT32_MAX ? (int32_t)word : -(int32_t)~word - 1;
}

static void put_s32(uint8_t *at, int32_t value)
{
    put_u32(at, IH_WRAPS(uint32_t, value));
}

uint32_t ih_rig_blob_crc32(const uint8_t *bytes, size_t count)
{
    uint32_t crc = UINT32_MAX;
    for (size_t i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) {
            crc = crc >> 1 ^ (crc & 1 ? POLYNOMIAL : 0);
        }
    }
    return ~crc;
}

/* Everything but the fields. */
static enum ih_err check_frame(const uint8_t *blob, size_t size)
{
    if (size < HEADER_BYTES) {
        return IH_ERR_BLOB_SHORT;
    }
    if (memcmp(&blob[AT_MAGIC], magic, sizeof magic) != 0) {
        return IH_ERR_BLOB_MAGIC;
    }
    const uint32_t version = get_u32(&blob[AT_VERSION]);
    if (version < 1 || version > IH_RIG_BLOB_VERSION) {
        return IH_ERR_BLOB_VERSION;
    }
    const size_t bytes = version == 1 ? IH_RIG_BLOB_1_BYTES : IH_RIG_BLOB_BYTES;
    if (get_u32(&blob[AT_LENGTH]) != bytes) {
        return IH_ERR_BLOB_LENGTH;
    }
    if (size != bytes) {
        return size < bytes ? IH_ERR_BLOB_SHORT : IH_ERR_BLOB_LONG;
    }
    const size_t at_crc = bytes - WORD_BYTES;
    return ih_rig_blob_crc32(blob, at_crc) == get_u32(&blob[at_crc]) ? IH_OK : IH_ERR_BLOB_CRC;
}

/* Of a blob in which nothing else is wrong. */
static enum ih_err check_fields(const uint8_t *blob)
{
    uint32_t kind = get_u32(&blob[AT_KIND]);
    if (kind != IH_RIG_DOTS && kind != IH_RIG_RANGE) {
        return IH_ERR_BLOB_FIELD;
    }
    for (int at = AT_PROJECTOR; at < AT_UP && kind == IH_RIG_RANGE; at++) {
        if (blob[at] != 0) {
            return IH_ERR_BLOB_FIELD;
        }
    }
    return IH_OK;
}

enum ih_err ih_rig_blob_decode(const uint8_t *blob, size_t size, struct ih_calibration *calibration)
{
    enum ih_err err = check_frame(blob, size);
    if (err == IH_OK) {
        err = check_fields(blob);
    }
    if (err != IH_OK) {
        return err;
    }
    struct ih_calibration *c = calibration;
    c->kind = get_u32(&blob[AT_KIND]) == IH_RIG_RANGE ? IH_RIG_RANGE : IH_RIG_DOTS;
    uint8_t *member = (uint8_t *)c;
    for (int i = 0; i < CAMERA_WORDS; i++) {
        int32_t value = get_s32(&blob[AT_CAMERA + WORD_BYTES * i]);
        memcpy(&member[camera_field[i]], &value, sizeof value);
    }
    for (int axis = 0; axis < AXES; axis++) {
        c->origin_mm_q16[axis] = get_s32(&blob[AT_PROJECTOR + WORD_BYTES * axis]);
    }
    for (int i = 0; i < AXES * IH_SLOTS; i++) {
        c->ray_q30[i / AXES][i % AXES] = get_s32(&blob[AT_RAYS + WORD_BYTES * i]);
    }
    const bool has_up = size == IH_RIG_BLOB_BYTES;
    for (int axis = 0; axis < AXES; axis++) {
        c->up_q30[axis] = has_up ? get_s32(&blob[AT_UP + WORD_BYTES * axis]) : level_q30[axis];
    }
    return IH_OK;
}

enum ih_err ih_rig_blob_encode(const struct ih_calibration *calibration,
                               uint8_t blob[IH_RIG_BLOB_BYTES])
{
    const struct ih_calibration *c = calibration;
    memcpy(&blob[AT_MAGIC], magic, sizeof magic);
    put_u32(&blob[AT_VERSION], IH_RIG_BLOB_VERSION);
    put_u32(&blob[AT_LENGTH], IH_RIG_BLOB_BYTES);
    put_u32(&blob[AT_KIND], (uint32_t)c->kind);
    const uint8_t *member = (const uint8_t *)c;
    for (int i = 0; i < CAMERA_WORDS; i++) {
        int32_t value = 0;
        memcpy(&value, &member[camera_field[i]], sizeof value);
        put_s32(&blob[AT_CAMERA + WORD_BYTES * i], value);
    }
    for (int axis = 0; axis < AXES; axis++) {
        put_s32(&blob[AT_PROJECTOR + WORD_BYTES * axis], c->origin_mm_q16[axis]);
    }
    for (int i = 0; i < AXES * IH_SLOTS; i++) {
        put_s32(&blob[AT_RAYS + WORD_BYTES * i], c->ray_q30[i / AXES][i % AXES]);
    }
    for (int axis = 0; axis < AXES; axis++) {
        put_s32(&blob[AT_UP + WORD_BYTES * axis], c->up_q30[axis]);
    }
    put_u32(&blob[AT_CRC], ih_rig_blob_crc32(blob, AT_CRC));
    return check_fields(blob);
}
