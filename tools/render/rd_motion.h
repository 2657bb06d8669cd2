/* rd_motion - what a person does over the frames of a sequence.
 * Trunk and head sway as sums of two slow oscillations; a turning person goes right round on the chair. In
 * sequence 2 each hand has its own list of gestures: over the face, at the cheek, on the head, waving beside it,
 * reaching for the camera, and rests between them. Whoever telephones has one hand with the phone at the ear most of
 * the time; others keep their hands at the face, or turn to the back seat every two to four seconds.
 * Visits: one, or two where there is time: nobody in the first and the last 15 of 100 frames, 10 to 15 frames for each
 * way. A person comes in from a side, upright and facing the way, a little before the seat; turns to the camera,
 * bends forward and sits down; leaves in the same manner, to either side.
 */
#ifndef RD_MOTION_H
#define RD_MOTION_H

#include <stdbool.h>
#include <stdint.h>

#include "rd_person.h"
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

/* A gesture and the way to the next take three frames at least: enough for RD_FRAMES_MAX frames. */
#define RD_GESTURES_MAX 2048

struct rd_sway {
    double middle, reach1, reach2; /* reach: amplitude */
    double period1, period2;       /* frames */
    double phase1, phase2;
};

/* Somebody who looks to the back seat: a turn there, a while there, the way back, and a while forward. */
struct rd_look_back {
    bool often;
    double period, start, offset, stay; /* frames */
    double trunk, head;                 /* radians */
    uint64_t seed;
};

struct rd_gesture {
    int arrive_frame, leave_frame; /* there from .. to; on the way between two gestures */
    int kind;                      /* index into the table of gestures */
    struct rd_vec shift_mm;        /* from the table's position */
    bool cross;                    /* to the other side of the body */
    double tilt;                   /* of the fingers, radians */
    double curl, spread;
};

struct rd_motion {
    struct rd_vec hips_mm;
    struct rd_sway lean, bend, twist; /* trunk: roll, pitch, yaw */
    struct rd_sway yaw, pitch, roll;  /* head against trunk */
    bool turning;
    double turn_start, turn_total; /* radians */
    struct rd_look_back back;
    bool phone[2];               /* which hand holds one */
    struct rd_approach approach; /* of the present frame; zero: on the seat */
    int frame_count;
    struct rd_gesture gestures[2][RD_GESTURES_MAX];
    int gesture_count[2];
};

/* Plans a sequence around a position of the head at rest. */
void rd_motion_make(struct rd_motion *motion, const struct rd_person *person, const struct rd_options *options,
                    uint64_t seed, struct rd_vec head_mm);

/* Yaw of the trunk and of the chair under it, radians. */
double rd_motion_turn(const struct rd_motion *motion, int frame);

void rd_motion_posture(const struct rd_motion *motion, const struct rd_person *person, int frame,
                       struct rd_posture *posture);

#endif
