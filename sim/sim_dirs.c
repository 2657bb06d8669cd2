#include "sim_dirs.h"

#include <dirent.h>
#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "hal_file.h"
#include "replay/hal_replay.h"

#define RIG_NAME "rig.json"
/* Room for a number after a label. */
#define LABEL_SUFFIX_MAX 24

static char *join(const char *dir, const char *name)
{
    char *path = hal_file_join(dir, name);
    return path != NULL ? path : sim_report_grow(NULL, SIZE_MAX, 1);
}

static bool has_rig(const char *dir)
{
    char *path = join(dir, RIG_NAME);
    bool found = hal_file_exists(path);
    free(path);
    return found;
}

static bool is_directory(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

/* The next name; NULL at the end and, with errno, at an error. */
static const char *next_name(DIR *stream)
{
    errno = 0;
    const struct dirent *item = readdir(stream);
    return item == NULL ? NULL : item->d_name;
}

/* At least one where that cannot be found out: opening the directory for its frames says why. */
static size_t count_frames(const char *dir)
{
    DIR *stream = opendir(dir);
    size_t count = 0;
    const char *name = NULL;
    while (stream != NULL && (name = next_name(stream)) != NULL) {
        count += hal_replay_is_frame(name, true);
    }
    bool is_whole = stream != NULL && errno == 0;
    if (stream != NULL) {
        closedir(stream);
    }
    return count > 0 || is_whole ? count : 1;
}

/* Can the directory be processed itself? */
static bool is_frames_dir(const char *path, bool with_rig)
{
    return is_directory(path) && (has_rig(path) || (with_rig && count_frames(path) > 0));
}

static bool label_taken(const struct sim_dirs *dirs, const char *label)
{
    for (size_t i = 0; i < dirs->dir_count; i++) {
        if (strcmp(dirs->dir[i].label, label) == 0) {
            return true;
        }
    }
    return false;
}

/* The last part of the path, without slashes at its end. */
static char *make_label(const struct sim_dirs *dirs, const char *path)
{
    size_t end = strlen(path);
    while (end > 0 && path[end - 1] == '/') {
        end--;
    }
    size_t start = end;
    while (start > 0 && path[start - 1] != '/') {
        start--;
    }
    const char *last = path + start;
    int length = (int)(end - start);
    if (length == 0 || strncmp(last, "..", (size_t)length) == 0) {
        last = "frames";
        length = (int)strlen(last);
    }
    size_t size = (size_t)length + LABEL_SUFFIX_MAX;
    char *label = sim_report_grow(NULL, size, 1);
    snprintf(label, size, "%.*s", length, last);
    for (int number = 2; label_taken(dirs, label); number++) {
        snprintf(label, size, "%.*s-%d", length, last, number);
    }
    return label;
}

/* Takes the path over. */
static void add(struct sim_dirs *dirs, char *path)
{
    if (dirs->dir_count == dirs->dir_capacity) {
        dirs->dir_capacity = dirs->dir_capacity == 0 ? 16 : dirs->dir_capacity * 2;
        dirs->dir = sim_report_grow(dirs->dir, dirs->dir_capacity, sizeof *dirs->dir);
    }
    struct sim_dir dir = {
        .path = path, .label = make_label(dirs, path), .file_count = count_frames(path)};
    dirs->file_count += dir.file_count;
    dirs->dir[dirs->dir_count++] = dir;
}

static int compare_names(const void *left, const void *right)
{
    return strcmp(*(char *const *)left, *(char *const *)right);
}

/* Paths of the subdirectories that are frames directories, sorted; *reason: why there may be more, or 0. */
static char **find_children(const char *path, DIR *stream, bool with_rig, size_t *count,
                            int *reason)
{
    char **child = NULL;
    size_t capacity = 0;
    *count = 0;
    const char *name = NULL;
    while ((name = next_name(stream)) != NULL) {
        if (name[0] == '.' || strcmp(name, "lost+found") == 0) {
            continue;
        }
        char *candidate = join(path, name);
        if (!is_frames_dir(candidate, with_rig)) {
            free(candidate);
            continue;
        }
        if (*count == capacity) {
            capacity = capacity == 0 ? 16 : capacity * 2;
            child = sim_report_grow(child, capacity, sizeof *child);
        }
        child[(*count)++] = candidate;
    }
    *reason = errno;
    if (*count > 0) {
        qsort(child, *count, sizeof *child, compare_names);
    }
    return child;
}

void sim_dirs_add(struct sim_dirs *dirs, const char *path, bool with_rig, struct sim_report *report)
{
    if (is_frames_dir(path, with_rig)) {
        size_t size = strlen(path) + 1;
        add(dirs, memcpy(sim_report_grow(NULL, size, 1), path, size));
        return;
    }
    DIR *stream = opendir(path);
    if (stream == NULL) {
        sim_report_error(report, path, "%s; expected a directory with frames and rig.json",
                         strerror(errno));
        return;
    }
    size_t count = 0;
    int reason = 0;
    char **child = find_children(path, stream, with_rig, &count, &reason);
    closedir(stream);
    for (size_t i = 0; i < count; i++) {
        add(dirs, child[i]);
    }
    free(child);
    if (reason != 0) {
        sim_report_error(report, path, "the list of its files ends with an error: %s",
                         strerror(reason));
    } else if (count == 0) {
        sim_report_error(report, path, "no %s here and in no subdirectory%s",
                         with_rig ? "frames (*.pgm, *.png, *.xyz)" : RIG_NAME,
                         with_rig ? "" : "; name one with --rig, or make one: docs/calibration.md");
    }
}

/* The same file or directory, whatever its path. */
static bool is_same(const char *path, const struct stat *as)
{
    struct stat status;
    return stat(path, &status) == 0 && status.st_dev == as->st_dev && status.st_ino == as->st_ino;
}

static bool is_same_in(const char *dir, const char *name, const struct stat *as)
{
    char *path = join(dir, name);
    bool same = is_same(path, as);
    free(path);
    return same;
}

/* One of those that a run reads in this directory. */
static bool is_input_of(const char *dir, const struct stat *as)
{
    static const char *const other[] = {RIG_NAME, "frames.jsonl", "truth.jsonl"};
    bool found = false;
    for (size_t i = 0; i < sizeof other / sizeof *other; i++) {
        found = found || is_same_in(dir, other[i], as);
    }
    DIR *stream = opendir(dir);
    const char *name = NULL;
    while (stream != NULL && !found && (name = next_name(stream)) != NULL) {
        found = hal_replay_is_frame(name, true) && is_same_in(dir, name, as);
    }
    if (stream != NULL) {
        closedir(stream);
    }
    return found;
}

bool sim_dirs_has_input(const struct sim_dirs *dirs, const char *path)
{
    struct stat status;
    bool found = false;
    for (size_t i = 0; i < dirs->dir_count && stat(path, &status) == 0; i++) {
        found = found || is_input_of(dirs->dir[i].path, &status);
    }
    return found;
}

bool sim_dirs_has(const struct sim_dirs *dirs, const char *path)
{
    struct stat status;
    bool found = false;
    for (size_t i = 0; i < dirs->dir_count && stat(path, &status) == 0; i++) {
        found = found || is_same(dirs->dir[i].path, &status);
    }
    return found;
}

void sim_dirs_free(struct sim_dirs *dirs)
{
    for (size_t i = 0; i < dirs->dir_count; i++) {
        free(dirs->dir[i].path);
        free(dirs->dir[i].label);
    }
    free(dirs->dir);
    *dirs = (struct sim_dirs){.dir_count = 0};
}
