#include "golden.h"

#include <string.h>

#include "golden_hash.h"
#include "golden_scene.h"
#include "hal_text.h"

#define FRAME_US 40000

static struct isohead head;
static struct ih_exposure exposure;
static struct ih_calibration calibration;
static uint16_t samples[GOLDEN_FRAME_BYTES / 2];
static uint16_t ambient_samples[GOLDEN_AMBIENT_BYTES / 2];

#define LINE_BYTES 120 /* a line of output; none is that long */
#define HASH_DIGITS 16

static bool end_line(struct hal_text *line)
{
    hal_text_put(line, "\n");
    return golden_write(line->text, line->length);
}

static bool fail(const char *what, uint32_t number, const char *expected)
{
    char memory[LINE_BYTES];
    struct hal_text line = hal_text_begin(memory, sizeof memory);
    hal_text_put(&line, "golden: ");
    hal_text_put(&line, what);
    hal_text_put(&line, " ");
    hal_text_put_number(&line, number, 1);
    hal_text_put(&line, ", expected ");
    hal_text_put(&line, expected);
    end_line(&line);
    return false;
}

static bool put_stage(uint32_t set, const char *frame, const char *stage, uint64_t hash)
{
    char memory[LINE_BYTES];
    struct hal_text line = hal_text_begin(memory, sizeof memory);
    hal_text_put(&line, "rig");
    hal_text_put_number(&line, set, 1);
    hal_text_put(&line, " ");
    hal_text_put(&line, frame);
    hal_text_put(&line, " ");
    hal_text_put(&line, stage);
    hal_text_put(&line, " ");
    hal_text_put_hex(&line, hash, HASH_DIGITS);
    return end_line(&line);
}

/* What is known of the set of frames that is being run. */
struct set {
    uint32_t number; /* from 1 on */
    uint32_t frame_count;
};

static bool start_set(struct set *set)
{
    int32_t bad_slot = IH_NONE;
    set->number++;
    set->frame_count = 0;
    enum ih_err err = isohead_init(&head, &calibration, &bad_slot);
    if (err != IH_OK) {
        return fail("the core refuses the rig with error", (uint32_t)-err, "none");
    }
    golden_inner_start(&exposure);
    return put_stage(set->number, "-", "rig", golden_hash_rig(&head));
}

/* The stages whose outputs the state does not keep. */
static bool put_inners(const struct set *set, const char *name, const struct ih_frame *frame,
                       const struct ih_frame *ambient)
{
    uint64_t hash[GOLDEN_INNERS];
    golden_inner_hash(&head, frame, ambient, &exposure, hash);
    for (int i = 0; i < GOLDEN_INNERS; i++) {
        if (!put_stage(set->number, name, golden_inner_name[i], hash[i])) {
            return false;
        }
    }
    return true;
}

static bool run_frame(struct set *set, const char *name, const struct ih_frame *frame,
                      const struct ih_frame *ambient)
{
    enum ih_err err = isohead_frame(&head, frame, ambient, (int64_t)set->frame_count * FRAME_US);
    if (err != IH_OK) {
        return fail("the core refuses a frame with error", (uint32_t)-err, "none");
    }
    set->frame_count++;
    for (int i = 0; i < GOLDEN_STAGES; i++) {
        if (!put_stage(set->number, name, golden_stage[i].name, golden_stage[i].hash(&head))) {
            return false;
        }
    }
    return put_inners(set, name, frame, ambient);
}

static bool read_word(uint32_t *word)
{
    uint8_t byte[4];
    if (!golden_read(byte, sizeof byte)) {
        return fail("the file ends early, words left:", 0, "more");
    }
    *word = byte[0] | (uint32_t)byte[1] << 8 | (uint32_t)byte[2] << 16 | (uint32_t)byte[3] << 24;
    return true;
}

static bool read_rig(void)
{
    uint32_t word = 0;
    char *words = golden_rig_words(&calibration);
    if (!read_word(&word)) {
        return false;
    }
    calibration.kind = (enum ih_rig_kind)word;
    for (int i = 0; i < GOLDEN_RIG_WORDS; i++) {
        if (!read_word(&word)) {
            return false;
        }
        memcpy(words + (size_t)i * sizeof word, &word, sizeof word);
    }
    return true;
}

