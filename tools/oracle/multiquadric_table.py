#!/usr/bin/env python3
"""The table of roots in firmware/core/surface/ih_multiquadric_table.h: sqrt(m) * 2^16 for m in 2^30 .. 2^32, in spans of 2^22. An
entry is the value at a span's beginning, raised by half of what the curve lies above its chord; the last one
is that at the last span's end. With g the position in a span, 0 .. 65535, and rise the difference to the next
entry >> 6, the root is value + (rise * g >> 10).

    multiquadric_table.py               writes its lines
    multiquadric_table.py --check FILE  exit status 1 when the table in FILE is another, or is farther off than is
                                 said of it there
"""

import re
import sys

import numpy as np

FIRST, LAST = 256, 1024  # spans
WORST = 2**-21.8  # relative
# Of a position up to 63 of 2^22, of a rise 63 of 2^22 towards the end of a span, of the product 1: at most, in the mean of
# both ends of the first span.
CUT_OFF = 96


def exact(m):
    return np.sqrt(m) * 2.0**16


def entry(i):
    """The entries before and after a span lie above the curve as this one does, to a 300th: half of what the
    curve lies above the chord, and half of what is cut off, in the mean."""
    g = np.linspace(0, 1, 257)
    start, rise = exact(i * 2.0**22), exact((i + 1) * 2.0**22) - exact(i * 2.0**22)
    above = np.max(exact((i + g) * 2.0**22) - start - rise * g)
    return min(int(round(start + above / 2 + CUT_OFF / 2)), 2**32 - 1)


def table():
    return [entry(i) for i in range(FIRST, LAST + 1)]


def off(i, value, following):
    """How far the root is off, at both ends of what is truncated of a position."""
    g = np.arange(0, 65536, 16)
    read = value + ((following - value >> 6) * g >> 10)
    return [read - exact(i * 2.0**22 + g * 64 + end) for end in (0, 63)]


def worst(entries):
    return max(np.max(np.abs(e)) / exact(i * 2.0**22)
               for i, each in enumerate(zip(entries, entries[1:]), FIRST) for e in off(i, *each))


def main():
    if len(sys.argv) == 1:
        print(", ".join("%d" % each for each in table()))
        return 0
    with open(sys.argv[2], encoding="utf-8") as file:
        found = re.search(r"roots_q16\[\] = \{(.*?)\};", file.read(), re.S)
    entries = [int(word) for word in re.findall(r"\d+", found[1])]
    print("multiquadric_table: %d entries, at most 2^%.2f off" % (len(entries), np.log2(worst(entries))))
    good = entries == table() and worst(entries) <= WORST
    if not good:
        print("multiquadric_table: %s has another table, or it does not keep its bound" % sys.argv[2], file=sys.stderr)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
