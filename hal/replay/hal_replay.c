#include "replay/hal_replay.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "hal_file.h"
#include "replay/hal_lines.h"
#include "replay/hal_pgm.h"
#include "replay/hal_png.h"
#include "replay/hal_xyz.h"

#define LIST_NAME "frames.jsonl"
#define PGM_SUFFIX ".pgm"
#define PNG_SUFFIX ".png"
#define POINTS_SUFFIX ".xyz"
/* Times beyond this are not exact in JSON's numbers. */
#define TIME_MAX_US ((double)((int64_t)1 << 53))

static char *copy_text(const char *text)
{
    size_t size = strlen(text) + 1;
    char *copy = malloc(size);
    if (copy != NULL) {
        memcpy(copy, text, size);
    }
    return copy;
}

/* In any case: cameras and other systems write .PGM. */
static bool has_suffix(const char *name, const char *suffix)
{
    size_t length = strlen(name);
    size_t suffix_length = strlen(suffix);
    return length > suffix_length && strcasecmp(name + length - suffix_length, suffix) == 0;
}

bool hal_replay_is_frame(const char *name, bool with_lists)
{
    return name[0] != '.' && strchr(name, '/') == NULL &&
           (has_suffix(name, PGM_SUFFIX) || has_suffix(name, PNG_SUFFIX) ||
            (with_lists && has_suffix(name, POINTS_SUFFIX)));
}

/* What a frame is called, for messages. */
static const char *frame_names(const struct hal_replay *replay)
{
    return replay->with_lists ? "*.pgm, *.png, *.xyz" : "*.pgm, *.png";
}

/* Index of the first entry whose name is not less. */
static size_t find_position(const struct hal_replay *replay, const char *name)
{
    size_t low = 0;
    size_t high = replay->entry_count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (strcmp(replay->entry[middle].name, name) < 0) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

static struct hal_replay_entry *find_entry(const struct hal_replay *replay, const char *name)
{
    size_t place = find_position(replay, name);
    if (place < replay->entry_count && strcmp(replay->entry[place].name, name) == 0) {
        return &replay->entry[place];
    }
    return NULL;
}

/* A new entry in its place. False: there is no memory. */
static bool add_entry(struct hal_replay *replay, const char *name)
{
    if (replay->entry_count == replay->entry_capacity) {
        size_t capacity = replay->entry_capacity == 0 ? 64 : replay->entry_capacity * 2;
        struct hal_replay_entry *grown = realloc(replay->entry, capacity * sizeof *grown);
        if (grown == NULL) {
            return false;
        }
        replay->entry = grown;
        replay->entry_capacity = capacity;
    }
    char *copy = copy_text(name);
    if (copy == NULL) {
        return false;
    }
    size_t place = find_position(replay, name);
    struct hal_replay_entry *entry = &replay->entry[place];
    memmove(entry + 1, entry, (replay->entry_count - place) * sizeof *entry);
    *entry = (struct hal_replay_entry){.name = copy, .laser = true};
    replay->entry_count++;
    return true;
}

static bool read_names(struct hal_replay *replay, struct hal_error *error)
{
    DIR *dir = opendir(replay->dir);
    if (dir == NULL) {
        return hal_fail(error, "%s", strerror(errno));
    }
    bool good = true;
    struct dirent *item = NULL;
    errno = 0; /* the end and an error differ in it alone */
    while (good && (item = readdir(dir)) != NULL) {
        if (hal_replay_is_frame(item->d_name, replay->with_lists)) {
            good = add_entry(replay, item->d_name);
        }
        errno = 0;
    }
    int reason = errno;
    closedir(dir);
    if (!good) {
        return hal_fail(error, "no memory for the list of frames");
    }
    if (reason != 0) {
        return hal_fail(error, "the list of its files ends with an error: %s", strerror(reason));
    }
    if (replay->entry_count == 0) {
        return hal_fail(error, "no frames (%s) in this directory", frame_names(replay));
    }
    return true;
}

/* Time and laser of one line. False: *error says which field is wrong. */
static bool read_fields(const cJSON *line, struct hal_replay_entry *entry, struct hal_error *error)
{
    const cJSON *time = cJSON_GetObjectItemCaseSensitive(line, "time_us");
    const cJSON *laser = cJSON_GetObjectItemCaseSensitive(line, "laser");
    if (laser != NULL) {
        if (!cJSON_IsBool(laser)) {
            return hal_fail(error, "laser: expected true or false");
        }
        entry->laser = cJSON_IsTrue(laser);
    }
    if (time == NULL) {
        return hal_fail(error, "no time_us");
    }
    if (!cJSON_IsNumber(time)) {
        return hal_fail(error, "time_us: expected a number");
    }
    double value = time->valuedouble;
    if (!(value >= -TIME_MAX_US && value <= TIME_MAX_US) || (double)(int64_t)value != value) {
        return hal_fail(error, "time_us is %g, expected a whole number within +-2^53", value);
    }
    entry->time_us = (int64_t)value;
    return true;
}

/* The frame that a line names; NULL with *error when there is no such name. */
static const char *read_name(const struct hal_replay *replay, const cJSON *line,
                             struct hal_error *error)
{
    const char *name = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(line, "file"));
    if (name == NULL) {
        hal_fail(error, "no file, expected the name of a frame");
        return NULL;
    }
    if (!hal_replay_is_frame(name, replay->with_lists)) {
        hal_fail(error, "file is \"%.100s\", expected the name of a frame (%s)", name,
                 frame_names(replay));
        return NULL;
    }
    return name;
}

