#include "rd_bitmap.h"

#include <errno.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rd_vec.h"

static bool read_header(FILE *file, int *width, int *height)
{
    int max;
    return fscanf(file, "P5 %5d %5d %5d", width, height, &max) == 3 && fgetc(file) != EOF && max == 255 && *width > 0 &&
           *height > 0 && *width <= RD_BITMAP_SIDE_MAX && *height <= RD_BITMAP_SIDE_MAX;
}

/* What is wrong, or NULL. */
static const char *read_bitmap(FILE *file, struct rd_bitmap *bitmap)
{
    if (!read_header(file, &bitmap->width, &bitmap->height))
        return "no binary PGM of 8 bits with sides of at most 8192";
    size_t size = (size_t)bitmap->width * (size_t)bitmap->height;
    bitmap->samples = malloc(size);
    if (bitmap->samples == NULL)
        return "out of memory";
    return fread(bitmap->samples, 1, size, file) == size ? NULL : "too short";
}

struct rd_bitmap *rd_bitmap_load(const char *path)
{
    struct rd_bitmap *bitmap = calloc(1, sizeof *bitmap);
    FILE *file = fopen(path, "rb");
    const char *reason = file == NULL ? strerror(errno) : bitmap == NULL ? "out of memory" : read_bitmap(file, bitmap);
    if (file != NULL)
        fclose(file);
    if (reason == NULL)
        return bitmap;
    fprintf(stderr, "render: %s: %s\n", path, reason);
    rd_bitmap_free(bitmap);
    return NULL;
}

void rd_bitmap_free(struct rd_bitmap *bitmap)
{
    if (bitmap != NULL)
        free(bitmap->samples);
    free(bitmap);
}

double rd_bitmap_albedo(const struct rd_bitmap *bitmap, double column, double row)
{
    double x = rd_clamp(column, 0.0, bitmap->width - 1.0), y = rd_clamp(row, 0.0, bitmap->height - 1.0);
    int left = (int)x, top = (int)y;
    int right = left + 1 < bitmap->width ? left + 1 : left, below = top + 1 < bitmap->height ? top + 1 : top;
    const uint8_t *above_row = bitmap->samples + (size_t)top * (size_t)bitmap->width;
    const uint8_t *below_row = bitmap->samples + (size_t)below * (size_t)bitmap->width;
    double part_x = x - left, part_y = y - top;
    double upper = above_row[left] + part_x * (above_row[right] - above_row[left]);
    double lower = below_row[left] + part_x * (below_row[right] - below_row[left]);
    return (upper + part_y * (lower - upper)) / 255.0;
}
