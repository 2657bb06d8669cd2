#include "sim_dirs.h"

#include <dirent.h>
#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "hal_file.h"

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

static size_t count_frames(const char *dir)
{
    DIR *stream = opendir(dir);
    size_t count = 0;
    struct dirent *item = NULL;
    while (stream != NULL && (item = readdir(stream)) != NULL) {
        const char *suffix = strrchr(item->d_name, '.');
        count += suffix != NULL && suffix != item->d_name &&
                 (strcmp(suffix, ".pgm") == 0 || strcmp(suffix, ".xyz") == 0);
    }
    if (stream != NULL) {
        closedir(stream);
    }
    return count;
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

/* Paths of the subdirectories that are frames directories, sorted. */
static char **find_children(const char *path, DIR *stream, bool with_rig, size_t *count)
{
    char **child = NULL;
    size_t capacity = 0;
    *count = 0;
    struct dirent *item = NULL;
    while ((item = readdir(stream)) != NULL) {
        if (item->d_name[0] == '.') {
            continue;
        }
        char *candidate = join(path, item->d_name);
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
    char **child = find_children(path, stream, with_rig, &count);
    closedir(stream);
    for (size_t i = 0; i < count; i++) {
        add(dirs, child[i]);
    }
    free(child);
    if (count == 0) {
        sim_report_error(report, path, "no %s here and in no subdirectory%s",
                         with_rig ? "frames (*.pgm, *.xyz)" : RIG_NAME,
                         with_rig ? "" : "; name one with --rig, or make one: docs/calibration.md");
    }
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
