/* ih_head_model - the mean head, from which fits begin.
 *
 * Units: mm, or hundredths of a semi-axis (PERCENT). Directions as in the level frame: down is positive.
 */
#ifndef IH_HEAD_MODEL_H
#define IH_HEAD_MODEL_H

/* Semi-axes of the mean adult head, hair included: across, up, deep. */
#define IH_HEAD_SEMI_X_MM 78
#define IH_HEAD_SEMI_Y_MM 113
#define IH_HEAD_SEMI_Z_MM 98

/* The square of a number of hundredths, with so many bits behind the point; rounded. */
#define IH_HEAD_SQUARE(percent, bits) ((((int64_t)(percent) * (percent) << (bits)) + 5000) / 10000)

#endif
