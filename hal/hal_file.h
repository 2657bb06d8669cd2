/* hal_file - regular files, opened or read whole, and what no JSON in them may have.
 *
 * Error: as text without the file's name: what the system says, a directory or device in place of
 *        a file (opening a pipe would wait for ever), more bytes than the limit, no memory.
 */
#ifndef HAL_FILE_H
#define HAL_FILE_H

#include <stddef.h>
#include <stdio.h>

#include "hal.h"

/* Is there anything of this name, be it a link that leads nowhere? True also where that cannot be found out: opening
 * it says why. */
bool hal_file_exists(const char *path);

enum hal_file_kind { HAL_FILE_NONE, HAL_FILE_DIRECTORY, HAL_FILE_CHARACTERS, HAL_FILE_OTHER };

/* What a path leads to; none also where nobody can say. */
enum hal_file_kind hal_file_kind(const char *path);

/* For reading; NULL with *error when that is not possible or it has more bytes than the limit. */
FILE *hal_file_open(const char *path, size_t limit, struct hal_error *error);

/* *data: to be freed by the caller; a zero byte that *size does not count follows the content. */
bool hal_file_read(const char *path, size_t limit, uint8_t **data, size_t *size,
                   struct hal_error *error);

/* dir/name in new memory; NULL when there is none. */
char *hal_file_join(const char *dir, const char *name);

struct cJSON;

/* Is each field of a JSON object, and of the objects among its fields, there once? Of two each reader may take another.
 * False: *error names one that is not. */
bool hal_file_is_unique(const struct cJSON *object, struct hal_error *error);

#endif
