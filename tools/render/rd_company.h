/* rd_company - people on their seats, from frame to frame.
 * person, turning: somebody is there except in four of fifty frames (at the start, in the middle or at the end, by
 * seed). empty: the seat alone. visit: a seat, an office chair or an open room that somebody comes to and leaves
 * again (rd_motion.h); the truth has the head when somebody is there and the head's centre lies within the pattern by
 * at least one dot's distance, as seen from the projector: rows and columns -8 .. 8 of -9 .. 9.
 * two: two people side by side, 450 to 650 mm apart, the second up to 200 mm behind; the head to find is the one
 * nearest the camera. They come and go as in the scene person.
 */
#ifndef RD_COMPANY_H
#define RD_COMPANY_H

#include "rd_motion.h"
#include "rd_options.h"
#include "rd_output.h"
#include "rd_rig.h"
#include "rd_room.h"
#include "rd_scene.h"

#define RD_SITTERS_MAX 2

struct rd_company {
    enum rd_scene_kind kind;
    bool shifted;
    /* Everything turned about the first head's position at rest and moved, for the options --tilt and --away. */
    struct rd_pose shift;
    const struct rd_rig *rig;
    struct rd_sitter {
        struct rd_person person;
        struct rd_motion motion;
    } sitters[RD_SITTERS_MAX];
    int sitter_count;
    struct rd_chair chair;
    int empty_first, empty_end; /* frames without the person, but for visits */
    struct rd_visits visits;
};

/* Makes people, seats and room; all shapes that it adds are still. The rig must outlive the company. */
void rd_company_make(struct rd_company *company, const struct rd_options *options, const struct rd_rig *rig,
                     struct rd_scene *scene);
/* Adds what moves. */
void rd_company_frame(struct rd_company *company, int frame, struct rd_scene *scene, struct rd_truth *truth);

/* Sets truth->head to the nearest head of those whose centre is within `dots` of the pattern's middle in row and column. */
void rd_company_choose(struct rd_truth *truth, const struct rd_rig *rig, double dots);

#endif
