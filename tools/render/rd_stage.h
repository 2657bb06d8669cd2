/* rd_stage - which scene stands before the camera in which frame.
 * person, turning, empty, visit, two: see rd_company.h. table, room, clutter: nobody; another arrangement every ten
 * frames, ten seconds later.
 * board: see rd_board.h; nobody.
 * A range directory: each of its depth images in turn, every frame ten seconds later; the heads are those of its truth
 * file, and the one to find is the one nearest to the camera of those whose centre lies within the pattern.
 */
#ifndef RD_STAGE_H
#define RD_STAGE_H

#include <stdint.h>

#include "rd_board.h"
#include "rd_company.h"
#include "rd_light.h"
#include "rd_range.h"

struct rd_stage {
    struct rd_options options;
    const struct rd_rig *rig;
    int frame_count;
    struct rd_scene scene;
    struct rd_light light;
    struct rd_company company;
    struct rd_range range;
    struct rd_board board;
    struct rd_relief *relief; /* of the depth image whose index is the arrangement */
    int arrangement;
    bool still_changed; /* the still shapes are others than in the frame before */
    const char *source; /* where the frame comes from, or NULL */
    struct rd_truth truth;
    int64_t time_us;
};

/* The rig must outlive the stage. False: a file's error is reported; rd_stage_end is due all the same. */
bool rd_stage_make(struct rd_stage *stage, const struct rd_options *options, const struct rd_rig *rig);
/* Sets scene, truth, time, source and still_changed for a frame; frames come in order from the first that the options
 * ask for. False: reported. */
bool rd_stage_frame(struct rd_stage *stage, int frame);
void rd_stage_end(struct rd_stage *stage);

#endif
