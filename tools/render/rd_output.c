#define _POSIX_C_SOURCE 200809L

#include "rd_output.h"

#include <dirent.h>
#include <errno.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool complain(const char *path)
{
    fprintf(stderr, "render: %s: %s\n", path, strerror(errno));
    return false;
}

static bool path_in(const struct rd_output *output, const char *name, char path[RD_PATH_MAX])
{
    int length = snprintf(path, RD_PATH_MAX, "%s/%s", output->dir, name);
    if (length > 0 && length < RD_PATH_MAX)
        return true;
    errno = ENAMETOOLONG;
    return complain(output->dir);
}

static void frame_name(int frame, char name[32])
{
    snprintf(name, 32, "%06d.pgm", frame);
}

static FILE *open_in(const struct rd_output *output, const char *name)
{
    char path[RD_PATH_MAX];
    if (!path_in(output, name, path))
        return NULL;
    FILE *file = fopen(path, "wb");
    if (file == NULL)
        complain(path);
    return file;
}

/* Closes a file that was written; a full disk often shows only now. */
static bool close_in(const struct rd_output *output, const char *name, FILE *file)
{
    char path[RD_PATH_MAX];
    bool written = !ferror(file);
    if (fclose(file) == 0 && written)
        return true;
    if (!written)
        errno = EIO; /* the write's own reason is long gone */
    return path_in(output, name, path) && complain(path);
}

static bool make_directories(const char *dir)
{
    char path[RD_PATH_MAX];
    size_t length = strlen(dir);
    if (length >= sizeof path) {
        errno = ENAMETOOLONG;
        return complain(dir);
    }
    for (size_t i = 1; i <= length; i++) {
        if (dir[i] != '/' && dir[i] != '\0')
            continue;
        memcpy(path, dir, i);
        path[i] = '\0';
        if (mkdir(path, 0777) != 0 && errno != EEXIST)
            return complain(path);
    }
    return true;
}

/* True: it is not there (any more). */
static bool remove_in(const struct rd_output *output, const char *name)
{
    char path[RD_PATH_MAX];
    return path_in(output, name, path) && (unlink(path) == 0 || errno == ENOENT || complain(path));
}

bool rd_output_open(struct rd_output *output, const char *dir)
{
    *output = (struct rd_output){.dir = dir};
    if (!make_directories(dir) || !remove_in(output, "rig.json"))
        return false;
    output->frames = open_in(output, "frames.jsonl");
    output->truth = output->frames != NULL ? open_in(output, "truth.jsonl") : NULL;
    return output->truth != NULL;
}

static void write_samples(FILE *file, int count, int max_value, const uint16_t *samples)
{
    for (int i = 0; i < count; i++) {
        if (max_value > 255)
            putc(samples[i] >> 8, file);
        putc(samples[i] & 255, file);
    }
}

/* Any text as a JSON string. */
static void write_string(FILE *file, const char *text)
{
    putc('"', file);
    for (const char *at = text; *at != '\0'; at++) {
        if ((unsigned char)*at < 0x20)
            fprintf(file, "\\u%04x", (unsigned)*at);
        else
            fprintf(file, "%s%c", *at == '"' || *at == '\\' ? "\\" : "", *at);
    }
    putc('"', file);
}

bool rd_output_frame(struct rd_output *output, int frame, const struct rd_frame_note *note, const struct rd_rig *rig,
                     int max_value, const uint16_t *samples)
{
    char name[32];
    frame_name(frame, name);
    FILE *file = open_in(output, name);
    if (file == NULL)
        return false;
    fprintf(file, "P5\n%d %d\n%d\n", rig->width, rig->height, max_value);
    write_samples(file, rig->width * rig->height, max_value, samples);
    fprintf(output->frames, "{\"file\":\"%s\",\"time_us\":%lld,\"laser\":%s", name, (long long)note->time_us,
            note->laser ? "true" : "false");
    if (note->source != NULL) {
        fputs(",\"source\":", output->frames);
        write_string(output->frames, note->source);
    }
    fputs("}\n", output->frames);
    return close_in(output, name, file);
}

static void write_head(FILE *file, const struct rd_head_truth *head)
{
    struct rd_vec c = head->centre_mm, a = head->semi_axes_mm;
    fprintf(file, "{\"centre_mm\":[%.2f,%.2f,%.2f],\"semi_axes_mm\":[%.2f,%.2f,%.2f]", c.x, c.y, c.z, a.x, a.y, a.z);
    if (head->angles_known)
        fprintf(file, ",\"angles_deg\":[%.2f,%.2f,%.2f]", head->yaw_deg, head->pitch_deg, head->roll_deg);
    putc('}', file);
}

static void write_vec(FILE *file, const char *before, struct rd_vec v)
{
    fprintf(file, "%s[%.9g,%.9g,%.9g]", before, v.x, v.y, v.z);
}

static void write_dots(FILE *file, const char *name, const struct rd_dot_list *list, bool is_dim)
{
    const char *before = "";
    fprintf(file, ",\"%s\":[", name);
    for (int i = 0; i < list->dot_count; i++) {
        const struct rd_dot *dot = &list->dots[i];
        if (dot->is_dim != is_dim)
            continue;
        fprintf(file, "%s[%d,%.3f,%.3f,%.2f]", before, dot->index, dot->u_px, dot->v_px, dot->z_mm);
        before = ",";
    }
    putc(']', file);
}

