/* ih_config - the sizes that every stage shares.
 *
 * A limit that belongs to one stage stands in that stage's header; here are only the few that
 * several stages must agree on. All are compile-time constants, so that the whole state is one
 * struct of known size and nothing is ever allocated.
 */
#ifndef IH_CONFIG_H
#define IH_CONFIG_H

/* Dots in a row and in a column of the projected pattern (paper, section 2.1: 19x19). */
#define IH_GRID 19
/* Slots of the dot table; slot = row * IH_GRID + column. */
#define IH_SLOTS (IH_GRID * IH_GRID)

/* Rows of pixels begin at multiples of this many bytes, the greatest vector's size: what lies across two
 * of a processor's cache lines takes twice as long to store. Costs less than so many bytes a table. */
#define IH_ALIGNMENT 32

/* What a processor's cache takes from memory at once: rows that will be needed are asked for in such steps. */
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
