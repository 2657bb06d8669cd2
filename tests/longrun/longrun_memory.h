/* longrun_memory - what this process holds. */
#ifndef LONGRUN_MEMORY_H
#define LONGRUN_MEMORY_H

#include <stdbool.h>

struct longrun_memory {
    long long heap_bytes;  /* allocated and not freed */
    long long resident_kb; /* anonymous pages in RAM; -1 where a sanitizer keeps what was freed */
};

/* False, with a message on standard error: the system does not report it. */
bool longrun_memory(struct longrun_memory *out);

#endif
