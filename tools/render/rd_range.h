/* rd_range - range directories on disk: real depth images and whose heads they show.
 * A directory without rig.json stands for those of its subdirectories that have one, in order of their names.
 * A function that returns false or NULL has printed the file and the reason on standard error.
 */
#ifndef RD_RANGE_H
#define RD_RANGE_H

#include <stdbool.h>

#include "rd_relief.h"

/* More heads in one depth image are refused. */
#define RD_RANGE_HEADS_MAX 16

struct rd_range_head {
    struct rd_vec centre_mm, semi_axes_mm;
};

struct rd_range_frame {
    char *dir, *name; /* of the file */
    char *source;     /* the last part of dir, and name */
    struct rd_relief_camera camera;
    double near_mm, far_mm; /* depths outside count as not measured */
    struct rd_range_head heads[RD_RANGE_HEADS_MAX];
    int head_count;
};

struct rd_range {
    struct rd_range_frame *frames;
    int frame_count;
};

/* Lists all frames with their cameras and heads. After a failure rd_range_close is still due. */
bool rd_range_open(struct rd_range *range, const char *dir);
void rd_range_close(struct rd_range *range);

struct rd_relief *rd_range_load(const struct rd_range_frame *frame);

#endif
