/* sim_run - all frames of all directories through the core, and out again. */
#ifndef SIM_RUN_H
#define SIM_RUN_H

#include "isohead.h"
#include "sim_options.h"

/* head: the one instance; its content does not matter. */
enum sim_status sim_run(const struct sim_options *options, struct isohead *head);

#endif
