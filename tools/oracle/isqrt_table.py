#!/usr/bin/env python3
"""The table of inverse roots in firmware/core/base/ih_fix.c.

    isqrt_table.py               writes its lines
    isqrt_table.py --check FILE  exit status 1 when the table in FILE is another, or does not keep what is
                                 said of it there: read between its entries as ih_isqrt_u64 does it is
                                 never too great, and at most 2^-13.7 too small
"""

import re
import sys

import numpy as np

FIRST, LAST = 64, 256  # m in 256ths
BETWEEN = 256  # positions checked between two entries


def exact_q15(m):
    return 2.0**15 / np.sqrt(m)


def excess():
    """By how much at most a chord lies above the curve, in each span."""
    part = np.linspace(0, 1, 65)[1:-1]
    for i in range(FIRST, LAST):
        chord = exact_q15(i / 256) * (1 - part) + exact_q15((i + 1) / 256) * part
        yield float(np.max(chord - exact_q15((i + part) / 256)))


def table():
    above = list(excess())
    lowered = [max(above[max(i - 1, 0)], above[min(i, len(above) - 1)]) for i in range(len(above) + 1)]
    return [int(np.floor(exact_q15((FIRST + i) / 256) - lowered[i])) for i in range(len(lowered))]


def worst_shortness(entries):
    """The largest relative lack, and the smallest: negative when anything is too large."""
    part_q16 = np.unique(np.append(np.arange(0, 65536, 65536 // BETWEEN), 65535))
    lacks = []
    for i, (here, after) in enumerate(zip(entries, entries[1:])):
        # all m that share these 24 bits; the smallest has the largest root, the last one the smallest
        read = here - (((here - after) * part_q16 + 0xffff) >> 16)
        for low_byte in (0, 255):
            m = ((FIRST + i) * 2**24 + part_q16 * 256 + low_byte) / 2.0**32
            lacks.append(1 - read / exact_q15(m))
    return float(np.max(lacks)), float(np.min(lacks))


def main():
    if len(sys.argv) == 1:
        print(", ".join(str(entry) for entry in table()))
        return 0
    with open(sys.argv[2], encoding="utf-8") as file:
        found = re.search(r"root_inverse_q15\[193\] = \{(.*?)\}", file.read(), re.S)
    entries = [int(word) for word in re.findall(r"\d+", found[1])]
    largest, smallest = worst_shortness(entries)
    print("isqrt_table: %d entries, short by %.3g to %.3g (2^%.2f)" % (len(entries), smallest, largest, np.log2(largest)))
    good = entries == table() and smallest >= 0 and largest <= 2**-13.7
    if not good:
        print("isqrt_table: %s has another table, or it does not keep its bounds" % sys.argv[2], file=sys.stderr)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
