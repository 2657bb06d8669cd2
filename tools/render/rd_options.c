#include "rd_options.h"

#include <errno.h>
#include <getopt.h>
#include <limits.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FRAMES_MAX 5000

enum option_id {
    OPT_SCENE = 1,
    OPT_SEQUENCE,
    OPT_RIG,
    OPT_SEED,
    OPT_RIG_SEED,
    OPT_FRAMES,
    OPT_SIZE,
    OPT_BACKGROUND,
    OPT_BITS,
    OPT_DISTORTION,
    OPT_AMBIENT,
    OPT_RANGE,
    OPT_PERSON,
    OPT_ACT,
    OPT_TILT,
    OPT_AWAY,
    OPT_KNOCK,
    OPT_KNOCK_SHIFT,
    OPT_KNOCK_CAMERA,
    OPT_DRIFT,
    OPT_LASER,
    OPT_EXPOSURE,
    OPT_FIRST_FRAME,
    OPT_CALIBRATION_NOISE,
    OPT_FOCAL,
    OPT_ASSEMBLY,
    OPT_BOARD,
    OPT_BOARD_MM,
    OPT_MISSING,
    OPT_BLUR,
    OPT_GLARE,
    OPT_HELP
};

static const char help_text[] = /* at most 80 columns */
    "Usage: render [options] OUT_DIR\n"
    "Renders a frames directory: pictures of a scene with 19x19 laser dots on it, the\n"
    "rig and the truth.\n"
    "The same options give the same files.\n"
    "\n"
    "  --scene KIND       person (default): somebody on a seat; turning: right round\n"
    "                     on an office chair; empty: the seat alone; table: things on\n"
    "                     a table; room: furniture, nobody there; clutter: things\n"
    "                     that might be taken for a head; visit: somebody comes to an\n"
    "                     empty seat, stays and goes; two: two people side by side;\n"
    "                     board: a printed board in another pose in each frame, in\n"
    "                     each two frames with --laser alternate\n"
    "  --board FILE       with --scene board: what is printed on it, a binary PGM of\n"
    "                     8 bits (255: albedo 1)\n"
    "  --board-mm W       20 to 2000: its width; its height follows\n"
    "  --glare            a lamp is mirrored in the board\n"
    "  --range DIR        no scene, but the real depth images of a range directory or\n"
    "                     of those in DIR\n"
    "  --sequence N       1 (default): hands down; 2: hands move strongly and partly\n"
    "                     cover the head\n"
    "  --person KIND      varied (default, by seed), child, hat, mask, beard,\n"
    "                     long-hair, bald, glasses, headphones\n"
    "  --act KIND         varied (default: as --sequence says), phone (at the ear),\n"
    "                     face (hands on it), back (turns to the back seat again and\n"
    "                     again), none (hands down)\n"
    "  --rig KIND         paper (default): 12.5 mm between camera and projector;\n"
    "                     wide: 125 mm; range: a depth camera instead of dots\n"
    "  --seed N           which person, room, light, motion (default 1); with\n"
    "                     --range: from where, 0 for the depth camera's own position\n"
    "  --rig-seed N       lens, assembly, laser, sensor (default: as --seed):\n"
    "                     other people before the same rig\n"
    "  --frames N         1 to 5000 (default 50, four of them without the person; for\n"
    "                     a visit 100); with --range for each depth image (default 1)\n"
    "  --size WxH         320x240 to 1280x800 (default 752x582, a depth camera\n"
    "                     640x480); the focal length follows the width\n"
    "  --background KIND  varied (default, by seed), near, far, none\n"
    "  --ambient KIND     varied (default, by seed), dim, normal, bright, sunlight\n"
    "                     (hard shadows)\n"
    "  --distortion KIND  normal (default), none, strong\n"
    "  --tilt DEG         -40 to 40 (default 0): the camera looks up at people by\n"
    "                     this, down where it is negative\n"
    "  --away MM          0 (default) to 2000: everything is farther away by this\n"
    "  --knock DEG        0 (default) to 0.5: the projector is rotated by this\n"
    "                     against what rig.json says, about an axis by seed\n"
    "  --knock X,Y,Z      -5 to 5 degrees each: rotated by this rotation vector\n"
    "                     (camera's axes; its direction is the axis, its length the\n"
    "                     angle)\n"
    "  --knock-shift X,Y,Z  -50 to 50 mm each: the projector's origin is shifted by\n"
    "                     this against what rig.json says\n"
    "  --knock-camera F,CX,CY  the camera differs from what rig.json says: F of\n"
    "                     -20 to 20 % of focal length, CX and CY of -100 to 100 px\n"
    "                     of principal point\n"
    "  --drift X,Y,Z      -5 to 5 degrees each: the projector rotates while the\n"
    "                     sequence runs, from nothing in frame 0 to this in the last\n"
    "                     frame, linearly; added to --knock\n"
    "  --calibration-noise X  0 (default) to 10: rig.json's errors, in typical ones:\n"
    "                     0.1 % of fx, 1 px of the centre, 0.01 degrees of each ray,\n"
    "                     0.1 mm of the projector's position\n"
    "  --focal X          0.5 to 2 (default 1): the focal length against the paper's\n"
    "  --assembly X       0 (default) to 10: how carelessly the rig was put together,\n"
    "                     in typical errors that rig.json knows of: 1 % of fx and fy,\n"
    "                     6 px of the centre, 1 mm of the projector's position,\n"
    "                     0.4 degrees of its direction and rotation, 0.4 % of the\n"
    "                     pitch, 0.01 degrees of each ray\n"
    "  --missing FRACTION 0 (default) to 0.9: so many dots are not there, others in\n"
    "                     each frame\n"
    "  --blur PX          0 (default) to 10: all frames out of focus, standard\n"
    "                     deviation\n"
    "  --laser KIND       on (default), alternate: every second frame (1, 3, ...)\n"
    "                     without it\n"
    "  --exposure X       0.05 to 20 (default 1): all light of the sensor's frames by\n"
    "                     this factor\n"
    "  --first-frame N[+COUNT]  only frame N and what follows, or COUNT frames from N\n"
    "                     on; they are the same as in the whole sequence\n"
    "  --bits N           8 (default), 10, 12 or 16 bits per sample\n"
    "  --help             this text\n"
    "\n"
    "rig.json is written last: a directory that has it is complete.\n"
    "Exit status: 0 done, 1 something could not be read or written, 2 wrong usage.\n";