/* The text may be lost for want of memory; that the entry is bad is not. */
static void spoil(struct hal_replay_entry *entry, const char *text)
{
    entry->bad = true;
    entry->error = copy_text(text);
}

/* Note what one line says in the entry that it names. False: it names none that it may. */
static bool read_line(struct hal_replay *replay, const cJSON *line, long number,
                      struct hal_error *error)
{
    const char *name = read_name(replay, line, error);
    if (name == NULL) {
        return false;
    }
    struct hal_replay_entry *entry = find_entry(replay, name);
    if (entry == NULL) {
        replay->absent_line = replay->absent_count == 0 ? number : replay->absent_line;
        replay->absent_count++;
        return true;
    }
    if (entry->listed) {
        return hal_fail(error, "%.100s was listed before; this line is ignored", name);
    }
    entry->listed = true;
    if (!read_fields(line, entry, error)) {
        char message[HAL_ERROR_MAX + 64];
        snprintf(message, sizeof message, LIST_NAME " line %ld: %s", number, error->text);
        spoil(entry, message);
    }
    return true;
}

static void read_lines(struct hal_replay *replay, struct hal_lines *lines, const char *path,
                       const struct hal_log *log)
{
    struct hal_error error;
    cJSON *line = NULL;
    enum hal_lines_next next = HAL_LINES_END;
    while ((next = hal_lines_next(lines, &line, &error)) != HAL_LINES_END) {
        if (next == HAL_LINES_BAD) {
            log->error(log->context, path, error.text);
            continue;
        }
        if (!read_line(replay, line, lines->number, &error)) {
            char message[HAL_ERROR_MAX + 64];
            snprintf(message, sizeof message, "line %ld: %s", lines->number, error.text);
            log->error(log->context, path, message);
        }
        cJSON_Delete(line);
    }
    if (replay->absent_count > 0) {
        char message[HAL_ERROR_MAX];
        snprintf(message, sizeof message,
                 "%zu of its frames are not in this directory, the first in line %ld",
                 replay->absent_count, replay->absent_line);
        log->error(log->context, path, message);
    }
}

/* A frame that was taken before the one before it is an error of its own; the time goes on from
 * there, so that one slip in a recording costs one frame. */
static void check_order(struct hal_replay *replay)
{
    const struct hal_replay_entry *before = NULL;
    for (size_t i = 0; i < replay->entry_count; i++) {
        struct hal_replay_entry *entry = &replay->entry[i];
        if (entry->bad || !entry->listed) {
            continue;
        }
        if (before != NULL && entry->time_us < before->time_us) {
            char message[HAL_ERROR_MAX];
            snprintf(message, sizeof message,
                     LIST_NAME ": time_us %lld is before %lld of the frame before it",
                     (long long)entry->time_us, (long long)before->time_us);
            spoil(entry, message);
        }
        before = entry;
    }
}

static void read_list(struct hal_replay *replay, const struct hal_log *log)
{
    struct hal_error error = {"no memory"};
    struct hal_lines lines;
    char *path = hal_file_join(replay->dir, LIST_NAME);
    if (path != NULL && !hal_file_exists(path)) {
        free(path);
        return;
    }
    if (path != NULL && hal_lines_open(&lines, path, &error)) {
        replay->listed = true;
        read_lines(replay, &lines, path, log);
        check_order(replay);
        hal_lines_close(&lines);
    } else {
        log->error(log->context, path == NULL ? LIST_NAME : path, error.text);
    }
    free(path);
}

static bool load_pgm(const char *path, struct hal_frame *frame, struct hal_error *error)
{
    size_t size = 0;
    struct hal_pgm pgm = {0};
    uint8_t *bytes = NULL;
    if (!hal_file_read(path, HAL_PGM_FILE_MAX, &bytes, &size, error)) {
        return false;
    }
    if (!hal_pgm_decode(bytes, size, &pgm, error)) {
        free(bytes);
        return false;
    }
    frame->samples = bytes;
    frame->width = pgm.width;
    frame->height = pgm.height;
    frame->stride_bytes = pgm.width * pgm.bytes_per_sample;
    frame->bytes_per_sample = pgm.bytes_per_sample;
    frame->maximum = pgm.maximum;
    return true;
}

