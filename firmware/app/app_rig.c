#include "app_rig.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hal_file.h"

#define RAY_AXES 3

static const char *const axis_text[RAY_AXES] = {" x", " y", " z"};

/* One field: where it stands, so that every message can name it. */
struct field {
    const cJSON *rig;
    const char *name;
    struct hal_error *error;
};

/* What stands where a number was expected. */
static const char *type_text(const cJSON *item)
{
    if (cJSON_IsString(item)) {
        return "a string";
    }
    if (cJSON_IsObject(item)) {
        return "an object";
    }
    if (cJSON_IsArray(item)) {
        return "an array";
    }
    return cJSON_IsNull(item) ? "null" : "true or false";
}

static const cJSON *find(const struct field *field)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(field->rig, field->name);
    if (item == NULL) {
        hal_fail(field->error, "%s: missing", field->name);
    }
    return item;
}

/* A finite number within the limits of int32_t. */
static bool read_number(const struct field *field, double *value)
{
    const cJSON *item = find(field);
    if (item == NULL) {
        return false;
    }
    if (!cJSON_IsNumber(item)) {
        return hal_fail(field->error, "%s: %s, expected a number", field->name, type_text(item));
    }
    *value = item->valuedouble;
    if (!isfinite(*value) || fabs(*value) >= INT32_MAX) {
        return hal_fail(field->error, "%s: %g, out of range", field->name, *value);
    }
    return true;
}

static bool read_integer(const struct field *field, int32_t *value)
{
    double number = 0;
    if (!read_number(field, &number)) {
        return false;
    }
    if (number != floor(number)) {
        return hal_fail(field->error, "%s: %g, expected a whole number", field->name, number);
    }
    *value = (int32_t)number;
    return true;
}

static bool check_count(const struct field *field, const cJSON *matrix, const char *key,
                        int expected)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(matrix, key);
    if (!cJSON_IsNumber(item)) {
        return hal_fail(field->error, "%s: no %s, expected %d", field->name, key, expected);
    }
    if (item->valuedouble != expected) {
        return hal_fail(field->error, "%s: %s is %g, expected %d", field->name, key,
                        item->valuedouble, expected);
    }
    return true;
}

/* Does OpenCV's form of a matrix say the shape and type that it must have? */
static bool check_form(const struct field *field, const cJSON *matrix, int rows, int columns)
{
    const char *type = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(matrix, "type_id"));
    if (type == NULL || strcmp(type, "opencv-matrix") != 0) {
        return hal_fail(field->error, "%s: type_id is %s, expected \"opencv-matrix\"", field->name,
                        type == NULL ? "missing" : type);
    }
    const char *format = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(matrix, "dt"));
    if (format == NULL || (strcmp(format, "d") != 0 && strcmp(format, "f") != 0)) {
        return hal_fail(field->error, "%s: dt is %s, expected \"d\" or \"f\"", field->name,
                        format == NULL ? "missing" : format);
    }
    return check_count(field, matrix, "rows", rows) && check_count(field, matrix, "cols", columns);
}

/* Where numbers are read from, and how many were. */
struct numbers {
    const struct field *field;
    int rows, columns;
    int count;
};

static bool read_one(struct numbers *numbers, const cJSON *item, double *value)
{
    const struct field *field = numbers->field;
    const int row = numbers->count / numbers->columns;
    const int column = numbers->count % numbers->columns;
    if (!cJSON_IsNumber(item)) {
        return hal_fail(field->error, "%s[%d][%d]: %s, expected a number", field->name, row, column,
                        type_text(item));
    }
    if (!isfinite(item->valuedouble)) {
        return hal_fail(field->error, "%s[%d][%d]: %g, expected a finite number", field->name, row,
                        column, item->valuedouble);
    }
    value[numbers->count++] = item->valuedouble;
    return true;
}

