/* hal_descriptors - for a process that has just been forked: what it inherits. */
#ifndef HAL_DESCRIPTORS_H
#define HAL_DESCRIPTORS_H

#include <stdbool.h>

/* Close all descriptors but these; -1 among them stands for none. False: /proc is not mounted. */
bool hal_descriptors_keep(const int *keep_fds, int keep_count);

#endif