static bool complain(const char *option, const char *value, const char *wanted)
{
    fprintf(stderr, "render: --%s %s: must be %s\n", option, value, wanted);
    return false;
}

/* A whole decimal number with nothing after it. */
static bool read_number(const char *option, const char *text, uint64_t low, uint64_t high, const char *wanted,
                        uint64_t *value)
{
    char *end;
    errno = 0;
    unsigned long long read = strtoull(text, &end, 10);
    if (text[0] < '0' || text[0] > '9' || *end != '\0' || errno != 0 || read < low || read > high)
        return complain(option, text, wanted);
    *value = read;
    return true;
}

static bool read_int(const char *option, const char *text, int low, int high, const char *wanted, int *value)
{
    uint64_t read;
    if (!read_number(option, text, (uint64_t)low, (uint64_t)high, wanted, &read))
        return false;
    *value = (int)read;
    return true;
}

/* A decimal number without sign or exponent. */
static bool read_decimal(const char *option, const char *text, double low, double high, const char *wanted,
                         double *value)
{
    char *end;
    const char *digits = text + (low < 0.0 && text[0] == '-');
    *value = strtod(text, &end);
    if (strspn(digits, "0123456789.") != strlen(digits) || end == text || *end != '\0' || *value < low || *value > high)
        return complain(option, text, wanted);
    return true;
}

/* Three decimal numbers, each at most its limit in magnitude. */
static bool read_three(const char *option, const char *text, const double limits[3], const char *wanted,
                       double values[3])
{
    const char *at = text;
    for (int i = 0; i < 3; i++) {
        char *end;
        const char *digits = at + (*at == '-');
        size_t length = strspn(digits, "0123456789.");
        values[i] = strtod(at, &end);
        if (length == 0 || end != digits + length || *end != (i < 2 ? ',' : '\0') || fabs(values[i]) > limits[i])
            return complain(option, text, wanted);
        at = end + 1;
    }
    return true;
}

static bool read_rotation(const char *option, const char *text, const char *wanted, double values[3])
{
    return read_three(option, text, (const double[]){5.0, 5.0, 5.0}, wanted, values);
}