/* All numbers of a flat array. where: what of the field it is. */
static bool read_flat(struct numbers *numbers, const cJSON *array, const char *where, double *value)
{
    const int expected = numbers->rows * numbers->columns;
    if (cJSON_GetArraySize(array) != expected) {
        return hal_fail(numbers->field->error, "%s: %d numbers%s, expected %d",
                        numbers->field->name, cJSON_GetArraySize(array), where, expected);
    }
    bool good = true;
    for (const cJSON *item = array->child; good && item != NULL; item = item->next) {
        good = read_one(numbers, item, value);
    }
    return good;
}

/* An array of rows, as NumPy's tolist() writes it. */
static bool read_rows(struct numbers *numbers, const cJSON *array, double *value)
{
    const struct field *field = numbers->field;
    if (cJSON_GetArraySize(array) != numbers->rows) {
        return hal_fail(field->error, "%s: %d rows, expected %d", field->name,
                        cJSON_GetArraySize(array), numbers->rows);
    }
    for (const cJSON *row = array->child; row != NULL; row = row->next) {
        const int index = numbers->count / numbers->columns;
        if (!cJSON_IsArray(row) || cJSON_GetArraySize(row) != numbers->columns) {
            return hal_fail(field->error, "%s[%d]: expected an array of %d numbers", field->name,
                            index, numbers->columns);
        }
        for (const cJSON *item = row->child; item != NULL; item = item->next) {
            if (!read_one(numbers, item, value)) {
                return false;
            }
        }
    }
    return true;
}

/* The numbers of a matrix, row by row: OpenCV's form, an array of rows, or a flat array. */
static bool read_matrix(const struct field *field, int rows, int columns, double *value)
{
    struct numbers numbers = {field, rows, columns, 0};
    const cJSON *matrix = find(field);
    if (matrix == NULL) {
        return false;
    }
    if (cJSON_IsArray(matrix)) {
        return cJSON_IsArray(matrix->child) ? read_rows(&numbers, matrix, value)
                                            : read_flat(&numbers, matrix, "", value);
    }
    if (!check_form(field, matrix, rows, columns)) {
        return false;
    }
    const cJSON *data = cJSON_GetObjectItemCaseSensitive(matrix, "data");
    if (!cJSON_IsArray(data)) {
        return hal_fail(field->error, "%s: data is no array", field->name);
    }
    return read_flat(&numbers, data, " in data", value);
}

/* value * 2^fraction_bits as int32_t. part: what of the field it is. */
static bool round_fixed(const struct field *field, const char *part, double value,
                        int fraction_bits, int32_t *fixed)
{
    double scaled = ldexp(value, fraction_bits);
    double limit = ldexp(1.0, 31 - fraction_bits);
    if (!(fabs(scaled) < INT32_MAX)) {
        return hal_fail(field->error, "%s%s: %g, expected less than %g in size", field->name, part,
                        value, limit);
    }
    *fixed = (int32_t)llround(scaled);
    return true;
}

static bool read_size(struct field *field, struct ih_calibration *calibration)
{
    field->name = "image_width";
    if (!read_integer(field, &calibration->width)) {
        return false;
    }
    field->name = "image_height";
    return read_integer(field, &calibration->height);
}

static bool read_camera(struct field *field, struct ih_calibration *calibration)
{
    static const double fixed_part[9] = {-1, 0, -1, 0, -1, -1, 0, 0, 1};
    double matrix[9] = {0};
    field->name = "camera_matrix";
    if (!read_matrix(field, 3, 3, matrix)) {
        return false;
    }
    for (int i = 0; i < 9; i++) {
        if (fixed_part[i] >= 0 && matrix[i] != fixed_part[i]) {
            return hal_fail(field->error, "camera_matrix[%d][%d]: %g, expected %g", i / 3, i % 3,
                            matrix[i], fixed_part[i]);
        }
    }
    return round_fixed(field, "[0][0]", matrix[0], 16, &calibration->fx_px_q16) &&
           round_fixed(field, "[0][2]", matrix[2], 16, &calibration->cx_px_q16) &&
           round_fixed(field, "[1][1]", matrix[4], 16, &calibration->fy_px_q16) &&
           round_fixed(field, "[1][2]", matrix[5], 16, &calibration->cy_px_q16);
}