void rd_output_truth(struct rd_output *output, int frame, const struct rd_truth *truth, const struct rd_dot_list *dots)
{
    FILE *file = output->truth;
    char name[32];
    frame_name(frame, name);
    fprintf(file, "{\"file\":\"%s\",\"head\":", name);
    if (truth->head != RD_NOBODY)
        write_head(file, &truth->heads[truth->head]);
    else
        fputs("null", file);
    for (int i = 0; truth->several && i < truth->head_count; i++) {
        fputs(i == 0 ? ",\"heads\":[" : ",", file);
        write_head(file, &truth->heads[i]);
        fputs(i == truth->head_count - 1 ? "]" : "", file);
    }
    if (truth->board_known) {
        write_vec(file, ",\"board\":{\"middle_mm\":", truth->board.origin_mm);
        write_vec(file, ",\"across\":", truth->board.rot.x);
        write_vec(file, ",\"down\":", truth->board.rot.y);
        putc('}', file);
    }
    if (dots != NULL) {
        write_dots(file, "dots", dots, false);
        write_dots(file, "dim_dots", dots, true);
    }
    fputs("}\n", file);
}

static void write_matrix(FILE *file, const char *name, int rows, int columns, const double *data)
{
    fprintf(file, "  \"%s\":{\"type_id\":\"opencv-matrix\",\"rows\":%d,\"cols\":%d,\"dt\":\"d\",\"data\":[", name, rows,
            columns);
    for (int i = 0; i < rows * columns; i++) {
        /* With a point or exponent: OpenCV's reader would take a bare 0 for an integer. */
        char number[40];
        snprintf(number, sizeof number, "%.17g", data[i]);
        fprintf(file, "%s%s%s", i > 0 ? "," : "", number, strpbrk(number, ".e") != NULL ? "" : ".0");
    }
    fputs("]},\n", file);
}

static bool write_rig(const struct rd_output *output, const struct rd_rig *rig)
{
    FILE *file = open_in(output, "rig.json");
    if (file == NULL)
        return false;
    double camera[9] = {rig->fx_px, 0.0, rig->cx_px, 0.0, rig->fy_px, rig->cy_px, 0.0, 0.0, 1.0};
    double lens[5] = {rig->k1, rig->k2, rig->p1, rig->p2, rig->k3};
    double rays[3 * RD_DOT_COUNT];
    for (int i = 0; i < RD_DOT_COUNT; i++) {
        rays[3 * i] = rig->dot_rays[i].x;
        rays[3 * i + 1] = rig->dot_rays[i].y;
        rays[3 * i + 2] = rig->dot_rays[i].z;
    }
    fprintf(file, "{\n  \"kind\":\"%s\",\n  \"image_width\":%d,\n  \"image_height\":%d,\n",
            rig->is_range ? "range" : "dots", rig->width, rig->height);
    write_matrix(file, "camera_matrix", 3, 3, camera);
    write_matrix(file, "distortion_coefficients", 1, 5, lens);
    if (!rig->is_range) {
        double projector[3] = {rig->projector_mm.x, rig->projector_mm.y, rig->projector_mm.z};
        write_matrix(file, "projector_origin", 3, 1, projector);
        write_matrix(file, "dot_rays", RD_DOT_COUNT, 3, rays);
    }
    fprintf(file, "  \"near_mm\":%.1f,\n  \"far_mm\":%.1f\n}\n", rig->near_mm, rig->far_mm);
    return close_in(output, "rig.json", file);
}

/* A frame's name, of another frame than first .. end - 1. */
static bool is_other_frame(const char *name, int first, int end)
{
    int frame, length = 0;
    bool is_frame = strspn(name, "0123456789") >= 6 && sscanf(name, "%9d.pgm%n", &frame, &length) == 1 && length > 0;
    return is_frame && name[length] == '\0' && (frame < first || frame >= end);
}

static bool remove_other_frames(const struct rd_output *output, int first, int end)
{
    bool good = true;
    DIR *stream = opendir(output->dir);
    const struct dirent *entry;
    if (stream == NULL)
        return complain(output->dir);
    while (good && (entry = readdir(stream)) != NULL)
        good = !is_other_frame(entry->d_name, first, end) || remove_in(output, entry->d_name);
    closedir(stream);
    return good;
}

bool rd_output_finish(struct rd_output *output, const struct rd_rig *rig, int first, int end)
{
    bool frames_ok = close_in(output, "frames.jsonl", output->frames);
    bool truth_ok = close_in(output, "truth.jsonl", output->truth);
    output->frames = NULL;
    output->truth = NULL;
    return frames_ok && truth_ok && remove_other_frames(output, first, end) && write_rig(output, rig);
}

void rd_output_abandon(struct rd_output *output)
{
    if (output->frames != NULL)
        fclose(output->frames);
    if (output->truth != NULL)
        fclose(output->truth);
}
