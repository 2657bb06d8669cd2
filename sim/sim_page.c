#include "sim_page.h"

#include <errno.h>
#include <inttypes.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "app_write.h"
#include "replay/hal_lines.h"
#include "sim_report.h"
#include "sim_table.h"
#include "sim_trace.h"

#define ZLIB_LEVEL 6
/* Room for a point, a process number and a zero. */
#define PART_SUFFIX_MAX 24
/* Of another run's file that is none, each line is wrong. */
#define OTHER_BAD_MAX 3

static void begin(struct sim_page *page, const char *attributes)
{
    fprintf(page->file, "<script type=\"application/json\" %s>", attributes);
}

static void end(struct sim_page *page)
{
    fputs("</script>\n", page->file);
}

/* JSON into an element: '<' stands in strings alone, where it can be said otherwise. */
static void take_json(void *context, const char *text, size_t length)
{
    FILE *file = context;
    for (size_t i = 0; i < length; i++) {
        if (text[i] == '<') {
            fputs("\\u003c", file);
        } else {
            fputc(text[i], file);
        }
    }
}

static struct app_write json_writer(struct sim_page *page)
{
    return (struct app_write){.take = take_json, .context = page->file};
}

static void take_memory(void *context, const char *text, size_t length)
{
    struct sim_page *page = context;
    if (length > page->capacity - page->length) {
        page->capacity = (page->length + length) * 2;
        page->text = sim_report_grow(page->text, page->capacity, 1);
    }
    memcpy(page->text + page->length, text, length);
    page->length += length;
}

static void put_base64(FILE *file, const uint8_t *data, size_t size)
{
    static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        size_t left = size - i;
        uint32_t bits = (uint32_t)data[i] << 16;
        bits |= left > 1 ? (uint32_t)data[i + 1] << 8 : 0;
        bits |= left > 2 ? (uint32_t)data[i + 2] : 0;
        fputc(digit[bits >> 18], file);
        fputc(digit[bits >> 12 & 63], file);
        fputc(left > 1 ? digit[bits >> 6 & 63] : '=', file);
        fputc(left > 2 ? digit[bits & 63] : '=', file);
    }
}

static void put_trace(struct sim_page *page, const struct sim_page_frame *frame)
{
    struct app_write write = {.take = take_memory, .context = page};
    page->length = 0;
    sim_trace_write(&write, frame->frame, frame->view, frame->head);
    uLongf packed_size = compressBound((uLong)page->length);
    uint8_t *packed = sim_report_grow(NULL, packed_size, 1);
    int status =
        compress2(packed, &packed_size, (const Bytef *)page->text, (uLong)page->length, ZLIB_LEVEL);
    if (status != Z_OK) {
        sim_report_grow(NULL, SIZE_MAX, 1); /* the buffer is large enough: there is no memory */
    }
    begin(page, "class=\"trace\"");
    put_base64(page->file, packed, packed_size);
    end(page);
    free(packed);
}

static void write_point(struct app_write *write, const char *key, const int32_t value_mm_q8[3])
{
    app_write_key(write, key);
    app_write_open(write, '[');
    for (int axis = 0; axis < 3; axis++) {
        app_write_int(write, value_mm_q8[axis]);
    }
    app_write_close(write, ']');
}

/* null where the truth says nothing about one head; else a head or false. */
static void write_truth(struct app_write *write, const struct sim_truth_frame *truth)
{
    app_write_key(write, "truth");
    if (truth == NULL || truth->head == SIM_TRUTH_UNSCORED) {
        app_write_null(write);
        return;
    }
    app_write_open(write, '{');
    app_write_key(write, "head");
    app_write_bool(write, truth->head == SIM_TRUTH_HEAD);
    if (truth->head == SIM_TRUTH_HEAD) {
        write_point(write, "centre_mm_q8", truth->centre_mm_q8);
    }
    app_write_close(write, '}');
}

