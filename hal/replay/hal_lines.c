#include "replay/hal_lines.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>

#include "hal_file.h"

bool hal_lines_open(struct hal_lines *lines, const char *path, struct hal_error *error)
{
    *lines = (struct hal_lines){.file = hal_file_open(path, HAL_LINES_FILE_MAX, error)};
    return lines->file != NULL;
}

/* The next line that is not empty, without the white space at its end; -1 at the end. */
static ssize_t read_text(struct hal_lines *lines)
{
    ssize_t length = 0;
    while ((length = getline(&lines->text, &lines->capacity, lines->file)) >= 0) {
        lines->number++;
        while (length > 0 && strchr(" \t\r\n", lines->text[length - 1]) != NULL) {
            length--;
        }
        if (length > 0) {
            lines->text[length] = 0;
            return length;
        }
    }
    return -1;
}

enum hal_lines_next hal_lines_next(struct hal_lines *lines, cJSON **object, struct hal_error *error)
{
    errno = 0;
    ssize_t length = read_text(lines);
    if (length < 0) {
        if (lines->broken || feof(lines->file)) {
            return HAL_LINES_END;
        }
        lines->broken = true;
        snprintf(error->text, sizeof error->text, "line %ld: %s", lines->number + 1,
                 strerror(errno));
        return HAL_LINES_BAD;
    }
    /* A zero byte inside the line would hide what follows it. */
    bool whole = memchr(lines->text, 0, (size_t)length) == NULL;
    *object = whole ? cJSON_ParseWithOpts(lines->text, NULL, 1) : NULL;
    struct hal_error reason;
    if (!cJSON_IsObject(*object)) {
        hal_fail(error, "line %ld: %s: %.60s", lines->number,
                 whole ? "not a JSON object" : "a zero byte in the line", lines->text);
    } else if (!hal_file_is_unique(*object, &reason)) {
        hal_fail(error, "line %ld: %.200s", lines->number, reason.text);
    } else {
        return HAL_LINES_OBJECT;
    }
    cJSON_Delete(*object);
    *object = NULL;
    return HAL_LINES_BAD;
}

void hal_lines_close(struct hal_lines *lines)
{
    if (lines->file != NULL) {
        fclose(lines->file);
    }
    free(lines->text);
    *lines = (struct hal_lines){.file = NULL};
}
