/* ih_rig_blob: the bytes of a rig against an independent reading of the format, and every kind of damage. */
#include "base/ih_config.h"
#include "base/ih_types.h"
#include "rig/ih_rig_blob.h"
#include "rig/ih_rig.h"

#include "ih_test.h"
#include "rigs.inc"

#define RIG_COUNT IH_TEST_COUNT(vector_rigs)
#define AT_CRC (IH_RIG_BLOB_BYTES - 4)

static uint8_t blob[IH_RIG_BLOB_BYTES];
static struct ih_calibration calibration;

void setUp(void)
{
    IH_TEST_EQUAL(IH_OK, ih_rig_blob_encode(&vector_rigs[0], blob), "encode", 0);
    memset(&calibration, IH_TEST_FILL, sizeof calibration);
}

void tearDown(void)
{
}

/* By arithmetic in 64 bits, unlike the code's shifts. */
static int64_t word_at(const uint8_t *bytes, int at)
{
    return bytes[at] + 256 * (bytes[at + 1] + 256 * (bytes[at + 2] + INT64_C(256) * bytes[at + 3]));
}

static int64_t signed_at(const uint8_t *bytes, int at)
{
    const int64_t word = word_at(bytes, at);

    return word < INT64_C(2147483648) ? word : word - INT64_C(4294967296);
}

static void set_word(uint8_t *bytes, int at, int64_t word)
{
    int i;

    for (i = 0; i < 4; i++) {
        bytes[at + i] = (uint8_t)((uint64_t)word >> (8 * i) & 255u);
    }
}

/* After a change that is meant. */
static void seal(uint8_t *bytes)
{
    set_word(bytes, AT_CRC, ih_rig_blob_crc32(bytes, AT_CRC));
}

static enum ih_err decode(const uint8_t *bytes, size_t size)
{
    return ih_rig_blob_decode(bytes, size, &calibration);
}

/* What is refused leaves the calibration alone. */
static void refused(enum ih_err wanted, const uint8_t *bytes, size_t size, const char *what,
                    int64_t index)
{
    IH_TEST_EQUAL(wanted, decode(bytes, size), what, index);
    IH_TEST_UNTOUCHED(&calibration, sizeof calibration, what);
}

static void crc_is_zlibs(void)
{
    /* From zlib.crc32 and the catalogue of CRCs' check value. */
    static const struct {
        const char *text;
        uint32_t crc;
    } known[] = {{"", 0x00000000u},
                 {"a", 0xe8b7be43u},
                 {"123456789", 0xcbf43926u},
                 {"The quick brown fox jumps over the lazy dog", 0x414fa339u}};
    uint8_t bytes[256];
    int i;

    for (i = 0; i < IH_TEST_COUNT(known); i++) {
        const uint8_t *text = (const uint8_t *)known[i].text;

        IH_TEST_EQUAL(known[i].crc, ih_rig_blob_crc32(text, strlen(known[i].text)), "text", i);
    }
    memset(bytes, 0, sizeof bytes);
    IH_TEST_EQUAL(0x190a55adu, ih_rig_blob_crc32(bytes, 32), "zeros", 32);
    memset(bytes, 0xff, sizeof bytes);
    IH_TEST_EQUAL(0xff6cab0bu, ih_rig_blob_crc32(bytes, 32), "ones", 32);
    for (i = 0; i < 256; i++) {
        bytes[i] = (uint8_t)i;
    }
    IH_TEST_EQUAL(0x29058c73u, ih_rig_blob_crc32(bytes, 256), "all bytes", 256);
}

