#!/usr/bin/env python3
"""A compiler launcher that makes explicit conversions checked ones.

    ranges_cc.py COMPILER ARGUMENT... -c SOURCE -o OBJECT

Clang's sanitizers check what C converts by itself. A cast they take for meant, and the core has one
wherever a 64-bit result goes into 32 bits: without a cast the build refuses it. So the source is
preprocessed, each cast to an integer type but int64_t in a file of firmware/core becomes
    (int32_t)ih_range_cast(OPERAND, INT32_MIN, INT32_MAX, ...)
and the result is compiled by the same command. Casts to int64_t alone stay: of all that the core has
only uint64_t can be greater, and there sanitizers see the sum or product that made it so.
"""

import re
import subprocess
import sys

LIMITS = {"int8_t": (-2**7, 2**7 - 1), "uint8_t": (0, 2**8 - 1),
          "int16_t": (-2**15, 2**15 - 1), "uint16_t": (0, 2**16 - 1),
          "int32_t": (-2**31, 2**31 - 1), "int": (-2**31, 2**31 - 1),
          "uint32_t": (0, 2**32 - 1), "uint64_t": (0, 2**64 - 1), "size_t": (0, 2**64 - 1)}
CAST = re.compile(r"\(\s*(%s)\s*\)" % "|".join(LIMITS))
CHECKED = re.compile(r"/firmware/core/|/ranges_planted\.c$")
TYPE = re.compile(r"\(\s*(const\s+)?(struct\s+|enum\s+)?\w+(\s*\*)*\s*\)")
MARKER = re.compile(r'^# (\d+) "([^"]*)"', re.M)
DECLARATION = ("__extension__ __int128 ih_range_cast(__int128 value, __int128 low, __int128 high, "
               "const char *what, const char *file, int line);\n")


def skip_space(text, at):
    while at < len(text) and text[at].isspace():
        at += 1
    return at


def after_bracket(text, at):
    """Behind the bracket that closes the one at `at`; no character or string of the core has one."""
    depth = 0
    while True:
        depth += text[at] in "([{"
        depth -= text[at] in ")]}"
        at += 1
        if depth == 0:
            return at


def operand_end(text, at):
    """The end of the unary expression that begins at `at`; None when there is none."""
    at = skip_space(text, at)
    while text[at] in "-+~!*&" or text.startswith("(", at) and is_cast(text, at):
        at = skip_space(text, after_bracket(text, at) if text[at] == "(" else at + 1)
    if text[at] == "(":
        at = after_bracket(text, at)
    else:
        word = re.compile(r"\w+").match(text, at)
        if not word or word[0] == "sizeof":
            return None
        at = word.end()
    while True:
        after = skip_space(text, at)
        member = re.compile(r"(\.|->)\s*\w+|\+\+|--").match(text, after)
        if text[after] in "([":
            at = after_bracket(text, after)
        elif member:
            at = member.end()
        else:
            return at


def is_cast(text, at):
    """Is the bracket at `at` a cast before an operand? A variable in brackets is followed by none."""
    found = TYPE.match(text, at)
    return bool(found) and re.match(r"[\w(]", text[skip_space(text, found.end()):][:1]) is not None


def is_declaration(text, at):
    """`int f(int32_t)` and sizeof(int32_t)."""
    before = re.search(r"(\w+)\s*$", text[max(0, at - 40):at])
    return bool(before) and before[1] not in ("return", "case", "else")


def place(text, at):
    """(file, line) of an offset of preprocessed text."""
    name, line, start = "", 1, 0
    for found in MARKER.finditer(text, 0, at):
        line, name, start = int(found[1]), found[2], text.index("\n", found.start()) + 1
    return name, line + text.count("\n", start, at)


def check_casts(text, where=None):
    """The text with its casts checked. where: of all of it; None: by its line markers."""
    result, done = [], 0
    for found in CAST.finditer(text):
        if found.start() < done or is_declaration(text, found.start()):
            continue
        name, line = where or place(text, found.start())
        end = operand_end(text, found.end())
        if not CHECKED.search(name) or end is None:
            continue
        low, high = LIMITS[found[1]]
        operand = check_casts(text[found.end():end], (name, line)) if end > found.end() else ""
        result.append(text[done:found.start()])
        result.append('((%s)ih_range_cast(%s, %s, %s, "%s", "%s", %d))'
                      % (found[1], operand, number(low), number(high), found[1], name, line))
        done = end
    return "".join(result) + text[done:]


def number(value):
    return "(-%dLL - 1)" % (-value - 1) if value < 0 else "%dULL" % value


def main():
    command = sys.argv[1:]
    output = command[command.index("-o") + 1]
    source = command[command.index("-c") + 1]
    preprocess = [output + ".i" if part == output else "-E" if part == "-c" else part
                  for part in command]
    # the dependencies are the object's
    if "-MD" in preprocess and "-MT" not in preprocess:
        preprocess += ["-MT", output]
    preprocess = [output if before == "-MT" else part
                  for before, part in zip([""] + preprocess, preprocess)]
    subprocess.run(preprocess, check=True)
    with open(output + ".i", encoding="utf-8") as file:
        text = file.read()
    with open(output + ".checked.c", "w", encoding="utf-8") as file:
        file.write(DECLARATION + check_casts(text))
    compile_ = [output + ".checked.c" if part == source else part for part in command]
    for option in ("-MF", "-MT"):
        if option in compile_:
            at = compile_.index(option)
            del compile_[at:at + 2]
    return subprocess.run([part for part in compile_ if part != "-MD"], check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
