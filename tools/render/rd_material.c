#include "rd_material.h"

#include <errno.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rd_rng.h"
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

#define EYE_ALBEDO 0.22
#define GLASSES_ALBEDO 0.05
#define MASK_ALBEDO 0.8

static bool in_ellipse(double x, double y, double half_x, double half_y)
{
    x /= half_x;
    y /= half_y;
    return x * x + y * y < 1.0;
}

static bool is_hair(const struct rd_face_paint *face, struct rd_vec u)
{
    /* The border of the hair falls from the forehead over the temples to the nape. */
    double back = rd_smoothstep(-0.30, 0.50, u.z);
    return u.y < face->hairline + (0.5 - face->hairline) * back;
}

static double face_front(const struct rd_material *m, struct rd_vec u)
{
    const struct rd_face_paint *face = &m->face;
    double side = fabs(u.x);
    if (face->glasses) {
        double x = (side - 0.42) / 0.30, y = (u.y + 0.04) / 0.19, rim = x * x + y * y;
        if (rim < 1.2 && rim > 0.8)
            return GLASSES_ALBEDO;
        if (side < 0.14 && fabs(u.y + 0.08) < 0.02)
            return GLASSES_ALBEDO;
    }
    if (face->mask && u.y > 0.12)
        return MASK_ALBEDO;
    if (in_ellipse(side - 0.40, u.y + 0.06, 0.15, 0.055))
        return EYE_ALBEDO;
    if (in_ellipse(side - 0.42, u.y + 0.22, 0.24, 0.035))
        return fmin(m->albedo, 1.5 * face->hair_albedo);
    if (in_ellipse(u.x, u.y - 0.55, 0.30, 0.05))
        return 0.65 * m->albedo;
    if (in_ellipse(side - 0.09, u.y - 0.34, 0.05, 0.025))
        return 0.1;
    if (face->beard_albedo > 0.0 && u.y > 0.36 + 0.5 * (0.5 - side) * (side < 0.25 ? 0.0 : 1.0))
        return face->beard_albedo;
    return m->albedo;
}

static double face_albedo(const struct rd_material *m, struct rd_vec local_mm)
{
    struct rd_vec u = rd_over(local_mm, m->face.axes_mm);
    if (is_hair(&m->face, u))
        return m->face.hair_albedo;
    return u.z < -0.25 ? face_front(m, u) : m->albedo;
}

static double pattern_albedo(const struct rd_material *m, struct rd_vec p)
{
    struct rd_vec q = rd_scale(p, 1.0 / m->period_mm);
    switch (m->pattern) {
    case RD_PLAIN:
        return m->albedo;
    case RD_STRIPES:
        return q.y - floor(q.y) < 0.5 ? m->albedo : m->albedo2;
    case RD_CHECKS:
        return fmod(fabs(floor(q.x) + floor(q.y) + floor(q.z)), 2.0) < 0.5 ? m->albedo : m->albedo2;
    case RD_TILES:
        return q.x - floor(q.x) < 0.06 || q.y - floor(q.y) < 0.06 ? m->albedo2 : m->albedo;
    case RD_MOTTLE: {
        double s = rd_smoothstep(0.3, 0.7, rd_noise3(q.x, q.y, q.z, m->seed));
        return m->albedo + (m->albedo2 - m->albedo) * s;
    }
    case RD_FACE:
        return face_albedo(m, p);
    case RD_BITMAP:
        return rd_bitmap_albedo(m->bitmap, q.x + 0.5 * (m->bitmap->width - 1), q.y + 0.5 * (m->bitmap->height - 1));
    }
    return m->albedo;
}

double rd_material_albedo(const struct rd_material *material, struct rd_vec local_mm)
{
    double albedo = pattern_albedo(material, local_mm);
    if (material->grain > 0.0) {
        struct rd_vec q = rd_scale(local_mm, 1.0 / material->grain_mm);
        albedo *= 1.0 + material->grain * (2.0 * rd_noise3(q.x, q.y, q.z, material->seed + 1) - 1.0);
    }
    return rd_clamp(albedo, 0.01, 0.95);
}
