/* rd_person - a seated person: proportions by seed, and the shapes of one posture.
 * The head is a skull, a face, a jaw and what sticks out of them, fitted into the ellipsoid that the truth file
 * names; it looks to -Z of its own frame. The torso's frame has its origin between the hips.
 */
#ifndef RD_PERSON_H
#define RD_PERSON_H

#include "rd_rng.h"
#include "rd_scene.h"

enum rd_hair_style { RD_HAIR_SHORT, RD_HAIR_FULL, RD_HAIR_LONG, RD_HAIR_BUN };

/* Materials, as indices into the scene. */
struct rd_person_paint {
    int face, skin, hair, cloth, sleeve, hat;
};

struct rd_person {
    struct rd_vec head_axes_mm; /* semi-axes: across, up, deep */
    double jaw_width, nose_mm;  /* relative width; length */
    double neck_radius_mm, neck_length_mm;
    double torso_mm; /* hips to the base of the neck */
    double shoulder_mm, shoulder_drop_mm;
    double girth; /* of torso and arms, relative */
    double upper_arm_mm, forearm_mm, hand_mm;
    enum rd_hair_style hair;
    bool hat, beard, glasses, mask, bare_arms;
    struct rd_person_paint paint;
};

/* One hand in camera coordinates: where its palm's middle is and how it is turned. */
struct rd_hand {
    struct rd_vec palm_mm;
    struct rd_vec fingers; /* unit: from the wrist to the finger tips */
    struct rd_vec facing;  /* unit: where the palm looks */
    double curl;           /* 0 flat hand .. 1 fist */
    double spread;         /* 0 fingers together .. 1 spread */
};

struct rd_posture {
    struct rd_pose torso, head; /* the head's origin is the middle of its ellipsoid */
    struct rd_hand hands[2];    /* the one at -X first */
};

/* Draws a person; its materials go into the scene with rd_person_dress. */
void rd_person_make(struct rd_person *person, struct rd_rng *rng);
void rd_person_dress(struct rd_person *person, struct rd_scene *scene, struct rd_rng *rng);

/* The head's pose on a torso. Angles in radians, with respect to the torso. */
struct rd_pose rd_person_head_pose(const struct rd_person *person, const struct rd_pose *torso, double yaw,
                                   double pitch, double roll);

/* Adds all shapes of the posture. */
void rd_person_build(const struct rd_person *person, const struct rd_posture *posture, struct rd_scene *scene);

#endif
