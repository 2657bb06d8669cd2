#include "linux/hal_iio.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "hal_file.h"

#define GRAVITY_M_S2 9.80665
/* Of gravity: sensors that are not calibrated are off by a tenth. */
#define TOLERANCE 0.2
/* Entries of a matrix times its transpose against the unit matrix. */
#define ROTATION_TOLERANCE 0.01
#define PATH_SIZE 1024
/* An attribute is at most a page. */
#define ATTRIBUTE_MAX 65536
#define DEVICE_PREFIX "iio:device"
#define NAME_SIZE 64
/* Longest part of a wrong text that is reported. */
#define QUOTE_MAX 40

struct path {
    char text[PATH_SIZE];
};

struct device {
    struct path dir;
    double offset[3], scale[3];
    double rows[3][3]; /* the mount matrix */
};

static struct path join(const char *dir, const char *name)
{
    struct path path;
    const int length = snprintf(path.text, sizeof path.text, "%s/%s", dir, name);
    if (length < 0 || (size_t)length >= sizeof path.text) {
        path.text[0] = 0; /* too long: there is no such file */
    }
    return path;
}

/* Without white space at its end; to be freed. NULL: *error, which names the file. */
static char *read_text(const char *dir, const char *name, struct hal_error *error)
{
    uint8_t *data = NULL;
    size_t size = 0;
    struct hal_error reason;
    const struct path path = join(dir, name);
    if (!hal_file_read(path.text, ATTRIBUTE_MAX, &data, &size, &reason)) {
        hal_fail(error, "%.150s: %.90s", path.text, reason.text);
        return NULL;
    }
    char *text = (char *)data;
    size_t length = strlen(text);
    while (length > 0 && isspace((unsigned char)text[length - 1])) {
        text[--length] = 0;
    }
    return text;
}

static bool has(const char *dir, const char *name)
{
    return hal_file_exists(join(dir, name).text);
}

static bool read_number(const char *dir, const char *name, double *value, struct hal_error *error)
{
    char *text = read_text(dir, name, error);
    if (text == NULL) {
        return false;
    }
    char *end = NULL;
    *value = strtod(text, &end);
    bool good = end != text && *end == 0 && isfinite(*value);
    if (!good) {
        hal_fail(error, "%.150s: \"%.*s\", expected a number", join(dir, name).text, QUOTE_MAX,
                 text);
    }
    free(text);
    return good;
}

/* in_accel_x_WHAT, or in_accel_WHAT for all axes; *value stays where neither is there and it need not be. */
static bool read_of_axis(const char *dir, char axis, const char *what, bool is_needed,
                         double *value, struct hal_error *error)
{
    char own[NAME_SIZE], common[NAME_SIZE];
    snprintf(own, sizeof own, "in_accel_%c_%s", axis, what);
    snprintf(common, sizeof common, "in_accel_%s", what);
    const char *name = has(dir, own) ? own : common;
    return (!is_needed && !has(dir, name)) || read_number(dir, name, value, error);
}

static bool is_rotation(const double rows[3][3])
{
    double determinant = 0.0;
    bool good = true;
    for (int i = 0; i < 3; i++) {
        const int next = (i + 1) % 3, last = (i + 2) % 3;
        determinant += rows[0][i] * (rows[1][next] * rows[2][last] - rows[1][last] * rows[2][next]);
        for (int k = 0; k < 3; k++) {
            double product = i == k ? -1.0 : 0.0;
            for (int axis = 0; axis < 3; axis++) {
                product += rows[i][axis] * rows[k][axis];
            }
            good = good && fabs(product) < ROTATION_TOLERANCE;
        }
    }
    return good && determinant > 0.0;
}

/* "1, 0, 0; 0, 1, 0; 0, 0, 1" */
static bool parse_matrix(const char *text, double rows[3][3])
{
    for (int i = 0; i < 9; i++) {
        char *end = NULL;
        rows[i / 3][i % 3] = strtod(text, &end);
        const char separator = (char)(i == 8 ? 0 : i % 3 == 2 ? ';' : ',');
        if (end == text || *end != separator) {
            return false;
        }
        text = separator == 0 ? end : end + 1;
    }
    return is_rotation((const double(*)[3])rows);
}

