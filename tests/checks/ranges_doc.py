#!/usr/bin/env python3
"""The ranges of firmware/core/base/ih_range.h: the same in docs/numerics.md, used, and no code.

  doc     each IH_RANGE_ constant is named in docs/numerics.md, with its value, as `NAME` = 123; the
          document names no other
  use     each is used in the core
  code    without ISOHEAD_RANGE_CHECKS the core's objects are, byte for byte, those of a copy without any
          IH_IN_RANGE

ranges_doc.py      exit status 1 if one of these does not hold
"""

import glob
import os
import re
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CORE = os.path.join(ROOT, "firmware", "core")
RANGE_HEADER = os.path.join("base", "ih_range.h")
CHECK = re.compile(r"^[ \t]*IH_IN_RANGE\([^;]*;\n", re.M)
COMPILE = ["gcc", "-std=c11", "-O0", "-I", ".", "-c", "-o"]


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def constants(header):
    """Name and value of each; a value is a number or one shifted."""
    found = re.findall(r"^#define (IH_RANGE_\w+) \(?(-?\d+)(?: << (\d+))?\)?", header, re.M)
    return {name: int(number) << int(shift or 0) for name, number, shift in found}


def check_doc(header, doc):
    stated = {name: int(value.replace(",", ""))
              for name, value in re.findall(r"`(IH_RANGE_\w+)` = (-?[\d,]+)", doc)}
    known = constants(header)
    wrong = ["%s is %s in ih_range.h, %s in docs/numerics.md"
             % (name, known.get(name, "missing"), stated.get(name, "missing"))
             for name in sorted(set(known) | set(stated)) if known.get(name) != stated.get(name)]
    return wrong if known else ["ih_range.h has no constants"]


def check_use(header, sources):
    return ["%s is used nowhere in the core" % name for name in constants(header)
            if not re.search(r"\b%s\b" % name, sources)]


def core_files():
    return sorted(glob.glob("**/*.[ch]", root_dir=CORE, recursive=True))


def compile_core(directory, objects):
    """The core's objects; compiled in their folder, so that paths are the same."""
    os.mkdir(objects)
    for path in sorted(glob.glob("**/*.c", root_dir=directory, recursive=True)):
        subprocess.run(COMPILE + [os.path.join(objects, os.path.basename(path)), path], cwd=directory, check=True)


def check_code():
    with tempfile.TemporaryDirectory() as work:
        for side, edit in (("with", lambda text: text), ("without", lambda text: CHECK.sub("", text))):
            for path in core_files():
                text = read(os.path.join(CORE, path))
                copy = os.path.join(work, side, path)
                os.makedirs(os.path.dirname(copy), exist_ok=True)
                with open(copy, "w", encoding="utf-8") as file:
                    file.write(text if path == RANGE_HEADER and side == "without" else edit(text))
            compile_core(os.path.join(work, side), os.path.join(work, side + ".o"))
        names = sorted(os.listdir(os.path.join(work, "with.o")))
        return names, ["%s: an IH_IN_RANGE makes code" % name for name in names
                       if open(os.path.join(work, "with.o", name), "rb").read()
                       != open(os.path.join(work, "without.o", name), "rb").read()]


def core_sources():
    return "".join(read(os.path.join(CORE, path)) for path in core_files() if path != RANGE_HEADER)


def check():
    header, doc, sources = (read(os.path.join(CORE, RANGE_HEADER)),
                            read(os.path.join(ROOT, "docs", "numerics.md")), core_sources())
    names, wrong = check_code()
    wrong += check_doc(header, doc) + check_use(header, sources)
    for line in wrong:
        print("ranges_doc: " + line)
    print("ranges_doc: %d constants, %d checks in the core, %d objects without a trace of them"
          % (len(constants(header)), len(CHECK.findall(sources)), len(names)))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(check())