/* Each number at its offset as ih_rig_blob.h lists them. */
static void fields_stand_where_the_header_says(void)
{
    int i, slot, axis;

    for (i = 0; i < RIG_COUNT; i++) {
        const struct ih_calibration *c = &vector_rigs[i];
        const int32_t camera[] = {
            c->width,  c->height, c->fx_px_q16, c->fy_px_q16, c->cx_px_q16, c->cy_px_q16, c->k1_q24,
            c->k2_q24, c->p1_q24, c->p2_q24,    c->k3_q24,    c->near_mm,   c->far_mm};
        int field;

        IH_TEST_EQUAL(IH_OK, ih_rig_blob_encode(c, blob), "encode", i);
        TEST_ASSERT_EQUAL_MEMORY("IHRB\x02\0\0\0", blob, 8);
        IH_TEST_EQUAL(4428, word_at(blob, 8), "length", i);
        IH_TEST_EQUAL(c->kind == IH_RIG_RANGE, word_at(blob, 12), "kind", i);
        for (field = 0; field < IH_TEST_COUNT(camera); field++) {
            IH_TEST_EQUAL(camera[field], signed_at(blob, 16 + 4 * field), "camera", field);
        }
        for (axis = 0; axis < 3; axis++) {
            IH_TEST_EQUAL(c->origin_mm_q16[axis], signed_at(blob, 68 + 4 * axis), "origin", axis);
        }
        for (slot = 0; slot < IH_SLOTS; slot++) {
            for (axis = 0; axis < 3; axis++) {
                IH_TEST_EQUAL(c->ray_q30[slot][axis], signed_at(blob, 80 + 12 * slot + 4 * axis),
                              "ray", slot);
            }
        }
        for (axis = 0; axis < 3; axis++) {
            IH_TEST_EQUAL(c->up_q30[axis], signed_at(blob, 4412 + 4 * axis), "up", axis);
        }
        IH_TEST_EQUAL(ih_rig_blob_crc32(blob, 4424), word_at(blob, 4424), "CRC", i);
    }
}

/* All 32 bits of every field, at every alignment. */
static void random_numbers_come_back(void)
{
    struct ih_test_random random = {7};
    static uint8_t shifted[IH_RIG_BLOB_BYTES + 8];
    static struct ih_calibration made;
    int round;

    for (round = 0; round < 200; round++) {
        int32_t *const head[] = {&made.width,     &made.height,    &made.fx_px_q16, &made.fy_px_q16,
                                 &made.cx_px_q16, &made.cy_px_q16, &made.k1_q24,    &made.k2_q24,
                                 &made.p1_q24,    &made.p2_q24,    &made.k3_q24,    &made.near_mm,
                                 &made.far_mm};
        int i;

        made.kind = IH_RIG_DOTS;
        for (i = 0; i < IH_TEST_COUNT(head); i++) {
            *head[i] = (int32_t)ih_test_between(&random, INT32_MIN, INT32_MAX);
        }
        for (i = 0; i < 6 + 3 * IH_SLOTS; i++) {
            int32_t *const at = i < 3   ? &made.origin_mm_q16[i]
                                : i < 6 ? &made.up_q30[i - 3]
                                        : &made.ray_q30[i / 3 - 2][i % 3];

            *at = (int32_t)ih_test_between(&random, INT32_MIN, INT32_MAX);
        }
        made.fx_px_q16 = round % 2 == 0 ? INT32_MIN : -1;
        made.ray_q30[IH_SLOTS - 1][2] = round % 2 == 0 ? INT32_MAX : 0;
        IH_TEST_EQUAL(IH_OK, ih_rig_blob_encode(&made, blob), "encode", round);
        memcpy(shifted + round % 8, blob, sizeof blob);
        IH_TEST_EQUAL(IH_OK, decode(shifted + round % 8, sizeof blob), "decode", round);
        TEST_ASSERT_EQUAL_MEMORY(&made, &calibration, sizeof made);
    }
}

static void every_bit_counts(void)
{
    int bit;

    for (bit = 0; bit < 8 * IH_RIG_BLOB_BYTES; bit++) {
        const enum ih_err wanted = bit < 32   ? IH_ERR_BLOB_MAGIC
                                   : bit < 64 ? IH_ERR_BLOB_VERSION
                                   : bit < 96 ? IH_ERR_BLOB_LENGTH
                                              : IH_ERR_BLOB_CRC;

        blob[bit / 8] ^= (uint8_t)(1u << bit % 8);
        IH_TEST_EQUAL(wanted, decode(blob, sizeof blob), "bit", bit);
        blob[bit / 8] ^= (uint8_t)(1u << bit % 8);
    }
    IH_TEST_UNTOUCHED(&calibration, sizeof calibration, "a flipped bit");
}

