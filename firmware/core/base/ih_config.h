/* ih_config - the sizes that every stage shares, and what headers need for C++.
 *
 * A limit that belongs to one stage stands in that stage's header; here are only the few that
 * several stages must agree on. All are compile-time constants, so that the whole state is one
 * struct of known size and nothing is ever allocated.
 */
#ifndef IH_CONFIG_H
#define IH_CONFIG_H

/* Around each header's declarations of functions: C++ links with the functions compiled as C. */
#ifdef __cplusplus
#define IH_BEGIN_DECLS extern "C" {
#define IH_END_DECLS }
#else
#define IH_BEGIN_DECLS
#define IH_END_DECLS
#endif

/* Dots in a row and in a column of the projected pattern (paper, section 2.1: 19x19). */
#define IH_GRID 19
/* Slots of the dot table; slot = row * IH_GRID + column. */
#define IH_SLOTS (IH_GRID * IH_GRID)

/* Scanline tables begin at multiples of this many bytes, the size of the largest vector: a store across
 * two cache lines takes twice as long. Padding costs at most this many bytes a table. */
#define IH_ALIGNMENT 32

/* A cache line; scanlines are prefetched in such steps. */
#define IH_LINE_BYTES 64

/* Frame sizes that are accepted. The widest frame costs 76 * IH_FRAME_WIDTH_MAX bytes
 * of row buffer in ih_dots. Range images may be smaller than camera frames. */
#define IH_FRAME_WIDTH_MIN 320
#define IH_FRAME_HEIGHT_MIN 240
#define IH_FRAME_WIDTH_MAX 1280
#define IH_FRAME_HEIGHT_MAX 800
#define IH_RANGE_SIDE_MIN 64

/* Working range that a rig may ask for. */
#define IH_DEPTH_MIN_MM 100
#define IH_DEPTH_MAX_MM 16000

/* "no such slot, dot or contour" in index fields. */
#define IH_NONE (-1)

#endif