static void write_verdict(struct app_write *write, const struct sim_verdict *verdict)
{
    app_write_key(write, "verdict");
    if (!verdict->scored) {
        app_write_null(write);
        return;
    }
    app_write_open(write, '{');
    app_write_key(write, "head_there");
    app_write_bool(write, verdict->head_there);
    app_write_key(write, "detected");
    app_write_bool(write, verdict->detected);
    app_write_key(write, "selected_right");
    app_write_bool(write, verdict->selected_right);
    app_write_key(write, "outcome");
    app_write_string(write, sim_table_outcome(verdict->outcome));
    if (verdict->error_known) {
        app_write_key(write, "error_mm");
        app_write_decimal(write, app_text_fixed(verdict->error_mm_q8, 8, 0));
    }
    app_write_close(write, '}');
}

/* After each frame: errno is soon another call's. */
static void note_error(struct sim_page *page)
{
    if (page->error_number == 0 && ferror(page->file)) {
        page->error_number = errno;
    }
}

static void put_record(struct sim_page *page, const struct app_record *record)
{
    fprintf(page->file, "{\"dir\":%zu,\"record\":", page->dir_count - 1);
    take_json(page->file, record->text, record->length);
}

bool sim_page_frame(struct sim_page *page, const struct sim_page_frame *frame,
                    struct hal_error *error)
{
    begin(page, "class=\"frame\"");
    put_record(page, frame->record);
    struct app_write write = json_writer(page);
    write.comma = true;
    write_truth(&write, frame->truth);
    write_verdict(&write, frame->verdict);
    app_write_close(&write, '}');
    end(page);
    page->frame_count++;
    put_trace(page, frame);
    bool good = sim_image_encode(&page->image, frame->view, &frame->head->rig, error);
    begin(page, "class=\"image\"");
    if (good) {
        put_base64(page->file, page->image.jpeg, page->image.jpeg_size);
    }
    end(page);
    note_error(page);
    return good;
}

void sim_page_lost(struct sim_page *page, const struct app_record *record)
{
    begin(page, "class=\"frame\"");
    put_record(page, record);
    fputs("}", page->file);
    end(page);
    page->frame_count++;
}

static void write_camera(struct app_write *write, const struct ih_rig *rig)
{
    const struct ih_calibration *c = &rig->calibration;
    app_write_key(write, "camera");
    app_write_open(write, '{');
    app_write_int_field(write, "width", c->width);
    app_write_int_field(write, "height", c->height);
    app_write_int_field(write, "fx_px_q16", c->fx_px_q16);
    app_write_int_field(write, "fy_px_q16", c->fy_px_q16);
    app_write_int_field(write, "cx_px_q16", c->cx_px_q16);
    app_write_int_field(write, "cy_px_q16", c->cy_px_q16);
    app_write_int_field(write, "k1_q24", c->k1_q24);
    app_write_int_field(write, "k2_q24", c->k2_q24);
    app_write_int_field(write, "p1_q24", c->p1_q24);
    app_write_int_field(write, "p2_q24", c->p2_q24);
    app_write_int_field(write, "k3_q24", c->k3_q24);
    if (!rig->is_level) {
        app_write_key(write, "level_q30");
        app_write_open(write, '[');
        for (int i = 0; i < 9; i++) {
            app_write_int(write, rig->level_q30[i / 3][i % 3]);
        }
        app_write_close(write, ']');
    }
    app_write_close(write, '}');
}

/* What scores are compared with; the paper's limits are in each trace. */
static void write_limits(struct app_write *write, const struct ih_tracks_params *params)
{
    app_write_key(write, "limits");
    app_write_open(write, '{');
    app_write_int_field(write, "start_head_logit_q10", params->start_head_logit_q10);
    app_write_int_field(write, "mature_findings", params->mature_detections);
    app_write_int_field(write, "accept_logit_q10", params->accept_logit_q10);
    app_write_int_field(write, "drop_logit_q10", params->drop_logit_q10);
    app_write_int_field(write, "moved_mm", params->moved_mm);
    app_write_int_field(write, "moved_logit_q10", params->moved_logit_q10);
    app_write_close(write, '}');
}