static bool load_png(const char *path, struct hal_frame *frame, struct hal_error *error)
{
    size_t size = 0;
    struct hal_png png = {.samples = NULL};
    uint8_t *bytes = NULL;
    if (!hal_file_read(path, HAL_PNG_FILE_MAX, &bytes, &size, error)) {
        return false;
    }
    bool good = hal_png_decode(bytes, size, &png, error);
    free(bytes);
    frame->samples = png.samples;
    frame->width = png.width;
    frame->height = png.height;
    frame->stride_bytes = png.width * png.bytes_per_sample;
    frame->bytes_per_sample = png.bytes_per_sample;
    frame->maximum = png.maximum;
    return good;
}

static bool load_points(const char *path, struct hal_frame *frame, struct hal_error *error)
{
    uint8_t *text = NULL;
    size_t size = 0;
    struct hal_xyz xyz = {0};
    if (!hal_file_read(path, HAL_XYZ_FILE_MAX, &text, &size, error)) {
        return false;
    }
    bool good = hal_xyz_decode((const char *)text, size, &xyz, error);
    free(text);
    frame->point_mm_q8 = (const int32_t(*)[3])xyz.point_mm_q8;
    frame->point_count = xyz.point_count;
    return good;
}

/* A frame's content from the disk. */
static bool load_frame(struct hal_replay *replay, const char *name, struct hal_frame *frame,
                       struct hal_error *error)
{
    char *path = hal_file_join(replay->dir, name);
    if (path == NULL) {
        return hal_fail(error, "no memory for this file");
    }
    bool good = has_suffix(name, POINTS_SUFFIX) ? load_points(path, frame, error)
                : has_suffix(name, PNG_SUFFIX)  ? load_png(path, frame, error)
                                                : load_pgm(path, frame, error);
    free(path);
    return good;
}

static enum hal_next next_frame(void *context, struct hal_frame *frame, struct hal_error *error)
{
    struct hal_replay *replay = context;
    if (replay->next_index == replay->entry_count) {
        return HAL_NEXT_END;
    }
    const struct hal_replay_entry *entry = &replay->entry[replay->next_index];
    *frame = (struct hal_frame){.name = entry->name,
                                .time_us = entry->time_us,
                                .sequence = (int64_t)replay->next_index,
                                .laser = entry->laser};
    replay->next_index++;
    if (entry->bad) {
        hal_fail(error, "%s", entry->error == NULL ? "no memory" : entry->error);
        return HAL_NEXT_BAD;
    }
    if (replay->listed && !entry->listed) {
        hal_fail(error, "not listed in " LIST_NAME);
        return HAL_NEXT_BAD;
    }
    return load_frame(replay, entry->name, frame, error) ? HAL_NEXT_FRAME : HAL_NEXT_BAD;
}

static void release_frame(void *context, const struct hal_frame *frame)
{
    (void)context;
    free((void *)frame->samples);
    free((void *)frame->point_mm_q8);
}

bool hal_replay_open(struct hal_replay *replay, const char *dir, bool with_lists,
                     const struct hal_log *log, struct hal_error *error)
{
    *replay = (struct hal_replay){
        .camera = {.context = replay, .next = next_frame, .release = release_frame},
        .with_lists = with_lists,
    };
    replay->dir = copy_text(dir);
    if (replay->dir == NULL) {
        return hal_fail(error, "no memory");
    }
    if (!read_names(replay, error)) {
        hal_replay_close(replay);
        return false;
    }
    read_list(replay, log);
    if (!replay->listed) {
        for (size_t i = 0; i < replay->entry_count; i++) {
            replay->entry[i].time_us = (int64_t)i * HAL_REPLAY_STEP_US;
        }
    }
    return true;
}

void hal_replay_close(struct hal_replay *replay)
{
    for (size_t i = 0; i < replay->entry_count; i++) {
        free(replay->entry[i].name);
        free(replay->entry[i].error);
    }
    free(replay->entry);
    free(replay->dir);
    *replay = (struct hal_replay){.next_index = 0};
}

bool hal_replay_has(const struct hal_replay *replay, const char *name)
{
    return find_entry(replay, name) != NULL;
}

/* Length without the suffix, which each frame has. */
static size_t stem_length(const char *name)
{
    return (size_t)(strrchr(name, '.') - name);
}

size_t hal_replay_stem(const struct hal_replay *replay, const char *name)
{
    const size_t length = stem_length(name);
    bool is_shared = false;
    for (size_t i = 0; !is_shared && i < replay->entry_count; i++) {
        const char *other = replay->entry[i].name;
        is_shared =
            strncmp(other, name, length) == 0 &&
            (other[length] == 0 || (stem_length(other) == length && strcmp(other, name) != 0));
    }
    return is_shared ? strlen(name) : length;
}
