/* rd_visit - when somebody comes, stays and goes, and how the body moves on the way.
 * One visit, or two where there is time: nobody in the first and the last 15 of 100 frames, 10 to 15 frames for each
 * way. A person comes in from a side, upright and facing the way, a little before the seat; turns to the camera,
 * bends forward and sits down; leaves in the same manner, to either side.
 */
#ifndef RD_VISIT_H
#define RD_VISIT_H

#include <stdbool.h>
#include <stdint.h>

#include "rd_vec.h"

#define RD_VISITS_MAX 2

struct rd_visit {
    int come_frame, sit_frame, rise_frame, gone_frame; /* on the way from come to sit and from rise to gone */
    double come_side, go_side;                         /* -1 or 1 along X */
};

struct rd_visits {
    struct rd_visit visits[RD_VISITS_MAX];
    int count;
    double outside_mm; /* where the body is out of sight */
    double stand_mm;   /* a standing head is this much higher than a sitting one */
    double before_mm;  /* the way leads this much before the seat */
    double facing;     /* how far the body turns into the way, radians */
};

/* What is added to a body that sits. */
struct rd_approach {
    struct rd_vec shift_mm;
    double yaw, pitch; /* of the trunk, radians */
};

/* side_free: from which of both sides (-X, +X) one can come. */
void rd_visits_plan(struct rd_visits *visits, uint64_t seed, int frame_count, double distance_mm,
                    const bool side_free[2]);

/* False: nobody is there. */
bool rd_visits_at(const struct rd_visits *visits, int frame, struct rd_approach *approach);

#endif
