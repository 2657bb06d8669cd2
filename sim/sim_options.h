/* sim_options - the command line of host_sim. */
#ifndef SIM_OPTIONS_H
#define SIM_OPTIONS_H

#include <stdbool.h>

#include "sim_without.h"

enum sim_status {
    SIM_STATUS_GOOD = 0,  /* every frame was processed */
    SIM_STATUS_INPUT = 1, /* some input was unreadable or wrong, or output could not be written */
    SIM_STATUS_USAGE = 2
};

struct sim_options {
    bool json;
    bool paper;       /* the paper's method alone */
    uint32_t without; /* parts that are left out, sim_without.h */
    bool help, version;
    const char *rig;     /* NULL: DIR/rig.json */
    const char *trace;   /* NULL: none */
    const char *report;  /* NULL: none */
    const char *against; /* records of another run, for the report; NULL: none */
    char **words;        /* the command line, options first */
    int word_count;
    char **dirs;
    int dir_count; /* at least 1, unless help or version is asked for */
};

/* False: wrong usage, reported on standard error. */
bool sim_options_parse(struct sim_options *options, int argument_count, char **arguments);

/* The text of --help, on standard output. */
void sim_options_help(void);

#endif
