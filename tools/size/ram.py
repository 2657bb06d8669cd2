"""sizeof struct isohead and of its parts, for any compiler: nothing has to be run."""

import os
import re
import subprocess

CORE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "firmware", "core")

WHOLE = "struct isohead"


def members():
    """Names in the order of their declaration, those of the shared memory with its name in front."""
    with open(os.path.join(CORE, "isohead.h"), encoding="utf-8") as file:
        body = re.search(r"\nstruct isohead \{\n(.*?)\n\};", file.read(), re.S)[1]
    union = re.search(r"union \{(.*?)\} scratch;", body, re.S)
    outer = body.replace(union[0], "") if union else body
    member = re.compile(r"struct \w+ (\w+);")
    names = member.findall(outer)
    if union:
        flat = re.sub(r"\n        struct \{.*?\n        \} (\w+);", r"\n        struct nested \1;", union[1], flags=re.S)
        names += ["scratch"] + ["scratch." + name for name in member.findall(flat)]
    return names


def sizes(compiler, nm, directory):
    """({WHOLE: bytes, member: bytes, ...}, IH_RAM_MAX). compiler: a command, as a list."""
    parts = [WHOLE] + members()
    source = os.path.join(directory, "ram.c")
    with open(source, "w", encoding="utf-8") as file:
        file.write('#include "isohead.h"\nextern struct isohead head;\nchar ram_max[IH_RAM_MAX];\n')
        for i, part in enumerate(parts):
            file.write("char part%d[sizeof head%s];\n" % (i, "" if part == WHOLE else "." + part))
    output = os.path.join(directory, "ram.o")
    subprocess.run(compiler + ["-std=c11", "-I", CORE, "-c", source, "-o", output], check=True)
    listing = subprocess.run([nm, "--print-size", "--radix=d", output], check=True, text=True,
                             stdout=subprocess.PIPE).stdout
    size = {line.split()[3]: int(line.split()[1]) for line in listing.splitlines() if len(line.split()) == 4}
    return {part: size["part%d" % i] for i, part in enumerate(parts)}, size["ram_max"]
