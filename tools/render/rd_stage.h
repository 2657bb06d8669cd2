/* rd_stage - which scene stands before the camera in which frame.
 * person, turning: somebody is there except in four of fifty frames (at the start, in the middle or at the end, by
 * seed). empty: the seat alone. table, room: nobody; another arrangement every ten frames, ten seconds later.
 */
#ifndef RD_STAGE_H
#define RD_STAGE_H

#include <stdint.h>

#include "rd_light.h"
#include "rd_motion.h"
#include "rd_options.h"
#include "rd_output.h"
#include "rd_room.h"
#include "rd_scene.h"

struct rd_stage {
    struct rd_options options;
    struct rd_scene scene;
    struct rd_light light;
    struct rd_person person;
    struct rd_motion motion;
    struct rd_chair chair;
    bool still_changed; /* the still shapes are others than in the frame before */
    int arrangement;
    int empty_first, empty_end; /* frames without the person */
    struct rd_truth truth;
    int64_t time_us;
};

void rd_stage_make(struct rd_stage *stage, const struct rd_options *options);
/* Sets scene, truth, time and still_changed for a frame; frames come in order from 0. */
void rd_stage_frame(struct rd_stage *stage, int frame);

#endif
