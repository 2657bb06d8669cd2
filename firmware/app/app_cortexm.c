/* isohead_cortexm RIG FRAME... - the records of frames (docs/contract.md) on a Cortex-M that hangs on a
 * debugger or an emulator: RIG is a blob (ih_rig_blob.h), each FRAME a binary PGM (P5), 40 ms after the one
 * before. The names stand on the command line, apart by blanks.
 *
 * Exit status as host_sim's: 0 every frame was processed, 1 something was unreadable or wrong (reported on
 * standard error; the other frames are still processed, but none without a rig), 2 wrong usage; 3 a
 * fault of the processor.
 */
#include "app_record.h"
#include "app_view.h"
#include "cortexm/hal_semihosting.h"
#include "hal_text.h"
#include "rig/ih_rig_blob.h"
#include "replay/hal_pgm.h"

#define FRAME_US 40000
#define LINE_BYTES 8192
#define MESSAGE_BYTES 1024
/* A header with comments. */
#define HEADER_BYTES 4096
/* Every frame of one byte a sample; of two bytes those that take no more. */
#define FRAME_BYTES (IH_FRAME_WIDTH_MAX * IH_FRAME_HEIGHT_MAX + HEADER_BYTES)

enum status { STATUS_GOOD = 0, STATUS_INPUT = 1, STATUS_USAGE = 2 };

/* The only instance, and what a frame is read into. */
static struct isohead head;
static uint16_t frame_memory[FRAME_BYTES / 2];
static struct app_record record;

/* A message about a file; always false. */
static bool fail(const char *name, const char *reason)
{
    char memory[MESSAGE_BYTES];
    struct hal_text text = hal_text_begin(memory, sizeof memory);
    hal_text_put(&text, "isohead_cortexm: ");
    hal_text_put(&text, name);
    hal_text_put(&text, ": ");
    hal_text_put(&text, reason);
    hal_text_put(&text, "\n");
    (void)hal_semihosting_complain(text.text, text.length);
    return false;
}

/* The first word of a line, cut off with a zero byte; *line goes on behind it. NULL: there is none. */
static char *next_word(char **line)
{
    char *at = *line;
    while (*at == ' ') {
        at++;
    }
    char *word = at;
    while (*at != 0 && *at != ' ') {
        at++;
    }
    *line = *at == 0 ? at : at + 1;
    *at = 0;
    return *word == 0 ? NULL : word;
}

static bool start_core(const char *name)
{
    static uint8_t blob[IH_RIG_BLOB_BYTES];
    static struct ih_calibration calibration;
    struct hal_error error;
    size_t length = 0;
    int32_t bad_slot = IH_NONE;
    if (!hal_semihosting_load(name, blob, sizeof blob, &length, &error)) {
        return fail(name, error.text);
    }
    enum ih_err err = ih_rig_blob_decode(blob, length, &calibration);
    if (err == IH_OK) {
        err = isohead_init(&head, &calibration, &bad_slot);
    }
    return err == IH_OK || fail(name, ih_err_text(err));
}

static bool read_frame(const char *path, struct hal_frame *frame, struct hal_error *error)
{
    struct hal_pgm pgm;
    size_t length = 0;
    uint8_t *data = (uint8_t *)frame_memory;
    if (!hal_semihosting_load(path, data, sizeof frame_memory, &length, error) ||
        !hal_pgm_decode(data, length, &pgm, error)) {
        return false;
    }
    frame->samples = frame_memory;
    frame->width = pgm.width;
    frame->height = pgm.height;
    frame->stride_bytes = pgm.width * pgm.bytes_per_sample;
    frame->bytes_per_sample = pgm.bytes_per_sample;
    frame->maximum = pgm.maximum;
    return true;
}

static const char *last_part(const char *path)
{
    const char *part = path;
    for (; *path != 0; path++) {
        part = *path == '/' ? path + 1 : part;
    }
    return part;
}

/* False: the frame is lost; its record says why. */
static bool process(const char *path, int64_t time_us)
{
    struct hal_error error;
    struct hal_frame frame = {.name = last_part(path), .time_us = time_us, .laser = true};
    bool good = read_frame(path, &frame, &error);
    if (good) {
        struct ih_frame view = app_view_of(&frame);
        enum ih_err err = isohead_frame(&head, &view, NULL, time_us);
        good = err == IH_OK;
        if (!good) {
            app_view_explain(&frame, &head.rig.calibration, err, &error);
        }
    }
    bool fits = good ? app_record_frame(&record, &frame, &head, NULL)
                     : app_record_error(&record, frame.name, error.text);
    if (!good) {
        fail(path, error.text);
    }
    if (!fits || !hal_semihosting_write(record.text, record.length)) {
        return fail(path, "its record cannot be written");
    }
    return good;
}

int main(void)
{
    static char memory[LINE_BYTES];
    char *line = memory;
    if (!hal_semihosting_command_line(memory, sizeof memory)) {
        fail("command line", "none, or one that is too long");
        return STATUS_USAGE;
    }
    (void)next_word(&line); /* the program's own name */
    const char *rig = next_word(&line);
    const char *path = next_word(&line);
    if (path == NULL) {
        fail("command line", "expected RIG FRAME...");
        return STATUS_USAGE;
    }
    if (!start_core(rig)) {
        return STATUS_INPUT;
    }
    enum status status = STATUS_GOOD;
    for (int64_t time_us = 0; path != NULL; path = next_word(&line), time_us += FRAME_US) {
        if (!process(path, time_us)) {
            status = STATUS_INPUT;
        }
    }
    return (int)status;
}