/* Two bits anywhere, three anywhere, a burst of 32. */
static void more_bits_count_too(void)
{
    struct ih_test_random random = {8};
    int round;

    for (round = 0; round < 3000; round++) {
        const int wanted = 2 + round % 3;
        int i;

        setUp();
        if (wanted == 4) {
            const int64_t at = ih_test_between(&random, 12, IH_RIG_BLOB_BYTES - 4);
            const int64_t flips = ih_test_between(&random, 1, UINT32_MAX);

            set_word(blob, (int)at, word_at(blob, (int)at) ^ flips);
        }
        for (i = 0; i < wanted && wanted < 4; i++) {
            /* each in a third of its own: never the same one twice */
            const int64_t third = 8 * (IH_RIG_BLOB_BYTES - 12) / 3;
            const int64_t bit = 96 + i * third + ih_test_between(&random, 0, third - 1);

            blob[bit / 8] ^= (uint8_t)(1u << bit % 8);
        }
        IH_TEST_EQUAL(IH_ERR_BLOB_CRC, decode(blob, sizeof blob), "round", round);
    }
}

/* The memory ends where the blob does, so that the sanitizers see a byte too many. */
static void every_truncation_is_refused(void)
{
    static uint8_t end[IH_RIG_BLOB_BYTES];
    size_t size;

    for (size = 0; size < sizeof blob; size++) {
        uint8_t *const bytes = end + sizeof end - size;

        memcpy(bytes, blob, size);
        refused(IH_ERR_BLOB_SHORT, bytes, size, "size", (int64_t)size);
    }
}

static void bytes_after_the_end_are_refused(void)
{
    static uint8_t more[2 * IH_RIG_BLOB_BYTES];

    memcpy(more, blob, sizeof blob);
    memcpy(more + sizeof blob, blob, sizeof blob);
    refused(IH_ERR_BLOB_LONG, more, sizeof blob + 1, "size", IH_RIG_BLOB_BYTES + 1);
    refused(IH_ERR_BLOB_LONG, more, sizeof more, "size", 2 * IH_RIG_BLOB_BYTES);
}

/* Sealed again: none is the CRC's to find. */
static void other_headers_are_refused(void)
{
    static const struct {
        int at;
        int64_t word;
        enum ih_err err;
    } other[] = {{0, 0x31474849, IH_ERR_BLOB_MAGIC},
                 {0, 0x42524849 ^ 0x20, IH_ERR_BLOB_MAGIC},
                 {4, 0, IH_ERR_BLOB_VERSION},
                 {4, 1, IH_ERR_BLOB_LENGTH},
                 {4, 3, IH_ERR_BLOB_VERSION},
                 {4, 0x01000000, IH_ERR_BLOB_VERSION},
                 {8, IH_RIG_BLOB_BYTES - 4, IH_ERR_BLOB_LENGTH},
                 {8, IH_RIG_BLOB_BYTES + 4, IH_ERR_BLOB_LENGTH},
                 {8, 0, IH_ERR_BLOB_LENGTH},
                 {8, 0xffffffff, IH_ERR_BLOB_LENGTH},
                 {12, 2, IH_ERR_BLOB_FIELD},
                 {12, 256, IH_ERR_BLOB_FIELD},
                 {12, 257, IH_ERR_BLOB_FIELD},
                 {12, 0xffffffff, IH_ERR_BLOB_FIELD}};
    static const uint8_t json[] = "{\"image_width\":752}";
    int i;

    for (i = 0; i < IH_TEST_COUNT(other); i++) {
        setUp();
        set_word(blob, other[i].at, other[i].word);
        seal(blob);
        refused(other[i].err, blob, sizeof blob, "header", i);
    }
    refused(IH_ERR_BLOB_MAGIC, json, sizeof json, "rig.json", 0);
}

static void a_range_rig_has_no_projector(void)
{
    static struct ih_calibration range;
    int at;

    range = vector_rigs[0];
    range.kind = IH_RIG_RANGE;
    IH_TEST_EQUAL(IH_ERR_BLOB_FIELD, ih_rig_blob_encode(&range, blob), "with a projector", 0);
    memset(range.origin_mm_q16, 0, sizeof range.origin_mm_q16);
    memset(range.ray_q30, 0, sizeof range.ray_q30);
    IH_TEST_EQUAL(IH_OK, ih_rig_blob_encode(&range, blob), "without one", 0);
    IH_TEST_EQUAL(IH_OK, decode(blob, sizeof blob), "without one", 0);
    TEST_ASSERT_EQUAL_MEMORY(&range, &calibration, sizeof range);
    memset(&calibration, IH_TEST_FILL, sizeof calibration);
    for (at = 68; at < 4412; at++) {
        blob[at] = 1;
        seal(blob);
        IH_TEST_EQUAL(IH_ERR_BLOB_FIELD, decode(blob, sizeof blob), "offset", at);
        blob[at] = 0;
    }
}

