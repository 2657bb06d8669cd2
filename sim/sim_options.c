#include "sim_options.h"

#include <getopt.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

static void without_scan(struct ih_params *params)
{
    params->detections.scan.candidate_max = 0;
}

static void without_nests(struct ih_params *params)
{
    params->detections.nest_max = 0;
}

static void without_expected(struct ih_params *params)
{
    params->detections.expected_max = 0;
}

static void without_fit(struct ih_params *params)
{
    params->detections.fit.step_count = 0;
}

static void without_move(struct ih_params *params)
{
    params->detections.move_max_mm = 0;
}

static void without_tracks(struct ih_params *params)
{
    params->tracks.gap_us = -1;
}

static void without_windows(struct ih_params *params)
{
    params->windows.window_max = 1;
}

static void without_skips(struct ih_params *params)
{
    params->detections.found_mm = 0;
    params->detections.hopeless_logit_q10 = INT32_MIN;
}

static void without_missing(struct ih_params *params)
{
    params->samples.fill_root_weight_q15 = 0;
}

/* Index of the part that is no parameter. */
#define PART_AMBIENT 0

static const struct {
    const char *name;
    void (*apply)(struct ih_params *params); /* NULL: none */
} part[] = {
    {"ambient", NULL},          {"scan", without_scan},
    {"nests", without_nests},   {"expected", without_expected},
    {"fit", without_fit},       {"move", without_move},
    {"tracks", without_tracks}, {"windows", without_windows},
    {"skips", without_skips},   {"missing", without_missing},
};

#define PART_COUNT (sizeof part / sizeof part[0])

/* The part of a name of this length; PART_COUNT when there is none. */
static size_t find(const char *name, size_t length)
{
    size_t i = 0;
    while (i < PART_COUNT &&
           (strlen(part[i].name) != length || strncmp(part[i].name, name, length) != 0)) {
        i++;
    }
    return i;
}

const char *sim_without_add(uint32_t *parts, const char *list)
{
    for (const char *name = list; name != NULL;) {
        size_t length = strcspn(name, ",");
        size_t index = find(name, length);
        if (index == PART_COUNT) {
            return name;
        }
        *parts |= UINT32_C(1) << index;
        name = name[length] == ',' ? name + length + 1 : NULL;
    }
    return NULL;
}

void sim_without_apply(uint32_t parts, struct ih_params *params)
{
    for (size_t i = 0; i < PART_COUNT; i++) {
        if ((parts >> i & 1) != 0 && part[i].apply != NULL) {
            part[i].apply(params);
        }
    }
}

bool sim_without_ambient(uint32_t parts)
{
    return (parts >> PART_AMBIENT & 1) != 0;
}

enum {
    OPTION_JSON = 1,
    OPTION_PAPER,
    OPTION_RIG,
    OPTION_TRACE,
    OPTION_REPORT,
    OPTION_AGAINST,
    OPTION_WITHOUT,
    OPTION_HELP,
    OPTION_VERSION
};

static const struct option table[] = {
    {"json", no_argument, NULL, OPTION_JSON},
    {"paper", no_argument, NULL, OPTION_PAPER},
    {"rig", required_argument, NULL, OPTION_RIG},
    {"trace", required_argument, NULL, OPTION_TRACE},
    {"report", required_argument, NULL, OPTION_REPORT},
    {"against", required_argument, NULL, OPTION_AGAINST},
    {"without", required_argument, NULL, OPTION_WITHOUT},
    {"help", no_argument, NULL, OPTION_HELP}, /* and -h */
    {"version", no_argument, NULL, OPTION_VERSION},
    {NULL, 0, NULL, 0},
};

static bool refuse(const char *reason, const char *subject)
{
    fprintf(stderr, "host_sim: %s%s; see host_sim --help\n", reason, subject);
    return false;
}

static bool take_without(struct sim_options *options, const char *list)
{
    const char *unknown = sim_without_add(&options->without, list);
    if (unknown != NULL) {
        fprintf(stderr,
                "host_sim: --without %s: no part '%.*s'; see host_sim --help for the list\n", list,
                (int)strcspn(unknown, ","), unknown);
    }
    return unknown == NULL;
}