/* A record of the other run as it is compared; what makes none goes to the report. */
static void put_other(struct sim_page *page, const cJSON *record)
{
    char *text = cJSON_PrintUnformatted(record);
    if (text == NULL) {
        sim_report_grow(NULL, SIZE_MAX, 1); /* there is no memory */
        return;
    }
    begin(page, "class=\"other\"");
    take_json(page->file, text, strlen(text));
    end(page);
    cJSON_free(text);
}

static bool is_record(const cJSON *line)
{
    return cJSON_IsString(cJSON_GetObjectItemCaseSensitive(line, "file")) &&
           (cJSON_IsArray(cJSON_GetObjectItemCaseSensitive(line, "hypotheses")) ||
            cJSON_IsString(cJSON_GetObjectItemCaseSensitive(line, "error")));
}

static void put_others(struct sim_page *page, const char *path, struct sim_report *report)
{
    struct hal_lines lines;
    struct hal_error error;
    cJSON *line = NULL;
    int bad_count = 0;
    enum hal_lines_next next = HAL_LINES_END;
    if (!hal_lines_open(&lines, path, &error)) {
        sim_report_error(report, path, "%s", error.text);
        return;
    }
    while (bad_count < OTHER_BAD_MAX &&
           (next = hal_lines_next(&lines, &line, &error)) != HAL_LINES_END) {
        if (next == HAL_LINES_BAD) {
            sim_report_error(report, path, "%s", error.text);
            bad_count++;
            continue;
        }
        if (is_record(line)) {
            put_other(page, line);
        } else {
            sim_report_error(report, path,
                             "line %ld: no record, expected a line of host_sim --json",
                             lines.number);
            bad_count++;
        }
        cJSON_Delete(line);
    }
    if (bad_count == OTHER_BAD_MAX) {
        sim_report_error(report, path, "%d lines that are no records: it is read no further",
                         bad_count);
    }
    hal_lines_close(&lines);
}

void sim_page_run(struct sim_page *page, const struct sim_options *options,
                  struct sim_report *report)
{
    struct app_write write = json_writer(page);
    begin(page, "class=\"run\"");
    app_write_open(&write, '{');
    app_write_key(&write, "version");
    app_write_string(&write, ISOHEAD_VERSION);
    app_write_key(&write, "command");
    app_write_open(&write, '[');
    for (int i = 1; i < options->word_count; i++) {
        app_write_string(&write, options->words[i]);
    }
    app_write_close(&write, ']');
    if (options->against != NULL) {
        app_write_key(&write, "against");
        app_write_string(&write, options->against);
    }
    app_write_close(&write, '}');
    end(page);
    if (options->against != NULL) {
        put_others(page, options->against, report);
    }
}

void sim_page_dir(struct sim_page *page, const struct sim_dir *dir, const char *rig_path,
                  const struct isohead *head)
{
    const struct ih_calibration *rig = &head->rig.calibration;
    struct app_write write = json_writer(page);
    begin(page, "class=\"dir\"");
    app_write_open(&write, '{');
    app_write_key(&write, "label");
    app_write_string(&write, dir->label);
    app_write_key(&write, "path");
    app_write_string(&write, dir->path);
    app_write_key(&write, "rig");
    app_write_string(&write, rig_path);
    app_write_int_field(&write, "near_mm", rig->near_mm);
    app_write_int_field(&write, "far_mm", rig->far_mm);
    app_write_key(&write, "range");
    app_write_bool(&write, rig->kind == IH_RIG_RANGE);
    app_write_key(&write, "paper");
    app_write_bool(&write, head->params.is_paper);
    write_camera(&write, &head->rig);
    write_limits(&write, &head->params.tracks);
    app_write_close(&write, '}');
    end(page);
    page->dir_count++;
}

static void write_counts(struct app_write *write, const char *key, const struct sim_counts *counts)
{
    app_write_key(write, key);
    app_write_open(write, '{');
    app_write_int_field(write, "frames", counts->frame_count);
    app_write_int_field(write, "detected", counts->detected_count);
    app_write_int_field(write, "right", counts->selected_right_count);
    for (int outcome = 0; outcome < SIM_OUTCOMES; outcome++) {
        app_write_int_field(write, sim_table_outcome((enum sim_outcome)outcome),
                            counts->outcome_count[outcome]);
    }
    app_write_close(write, '}');
}

