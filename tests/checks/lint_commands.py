#!/usr/bin/env python3
"""Each source once: compile_commands.json for clang-tidy.

clang-tidy 14 looks at a source that several targets build once for each, and from the second time on it
takes every va_list for one without a value.

lint_commands.py BUILD OUT_FOLDER
"""

import json
import os
import sys


def main():
    build, folder = sys.argv[1:]
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as file:
        commands = json.load(file)
    once = {}
    for command in commands:
        once.setdefault(os.path.join(command["directory"], command["file"]), command)
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "compile_commands.json"), "w", encoding="utf-8") as file:
        json.dump(list(once.values()), file, indent=1)


if __name__ == "__main__":
    main()
