#!/usr/bin/env python3
"""The table of roots in firmware/core/ih_basis.c: sqrt(m) * 2^16 for m in 2^30 .. 2^32, in spans of 2^22. An
entry is the value at the span's beginning, raised by half of what the curve lies above its chord, and the rise
over the span: with g the place in the span, 0 .. 65535, the root is value + (rise * g >> 10).

    basis_table.py               writes its lines
    basis_table.py --check FILE  exit status 1 when the table in FILE is another, or is farther off than is
                                 said of it there
"""

import re
import sys

import numpy as np

FIRST, LAST = 256, 1024  # spans
WORST = 2**-21.9  # relative


def exact(m):
    return np.sqrt(m) * 2.0**16


def off(i, value, rise):
    """How far the root is off, at both ends of what is cut off of a place."""
    g = np.arange(0, 65536, 16)
    read = value + (rise * g >> 10)
    return [read - exact(i * 2.0**22 + g * 64 + end) for end in (0, 63)]


def entry(i):
    rise = int(round((exact((i + 1) * 2.0**22) - exact(i * 2.0**22)) / 64))
    ends = off(i, 0, rise)
    value = int(round(-(min(e.min() for e in ends) + max(e.max() for e in ends)) / 2))
    return min(value, 2**32 - 1 - (rise * 65535 >> 10)), rise  # the last one would pass 2^32


def table():
    return [entry(i) for i in range(FIRST, LAST)]


def worst(entries):
    return max(np.max(np.abs(e)) / exact(i * 2.0**22)
               for i, (value, rise) in enumerate(entries, FIRST) for e in off(i, value, rise))


def main():
    if len(sys.argv) == 1:
        print(", ".join("{%d, %d}" % each for each in table()))
        return 0
    with open(sys.argv[2], encoding="utf-8") as file:
        found = re.search(r"spans\[\] = \{(.*?)\};", file.read(), re.S)
    words = [int(word) for word in re.findall(r"\d+", found[1])]
    entries = list(zip(words[::2], words[1::2]))
    print("basis_table: %d entries, at most 2^%.2f off" % (len(entries), np.log2(worst(entries))))
    good = entries == table() and worst(entries) <= WORST
    if not good:
        print("basis_table: %s has another table, or it does not keep its bound" % sys.argv[2], file=sys.stderr)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