/* Of boards that knew nothing of up. */
static void version_1_is_a_level_camera(void)
{
    static struct ih_calibration level;
    size_t size;

    level = vector_rigs[1];
    IH_TEST_EQUAL(IH_OK, ih_rig_blob_encode(&level, blob), "encode", 1);
    set_word(blob, 4, 1);
    set_word(blob, 8, IH_RIG_BLOB_1_BYTES);
    set_word(blob, 4412, ih_rig_blob_crc32(blob, 4412));
    for (size = 0; size < IH_RIG_BLOB_1_BYTES; size++) {
        refused(IH_ERR_BLOB_SHORT, blob, size, "size", (int64_t)size);
    }
    refused(IH_ERR_BLOB_LONG, blob, IH_RIG_BLOB_1_BYTES + 1, "size", IH_RIG_BLOB_1_BYTES + 1);
    refused(IH_ERR_BLOB_LONG, blob, IH_RIG_BLOB_BYTES, "size", IH_RIG_BLOB_BYTES);
    IH_TEST_EQUAL(IH_OK, decode(blob, IH_RIG_BLOB_1_BYTES), "decode", 1);
    level.up_q30[1] = -(1 << 30);
    TEST_ASSERT_EQUAL_MEMORY(&level, &calibration, sizeof level);
    memset(&calibration, IH_TEST_FILL, sizeof calibration);
    blob[4411] ^= 1;
    refused(IH_ERR_BLOB_CRC, blob, IH_RIG_BLOB_1_BYTES, "changed", 4411);
    blob[4411] ^= 1;
    set_word(blob, 8, IH_RIG_BLOB_BYTES);
    refused(IH_ERR_BLOB_LENGTH, blob, IH_RIG_BLOB_1_BYTES, "length of version 2", 1);
}

static void kinds_that_do_not_exist_have_no_blob(void)
{
    calibration = vector_rigs[0];
    calibration.kind = (enum ih_rig_kind)2;
    IH_TEST_EQUAL(IH_ERR_BLOB_FIELD, ih_rig_blob_encode(&calibration, blob), "kind", 2);
}

/* A sound blob of a wrong rig: its numbers arrive, and ih_rig_init says which is wrong. */
static void wrong_numbers_are_the_rigs_business(void)
{
    static struct ih_rig rig;
    static const struct {
        int at;
        int64_t word;
        enum ih_err err;
    } wrong[] = {{16, 0, IH_ERR_SIZE},
                 {20, 0xffffffff, IH_ERR_SIZE},
                 {24, 0, IH_ERR_FOCAL},
                 {28, 0x80000000, IH_ERR_FOCAL},
                 {32, 0x7fffffff, IH_ERR_PRINCIPAL},
                 {40, 0x7fffffff, IH_ERR_DISTORTION},
                 {60, 0, IH_ERR_RANGE},
                 {64, 0x7fffffff, IH_ERR_RANGE},
                 {68, 0x80000000, IH_ERR_BASELINE},
                 {88, 0, IH_ERR_RAY},
                 {4416, 5, IH_ERR_UP}};
    int32_t bad_slot = 0;
    int i;

    for (i = 0; i < IH_TEST_COUNT(wrong); i++) {
        setUp();
        set_word(blob, wrong[i].at, wrong[i].word);
        seal(blob);
        IH_TEST_EQUAL(IH_OK, decode(blob, sizeof blob), "decode", i);
        IH_TEST_EQUAL(wrong[i].err, ih_rig_init(&rig, &calibration, &bad_slot), "rig", i);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(crc_is_zlibs);
    RUN_TEST(fields_stand_where_the_header_says);
    RUN_TEST(random_numbers_come_back);
    RUN_TEST(every_bit_counts);
    RUN_TEST(more_bits_count_too);
    RUN_TEST(every_truncation_is_refused);
    RUN_TEST(bytes_after_the_end_are_refused);
    RUN_TEST(other_headers_are_refused);
    RUN_TEST(a_range_rig_has_no_projector);
    RUN_TEST(version_1_is_a_level_camera);
    RUN_TEST(kinds_that_do_not_exist_have_no_blob);
    RUN_TEST(wrong_numbers_are_the_rigs_business);
    return UNITY_END();
}
