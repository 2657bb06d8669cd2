/* rd_person - a seated person: proportions by seed, and the shapes of one posture.
 * The head is a skull, a face, a jaw and what sticks out of them, fitted into the ellipsoid that the truth file
 * names; it looks to -Z of its own frame. The torso's frame has its origin between the hips.
 */
#ifndef RD_PERSON_H
#define RD_PERSON_H

#include "rd_options.h"
#include "rd_rng.h"
#include "rd_scene.h"

enum rd_hair_style { RD_HAIR_SHORT, RD_HAIR_FULL, RD_HAIR_LONG, RD_HAIR_BUN };

enum rd_hat_kind { RD_HAT_PEAKED, RD_HAT_KNITTED, RD_HAT_WIDE, RD_HAT_HOOD };

/* What only some kinds of persons wear. */
struct rd_gear {
    bool headphones, frames, dark_lenses, cup, thick_beard, own_hat;
    enum rd_hat_kind hat;
    double bulk;       /* 0 small .. 1 large */
    int plastic, dark; /* materials */
};

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
    double girth;    /* of torso and arms, relative */
    double build;    /* of the trunk's bones, relative */
    double lower_mm; /* how much lower than others the head is on the same seat */
    double upper_arm_mm, forearm_mm, hand_mm;
    enum rd_hair_style hair;
    bool hat, beard, glasses, mask, bare_arms, bald;
    struct rd_gear gear;
    struct rd_person_paint paint;
};

/* One hand in camera coordinates: where its palm's middle is and how it is turned. */
struct rd_hand {
    struct rd_vec palm_mm;
    struct rd_vec fingers; /* unit: from the wrist to the finger tips */
    struct rd_vec facing;  /* unit: where the palm looks */
    double curl;           /* 0 flat hand .. 1 fist */
    double spread;         /* 0 fingers together .. 1 spread */
    bool phone;            /* holds one */
};

struct rd_posture {
    struct rd_pose torso, head; /* the head's origin is the middle of its ellipsoid */
    struct rd_hand hands[2];    /* the one at -X first */
};

/* Draws a person; its materials go into the scene with rd_person_dress. */
void rd_person_make(struct rd_person *person, struct rd_rng *rng);
/* Makes one of a kind of the person. */
void rd_person_make_kind(struct rd_person *person, enum rd_person_kind kind, struct rd_rng *rng);
void rd_person_dress(struct rd_person *person, struct rd_scene *scene, struct rd_rng *rng);
/* The materials of gear and phone. */
void rd_gear_dress(struct rd_person *person, struct rd_scene *scene, struct rd_rng *rng);

/* The head's pose on a torso. Angles in radians, with respect to the torso. */
struct rd_pose rd_person_head_pose(const struct rd_person *person, const struct rd_pose *torso, double yaw,
                                   double pitch, double roll);

/* Skull, face, hair, ears, hat and what else the person wears at the posture's head pose. */
void rd_head_build(const struct rd_person *person, const struct rd_pose *head, struct rd_scene *scene);

/* Adds all shapes of the posture. */
void rd_person_build(const struct rd_person *person, const struct rd_posture *posture, struct rd_scene *scene);

#endif
