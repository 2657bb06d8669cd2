/* sim_without - parts of the method left out, to measure what each of them brings.
 *
 * Every part is a parameter of the core that is set so that the part does nothing; but for ambient
 * frames, which the core is not given.
 */
#ifndef SIM_WITHOUT_H
#define SIM_WITHOUT_H

#include <stdbool.h>
#include <stdint.h>

#include "isohead.h"

/* Add the parts of a list, "scan,fit", to a set. NULL, or where in the list the first stands that does
 * not exist. */
const char *sim_without_add(uint32_t *parts, const char *list);

void sim_without_apply(uint32_t parts, struct ih_params *params);

/* Are frames without laser left out? */
bool sim_without_ambient(uint32_t parts);

#endif
