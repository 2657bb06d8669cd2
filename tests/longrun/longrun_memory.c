#include "longrun_memory.h"

#ifdef __SANITIZE_ADDRESS__
#include <stddef.h>

/* The sanitizer's own count: mallinfo2 knows nothing of its heap. Not every compiler brings the header. */
size_t __sanitizer_get_current_allocated_bytes(void);

bool longrun_memory(struct longrun_memory *out)
{
    out->heap_bytes = (long long)__sanitizer_get_current_allocated_bytes();
    out->resident_kb = -1;
    return true;
}
#else
#include <malloc.h>
#include <stdio.h>

#define PAGES "/proc/self/smaps_rollup"

static bool resident_kb(long long *kb)
{
    char line[256];
    bool found = false;
    FILE *file = fopen(PAGES, "r");
    if (file == NULL) {
        perror("longrun: " PAGES);
        return false;
    }
    while (!found && fgets(line, sizeof line, file) != NULL) {
        found = sscanf(line, "Anonymous: %lld kB", kb) == 1;
    }
    fclose(file);
    if (!found) {
        fputs("longrun: " PAGES " has no line \"Anonymous: N kB\"\n", stderr);
    }
    return found;
}

bool longrun_memory(struct longrun_memory *out)
{
    struct mallinfo2 info = mallinfo2();
    out->heap_bytes = (long long)(info.uordblks + info.hblkhd);
    return resident_kb(&out->resident_kb);
}
#endif