static bool read_distortion(struct field *field, struct ih_calibration *calibration)
{
    double k[5] = {0};
    field->name = "distortion_coefficients";
    return read_matrix(field, 1, 5, k) &&
           round_fixed(field, " k1", k[0], 24, &calibration->k1_q24) &&
           round_fixed(field, " k2", k[1], 24, &calibration->k2_q24) &&
           round_fixed(field, " p1", k[2], 24, &calibration->p1_q24) &&
           round_fixed(field, " p2", k[3], 24, &calibration->p2_q24) &&
           round_fixed(field, " k3", k[4], 24, &calibration->k3_q24);
}

static bool read_range(struct field *field, struct ih_calibration *calibration)
{
    double limit_mm = 0;
    field->name = "near_mm";
    if (!read_number(field, &limit_mm)) {
        return false;
    }
    calibration->near_mm = (int32_t)floor(limit_mm);
    field->name = "far_mm";
    if (!read_number(field, &limit_mm)) {
        return false;
    }
    calibration->far_mm = (int32_t)ceil(limit_mm);
    return true;
}

static bool read_projector(struct field *field, struct ih_calibration *calibration)
{
    double origin_mm[RAY_AXES] = {0};
    double ray[IH_SLOTS * RAY_AXES] = {0};
    field->name = "projector_origin";
    if (!read_matrix(field, RAY_AXES, 1, origin_mm)) {
        return false;
    }
    for (int i = 0; i < RAY_AXES; i++) {
        if (!round_fixed(field, axis_text[i], origin_mm[i], 16, &calibration->origin_mm_q16[i])) {
            return false;
        }
    }
    field->name = "dot_rays";
    if (!read_matrix(field, IH_SLOTS, RAY_AXES, ray)) {
        return false;
    }
    for (int i = 0; i < IH_SLOTS * RAY_AXES; i++) {
        char part[32];
        snprintf(part, sizeof part, "[%d]%s", i / RAY_AXES, axis_text[i % RAY_AXES]);
        if (!round_fixed(field, part, ray[i], 30,
                         &calibration->ray_q30[i / RAY_AXES][i % RAY_AXES])) {
            return false;
        }
    }
    return true;
}

/* mm per unit; 1 where the file says nothing. */
static bool read_depth_scale(struct field *field, const struct ih_calibration *calibration,
                             int32_t *scale_q20)
{
    double scale = 1;
    field->name = "depth_scale";
    *scale_q20 = APP_RIG_SCALE_ONE;
    if (cJSON_GetObjectItemCaseSensitive(field->rig, field->name) == NULL) {
        return true;
    }
    if (!read_number(field, &scale)) {
        return false;
    }
    if (calibration->kind != IH_RIG_RANGE) {
        return hal_fail(field->error, "depth_scale: only a rig of kind \"range\" has depths");
    }
    if (!(scale >= APP_RIG_SCALE_MIN && scale <= APP_RIG_SCALE_MAX)) {
        return hal_fail(field->error, "depth_scale: %g, expected %g to %g mm per unit", scale,
                        APP_RIG_SCALE_MIN, APP_RIG_SCALE_MAX);
    }
    return round_fixed(field, "", scale, 20, scale_q20);
}

static bool read_kind(struct field *field, struct ih_calibration *calibration)
{
    const cJSON *kind = cJSON_GetObjectItemCaseSensitive(field->rig, "kind");
    calibration->kind = IH_RIG_DOTS;
    if (kind == NULL) {
        return true;
    }
    if (!cJSON_IsString(kind)) {
        return hal_fail(field->error, "kind: not a string, expected \"dots\" or \"range\"");
    }
    if (strcmp(kind->valuestring, "range") == 0) {
        calibration->kind = IH_RIG_RANGE;
    } else if (strcmp(kind->valuestring, "dots") != 0) {
        return hal_fail(field->error, "kind: \"%.60s\", expected \"dots\" or \"range\"",
                        kind->valuestring);
    }
    return true;
}

