#define _POSIX_C_SOURCE 200809L

#include "rd_range.h"

#include <cjson/cJSON.h>
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define FILE_BYTES_MAX (64 << 20)
#define SIDE_PX_MIN 64
#define SIDE_PX_MAX 1280
#define MM_MAX 1e6

static bool complain(const char *dir, const char *name, const char *reason)
{
    fprintf(stderr, "render: %s%s%s: %s\n", dir, name[0] != '\0' ? "/" : "", name, reason);
    return false;
}

static char *join(const char *left, const char *right)
{
    size_t size = strlen(left) + strlen(right) + 2;
    char *path = malloc(size);
    if (path != NULL)
        snprintf(path, size, "%s/%s", left, right);
    return path;
}

/* The whole file with a zero after it; NULL: reported. */
static char *read_all(const char *dir, const char *name, size_t *size)
{
    char *path = join(dir, name), *text = NULL;
    FILE *file = path != NULL ? fopen(path, "rb") : NULL;
    struct stat status;
    const char *reason = NULL;
    if (file == NULL || fstat(fileno(file), &status) != 0)
        reason = strerror(errno);
    else if (!S_ISREG(status.st_mode) || status.st_size > FILE_BYTES_MAX)
        reason = "no regular file of at most 64 MB";
    else if ((text = malloc((size_t)status.st_size + 1)) == NULL)
        reason = "out of memory";
    else if ((*size = fread(text, 1, (size_t)status.st_size, file)) != (size_t)status.st_size)
        reason = "could not be read to its end";
    if (reason != NULL) {
        complain(dir, name, reason);
        free(text);
        text = NULL;
    } else if (text != NULL) {
        text[*size] = '\0';
    }
    if (file != NULL)
        fclose(file);
    free(path);
    return text;
}

/* An array of exactly count numbers. */
static bool read_numbers(const cJSON *array, int count, double *values)
{
    const cJSON *item = NULL;
    int index = 0;
    if (!cJSON_IsArray(array) || cJSON_GetArraySize(array) != count)
        return false;
    cJSON_ArrayForEach(item, array)
    {
        if (!cJSON_IsNumber(item) || !(fabs(item->valuedouble) <= MM_MAX))
            return false;
        values[index++] = item->valuedouble;
    }
    return true;
}

static bool read_matrix(const cJSON *rig, const char *name, int count, double *values)
{
    const cJSON *matrix = cJSON_GetObjectItemCaseSensitive(rig, name);
    return read_numbers(cJSON_GetObjectItemCaseSensitive(matrix, "data"), count, values);
}

static double number_in(const cJSON *object, const char *name)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    return cJSON_IsNumber(item) ? item->valuedouble : -1.0;
}

/* What is wrong with a rig, or NULL. */
static const char *take_rig(const cJSON *rig, struct rd_range_frame *frame)
{
    const cJSON *kind = cJSON_GetObjectItemCaseSensitive(rig, "kind");
    double m[9] = {0.0}, lens[5] = {0.0}, width = number_in(rig, "image_width"),
           height = number_in(rig, "image_height");
    if (!cJSON_IsString(kind) || strcmp(kind->valuestring, "range") != 0)
        return "not the rig of a range directory: \"kind\" must be \"range\"";
    if (!(width >= SIDE_PX_MIN && width <= SIDE_PX_MAX && height >= SIDE_PX_MIN && height <= SIDE_PX_MAX) ||
        width != floor(width) || height != floor(height))
        return "image_width, image_height: must be whole numbers from 64 to 1280";
    if (!read_matrix(rig, "camera_matrix", 9, m) || !(m[0] >= 1.0 && m[4] >= 1.0))
        return "camera_matrix: expected 3x3 numbers with focal lengths of at least 1";
    if (!read_matrix(rig, "distortion_coefficients", 5, lens))
        return "distortion_coefficients: expected 1x5 numbers";
    for (int i = 0; i < 5; i++) {
        if (lens[i] != 0.0)
            return "distortion_coefficients: only depth images without distortion can be rendered";
    }
    frame->camera = (struct rd_relief_camera){(int)width, (int)height, m[0], m[4], m[2], m[5]};
    frame->near_mm = number_in(rig, "near_mm");
    frame->far_mm = number_in(rig, "far_mm");
    return frame->near_mm > 0.0 && frame->far_mm > frame->near_mm ? NULL : "near_mm, far_mm: must be 0 < near < far";
}