/* Index of a word in a list that ends with NULL. */
static bool read_word(const char *option, const char *text, const char *const *words, const char *wanted, int *index)
{
    for (*index = 0; words[*index] != NULL; (*index)++) {
        if (strcmp(text, words[*index]) == 0)
            return true;
    }
    return complain(option, text, wanted);
}

static bool read_size(const char *text, struct rd_options *options)
{
    int width, height, length = 0;
    bool read = sscanf(text, "%4dx%4d%n", &width, &height, &length) == 2 && text[length] == '\0';
    if (!read || width < 320 || width > 1280 || height < 240 || height > 800)
        return complain("size", text, "WxH from 320x240 to 1280x800");
    options->width = width;
    options->height = height;
    return true;
}

static bool read_first_frame(const char *text, struct rd_options *options)
{
    int first, count = 0, length = 0;
    bool read = sscanf(text, "%4d%n", &first, &length) == 1;
    if (read && text[length] == '+') {
        const char *after = text + length + 1;
        read = sscanf(after, "%4d%n", &count, &length) == 1 && after[0] >= '0' && after[0] <= '9' && count > 0 &&
               after[length] == '\0';
    } else {
        read = read && text[length] == '\0';
    }
    if (!read || text[0] < '0' || text[0] > '9')
        return complain("first-frame", text, "N or N+COUNT");
    options->first_frame = first;
    options->shown_count = count;
    return true;
}

static bool take_word(int id, const char *text, struct rd_options *options)
{
    static const char *const scenes[] = {"person",  "turning", "empty", "table", "room",
                                         "clutter", "visit",   "two",   "board", NULL};
    static const char *const persons[] = {"varied",    "child", "hat",     "mask",       "beard",
                                          "long-hair", "bald",  "glasses", "headphones", NULL};
    static const char *const acts[] = {"varied", "phone", "face", "back", "none", NULL};
    static const char *const lasers[] = {"on", "alternate", NULL};
    static const char *const rigs[] = {"paper", "wide", "range", NULL};
    static const char *const backgrounds[] = {"varied", "near", "far", "none", NULL};
    static const char *const lenses[] = {"normal", "none", "strong", NULL};
    static const char *const ambients[] = {"varied", "dim", "normal", "bright", "sunlight", NULL};
    int index = 0;
    bool known = false;
    if (id == OPT_SCENE) {
        known = read_word("scene", text, scenes, "person, turning, empty, table, room, clutter, visit, two or board",
                          &index);
        options->scene = (enum rd_scene_kind)index;
    } else if (id == OPT_PERSON) {
        known = read_word("person", text, persons,
                          "varied, child, hat, mask, beard, long-hair, bald, glasses or headphones", &index);
        options->person = (enum rd_person_kind)index;
    } else if (id == OPT_ACT) {
        known = read_word("act", text, acts, "varied, phone, face, back or none", &index);
        options->act = (enum rd_act)index;
    } else if (id == OPT_LASER) {
        known = read_word("laser", text, lasers, "on or alternate", &index);
        options->alternate = index == 1;
    } else if (id == OPT_RIG) {
        known = read_word("rig", text, rigs, "paper, wide or range", &index);
        options->rig = (enum rd_rig_kind)index;
    } else if (id == OPT_BACKGROUND) {
        known = read_word("background", text, backgrounds, "varied, near, far or none", &index);
        options->background = (enum rd_background)index;
    } else if (id == OPT_DISTORTION) {
        known = read_word("distortion", text, lenses, "normal, none or strong", &index);
        options->distortion = (enum rd_distortion)index;
    } else if (id == OPT_AMBIENT) {
        known = read_word("ambient", text, ambients, "varied, dim, normal, bright or sunlight", &index);
        options->ambient = (enum rd_ambient_kind)index;
    }
    return known;
}

