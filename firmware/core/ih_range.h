/* ih_range - the ranges that docs/numerics.md states, checked where a quantity is stored.
 *
 * IH_IN_RANGE(value, low, high) is nothing in an ordinary build: its arguments are not evaluated and
 * no code is made. In a build with ISOHEAD_RANGE_CHECKS (make ranges) a value outside low .. high ends
 * the program with file, line, value and range. Arguments must have no side effects.
 *
 * The constants are the greatest sizes that docs/numerics.md argues for, in the unit and format that
 * their names say; tests/checks/ranges_doc.py compares both. A range without a name in the code is that
 * of a constant of its stage.
 */
#ifndef IH_RANGE_H
#define IH_RANGE_H

#include <stdint.h>

#ifdef ISOHEAD_RANGE_CHECKS
void ih_range_check(int64_t value, int64_t low, int64_t high, const char *what, const char *file,
                    int line);
#define IH_IN_RANGE(value, low, high) \
    ih_range_check((value), (low), (high), #value, __FILE__, __LINE__)
#else
#define IH_IN_RANGE(value, low, high) ((void)sizeof((value) >= (low) && (value) <= (high)))
#endif

#endif
