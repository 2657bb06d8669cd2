#!/usr/bin/env python3
"""Pack the inputs of a fuzz target into one file, and unpack them.

A pack is text, so that a diff shows which inputs came and went:

    isohead fuzz inputs COUNT
    LINE...                      one for each input: its bytes as hex digits, in lower case

The lines are sorted and each is there once: the same inputs always give the same pack. The count
shows a pack that lost lines. There is no checksum: any bytes are an input, and git checks its files.
"""

import argparse
import hashlib
import os
import re
import sys

HEADER = "isohead fuzz inputs "  # fuzz_main.c has the same
SIZE_MAX = 1 << 20  # and this


class Wrong(Exception):
    """What is wrong with a file, for the user."""


def read_pack(path):
    """The inputs of a pack, as bytes."""
    with open(path, "rb") as file:
        header, *lines = file.read().split(b"\n")
    count = re.fullmatch(HEADER.encode() + b"([0-9]+)", header)
    if count is None:
        raise Wrong("%s: line 1 is not '%sCOUNT'" % (path, HEADER))
    if not lines or lines.pop() != b"":
        raise Wrong("%s: the last line has no end" % path)
    for number, line in enumerate(lines, 2):
        if not re.fullmatch(b"(?:[0-9a-f]{2})*", line) or len(line) > 2 * SIZE_MAX:
            raise Wrong("%s: line %d is not an input in hex digits" % (path, number))
    if len(lines) != int(count[1]):
        raise Wrong("%s: %d inputs, but line 1 says %d" % (path, len(lines), int(count[1])))
    return [bytes.fromhex(line.decode()) for line in lines]


def write_pack(path, inputs):
    """Replace a pack in one step: an interrupted run leaves the old one."""
    lines = sorted(set(inputs))
    with open(path + ".new", "w", encoding="ascii", newline="\n") as file:
        file.write("%s%d\n" % (HEADER, len(lines)))
        file.writelines(line.hex() + "\n" for line in lines)
    os.replace(path + ".new", path)


def pack(directory, path):
    inputs = []
    for name in os.listdir(directory):
        with open(os.path.join(directory, name), "rb") as file:
            inputs.append(file.read(SIZE_MAX + 1))
        if len(inputs[-1]) > SIZE_MAX:
            raise Wrong("%s/%s: longer than 1 MiB" % (directory, name))
    if not inputs:
        raise Wrong("%s: no inputs" % directory)
    write_pack(path, inputs)


def unpack(path, directory):
    inputs = read_pack(path)
    os.makedirs(directory, exist_ok=True)
    if os.listdir(directory):
        raise Wrong("%s: not empty" % directory)
    for one in inputs:
        with open(os.path.join(directory, hashlib.sha1(one).hexdigest()), "wb") as file:
            file.write(one)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True, metavar="pack|unpack")
    command = commands.add_parser("pack", help="write PACK from the files of DIRECTORY")
    command.add_argument("source", metavar="DIRECTORY")
    command.add_argument("target", metavar="PACK")
    command.set_defaults(run=pack)
    command = commands.add_parser("unpack", help="write the inputs of PACK into DIRECTORY, which is new or empty; "
                                  "each file is named by its SHA-1")
    command.add_argument("source", metavar="PACK")
    command.add_argument("target", metavar="DIRECTORY")
    command.set_defaults(run=unpack)
    arguments = parser.parse_args()
    try:
        arguments.run(arguments.source, arguments.target)
    except (OSError, Wrong) as error:
        sys.exit("corpus.py: %s" % error)


if __name__ == "__main__":
    main()