static bool take_option(int id, const char *text, struct rd_options *options)
{
    switch (id) {
    case OPT_SEQUENCE:
        return read_int("sequence", text, 1, 2, "1 or 2", &options->sequence);
    case OPT_SEED:
        return read_number("seed", text, 0, UINT64_MAX, "a whole number", &options->seed);
    case OPT_RIG_SEED:
        options->rig_seed_given = true;
        return read_number("rig-seed", text, 0, UINT64_MAX, "a whole number", &options->rig_seed);
    case OPT_FRAMES:
        return read_int("frames", text, 1, FRAMES_MAX, "a whole number from 1 to 5000", &options->frame_count);
    case OPT_SIZE:
        return read_size(text, options);
    case OPT_BITS:
        return read_int("bits", text, 8, 16, "8, 10, 12 or 16", &options->bits) &&
               (options->bits == 8 || options->bits == 10 || options->bits == 12 || options->bits == 16 ||
                complain("bits", text, "8, 10, 12 or 16"));
    case OPT_TILT:
        return read_decimal("tilt", text, -40.0, 40.0, "a number from -40 to 40", &options->tilt_deg);
    case OPT_AWAY:
        return read_decimal("away", text, 0.0, 2000.0, "a number from 0 to 2000", &options->away_mm);
    case OPT_KNOCK:
        if (strchr(text, ',') != NULL)
            return read_rotation("knock", text, "X,Y,Z of -5 to 5 each", options->knock_xyz_deg);
        return read_decimal("knock", text, 0.0, 0.5, "a number from 0 to 0.5 or X,Y,Z", &options->knock_deg);
    case OPT_KNOCK_SHIFT:
        return read_three("knock-shift", text, (const double[]){50.0, 50.0, 50.0}, "X,Y,Z of -50 to 50 each",
                          options->knock_shift_mm);
    case OPT_KNOCK_CAMERA:
        return read_three("knock-camera", text, (const double[]){20.0, 100.0, 100.0},
                          "F,CX,CY of -20 to 20, -100 to 100, -100 to 100", options->knock_camera);
    case OPT_DRIFT:
        return read_rotation("drift", text, "X,Y,Z of -5 to 5 each", options->drift_deg);
    case OPT_CALIBRATION_NOISE:
        return read_decimal("calibration-noise", text, 0.0, 10.0, "a number from 0 to 10", &options->calibration_noise);
    case OPT_FOCAL:
        return read_decimal("focal", text, 0.5, 2.0, "a number from 0.5 to 2", &options->focal);
    case OPT_ASSEMBLY:
        return read_decimal("assembly", text, 0.0, 10.0, "a number from 0 to 10", &options->assembly);
    case OPT_BOARD:
        options->board_file = text;
        return true;
    case OPT_BOARD_MM:
        return read_decimal("board-mm", text, 20.0, 2000.0, "a number from 20 to 2000", &options->board_mm);
    case OPT_MISSING:
        return read_decimal("missing", text, 0.0, 0.9, "a number from 0 to 0.9", &options->missing);
    case OPT_BLUR:
        return read_decimal("blur", text, 0.0, 10.0, "a number from 0 to 10", &options->blur_px);
    case OPT_GLARE:
        options->glare = true;
        return true;
    case OPT_EXPOSURE:
        return read_decimal("exposure", text, 0.05, 20.0, "a number from 0.05 to 20", &options->exposure);
    case OPT_FIRST_FRAME:
        return read_first_frame(text, options);
    case OPT_RANGE:
        options->range_dir = text;
        return text[0] != '\0' || complain("range", text, "a directory");
    default:
        return take_word(id, text, options);
    }
}

/* What a depth camera does not have. */
static bool is_of_dots(int id)
{
    static const int ids[] = {OPT_BOARD,    OPT_RANGE,        OPT_BITS,  OPT_AMBIENT, OPT_DISTORTION,
                              OPT_KNOCK,    OPT_KNOCK_SHIFT,  OPT_DRIFT, OPT_LASER,   OPT_CALIBRATION_NOISE,
                              OPT_ASSEMBLY, OPT_KNOCK_CAMERA, OPT_BLUR,  OPT_MISSING, OPT_EXPOSURE,
                              OPT_GLARE};
    for (size_t i = 0; i < sizeof ids / sizeof ids[0]; i++) {
        if (ids[i] == id)
            return true;
    }
    return false;
}

/* `of_dots`: an option that was given of what a depth camera does not have, or NULL. */
static bool fit_together(const struct rd_options *options, bool scene_given, const char *of_dots)
{
    if (options->range_dir != NULL && scene_given) {
        fputs("render: --range takes the place of --scene\n", stderr);
        return false;
    }
    if ((options->scene == RD_SCENE_BOARD) != (options->board_file != NULL && options->board_mm > 0.0)) {
        fputs("render: --scene board, --board and --board-mm go together\n", stderr);
        return false;
    }
    if (options->rig == RD_RIG_RANGE && of_dots != NULL) {
        fprintf(stderr, "render: --%s: a depth camera (--rig range) has none of that\n", of_dots);
        return false;
    }
    if (options->away_mm > 0.0 && (options->range_dir != NULL || options->scene == RD_SCENE_BOARD)) {
        fputs("render: --away is of people and rooms, not of boards and real depth images\n", stderr);
        return false;
    }
    return true;
}

