/* rd_board - somebody shows a printed board to the camera: the pictures of a calibration.
 * The board is flat, as large as the options say, its picture a bitmap. Picture k has a pose of its own, with its
 * distance (0.4 to 1.5 m, evenly in its logarithm), tilt (to 45 degrees) and position in the frame spread as by somebody who follows instructions;
 * at least half of the board is in the frame. Behind it is a room. With --laser alternate two frames in succession
 * show the same pose, the first with the laser.
 */
#ifndef RD_BOARD_H
#define RD_BOARD_H

#include "rd_light.h"
#include "rd_material.h"
#include "rd_rig.h"

struct rd_board {
    struct rd_bitmap *bitmap;
    double half_width_mm, half_height_mm;
};

/* The sheet, as the options name it. False: reported. */
bool rd_board_make(struct rd_board *board, const struct rd_options *options);
void rd_board_end(struct rd_board *board);

/* The light in which somebody takes such pictures. */
void rd_board_light(const struct rd_options *options, struct rd_light *light);

/* Sets up the scene of a picture; *pose: the sheet's middle, X along its width, Y down, Z away from who looks at it.
 * With --glare a lamp is mirrored in it. */
void rd_board_show(const struct rd_board *board, const struct rd_options *options, const struct rd_rig *rig,
                   int picture, struct rd_scene *scene, struct rd_light *light, struct rd_pose *pose);

#endif
