/* ih_head_model - the mean head and the regions around it: numbers that several stages share.
 *
 * Units: mm, or hundredths of a semi-axis (PERCENT). Directions as in the camera frame: down is positive.
 */
#ifndef IH_HEAD_MODEL_H
#define IH_HEAD_MODEL_H

/* Semi-axes of the mean adult head, hair included: across, up, deep. */
#define IH_HEAD_SEMI_X_MM 78
#define IH_HEAD_SEMI_Y_MM 113
#define IH_HEAD_SEMI_Z_MM 98

/* A point this far behind the head's centre: the space beside the head is open there. */
#define IH_HEAD_OPEN_MM 60

/* The ring of rays around a head; the template's begins farther out. */
#define IH_HEAD_RING_INNER_PERCENT 125
#define IH_HEAD_RING_INNER_TEMPLATE_PERCENT 130
#define IH_HEAD_RING_OUTER_PERCENT 190
/* In the ring, tenths: below is more down than this times aside, above is more up. */
#define IH_HEAD_RING_BELOW_TENTHS 9
#define IH_HEAD_RING_ABOVE_TENTHS 8

/* The region high above a head: from here on, and this far aside. */
#define IH_HEAD_HIGH_FROM_PERCENT 190
#define IH_HEAD_HIGH_ASIDE_PERCENT 160

/* Body: its depths against the centre's, its heights below the chin, this far aside. */
#define IH_HEAD_BODY_BEFORE_MM 220
#define IH_HEAD_BODY_BEHIND_MM 200
#define IH_HEAD_BODY_TOP_MM 40
#define IH_HEAD_BODY_BOTTOM_MM 260
#define IH_HEAD_BODY_ASIDE_MM 180
/* Beside the body, where a table has surface, too. */
#define IH_HEAD_WIDE_BOTTOM_MM 240
#define IH_HEAD_WIDE_ASIDE_MM 300
/* Shoulders: from this fraction of the semi-axis down to below the chin; aside from, to. */
#define IH_HEAD_SHOULDER_TOP_PERCENT 90
#define IH_HEAD_SHOULDER_BOTTOM_MM 160
#define IH_HEAD_SHOULDER_NEAR_MM 100
#define IH_HEAD_SHOULDER_FAR_MM 260
/* Things beside the head: within this depth of its centre; aside from, to. */
#define IH_HEAD_LEVEL_DEPTH_MM 150
#define IH_HEAD_LEVEL_NEAR_MM 170
#define IH_HEAD_LEVEL_FAR_MM 330
/* Things around the head and this far before its front. */
#define IH_HEAD_AROUND_PERCENT 250
#define IH_HEAD_BEFORE_MM 60

/* A number of hundredths, and its square, with so many bits behind the point; rounded. */
#define IH_HEAD_PART(percent, bits) ((((int64_t)(percent) << (bits)) + 50) / 100)
#define IH_HEAD_SQUARE(percent, bits) ((((int64_t)(percent) * (percent) << (bits)) + 5000) / 10000)

#endif