/* Samples of two bytes: from the file's order to the processor's. */
static void order_samples(uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        uint8_t byte[2];
        memcpy(byte, &samples[i], sizeof byte);
        samples[i] = (uint16_t)(byte[0] | byte[1] << 8);
    }
}

static bool read_frame(struct ih_frame *frame)
{
    uint32_t width = 0, height = 0, bytes = 0, maximum = 0;
    if (!read_word(&width) || !read_word(&height) || !read_word(&bytes) || !read_word(&maximum)) {
        return false;
    }
    if (width > IH_FRAME_WIDTH_MAX || height > IH_FRAME_HEIGHT_MAX || bytes < 1 || bytes > 2 ||
        width * height * bytes > GOLDEN_FRAME_BYTES) {
        return fail("a frame has bytes:", width * height * bytes, "at most GOLDEN_FRAME_BYTES");
    }
    if (!golden_read(samples, width * height * bytes)) {
        return fail("the file ends in a frame of width", width, "all of it");
    }
    if (bytes == 2) {
        order_samples(width * height);
    }
    *frame = (struct ih_frame){samples,         (int32_t)width,
                               (int32_t)height, (int32_t)(width * bytes),
                               (int32_t)bytes,  (int32_t)maximum};
    return true;
}

static bool run_recorded(struct set *set)
{
    struct ih_frame frame;
    char memory[LINE_BYTES];
    struct hal_text name = hal_text_begin(memory, sizeof memory);
    hal_text_put(&name, "recorded");
    hal_text_put_number(&name, set->frame_count, 1);
    return read_frame(&frame) && run_frame(set, name.text, &frame, NULL);
}

static bool run_dot_scenes(struct set *set)
{
    if (calibration.width * calibration.height > GOLDEN_AMBIENT_BYTES) {
        return fail("the rig's width is", (uint32_t)calibration.width,
                    "GOLDEN_AMBIENT_BYTES in all");
    }
    for (int i = 0; i < GOLDEN_DOT_SCENES; i++) {
        struct ih_frame frame;
        bool has_ambient = false;
        const char *name =
            golden_scene_dots(i, &head.rig, samples, ambient_samples, &frame, &has_ambient);
        struct ih_frame ambient = frame;
        ambient.samples = ambient_samples;
        if (!run_frame(set, name, &frame, has_ambient ? &ambient : NULL)) {
            return false;
        }
    }
    return true;
}

static bool run_range_scenes(struct set *set)
{
    golden_scene_range_rig(&calibration);
    bool good = start_set(set);
    for (int i = 0; i < GOLDEN_RANGE_SCENES && good; i++) {
        struct ih_frame frame;
        const char *name = golden_scene_range(i, &calibration, samples, &frame);
        good = run_frame(set, name, &frame, NULL);
    }
    return good;
}

/* One record of the file; the made-up frames of a rig follow its recorded ones. */
static bool run_record(struct set *set, uint32_t kind)
{
    if (kind != GOLDEN_FRAME && set->number > 0 && !run_dot_scenes(set)) {
        return false;
    }
    switch (kind) {
    case GOLDEN_END:
        return true;
    case GOLDEN_RIG:
        return read_rig() && start_set(set);
    case GOLDEN_FRAME:
        return set->number > 0 ? run_recorded(set) : fail("rigs before the first frame:", 0, "one");
    default:
        return fail("a record is of kind", kind, "0, 1 or 2");
    }
}

bool golden_run(void)
{
    struct set set = {.number = 0};
    uint32_t word = 0;
    if (!read_word(&word)) {
        return false;
    }
    if (word != GOLDEN_MAGIC) {
        return fail("the file begins with", word, "GOLDEN_MAGIC: a file of golden_pack");
    }
    do {
        if (!read_word(&word) || !run_record(&set, word)) {
            return false;
        }
    } while (word != GOLDEN_END);
    return run_range_scenes(&set);
}
