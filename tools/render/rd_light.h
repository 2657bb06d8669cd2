/* rd_light - what lights the scene apart from the laser, and how bright a lit point looks.
 * All strengths are grey levels (of 255) of a white surface that faces the light.
 */
#ifndef RD_LIGHT_H
#define RD_LIGHT_H

#include "rd_options.h"
#include "rd_scene.h"

struct rd_light {
    double sky_grey;       /* from all around, stronger from above */
    struct rd_vec key_dir; /* towards the sun, a window or a ceiling lamp; unit */
    double key_grey;
    double lamp_grey; /* beside the camera, at 1 m; falls with the square of the distance */
    bool shadows;     /* surfaces keep the key light from others */
    bool bars;        /* the key light comes through a window's bars or leaves */
    double bars_mm;
    struct rd_vec slope;     /* relative change of all of it per metre: rooms are not evenly lit */
    double nothing_grey;     /* where no surface is seen */
    struct rd_vec glare_dir; /* towards a small lamp that glossy surfaces mirror; unit */
    double glare_grey;       /* its mirror image on a gloss of 1; 0: no such lamp */
};

void rd_light_make(struct rd_light *light, const struct rd_options *options);

/* Grey level of a point of the scene seen along `view` (unit, away from the camera). */
double rd_light_grey(const struct rd_light *light, const struct rd_scene *scene, const struct rd_hit *hit,
                     struct rd_vec view);

#endif