static bool read_matrix(struct device *device, struct hal_error *error)
{
    static const char *const names[] = {"in_accel_mount_matrix", "in_mount_matrix", "mount_matrix"};
    static const double none[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    size_t i = 0;
    memcpy(device->rows, none, sizeof none);
    while (i < sizeof names / sizeof *names && !has(device->dir.text, names[i])) {
        i++;
    }
    if (i == sizeof names / sizeof *names) {
        return true;
    }
    char *text = read_text(device->dir.text, names[i], error);
    bool good = text != NULL && parse_matrix(text, device->rows);
    if (text != NULL && !good) {
        hal_fail(error, "%.120s: \"%.*s\", expected a rotation, such as 1, 0, 0; 0, 1, 0; 0, 0, 1",
                 join(device->dir.text, names[i]).text, QUOTE_MAX, text);
    }
    free(text);
    return good;
}

/* What a search of the directory has found. */
struct search {
    const char *called;
    int found_count;
    struct path found;
    struct hal_error all; /* what there is, as a list */
};

static void look_at(struct search *search, const char *dir, const char *entry)
{
    struct hal_error ignored;
    char *name = read_text(join(dir, entry).text, "name", &ignored);
    const char *text = name != NULL ? name : "without a name";
    char shown[2 * NAME_SIZE];
    snprintf(shown, sizeof shown, "%.60s (%.60s)", text, entry);
    hal_add(&search->all, shown);
    if (strcmp(entry, search->called) == 0 || (name != NULL && strcmp(name, search->called) == 0)) {
        search->found_count++;
        search->found = join(dir, entry);
    }
    free(name);
}

static int is_device(const struct dirent *entry)
{
    return strncmp(entry->d_name, DEVICE_PREFIX, strlen(DEVICE_PREFIX)) == 0;
}

static bool find_device(const struct hal_iio_config *config, struct device *device,
                        struct hal_error *error)
{
    struct search search = {.called = config->called};
    struct dirent **entries = NULL;
    if (strchr(config->called, '/') != NULL) {
        snprintf(device->dir.text, sizeof device->dir.text, "%s", config->called);
        return true;
    }
    int count = scandir(config->dir, &entries, is_device, alphasort);
    if (count < 0) {
        return hal_fail(error, "%.120s: %.90s", config->dir, strerror(errno));
    }
    for (int i = 0; i < count; i++) {
        look_at(&search, config->dir, entries[i]->d_name);
        free(entries[i]);
    }
    free(entries);
    if (search.found_count == 0) {
        return hal_fail(error, "no such device in %.60s, there %s%.140s", config->dir,
                        search.all.text[0] != 0 ? "are: " : "is none", search.all.text);
    }
    if (search.found_count > 1) {
        return hal_fail(error, "%d devices have this name, expected iio:deviceN of one: %.140s",
                        search.found_count, search.all.text);
    }
    device->dir = search.found;
    return true;
}

static bool read_device(struct device *device, struct hal_error *error)
{
    const char *dir = device->dir.text;
    for (int axis = 0; axis < 3; axis++) {
        device->offset[axis] = 0.0;
        if (!read_of_axis(dir, (char)('x' + axis), "scale", true, &device->scale[axis], error) ||
            !read_of_axis(dir, (char)('x' + axis), "offset", false, &device->offset[axis], error)) {
            return false;
        }
    }
    return read_matrix(device, error);
}

/* In the camera frame, m/s2. */
static bool read_sample(const struct device *device, double sample[3], struct hal_error *error)
{
    double sensor[3];
    for (int axis = 0; axis < 3; axis++) {
        char name[NAME_SIZE];
        double raw = 0.0;
        snprintf(name, sizeof name, "in_accel_%c_raw", 'x' + axis);
        if (!read_number(device->dir.text, name, &raw, error)) {
            return false;
        }
        sensor[axis] = (raw + device->offset[axis]) * device->scale[axis];
    }
    for (int row = 0; row < 3; row++) {
        sample[row] = device->rows[row][0] * sensor[0] + device->rows[row][1] * sensor[1] +
                      device->rows[row][2] * sensor[2];
    }
    return true;
}

static double length_of(const double vector[3])
{
    return sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]);
}

/* Of a sensor at rest. */
static bool check_samples(const double samples[HAL_IIO_SAMPLES][3], const double mean[3],
                          struct hal_error *error)
{
    double max = 0.0;
    const double length = length_of(mean);
    for (int i = 0; i < HAL_IIO_SAMPLES; i++) {
        const double from_mean[3] = {samples[i][0] - mean[0], samples[i][1] - mean[1],
                                     samples[i][2] - mean[2]};
        max = fmax(max, length_of(from_mean));
    }
    if (!(max <= HAL_IIO_MOVED_MAX)) {
        return hal_fail(error,
                        "it moves: readings are up to %.2f m/s2 from their mean, expected at most "
                        "%.1f of a camera at rest",
                        max, HAL_IIO_MOVED_MAX);
    }
    if (!(fabs(length - GRAVITY_M_S2) <= TOLERANCE * GRAVITY_M_S2)) {
        return hal_fail(error, "it reads %.2f m/s2, expected %.1f to %.1f of a camera at rest",
                        length, (1.0 - TOLERANCE) * GRAVITY_M_S2, (1.0 + TOLERANCE) * GRAVITY_M_S2);
    }
    return true;
}

static void name_device(const struct device *device, char *text, size_t size)
{
    struct hal_error ignored;
    const char *slash = strrchr(device->dir.text, '/');
    char *name = read_text(device->dir.text, "name", &ignored);
    snprintf(text, size, "%.60s (%.60s)", name != NULL ? name : "accelerometer",
             slash != NULL ? slash + 1 : device->dir.text);
    free(name);
}

bool hal_iio_read(const struct hal_iio_config *config, struct hal_iio_up *up,
                  struct hal_error *error)
{
    const struct timespec pause = {.tv_nsec = config->pause_us * 1000L};
    struct device device;
    double samples[HAL_IIO_SAMPLES][3];
    double mean[3] = {0.0, 0.0, 0.0};
    if (!find_device(config, &device, error) || !read_device(&device, error)) {
        return false;
    }
    for (int i = 0; i < HAL_IIO_SAMPLES; i++) {
        if (!read_sample(&device, samples[i], error)) {
            return false;
        }
        for (int axis = 0; axis < 3; axis++) {
            mean[axis] += samples[i][axis] / HAL_IIO_SAMPLES;
        }
        nanosleep(&pause, NULL);
    }
    if (!check_samples((const double(*)[3])samples, mean, error)) {
        return false;
    }
    up->gravity_m_s2 = length_of(mean);
    for (int axis = 0; axis < 3; axis++) {
        up->up[axis] = mean[axis] / up->gravity_m_s2;
    }
    name_device(&device, up->device, sizeof up->device);
    return true;
}