/* What follows from other options where it was not given. */
static void fill_in(struct rd_options *options)
{
    if (options->width == 0) {
        options->width = options->rig == RD_RIG_RANGE ? 640 : 752;
        options->height = options->rig == RD_RIG_RANGE ? 480 : 582;
    }
    if (!options->rig_seed_given)
        options->rig_seed = options->seed;
    if (options->frame_count == 0)
        options->frame_count = options->range_dir != NULL ? 1 : options->scene == RD_SCENE_VISIT ? 100 : 50;
}

enum rd_options_result rd_options_parse(int argc, char **argv, struct rd_options *options)
{
    static const struct option long_options[] = {
        {"scene", required_argument, NULL, OPT_SCENE},
        {"sequence", required_argument, NULL, OPT_SEQUENCE},
        {"rig", required_argument, NULL, OPT_RIG},
        {"seed", required_argument, NULL, OPT_SEED},
        {"rig-seed", required_argument, NULL, OPT_RIG_SEED},
        {"frames", required_argument, NULL, OPT_FRAMES},
        {"size", required_argument, NULL, OPT_SIZE},
        {"background", required_argument, NULL, OPT_BACKGROUND},
        {"bits", required_argument, NULL, OPT_BITS},
        {"distortion", required_argument, NULL, OPT_DISTORTION},
        {"ambient", required_argument, NULL, OPT_AMBIENT},
        {"range", required_argument, NULL, OPT_RANGE},
        {"person", required_argument, NULL, OPT_PERSON},
        {"act", required_argument, NULL, OPT_ACT},
        {"tilt", required_argument, NULL, OPT_TILT},
        {"away", required_argument, NULL, OPT_AWAY},
        {"knock", required_argument, NULL, OPT_KNOCK},
        {"knock-shift", required_argument, NULL, OPT_KNOCK_SHIFT},
        {"knock-camera", required_argument, NULL, OPT_KNOCK_CAMERA},
        {"drift", required_argument, NULL, OPT_DRIFT},
        {"calibration-noise", required_argument, NULL, OPT_CALIBRATION_NOISE},
        {"laser", required_argument, NULL, OPT_LASER},
        {"exposure", required_argument, NULL, OPT_EXPOSURE},
        {"focal", required_argument, NULL, OPT_FOCAL},
        {"assembly", required_argument, NULL, OPT_ASSEMBLY},
        {"board", required_argument, NULL, OPT_BOARD},
        {"board-mm", required_argument, NULL, OPT_BOARD_MM},
        {"missing", required_argument, NULL, OPT_MISSING},
        {"blur", required_argument, NULL, OPT_BLUR},
        {"glare", no_argument, NULL, OPT_GLARE},
        {"first-frame", required_argument, NULL, OPT_FIRST_FRAME},
        {"help", no_argument, NULL, OPT_HELP},
        {NULL, 0, NULL, 0},
    };
    int id, index = 0;
    bool scene_given = false;
    const char *of_dots = NULL;
    *options = (struct rd_options){.sequence = 1, .exposure = 1.0, .focal = 1.0, .seed = 1, .bits = 8};
    while ((id = getopt_long(argc, argv, "", long_options, &index)) != -1) {
        if (id == OPT_HELP) {
            fputs(help_text, stdout);
            return RD_OPTIONS_HELP;
        }
        /* getopt_long has already said what it did not understand. */
        if (id == '?' || !take_option(id, optarg, options))
            return RD_OPTIONS_WRONG;
        scene_given = scene_given || id == OPT_SCENE;
        of_dots = is_of_dots(id) ? long_options[index].name : of_dots;
    }
    if (optind != argc - 1 || argv[optind][0] == '\0') {
        fputs("render: one OUT_DIR is needed; see render --help\n", stderr);
        return RD_OPTIONS_WRONG;
    }
    if (!fit_together(options, scene_given, of_dots))
        return RD_OPTIONS_WRONG;
    fill_in(options);
    options->out_dir = argv[optind];
    return RD_OPTIONS_RUN;
}
