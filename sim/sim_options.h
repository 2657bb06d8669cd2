/* sim_options - the command line of host_sim, and what --without leaves out.
 *
 * Each part of the method that can be left out, to measure what it brings, is a parameter of the core
 * that is set so that the part does nothing; but for ambient frames, which the core is not given.
 */
#ifndef SIM_OPTIONS_H
#define SIM_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "isohead.h"

enum sim_status {
    SIM_STATUS_GOOD = 0,  /* every frame was processed */
    SIM_STATUS_INPUT = 1, /* some input was unreadable or wrong, or output could not be written */
    SIM_STATUS_USAGE = 2
};

struct sim_options {
    bool json;
    bool paper;       /* the paper's method alone */
    uint32_t without; /* parts that are left out */
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

/* Add the parts of a list, "scan,fit", to a set. NULL, or where in the list the first stands that does
 * not exist. */
const char *sim_without_add(uint32_t *parts, const char *list);

void sim_without_apply(uint32_t parts, struct ih_params *params);

/* Are frames without laser left out? */
bool sim_without_ambient(uint32_t parts);

#endif
