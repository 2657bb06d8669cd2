#include "replay/hal_replay.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hal_file.h"
#include "replay/hal_lines.h"
#include "replay/hal_pgm.h"
#include "replay/hal_xyz.h"

#define LIST_NAME "frames.jsonl"
#define FRAME_SUFFIX ".pgm"
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

static bool has_suffix(const char *name, const char *suffix)
{
    size_t length = strlen(name);
    size_t suffix_length = strlen(suffix);
    return length > suffix_length && strcmp(name + length - suffix_length, suffix) == 0;
}

/* Frames are what the shell's *.pgm matches, and *.xyz where lists are asked for. */
static bool is_frame_name(const struct hal_replay *replay, const char *name)
{
    return name[0] != '.' && strchr(name, '/') == NULL &&
           (has_suffix(name, FRAME_SUFFIX) ||
            (replay->with_lists && has_suffix(name, POINTS_SUFFIX)));
}

/* What a frame is called, for messages. */
static const char *frame_names(const struct hal_replay *replay)
{
    return replay->with_lists ? "*" FRAME_SUFFIX ", *" POINTS_SUFFIX : "*" FRAME_SUFFIX;
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

/* A new entry in its place; NULL when there is no memory. */
static struct hal_replay_entry *add_entry(struct hal_replay *replay, const char *name)
{
    if (replay->entry_count == replay->entry_capacity) {
        size_t capacity = replay->entry_capacity == 0 ? 64 : replay->entry_capacity * 2;
        struct hal_replay_entry *grown = realloc(replay->entry, capacity * sizeof *grown);
        if (grown == NULL) {
            return NULL;
        }
        replay->entry = grown;
        replay->entry_capacity = capacity;
    }
    char *copy = copy_text(name);
    if (copy == NULL) {
        return NULL;
    }
    size_t place = find_position(replay, name);
    struct hal_replay_entry *entry = &replay->entry[place];
    memmove(entry + 1, entry, (replay->entry_count - place) * sizeof *entry);
    *entry = (struct hal_replay_entry){.name = copy, .laser = true};
    replay->entry_count++;
    return entry;
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
        if (is_frame_name(replay, item->d_name)) {
            struct hal_replay_entry *entry = add_entry(replay, item->d_name);
            good = entry != NULL;
            if (good) {
                entry->on_disk = true;
            }
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

/* The entry that a line names, from now on listed; NULL with *error when there is none to take. */
static struct hal_replay_entry *claim_entry(struct hal_replay *replay, const cJSON *line,
                                            struct hal_error *error)
{
    const cJSON *file = cJSON_GetObjectItemCaseSensitive(line, "file");
    if (!cJSON_IsString(file)) {
        hal_fail(error, "no file, expected the name of a frame");
        return NULL;
    }
    const char *name = file->valuestring;
    if (!is_frame_name(replay, name)) {
        hal_fail(error, "file is \"%.100s\", expected the name of a %s", name, frame_names(replay));
        return NULL;
    }
    struct hal_replay_entry *entry = find_entry(replay, name);
    if (entry == NULL) {
        entry = add_entry(replay, name);
        if (entry == NULL) {
            hal_fail(error, "no memory for the list of frames");
        }
    } else if (entry->listed) {
        hal_fail(error, "%.100s was listed before; this line is ignored", name);
        return NULL;
    }
    if (entry != NULL) {
        entry->listed = true;
    }
    return entry;
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
    struct hal_replay_entry *entry = claim_entry(replay, line, error);
    if (entry == NULL) {
        return false;
    }
    char message[HAL_ERROR_MAX + 64];
    if (!read_fields(line, entry, error)) {
        snprintf(message, sizeof message, LIST_NAME " line %ld: %s", number, error->text);
        spoil(entry, message);
    } else if (!entry->on_disk) {
        snprintf(message, sizeof message, "no such file; listed in " LIST_NAME " line %ld", number);
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

static bool load_image(const char *path, struct hal_frame *frame, struct hal_error *error)
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
                                                : load_image(path, frame, error);
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
    const struct hal_replay_entry *entry = find_entry(replay, name);
    return entry != NULL && entry->on_disk;
}
