#include "replay/hal_xyz.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define AXES 3
#define BLANKS " \t\r\v\f"
#define BYTE_ORDER_MARK "\xEF\xBB\xBF"

/* One coordinate; *at moves behind it. */
static bool read_number(const char **at, long line, int32_t *value_mm_q8, struct hal_error *error)
{
    *at += strspn(*at, BLANKS);
    if (**at == '\n' || **at == 0) {
        return hal_fail(error, "line %ld: it ends early, expected three numbers: x y z in mm",
                        line);
    }
    int length = (int)strcspn(*at, BLANKS "\n");
    char *end = NULL;
    double value_mm = strtod(*at, &end);
    /* strtod takes hexadecimal numbers, which no writer of points means. */
    if (end != *at + length || strcspn(*at, "xX") < (size_t)length) {
        return hal_fail(error, "line %ld: %.*s, expected a number", line, length < 40 ? length : 40,
                        *at);
    }
    if (!isfinite(value_mm) || fabs(value_mm) > HAL_XYZ_MAX_MM) {
        return hal_fail(error, "line %ld: %g mm, expected within +-%d", line, value_mm,
                        HAL_XYZ_MAX_MM);
    }
    *value_mm_q8 = (int32_t)lround(value_mm * 256);
    *at = end;
    return true;
}

/* A line with a point; *at moves to its end. */
static bool read_point(const char **at, long line, int32_t point_mm_q8[AXES],
                       struct hal_error *error)
{
    for (int axis = 0; axis < AXES; axis++) {
        if (!read_number(at, line, &point_mm_q8[axis], error)) {
            return false;
        }
    }
    *at += strspn(*at, BLANKS);
    if (**at != '\n' && **at != 0) {
        return hal_fail(error, "line %ld: more than three numbers, expected x y z in mm", line);
    }
    return true;
}

static bool read_points(const char *text, struct hal_xyz *xyz, struct hal_error *error)
{
    const bool is_marked = strncmp(text, BYTE_ORDER_MARK, strlen(BYTE_ORDER_MARK)) == 0;
    const char *at = is_marked ? text + strlen(BYTE_ORDER_MARK) : text;
    for (long line = 1; *at != 0; line++) {
        at += strspn(at, BLANKS);
        if (*at == '#') {
            at += strcspn(at, "\n");
        } else if (*at != '\n' && *at != 0) {
            if (!read_point(&at, line, xyz->point_mm_q8[xyz->point_count], error)) {
                return false;
            }
            xyz->point_count++;
        }
        at += *at == '\n';
    }
    return true;
}

bool hal_xyz_decode(const char *text, size_t size, struct hal_xyz *xyz, struct hal_error *error)
{
    *xyz = (struct hal_xyz){.point_count = 0};
    if (strlen(text) != size) {
        return hal_fail(error, "offset %zu: a zero byte, expected text", strlen(text));
    }
    size_t line_count = 1;
    for (const char *at = text; (at = strchr(at, '\n')) != NULL; at++) {
        line_count++;
    }
    xyz->point_mm_q8 = malloc(line_count * sizeof *xyz->point_mm_q8);
    if (xyz->point_mm_q8 == NULL) {
        return hal_fail(error, "no memory for this file");
    }
    if (!read_points(text, xyz, error)) {
        free(xyz->point_mm_q8);
        *xyz = (struct hal_xyz){.point_count = 0};
        return false;
    }
    return true;
}
