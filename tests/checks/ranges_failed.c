/* What a build with ISOHEAD_RANGE_CHECKS does with a value outside its range: a line on stderr, abort. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/ih_range.h"

/* Called by the casts that ranges_cc.py makes. */
__extension__ __int128 ih_range_cast(__int128 value, __int128 low, __int128 high, const char *what,
                                     const char *file, int line);

void ih_range_check(int64_t value, int64_t low, int64_t high, const char *file, int line)
{
    if (value < low || value > high) {
        fprintf(stderr, "%s:%d: range: %" PRId64 ", expected %" PRId64 " .. %" PRId64 "\n", file,
                line, value, low, high);
        abort();
    }
}

__extension__ __int128 ih_range_cast(__int128 value, __int128 low, __int128 high, const char *what,
                                     const char *file, int line)
{
    if (value < low || value > high) {
        fprintf(stderr, "%s:%d: range: converted to %s is %.0f, expected %.0f .. %.0f\n", file,
                line, what, (double)value, (double)low, (double)high);
        abort();
    }
    return value;
}