void sim_page_row(struct sim_page *page, const char *label, struct sim_score *score)
{
    static const int percent[] = {50, 90};
    struct app_write write = json_writer(page);
    begin(page, "class=\"row\"");
    app_write_open(&write, '{');
    app_write_key(&write, "label");
    app_write_string(&write, label);
    write_counts(&write, "with_head", &score->with_head);
    write_counts(&write, "empty", &score->empty);
    app_write_key(&write, "error_mm");
    app_write_open(&write, '[');
    for (size_t i = 0; score->error_mm_q8.count > 0 && i < sizeof percent / sizeof *percent; i++) {
        app_write_decimal(&write,
                          app_text_fixed(sim_list_rank(&score->error_mm_q8, percent[i]), 8, 0));
    }
    app_write_close(&write, ']');
    app_write_close(&write, '}');
    end(page);
}

/* What a signal's handler removes; NULL: nothing. */
static const char *volatile unfinished_path;

static void remove_unfinished(int signal_number)
{
    const char *path = unfinished_path;
    if (path != NULL) {
        (void)unlink(path);
    }
    (void)raise(signal_number); /* which then does what it does without a handler */
}

/* A run that is stopped, or whose reader has gone, leaves nothing half done. What is ignored stays
 * ignored: nohup and shells in the background count on it. */
static void watch_signals(void)
{
    static const int ending[] = {SIGHUP, SIGINT, SIGPIPE, SIGTERM};
    for (size_t i = 0; i < sizeof ending / sizeof *ending; i++) {
        struct sigaction old;
        struct sigaction removing = {.sa_handler = remove_unfinished,
                                     .sa_flags = (int)SA_RESETHAND};
        sigemptyset(&removing.sa_mask);
        if (sigaction(ending[i], NULL, &old) == 0 && old.sa_handler == SIG_DFL) {
            (void)sigaction(ending[i], &removing, NULL);
        }
    }
}

static bool fail(struct hal_error *error, int error_number)
{
    return hal_fail(error, "the report cannot be written: %s", strerror(error_number));
}

static void free_all(struct sim_page *page)
{
    unfinished_path = NULL;
    sim_image_free(&page->image);
    free(page->part_path);
    free(page->text);
    *page = (struct sim_page){.file = NULL};
}

bool sim_page_open(struct sim_page *page, const char *path, struct hal_error *error)
{
    struct stat status;
    if (stat(path, &status) == 0 && !S_ISREG(status.st_mode)) {
        return hal_fail(error, "the report needs a regular file, expected no device or pipe");
    }
    size_t size = strlen(path) + PART_SUFFIX_MAX;
    *page = (struct sim_page){.path = path, .part_path = sim_report_grow(NULL, size, 1)};
    snprintf(page->part_path, size, "%s.%ld", path, (long)getpid());
    unfinished_path = page->part_path;
    watch_signals();
    page->file = fopen(page->part_path, "w");
    if (page->file == NULL) {
        fail(error, errno);
        free_all(page);
        return false;
    }
    fwrite(sim_page_head, 1, sim_page_head_size, page->file);
    return true;
}

/* True: it has its name. */
static bool finish(struct sim_page *page, struct hal_error *error)
{
    fwrite(sim_page_tail, 1, sim_page_tail_size, page->file);
    bool good = fflush(page->file) == 0 && !ferror(page->file);
    /* Closing writes too, and must be done in any case. */
    good = fclose(page->file) == 0 && good;
    if (good && page->frame_count == 0) {
        return hal_fail(error, "no report is written: there is no frame for it");
    }
    good = good && rename(page->part_path, page->path) == 0;
    return good || fail(error, page->error_number != 0 ? page->error_number : errno);
}

bool sim_page_close(struct sim_page *page, struct hal_error *error)
{
    bool good = finish(page, error);
    if (!good) {
        (void)unlink(page->part_path);
    }
    free_all(page);
    return good;
}
