/* rd_material - how much light a point of a surface sends back (its albedo at the laser's 670 nm, also used for
 * the ambient picture), by pattern and place.
 * In:    a point in the pattern's own frame, mm.
 * Out:   albedo 0.01 .. 0.95.
 * A printed sheet's albedo comes from a binary PGM of 8 bits: a sample of 255 is an albedo of 1.
 */
#ifndef RD_MATERIAL_H
#define RD_MATERIAL_H

#include <stdbool.h>
#include <stdint.h>

#include "rd_vec.h"

/* Longer sides are refused. */
#define RD_BITMAP_SIDE_MAX 8192

struct rd_bitmap {
    int width, height;
    uint8_t *samples; /* row by row */
};

/* NULL: reported on standard error. */
struct rd_bitmap *rd_bitmap_load(const char *path);
void rd_bitmap_free(struct rd_bitmap *bitmap);

/* Albedo at a position in samples, their centres at integers; between them it is linear, outside it is the border's. */
double rd_bitmap_albedo(const struct rd_bitmap *bitmap, double column, double row);

enum rd_pattern {
    RD_PLAIN,
    RD_STRIPES, /* across Y */
    RD_CHECKS,
    RD_TILES,  /* joints of the second albedo in X and Y */
    RD_MOTTLE, /* coarse smooth spots between the two albedos */
    RD_FACE,   /* skin and what is painted on it: see struct rd_face_paint */
    RD_BITMAP  /* a printed sheet about the origin in X and Y, a sample every period_mm */
};

/* Coordinates of the paint are the head's own, in units of its semi-axes: the face looks to -Z. */
struct rd_face_paint {
    struct rd_vec axes_mm;
    double hairline; /* -1 top of the head .. 0 middle; below -1: bald */
    double hair_albedo;
    double beard_albedo; /* 0: none */
    bool glasses, mask;
};

struct rd_material {
    enum rd_pattern pattern;
    double albedo, albedo2;
    double period_mm;
    double grain; /* relative amplitude of fine irregularity, 0 .. 0.5 */
    double grain_mm;
    double gloss; /* strength of a highlight in the ambient picture, 0 .. 1 */
    uint64_t seed;
    struct rd_face_paint face;
    const struct rd_bitmap *bitmap;
};

double rd_material_albedo(const struct rd_material *material, struct rd_vec local_mm);

#endif
