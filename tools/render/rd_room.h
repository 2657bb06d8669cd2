/* rd_room - what stands behind and around a person: walls and furniture, seat and office chair.
 * Positions are in the camera frame, mm.
 */
#ifndef RD_ROOM_H
#define RD_ROOM_H

#include "rd_options.h"
#include "rd_rng.h"
#include "rd_scene.h"

/* An office chair that turns; its shapes are added anew for every frame. */
struct rd_chair {
    bool headrest;
    double back_half_width_mm, back_half_height_mm, back_behind_mm, back_above_mm;
    int cover, metal; /* materials */
};

/* A material of a random pattern with both albedos between low and high. */
int rd_room_paint(struct rd_scene *scene, struct rd_rng *rng, double low, double high);

/* Wall (none for RD_BACK_NONE) and things before it, all of it behind nearest_mm. The kind must not be varied. */
void rd_room_build(struct rd_scene *scene, struct rd_rng *rng, enum rd_background kind, double nearest_mm);

/* A car-like seat for somebody whose head is at head_mm. */
void rd_seat_build(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec head_mm);

void rd_chair_make(struct rd_chair *chair, struct rd_scene *scene, struct rd_rng *rng);
void rd_chair_build(const struct rd_chair *chair, struct rd_scene *scene, struct rd_vec hips_mm, double turn,
                    double torso_mm);

#endif