static bool read_rig(const char *dir, struct rd_range_frame *frame)
{
    size_t size = 0;
    char *text = read_all(dir, "rig.json", &size);
    if (text == NULL)
        return false;
    cJSON *rig = cJSON_Parse(text);
    const char *wrong = rig != NULL ? take_rig(rig, frame) : "not JSON";
    cJSON_Delete(rig);
    free(text);
    return wrong == NULL || complain(dir, "rig.json", wrong);
}

static bool take_head(const cJSON *item, struct rd_range_frame *frame)
{
    double c[3] = {0.0}, a[3] = {0.0};
    if (frame->head_count >= RD_RANGE_HEADS_MAX ||
        !read_numbers(cJSON_GetObjectItemCaseSensitive(item, "centre_mm"), 3, c) ||
        !read_numbers(cJSON_GetObjectItemCaseSensitive(item, "semi_axes_mm"), 3, a) ||
        !(a[0] > 0.0 && a[1] > 0.0 && a[2] > 0.0))
        return false;
    frame->heads[frame->head_count++] = (struct rd_range_head){rd_v(c[0], c[1], c[2]), rd_v(a[0], a[1], a[2])};
    return true;
}

/* "heads" where it is present, else "head". */
static bool take_heads(const cJSON *line, struct rd_range_frame *frame)
{
    const cJSON *head = cJSON_GetObjectItemCaseSensitive(line, "head"), *item = NULL;
    const cJSON *heads = cJSON_GetObjectItemCaseSensitive(line, "heads");
    if (!cJSON_IsArray(heads))
        return cJSON_IsNull(head) || take_head(head, frame);
    cJSON_ArrayForEach(item, heads)
    {
        if (!take_head(item, frame))
            return false;
    }
    return true;
}

static struct rd_range_frame *find_frame(struct rd_range *range, int first, const cJSON *file)
{
    for (int i = first; cJSON_IsString(file) && i < range->frame_count; i++) {
        if (strcmp(range->frames[i].name, file->valuestring) == 0)
            return &range->frames[i];
    }
    return NULL;
}

/* Heads of the frames from `first` on, which are all of dir. */
static bool read_truth(struct rd_range *range, int first, const char *dir)
{
    size_t size = 0;
    char *text = read_all(dir, "truth.jsonl", &size), *position = NULL;
    int described_count = 0;
    bool good = text != NULL;
    for (char *row = good ? strtok_r(text, "\n", &position) : NULL; good && row != NULL;
         row = strtok_r(NULL, "\n", &position)) {
        cJSON *line = cJSON_Parse(row);
        struct rd_range_frame *frame = find_frame(range, first, cJSON_GetObjectItemCaseSensitive(line, "file"));
        good = line != NULL && (frame == NULL || take_heads(line, frame));
        described_count += frame != NULL;
        cJSON_Delete(line);
        if (!good)
            complain(dir, "truth.jsonl", "a line is no JSON or its heads are wrong");
    }
    free(text);
    if (good && described_count != range->frame_count - first)
        return complain(dir, "truth.jsonl", "must have one line for each depth image");
    return good;
}

static int is_image(const struct dirent *entry)
{
    const char *suffix = strrchr(entry->d_name, '.');
    return suffix != NULL && suffix != entry->d_name && strcmp(suffix, ".pgm") == 0;
}

