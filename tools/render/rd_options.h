/* rd_options - the command line, checked. */
#ifndef RD_OPTIONS_H
#define RD_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

enum rd_scene_kind {
    RD_SCENE_PERSON,
    RD_SCENE_TURNING,
    RD_SCENE_EMPTY,
    RD_SCENE_TABLE,
    RD_SCENE_ROOM,
    RD_SCENE_CLUTTER,
    RD_SCENE_VISIT,
    RD_SCENE_TWO,
    RD_SCENE_BOARD
};
enum rd_person_kind {
    RD_PERSON_VARIED,
    RD_PERSON_CHILD,
    RD_PERSON_HAT,
    RD_PERSON_MASK,
    RD_PERSON_BEARD,
    RD_PERSON_LONG_HAIR,
    RD_PERSON_BALD,
    RD_PERSON_GLASSES,
    RD_PERSON_HEADPHONES
};
enum rd_act { RD_ACT_VARIED, RD_ACT_PHONE, RD_ACT_FACE, RD_ACT_BACK, RD_ACT_NONE };
enum rd_rig_kind { RD_RIG_PAPER, RD_RIG_WIDE, RD_RIG_RANGE };
enum rd_background { RD_BACK_VARIED, RD_BACK_NEAR, RD_BACK_FAR, RD_BACK_NONE };
enum rd_distortion { RD_LENS_NORMAL, RD_LENS_NONE, RD_LENS_STRONG };
enum rd_ambient_kind { RD_AMBIENT_VARIED, RD_AMBIENT_DIM, RD_AMBIENT_NORMAL, RD_AMBIENT_BRIGHT, RD_AMBIENT_SUNLIGHT };

/* What parsing came to. */
enum rd_options_result { RD_OPTIONS_RUN, RD_OPTIONS_HELP, RD_OPTIONS_WRONG };

struct rd_options {
    const char *out_dir;
    const char *range_dir; /* real depth images instead of a scene; NULL: none */
    enum rd_scene_kind scene;
    int sequence; /* 1: hands down; 2: hands move strongly */
    enum rd_person_kind person;
    enum rd_act act;
    enum rd_rig_kind rig;
    enum rd_background background;
    enum rd_distortion distortion;
    enum rd_ambient_kind ambient;
    bool alternate;          /* every second frame without the laser */
    double exposure;         /* all light, relative */
    uint64_t seed, rig_seed; /* rig_seed: which rig, laser and sensor; as seed where not given */
    bool rig_seed_given;
    int frame_count;          /* for each depth image, where there are any */
    double tilt_deg;          /* the camera looks up at people by this, or down */
    double away_mm;           /* everything is farther away by this */
    double knock_deg;         /* the projector's rotation against what rig.json says, about an axis by seed */
    double knock_xyz_deg[3];  /* the same as a rotation vector, camera frame */
    double knock_shift_mm[3]; /* of the projector's origin */
    double knock_camera[3];   /* focal length in per cent, principal point in px */
    double drift_deg[3];      /* the projector's further rotation at the last frame, linear in time */
    double calibration_noise; /* rig.json's errors, in typical errors of a calibration */
    double focal;             /* the focal length against the paper's */
    double assembly;          /* the rig's own differences from the plan, in typical ones */
    const char *board_file;   /* what is printed on the board */
    double board_mm;          /* its width */
    double missing;           /* fraction of the dots that are not there, others in each frame */
    double blur_px;           /* frames out of focus by this (sigma) */
    bool glare;               /* a lamp is mirrored in the board */
    int first_frame;
    int shown_count;   /* frames from the first on; 0: all that follow */
    int width, height; /* pixels */
    int bits;          /* per sample of the image files */
};

/* Fills `options`; prints the help on standard output, or what is wrong on standard error. */
enum rd_options_result rd_options_parse(int argc, char **argv, struct rd_options *options);

#endif
