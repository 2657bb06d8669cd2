"""The bounds that tests/limits.conf sets."""

import os
import re

PATH = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tests", "limits.conf")
NAMES = {"ram_bytes", "flash_bytes", "stack_bytes", "x86_stack_bytes", "x86_code_bytes", "cortexm7_frame_instructions",
         "bench_frame_instructions", "bench_dots_instructions", "bench_labels_instructions",
         "bench_surface_instructions", "bench_nests_instructions", "bench_findings_instructions"}


class Wrong(Exception):
    """The file is not as it must be; says where."""


def read(path=PATH):
    """{name: bound}, every name once."""
    bounds = {}
    with open(path, encoding="utf-8") as file:
        for number, line in enumerate(file, 1):
            text = line.partition("#")[0].strip()
            if not text:
                continue
            found = re.fullmatch(r"([a-z0-9_]+)\s*=\s*([0-9]+)", text)
            if not found:
                raise Wrong("%s:%d: '%s', expected name = whole number" % (path, number, text))
            if found[1] not in NAMES or found[1] in bounds:
                why = "twice" if found[1] in bounds else "no bound that anything checks"
                raise Wrong("%s:%d: %s: %s" % (path, number, found[1], why))
            bounds[found[1]] = int(found[2])
    missing = sorted(NAMES - set(bounds))
    if missing:
        raise Wrong("%s: missing: %s" % (path, ", ".join(missing)))
    return bounds