static int is_visible(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

/* The last part of the directory's path, without slashes at its end, and the file's name. */
static char *source_of(const char *dir, const char *name)
{
    char *path = join(dir, name);
    if (path == NULL)
        return NULL;
    char *start = path + strlen(dir);
    while (start > path && start[-1] == '/')
        start--;
    while (start > path && start[-1] != '/')
        start--;
    char *source = strdup(start);
    free(path);
    return source;
}

static bool add_frame(struct rd_range *range, const char *dir, const char *name, const struct rd_range_frame *like)
{
    struct rd_range_frame *grown = realloc(range->frames, ((size_t)range->frame_count + 1) * sizeof *grown);
    if (grown == NULL)
        return complain(dir, name, "out of memory");
    range->frames = grown;
    struct rd_range_frame *frame = &grown[range->frame_count++];
    *frame = *like;
    frame->dir = strdup(dir);
    frame->name = strdup(name);
    frame->source = source_of(dir, name);
    return (frame->dir != NULL && frame->name != NULL && frame->source != NULL) || complain(dir, name, "out of memory");
}

static bool add_directory(struct rd_range *range, const char *dir)
{
    struct rd_range_frame like = {.head_count = 0};
    struct dirent **entries = NULL;
    int first = range->frame_count;
    if (!read_rig(dir, &like))
        return false;
    int count = scandir(dir, &entries, is_image, alphasort);
    bool good = count > 0 || complain(dir, "", count < 0 ? strerror(errno) : "no depth images");
    for (int i = 0; i < count; i++) {
        good = good && add_frame(range, dir, entries[i]->d_name, &like);
        free(entries[i]);
    }
    free(entries);
    return good && read_truth(range, first, dir);
}

static bool has_rig(const char *dir)
{
    struct stat status;
    char *path = join(dir, "rig.json");
    bool found = path != NULL && stat(path, &status) == 0;
    free(path);
    return found;
}

bool rd_range_open(struct rd_range *range, const char *dir)
{
    struct dirent **entries = NULL;
    *range = (struct rd_range){.frames = NULL};
    if (has_rig(dir))
        return add_directory(range, dir);
    int count = scandir(dir, &entries, is_visible, alphasort);
    bool good = count >= 0 || complain(dir, "", strerror(errno));
    for (int i = 0; i < count; i++) {
        char *child = join(dir, entries[i]->d_name);
        if (good && child != NULL && has_rig(child))
            good = add_directory(range, child);
        free(child);
        free(entries[i]);
    }
    free(entries);
    return good && (range->frame_count > 0 || complain(dir, "", "no range directory: it has no rig.json"));
}

void rd_range_close(struct rd_range *range)
{
    for (int i = 0; i < range->frame_count; i++) {
        free(range->frames[i].dir);
        free(range->frames[i].name);
        free(range->frames[i].source);
    }
    free(range->frames);
    *range = (struct rd_range){.frames = NULL};
}

/* One number of a PGM's header, after white space and comments; negative: there is none. */
static int header_number(const char **at, const char *end)
{
    int value = 0, digit_count = 0;
    while (*at < end && strchr(" \t\r\n#", **at) != NULL) {
        if (**at == '#')
            while (*at < end && **at != '\n')
                (*at)++;
        else
            (*at)++;
    }
    while (*at < end && **at >= '0' && **at <= '9' && digit_count++ < 6)
        value = 10 * value + (*(*at)++ - '0');
    return digit_count > 0 ? value : -1;
}

/* The depths within the working range; NULL: reported. */
static uint16_t *read_depths(const struct rd_range_frame *frame)
{
    size_t size = 0;
    char *text = read_all(frame->dir, frame->name, &size);
    if (text == NULL)
        return NULL;
    const char *at = text + 2, *end = text + size;
    size_t pixel_count = (size_t)frame->camera.width * (size_t)frame->camera.height;
    bool magic = size > 2 && text[0] == 'P' && text[1] == '5';
    int width = magic ? header_number(&at, end) : -1, height = magic ? header_number(&at, end) : -1;
    int max_value = magic ? header_number(&at, end) : -1;
    uint16_t *depths = NULL;
    if (max_value < 256 || max_value > 65535)
        complain(frame->dir, frame->name, "no binary PGM of 16 bits");
    else if (width != frame->camera.width || height != frame->camera.height)
        complain(frame->dir, frame->name, "its size is not the rig's");
    else if (end - at < 1 || (size_t)(end - at - 1) < 2 * pixel_count)
        complain(frame->dir, frame->name, "too short");
    else if ((depths = malloc(pixel_count * sizeof *depths)) == NULL)
        complain(frame->dir, frame->name, "out of memory");
    const unsigned char *bytes = (const unsigned char *)at + 1;
    for (size_t i = 0; depths != NULL && i < pixel_count; i++) {
        int depth_mm = bytes[2 * i] << 8 | bytes[2 * i + 1];
        depths[i] = depth_mm >= frame->near_mm && depth_mm <= frame->far_mm ? (uint16_t)depth_mm : 0;
    }
    free(text);
    return depths;
}

struct rd_relief *rd_range_load(const struct rd_range_frame *frame)
{
    uint16_t *depths = read_depths(frame);
    if (depths == NULL)
        return NULL;
    struct rd_relief *relief = rd_relief_new(&frame->camera, depths);
    if (relief == NULL)
        complain(frame->dir, frame->name, "out of memory");
    free(depths);
    return relief;
}
