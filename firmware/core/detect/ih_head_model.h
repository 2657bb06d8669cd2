/* ih_head_model - the mean head, from which fits begin.
 *
 * Units: mm.
 */
#ifndef IH_HEAD_MODEL_H
#define IH_HEAD_MODEL_H

/* Semi-axes of the mean adult head, hair included: across, up, deep. */
#define IH_HEAD_SEMI_X_MM 78
#define IH_HEAD_SEMI_Y_MM 113
#define IH_HEAD_SEMI_Z_MM 98

#endif
