/* hal_lines - a file of JSON objects, one per line (JSON Lines), read line by line.
 *
 * Empty lines are skipped. Error: on opening as hal_file; a line that is no JSON object, or one with a field twice,
 * is reported with its number, and reading goes on behind it.
 */
#ifndef HAL_LINES_H
#define HAL_LINES_H

#include <cjson/cJSON.h>
#include <stdio.h>

#include "hal.h"

/* Largest file; a line of it has to fit into memory. */
#define HAL_LINES_FILE_MAX ((size_t)1 << 30)

struct hal_lines {
    FILE *file;
    char *text;
    size_t capacity;
    long number; /* of the line read last, from 1 */
    bool broken; /* reading failed: there is no more */
};

enum hal_lines_next {
    HAL_LINES_END = 0,
    HAL_LINES_OBJECT = 1, /* *object is to be deleted by the caller */
    HAL_LINES_BAD = 2     /* this line is lost, *error says why */
};

bool hal_lines_open(struct hal_lines *lines, const char *path, struct hal_error *error);
enum hal_lines_next hal_lines_next(struct hal_lines *lines, cJSON **object,
                                   struct hal_error *error);
void hal_lines_close(struct hal_lines *lines);

#endif
