#!/usr/bin/env python3
"""The table of inverse roots in firmware/core/ih_basis.c: 2^30 / sqrt(m) for m in 2^29 .. 2^31, in spans of
2^23. An entry is the value at the span's beginning, lowered by half of what a chord lies above the curve,
Q3 with a half for rounding, times 2^12, plus the fall over the span, Q3.

    basis_table.py               writes its lines
    basis_table.py --check FILE  exit status 1 when the table in FILE is another, or is farther off than is
                                 said of it there
"""

import re
import sys

import numpy as np

FIRST, LAST = 64, 256  # spans
WORST = 2**-15  # relative


def exact(m):
    return 2.0**30 / np.sqrt(m)


def table():
    part = np.linspace(0, 1, 65)
    entries = []
    for i in range(FIRST, LAST):
        here, after = exact(i * 2.0**23), exact((i + 1) * 2.0**23)
        above = np.max(here + (after - here) * part - exact((i + part) * 2.0**23))
        entries.append(int(round((here - above / 2) * 8) + 4) << 12 | int(round((here - after) * 8)))
    return entries


def worst(entries):
    part_q16 = np.arange(0, 65536, 16)
    off = []
    for i, entry in enumerate(entries):
        read = ((entry >> 12) - ((entry & 4095) * part_q16 >> 16)) >> 3
        off.append(np.max(np.abs(read / exact((FIRST + i) * 2.0**23 + part_q16 * 128) - 1)))
    return float(max(off))


def main():
    if len(sys.argv) == 1:
        print(", ".join(str(entry) for entry in table()))
        return 0
    with open(sys.argv[2], encoding="utf-8") as file:
        found = re.search(r"inverse_root\[\] = \{(.*?)\}", file.read(), re.S)
    entries = [int(word) for word in re.findall(r"\d+", found[1])]
    print("basis_table: %d entries, at most 2^%.2f off" % (len(entries), np.log2(worst(entries))))
    good = entries == table() and worst(entries) <= WORST
    if not good:
        print("basis_table: %s has another table, or it does not keep its bound" % sys.argv[2], file=sys.stderr)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
