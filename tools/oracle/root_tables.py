#!/usr/bin/env python3
"""The core's two tables of roots.

    root_tables.py TABLE               writes its lines; TABLE: inverse or multiquadric
    root_tables.py TABLE --check FILE  exit status 1 when the table in FILE is another, or does not keep what
                                       is said of it there

inverse, in firmware/core/base/ih_fix.c: inverse roots. Read between its entries as ih_isqrt_u64 does it is never
too great, and at most 2^-13.7 too small.

multiquadric, in firmware/core/surface/ih_multiquadric_table.h: sqrt(m) * 2^16 for m in 2^30 .. 2^32, in spans of
2^22. An entry is the value at a span's beginning, raised by half of what the curve lies above its chord; the last
one is that at the last span's end. With g the position in a span, 0 .. 65535, and rise the difference to the next
entry >> 6, the root is value + (rise * g >> 10). At most 2^-21.8 off.
"""

import re
import sys

import numpy as np


class Inverse:
    FIRST, LAST = 64, 256  # m in 256ths
    BETWEEN = 256  # positions checked between two entries
    PLACE = r"root_inverse_q15\[193\] = \{(.*?)\}"

    @staticmethod
    def exact_q15(m):
        return 2.0**15 / np.sqrt(m)

    def excess(self):
        """By how much at most a chord lies above the curve, in each span."""
        part = np.linspace(0, 1, 65)[1:-1]
        for i in range(self.FIRST, self.LAST):
            chord = self.exact_q15(i / 256) * (1 - part) + self.exact_q15((i + 1) / 256) * part
            yield float(np.max(chord - self.exact_q15((i + part) / 256)))

    def table(self):
        above = list(self.excess())
        lowered = [max(above[max(i - 1, 0)], above[min(i, len(above) - 1)]) for i in range(len(above) + 1)]
        return [int(np.floor(self.exact_q15((self.FIRST + i) / 256) - low)) for i, low in enumerate(lowered)]

    def judge(self, entries):
        """In words, and whether the bounds are kept: the largest relative lack, and the smallest, which is negative when
        anything is too large."""
        part_q16 = np.unique(np.append(np.arange(0, 65536, 65536 // self.BETWEEN), 65535))
        lacks = []
        for i, (here, after) in enumerate(zip(entries, entries[1:])):
            # all m that share these 24 bits; the smallest has the largest root, the last one the smallest
            read = here - (((here - after) * part_q16 + 0xffff) >> 16)
            for low_byte in (0, 255):
                m = ((self.FIRST + i) * 2**24 + part_q16 * 256 + low_byte) / 2.0**32
                lacks.append(1 - read / self.exact_q15(m))
        largest, smallest = float(np.max(lacks)), float(np.min(lacks))
        return ("short by %.3g to %.3g (2^%.2f)" % (smallest, largest, np.log2(largest)),
                smallest >= 0 and largest <= 2**-13.7)


class Multiquadric:
    FIRST, LAST = 256, 1024  # spans
    WORST = 2**-21.8  # relative
    # Of a position up to 63 of 2^22, of a rise 63 of 2^22 towards the end of a span, of the product 1: at most, in the
    # mean of both ends of the first span.
    CUT_OFF = 96
    PLACE = r"roots_q16\[\] = \{(.*?)\};"

    @staticmethod
    def exact(m):
        return np.sqrt(m) * 2.0**16

    def entry(self, i):
        """The entries before and after a span lie above the curve as this one does, to a 300th: half of what the
        curve lies above the chord, and half of what is cut off, in the mean."""
        g = np.linspace(0, 1, 257)
        start, rise = self.exact(i * 2.0**22), self.exact((i + 1) * 2.0**22) - self.exact(i * 2.0**22)
        above = np.max(self.exact((i + g) * 2.0**22) - start - rise * g)
        return min(int(round(start + above / 2 + self.CUT_OFF / 2)), 2**32 - 1)

    def table(self):
        return [self.entry(i) for i in range(self.FIRST, self.LAST + 1)]

    def off(self, i, value, following):
        """How far the root is off, at both ends of what is truncated of a position."""
        g = np.arange(0, 65536, 16)
        read = value + ((following - value >> 6) * g >> 10)
        return [read - self.exact(i * 2.0**22 + g * 64 + end) for end in (0, 63)]

    def judge(self, entries):
        worst = max(np.max(np.abs(e)) / self.exact(i * 2.0**22)
                    for i, each in enumerate(zip(entries, entries[1:]), self.FIRST) for e in self.off(i, *each))
        return "at most 2^%.2f off" % np.log2(worst), worst <= self.WORST


def main():
    tables = {"inverse": Inverse, "multiquadric": Multiquadric}
    if not (len(sys.argv) in (2, 4) and sys.argv[1] in tables and sys.argv[2:3] in ([], ["--check"])):
        print(__doc__, file=sys.stderr)
        return 2
    kind = tables[sys.argv[1]]()
    if len(sys.argv) == 2:
        print(", ".join(str(entry) for entry in kind.table()))
        return 0
    with open(sys.argv[3], encoding="utf-8") as file:
        found = re.search(kind.PLACE, file.read(), re.S)
    entries = [int(word) for word in re.findall(r"\d+", found[1])]
    words, kept = kind.judge(entries)
    print("root_tables: %s: %d entries, %s" % (sys.argv[1], len(entries), words))
    if not kept or entries != kind.table():
        print("root_tables: %s has another table, or it does not keep its bounds" % sys.argv[3], file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
