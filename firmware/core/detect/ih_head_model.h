/* ih_head_model - the mean head and the regions around it, by which stages look for heads before they are fitted.
 *
 * Units: mm, or hundredths of a semi-axis (PERCENT). Directions as in the level frame: down is positive.
 */
#ifndef IH_HEAD_MODEL_H
#define IH_HEAD_MODEL_H

/* Semi-axes of the mean adult head, hair included: across, up, deep. */
#define IH_HEAD_SEMI_X_MM 78
#define IH_HEAD_SEMI_Y_MM 113
#define IH_HEAD_SEMI_Z_MM 98

/* A point this far behind the head's centre: the space beside the head is open there. */
#define IH_HEAD_OPEN_MM 60

/* The template's ring of rays around a head. */
#define IH_HEAD_RING_INNER_PERCENT 130
#define IH_HEAD_RING_OUTER_PERCENT 190

/* The region high above a head: from here on, and this far aside. */
#define IH_HEAD_HIGH_FROM_PERCENT 190
#define IH_HEAD_HIGH_ASIDE_PERCENT 160

/* Body: its depths against the centre's, its heights below the chin, this far aside. */
#define IH_HEAD_BODY_BEFORE_MM 220
#define IH_HEAD_BODY_BEHIND_MM 200
#define IH_HEAD_BODY_TOP_MM 40
#define IH_HEAD_BODY_BOTTOM_MM 260
#define IH_HEAD_BODY_ASIDE_MM 180
/* Things beside the head: within this depth of its centre; aside from, to. */
#define IH_HEAD_LEVEL_DEPTH_MM 150
#define IH_HEAD_LEVEL_NEAR_MM 170
#define IH_HEAD_LEVEL_FAR_MM 330

/* The square of a number of hundredths, with so many bits behind the point; rounded. */
#define IH_HEAD_SQUARE(percent, bits) ((((int64_t)(percent) * (percent) << (bits)) + 5000) / 10000)

#endif
