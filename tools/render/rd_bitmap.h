/* rd_bitmap - a printed sheet: albedo by position, from a binary PGM of 8 bits. A sample of 255 is an albedo of 1.
 */
#ifndef RD_BITMAP_H
#define RD_BITMAP_H

#include <stdint.h>

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

#endif
