#include "hal_file.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static void fail(struct hal_error *error, const char *text)
{
    snprintf(error->text, sizeof error->text, "%s", text);
}

bool hal_file_exists(const char *path)
{
    struct stat status;
    return lstat(path, &status) == 0 || (errno != ENOENT && errno != ENOTDIR);
}

enum hal_file_kind hal_file_kind(const char *path)
{
    struct stat status;
    if (stat(path, &status) != 0) {
        return HAL_FILE_NONE;
    }
    if (S_ISDIR(status.st_mode)) {
        return HAL_FILE_DIRECTORY;
    }
    return S_ISCHR(status.st_mode) ? HAL_FILE_CHARACTERS : HAL_FILE_OTHER;
}

FILE *hal_file_open(const char *path, size_t limit, struct hal_error *error)
{
    struct stat status;
    if (stat(path, &status) != 0) {
        fail(error, strerror(errno));
    } else if (S_ISDIR(status.st_mode)) {
        fail(error, "a directory, expected a file");
    } else if (!S_ISREG(status.st_mode)) {
        fail(error, "a device or pipe, expected a file");
    } else if (status.st_size < 0 || (uintmax_t)status.st_size > limit) {
        snprintf(error->text, sizeof error->text, "%jd bytes, expected at most %zu",
                 (intmax_t)status.st_size, limit);
    } else {
        FILE *file = fopen(path, "rb");
        if (file == NULL) {
            fail(error, strerror(errno));
        }
        return file;
    }
    return NULL;
}

/* Content of an open file in new memory; NULL when it cannot be read. The file may have changed
 * since it was measured: what is read counts, and never more than the limit. */
static uint8_t *read_content(FILE *file, size_t limit, size_t *size, struct hal_error *error)
{
    struct stat status;
    if (fstat(fileno(file), &status) != 0) {
        fail(error, strerror(errno));
        return NULL;
    }
    size_t length = (uintmax_t)status.st_size > limit ? limit : (size_t)status.st_size;
    uint8_t *content = malloc(length + 1);
    if (content == NULL) {
        fail(error, "no memory for this file");
        return NULL;
    }
    *size = fread(content, 1, length, file);
    if (ferror(file)) {
        fail(error, strerror(errno));
        free(content);
        return NULL;
    }
    content[*size] = 0;
    return content;
}

bool hal_file_read(const char *path, size_t limit, uint8_t **data, size_t *size,
                   struct hal_error *error)
{
    FILE *file = hal_file_open(path, limit, error);
    if (file == NULL) {
        return false;
    }
    *data = read_content(file, limit, size, error);
    fclose(file);
    return *data != NULL;
}

char *hal_file_join(const char *dir, const char *name)
{
    size_t size = strlen(dir) + 1 + strlen(name) + 1;
    char *path = malloc(size);
    if (path != NULL) {
        size_t dir_length = strlen(dir);
        bool has_slash = dir_length > 0 && dir[dir_length - 1] == '/';
        snprintf(path, size, "%s%s%s", dir, has_slash ? "" : "/", name);
    }
    return path;
}

static int compare_names(const void *left, const void *right)
{
    return strcmp(*(const char *const *)left, *(const char *const *)right);
}

/* The fields of one object alone; they are sorted, as there may be very many. of, point: the object's name and a
 * point, or "". */
static bool is_unique(const cJSON *object, const char *of, const char *point,
                      struct hal_error *error)
{
    size_t count = 0;
    for (const cJSON *item = object->child; item != NULL; item = item->next) {
        count++;
    }
    const char **name = malloc((count + 1) * sizeof *name);
    if (name == NULL) {
        fail(error, "no memory for this file");
        return false;
    }
    count = 0;
    for (const cJSON *item = object->child; item != NULL; item = item->next) {
        name[count++] = item->string;
    }
    qsort(name, count, sizeof *name, compare_names);
    bool good = true;
    for (size_t i = 1; good && i < count; i++) {
        good = strcmp(name[i - 1], name[i]) != 0 ||
               hal_fail(error, "%.60s%s%.60s: a second time", of, point, name[i]);
    }
    free(name);
    return good;
}

bool hal_file_is_unique(const struct cJSON *object, struct hal_error *error)
{
    bool good = is_unique(object, "", "", error);
    for (const cJSON *item = object->child; good && item != NULL; item = item->next) {
        good =
            (item->type & UINT8_MAX) != cJSON_Object || is_unique(item, item->string, ".", error);
    }
    return good;
}