/* Absent: all 0, as of a level camera. There, it must not be that. */
static bool read_up(struct field *field, struct ih_calibration *calibration)
{
    double up[RAY_AXES] = {0};
    bool is_zero = true;
    field->name = "up";
    if (cJSON_GetObjectItemCaseSensitive(field->rig, field->name) == NULL) {
        return true;
    }
    if (!read_matrix(field, 1, RAY_AXES, up)) {
        return false;
    }
    for (int i = 0; i < RAY_AXES; i++) {
        if (!round_fixed(field, axis_text[i], up[i], 30, &calibration->up_q30[i])) {
            return false;
        }
        is_zero = is_zero && calibration->up_q30[i] == 0;
    }
    return !is_zero ||
           hal_fail(field->error, "up: (%g, %g, %g), expected a unit vector", up[0], up[1], up[2]);
}

static bool read_rig(const cJSON *rig, struct ih_calibration *calibration, int32_t *scale_q20,
                     struct hal_error *error)
{
    struct field field = {.rig = rig, .error = error};
    *calibration = (struct ih_calibration){.kind = IH_RIG_DOTS};
    return read_kind(&field, calibration) && read_size(&field, calibration) &&
           read_camera(&field, calibration) && read_distortion(&field, calibration) &&
           read_range(&field, calibration) &&
           (calibration->kind == IH_RIG_RANGE || read_projector(&field, calibration)) &&
           read_depth_scale(&field, calibration, scale_q20) && read_up(&field, calibration);
}

/* Where in the text parsing stopped. */
static void locate(const char *text, const char *stop, struct hal_error *error)
{
    long line = 1;
    const char *line_start = text;
    for (const char *at = text; at < stop; at++) {
        if (*at == '\n') {
            line++;
            line_start = at + 1;
        }
    }
    if (*stop == 0) {
        hal_fail(error, "line %ld: not JSON: the file ends too early", line);
    } else {
        hal_fail(error, "line %ld column %ld: not JSON: %.40s", line, (long)(stop - line_start) + 1,
                 stop);
    }
}

bool app_rig_parse(const char *text, size_t size, struct ih_calibration *calibration,
                   int32_t *scale_q20, struct hal_error *error)
{
    const char *stop = text;
    cJSON *rig = NULL;
    bool good = false;
    if (strlen(text) != size) {
        hal_fail(error, "offset %zu: a zero byte, expected JSON", strlen(text));
    } else if ((rig = cJSON_ParseWithOpts(text, &stop, 1)) == NULL) {
        locate(text, stop, error);
    } else if (!cJSON_IsObject(rig)) {
        hal_fail(error, "%s, expected an object", type_text(rig));
    } else {
        good = hal_file_is_unique(rig, error) && read_rig(rig, calibration, scale_q20, error);
    }
    cJSON_Delete(rig);
    return good;
}

bool app_rig_load_scaled(const char *path, struct ih_calibration *calibration, int32_t *scale_q20,
                         struct hal_error *error)
{
    uint8_t *data = NULL;
    size_t size = 0;
    if (!hal_file_read(path, APP_RIG_FILE_MAX, &data, &size, error)) {
        return false;
    }
    bool good = app_rig_parse((const char *)data, size, calibration, scale_q20, error);
    free(data);
    return good;
}

bool app_rig_load(const char *path, struct ih_calibration *calibration, struct hal_error *error)
{
    int32_t scale_q20 = APP_RIG_SCALE_ONE;
    if (!app_rig_load_scaled(path, calibration, &scale_q20, error)) {
        return false;
    }
    if (scale_q20 != APP_RIG_SCALE_ONE) {
        return hal_fail(error, "depth_scale: expected 1, as this program takes depths in mm");
    }
    return true;
}

enum ih_err app_rig_to_blob(const struct ih_calibration *calibration,
                            uint8_t blob[IH_RIG_BLOB_BYTES])
{
    struct ih_calibration level = *calibration;
    const int32_t *up = level.up_q30;
    if (up[0] == 0 && up[1] == 0 && up[2] == 0) {
        level.up_q30[1] = -(1 << 30);
    }
    return ih_rig_blob_encode(&level, blob);
}
