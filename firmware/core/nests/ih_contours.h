/* ih_contours - contours of equal depth of the surface (paper, section 3.2).
 *
 * In:     the depth grid and one depth.
 * Out:    the contours at that depth: closed polygons, and open ones that end at the grid's border.
 * Method: marching squares. A node is inside when depth < level (strictly), so a level that
 *         meets a node exactly still gives clean polygons. Vertices are interpolated along the cell
 *         edges. A saddle cell is joined across when the mean of its four nodes is inside: one rule
 *         for all, so contours never cross. Every contour runs with the inside (nearer) on its
 *         right as seen on a screen (x right, y down): its signed area, sum(x0 y1 - x1 y0) / 2, is
 *         positive around a minimum of depth and negative around a maximum.
 * Cost:   one comparison per node, one division per vertex. Nodes and cells are bits of a row, so that
 *         only cells that a contour crosses are visited.
 * Full tables drop and count: a contour that does not fit is dropped whole, contours_dropped.
 */
#ifndef IH_CONTOURS_H
#define IH_CONTOURS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "surface/ih_surface.h"

/* Vertices of all contours of one level; 4 bytes each. Real surfaces need up to about 300; the worst
 * checkerboard would have 2 x 46 x 46 segments. */
#define IH_CONTOURS_VERTICES_MAX 2048
#define IH_CONTOURS_CONTOURS_MAX 64

/* A point on the grid: 0 .. IH_SURFACE_GRID - 1 steps. */
struct ih_vertex {
    int16_t x_q9, y_q9;
};

struct ih_contour {
    int16_t first, vertex_count; /* in ih_contours.vertex; a closed one does not repeat its first */
    bool closed;
};

struct ih_contours {
    int32_t level_mm_q8;
    int32_t contour_count, vertex_count;
    int32_t contours_dropped;
    struct ih_contour contour[IH_CONTOURS_CONTOURS_MAX];
    struct ih_vertex vertex[IH_CONTOURS_VERTICES_MAX];
    /* scratch, bit x of row y: node x is inside; no contour has entered cell x yet, through its upper or
     * right edge [0], through its lower or left one [1] */
    uint64_t inside[IH_SURFACE_GRID];
    uint64_t entrance[2][IH_SURFACE_GRID];
};

IH_BEGIN_DECLS

void ih_contours_level(const struct ih_surface *surface, int32_t level_mm_q8,
                       struct ih_contours *out);

IH_END_DECLS

#endif
