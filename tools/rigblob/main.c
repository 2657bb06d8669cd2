/* rigblob - a calibrated rig as the blob that a board without JSON reads (ih_rig_blob.h). */
#include <errno.h>
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "app_rig.h"
#include "hal_file.h"
#include "rig/ih_rig_blob.h"

enum status { STATUS_GOOD = 0, STATUS_INPUT = 1, STATUS_USAGE = 2 };

static const char help_text[] =
    "rigblob RIG OUT\n"
    "rigblob --show BLOB\n"
    "Write the rig file RIG (rig.json, docs/contract.md) as a binary blob for boards\n"
    "without JSON, or print what is in one. A rig that the core refuses is refused\n"
    "here. OUT is another file than RIG, written completely or not at all.\n"
    "\n"
    "  --show     print the blob's numbers, one to a line\n"
    "  --help     this text\n"
    "\n"
    "Exit status: 0 done, 1 a file could not be read or written or is wrong, 2 wrong usage.\n";

/* Always STATUS_INPUT. */
static enum status fail(const char *path, const char *reason)
{
    fprintf(stderr, "rigblob: %s: %s\n", path, reason);
    return STATUS_INPUT;
}

static bool check(const struct ih_calibration *calibration, struct hal_error *error)
{
    static struct ih_rig rig;
    int32_t bad_slot = IH_NONE;
    enum ih_err err = ih_rig_init(&rig, calibration, &bad_slot);
    if (err != IH_OK) {
        app_rig_explain(calibration, err, bad_slot, error);
    }
    return err == IH_OK;
}

/* To the disk, then under its name. What stands there must be a file: root could replace a device. */
static bool put(const char *part, const char *path, const uint8_t *blob, struct hal_error *error)
{
    struct stat there;
    if (stat(path, &there) == 0 && !S_ISREG(there.st_mode)) {
        return hal_fail(error, "a directory, device or pipe, expected a file");
    }
    FILE *file = fopen(part, "wb");
    if (file == NULL) {
        return hal_fail(error, "%s", strerror(errno));
    }
    bool good = fwrite(blob, 1, IH_RIG_BLOB_BYTES, file) == IH_RIG_BLOB_BYTES &&
                fflush(file) == 0 && fsync(fileno(file)) == 0;
    int reason = errno;
    if (fclose(file) != 0 && good) {
        good = false;
        reason = errno;
    }
    if (good && rename(part, path) != 0) {
        good = false;
        reason = errno;
    }
    if (!good) {
        remove(part);
        return hal_fail(error, "%s", strerror(reason));
    }
    return true;
}

/* The same file, whatever its path. */
static bool is_same(const char *first, const char *second)
{
    struct stat one, other;
    return stat(first, &one) == 0 && stat(second, &other) == 0 && one.st_dev == other.st_dev &&
           one.st_ino == other.st_ino;
}

/* part: a file beside OUT, which gets its name once it is whole. */
static enum status write_blob(const char *rig_path, const char *part, const char *path)
{
    static struct ih_calibration calibration;
    static uint8_t blob[IH_RIG_BLOB_BYTES];
    struct hal_error error;
    if (is_same(rig_path, path) || is_same(rig_path, part)) {
        fprintf(stderr, "rigblob: %s: OUT would replace RIG, expected another file\n", path);
        return STATUS_USAGE;
    }
    if (!app_rig_load(rig_path, &calibration, &error) || !check(&calibration, &error)) {
        return fail(rig_path, error.text);
    }
    enum ih_err err = app_rig_to_blob(&calibration, blob);
    if (err != IH_OK) {
        return fail(rig_path, ih_err_text(err));
    }
    return put(part, path, blob, &error) ? STATUS_GOOD : fail(path, error.text);
}

static enum status convert(const char *rig_path, const char *path)
{
    size_t size = strlen(path) + sizeof ".part";
    char *part = malloc(size);
    if (part == NULL) {
        return fail(path, "no memory");
    }
    int length = snprintf(part, size, "%s.part", path);
    enum status status = length > 0 ? write_blob(rig_path, part, path) : fail(path, "too long");
    free(part);
    return status;
}

static void print(const char *name, int32_t value, int fraction_bits)
{
    printf("%s %.9g\n", name, (double)value / (double)((int64_t)1 << fraction_bits));
}

static void print_calibration(const struct ih_calibration *c)
{
    static const char axis[] = "xyz";
    printf("kind %s\n", c->kind == IH_RIG_RANGE ? "range" : "dots");
    print("image_width", c->width, 0);
    print("image_height", c->height, 0);
    print("fx", c->fx_px_q16, 16);
    print("fy", c->fy_px_q16, 16);
    print("cx", c->cx_px_q16, 16);
    print("cy", c->cy_px_q16, 16);
    print("k1", c->k1_q24, 24);
    print("k2", c->k2_q24, 24);
    print("p1", c->p1_q24, 24);
    print("p2", c->p2_q24, 24);
    print("k3", c->k3_q24, 24);
    print("near_mm", c->near_mm, 0);
    print("far_mm", c->far_mm, 0);
    for (int i = 0; i < 3; i++) {
        char name[sizeof "projector_origin x"];
        snprintf(name, sizeof name, "projector_origin %c", axis[i]);
        print(name, c->origin_mm_q16[i], 16);
    }
    printf("up %.9g %.9g %.9g\n", c->up_q30[0] / 0x1p30, c->up_q30[1] / 0x1p30,
           c->up_q30[2] / 0x1p30);
    for (int slot = 0; slot < IH_SLOTS && c->kind == IH_RIG_DOTS; slot++) {
        const int32_t *ray = c->ray_q30[slot];
        printf("dot_rays[%d] %.9f %.9f %.9f\n", slot, ray[0] / 0x1p30, ray[1] / 0x1p30,
               ray[2] / 0x1p30);
    }
}

static enum status show_blob(const char *path)
{
    static struct ih_calibration calibration;
    struct hal_error error;
    uint8_t *blob = NULL;
    size_t size = 0;
    if (!hal_file_read(path, 2 * IH_RIG_BLOB_BYTES, &blob, &size, &error)) {
        return fail(path, error.text);
    }
    enum ih_err err = ih_rig_blob_decode(blob, size, &calibration);
    free(blob);
    if (err != IH_OK) {
        return fail(path, ih_err_text(err));
    }
    if (!check(&calibration, &error)) {
        return fail(path, error.text);
    }
    print_calibration(&calibration);
    return STATUS_GOOD;
}

int main(int argument_count, char **arguments)
{
    static const struct option table[] = {
        {"show", no_argument, NULL, 's'}, {"help", no_argument, NULL, 'h'}, {NULL, 0, NULL, 0}};
    bool show = false, help = false;
    int option = 0;
    while ((option = getopt_long(argument_count, arguments, "", table, NULL)) != -1) {
        if (option == '?') {
            return STATUS_USAGE; /* getopt has said why */
        }
        show = show || option == 's';
        help = help || option == 'h';
    }
    char **path = arguments + optind;
    enum status status = STATUS_GOOD;
    if (help) {
        fputs(help_text, stdout);
    } else if (argument_count - optind != (show ? 1 : 2)) {
        fputs("rigblob: expected RIG OUT, or --show BLOB; see rigblob --help\n", stderr);
        return STATUS_USAGE;
    } else {
        status = show ? show_blob(path[0]) : convert(path[0], path[1]);
    }
    if (fflush(stdout) != 0) {
        return (int)fail("standard output", strerror(errno));
    }
    return (int)status;
}