static bool take(struct sim_options *options, int option)
{
    switch (option) {
    case OPTION_JSON:
        options->json = true;
        break;
    case OPTION_PAPER:
        options->paper = true;
        break;
    case OPTION_RIG:
        options->rig = optarg;
        break;
    case OPTION_TRACE:
        options->trace = optarg;
        break;
    case OPTION_REPORT:
        options->report = optarg;
        break;
    case OPTION_AGAINST:
        options->against = optarg;
        break;
    case OPTION_WITHOUT:
        return take_without(options, optarg);
    case OPTION_HELP:
    case 'h':
        options->help = true;
        break;
    default:
        options->version = true;
        break;
    }
    return true;
}

bool sim_options_parse(struct sim_options *options, int argument_count, char **arguments)
{
    *options = (struct sim_options){.json = false};
    int option = 0;
    int index = 0; /* in the table */
    opterr = 0;
    /* The leading ':' tells a missing argument from an unknown option. */
    while ((option = getopt_long(argument_count, arguments, ":h", table, &index)) != -1) {
        if (option == ':') {
            return refuse("missing argument of ", arguments[optind - 1]);
        }
        if (option == '?') {
            /* optopt is the letter of a short option; for a long one it is small or 0. */
            const char letter[] = {'-', (char)optopt, 0};
            return refuse("unknown option or unexpected argument: ",
                          optopt >= ' ' ? letter : arguments[optind - 1]);
        }
        if (optarg != NULL && optarg[0] == 0) {
            return refuse("empty argument of --", table[index].name);
        }
        if (!take(options, option)) {
            return false;
        }
    }
    if (options->against != NULL && options->report == NULL) {
        return refuse("--against needs the page that it is for: --report FILE", "");
    }
    options->words = arguments;
    options->word_count = argument_count;
    options->dirs = arguments + optind;
    options->dir_count = argument_count - optind;
    if (options->dir_count == 0 && !options->help && !options->version) {
        return refuse("no frames directory given; make frames renders two: host_sim frames/", "");
    }
    return true;
}

void sim_options_help(void)
{
    fputs("host_sim [options] DIR...\n"
          "Find a person's head in 3-D in the frames of each DIR (*.pgm, *.png, rig.json).\n"
          "With a range rig *.xyz are frames too: a line `x y z` in mm per point.\n"
          "A DIR without rig.json stands for those of its subdirectories that have one.\n"
          "\n"
          "  --json         a JSON record per frame on standard output, nothing else\n"
          "  --paper        the paper's method alone: every frame on its own\n"
          "  --rig FILE     this rig file instead of DIR/rig.json\n"
          "  --trace OUT    also write every stage's results of each frame under OUT\n"
          "  --report FILE  also write a page for a browser that explains each frame\n"
          "  --against FILE and in it what another run said, its --json in FILE\n"
          "  --without PART[,PART...]  leave out parts of the method:\n"
          "                 ambient   frames without laser help nothing\n"
          "                 scan      no candidates from the model scan\n"
          "                 nests     no candidates from the paper's nests, only evidence\n"
          "                 expected  no candidates from tracks\n"
          "                 fit       candidates are not fitted: mean heads instead\n"
          "                 move      fitted centres are not moved by what is around them\n"
          "                 tracks    every frame on its own\n"
          "                 windows   of a depth image only the best window\n"
          "                 skips     fits beside a head, and hopeless ones, go on\n"
          "                 missing   dots that are not seen are not entered as far points\n"
          "  -h, --help     this text\n"
          "  --version      the version\n"
          "\n"
          "Without --json: a line per frame, then, where there is truth, the paper's\n"
          "Table 1.\n"
          "Exit status: 0 all frames processed, 1 some input wrong (see standard error),\n"
          "2 wrong usage. docs/contract.md describes all files.\n",
          stdout);
}
