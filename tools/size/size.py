#!/usr/bin/env python3
"""What the core takes of a Cortex-M7: flash, RAM, stack, instructions; against tests/limits.conf.

  flash         code and constants of every object of firmware/core
  RAM           sizeof struct isohead and of its members; writable static data: none
  stack         the deepest chain of calls, from the frames that the compiler reports (-fcallgraph-info=su)
                and the calls that it reports or that stand in the linked code; and the deepest store that
                an emulator saw while the frames were processed
  instructions  executed in an emulator between entry and end of isohead_frame, by source file, most first

size.py --build DIR --plugin FILE --rig FILE FRAME...      exit status 1 when a bound is passed

DIR: a CMake build for mps2-an500 with the program isohead_cortexm. FILE: tools/size/count.c as a plugin of
QEMU, and a rig as a blob. Frames are processed in order; the last MEASURED of them count.
"""

import argparse
import functools
import glob
import os
import re
import statistics
import subprocess
import sys
import tempfile

import call_graph
import limits
import ram
from call_graph import Broken
from program import PREFIX, Program, run

BOARD = "mps2-an500"
COMPILER = [PREFIX + "gcc", "-mcpu=cortex-m7", "-mthumb", "-mfloat-abi=soft"]
MEASURED = 5
DECODE, INIT, FRAME = "ih_rig_blob_decode", "isohead_init", "isohead_frame"
ENTRIES = (DECODE, INIT, FRAME)
# Where the work of the core ends: what the program calls next.
ENDS = ("app_record_frame", "app_record_error", "hal_semihosting_call")
MEM = ("memcpy", "memmove", "memset", "memcmp")
COMPILER_HELPERS = ("__aeabi_ldivmod", "__aeabi_uldivmod", "__ctzdi2")
HELPERS = ("ih_fix.c", "memory", "arithmetic")
ROWS_OUTSIDE = {"memory": "memcpy and its kin (C library)", "arithmetic": "64-bit arithmetic (compiler)"}


def sections(path):
    """(code, constants, writable) bytes of an object."""
    size = {"code": 0, "constants": 0, "writable": 0}
    for line in run(PREFIX + "size", "-A", path).splitlines():
        found = re.match(r"(\.text|\.rodata|\.data|\.bss|\.tdata|\.tbss|COMMON)\S*\s+(\d+)\s", line)
        if found:
            kind = {".text": "code", ".rodata": "constants"}.get(found[1], "writable")
            size[kind] += int(found[2])
    return size["code"], size["constants"], size["writable"]


def flash(objects):
    """{source: (code, constants)}; Broken when something can be written."""
    table = {}
    for path in objects:
        source = os.path.basename(path).removesuffix(".obj")
        code, constants, writable = sections(path)
        if writable:
            raise Broken("data: %s has %d bytes that can be written" % (source, writable))
        table[source] = (code, constants)
    return table


def graph(objects, program):
    """The compiler's call graph, and in it every call that the linked code has."""
    stack, callees = call_graph.read(re.sub(r"\.obj$", ".ci", path) for path in objects)
    for function in stack:
        if function in program.code:
            callees[function] |= {name for name in program.calls(function) if name != function}
    return stack, callees


def check_calls(stack, callees):
    outside = sorted({name for names in callees.values() for name in names if name not in stack})
    strange = [name for name in outside if name not in MEM + COMPILER_HELPERS]
    if strange:
        raise Broken("symbols: not the core's own and not allowed: " + ", ".join(strange))
    return outside


def count(program, plugin, rig, frames):
    """[(mark, first store, lowest store, {(address, instructions): runs})] of every phase."""
    marks = {program.symbol[name]: name for name in ENTRIES + ENDS}
    words = ["isohead_cortexm", rig] + frames
    if any("," in word or " " in word for word in words):
        raise Broken("frames: a name with a blank or comma, which semihosting cannot pass on")
    with tempfile.TemporaryDirectory() as work:
        out = os.path.join(work, "count")
        done = subprocess.run(
            ["qemu-system-arm", "-M", BOARD, "-nographic", "-monitor", "none", "-serial", "none",
             "-semihosting-config", "enable=on,target=native," + ",".join("arg=" + word for word in words),
             "-plugin", "%s,out=%s,stack=%x,%s" % (plugin, out, program.symbol["hal_bss_end"],
                                                   ",".join("mark=%x" % mark for mark in marks)),
             "-kernel", program.path], stdout=subprocess.PIPE, text=True, timeout=3600, check=False)
        if done.returncode or done.stdout.count('"head":') != len(frames):
            raise Broken("run: status %d, %d records of %d frames"
                         % (done.returncode, done.stdout.count('"head":'), len(frames)))
        phases = []
        with open(out, encoding="ascii") as file:
            for line in file:
                part = line.split()
                if part[0] == "phase":
                    phases.append((marks[int(part[1], 16)], int(part[2], 16), int(part[3], 16), {}))
                else:
                    at, instructions, runs = (int(word, 16) for word in part)
                    table = phases[-1][3]
                    table[at, instructions] = table.get((at, instructions), 0) + runs
        return phases


def row_at(program, address):
    """The row of the table that an address belongs to; None: the calling program's. Its few instructions
    between the end of a function of the core and the next mark are left out."""
    source = program.source_of(address)
    if source.removesuffix("-stub") in MEM:
        return "memory"
    if source.startswith("_") and "libgcc" in program.object_of(address):
        return "arithmetic"
    return source if source.startswith(("ih_", "isohead.c")) else None


def by_row(program, pieces):
    """{row: instructions}"""
    rows = {}
    for (address, instructions), runs in pieces.items():
        row = row_at(program, address)
        if row:
            rows[row] = rows.get(row, 0) + instructions * runs
    return rows


def shared_out(program, pieces):
    """{row: instructions} with those of HELPERS handed on to who calls them, in proportion to the calls."""
    own, calls, total_calls = {}, {}, {}
    for (address, instructions), runs in pieces.items():
        caller = program.function_at(address)
        callee = program.called_by(address, instructions)
        own[caller] = own.get(caller, 0) + instructions * runs
        if callee and callee != caller:
            calls.setdefault(caller, {})
            calls[caller][callee] = calls[caller].get(callee, 0) + runs
            total_calls[callee] = total_calls.get(callee, 0) + runs
    row = {name: row_at(program, address) for address, name in program.name.items()}

    @functools.lru_cache(maxsize=None)
    def with_helpers(function):
        return own.get(function, 0) + sum(
            with_helpers(callee) * runs / total_calls[callee]
            for callee, runs in calls.get(function, {}).items() if row[callee] in HELPERS)

    rows = {}
    for function in own:
        if row[function] and row[function] not in HELPERS:
            rows[row[function]] = rows.get(row[function], 0) + with_helpers(function)
    return rows


def outside_flash(program, row):
    """Code of the linked functions that a row stands for."""
    return sum(size for at, size, kind, _ in program.sections
               if kind == ".text" and row == row_at(program, at))


def joined(tables):
    """The sums of several tables."""
    total = {}
    for table in tables:
        for key, value in table.items():
            total[key] = total.get(key, 0) + value
    return total


def print_stages(table, program, frames, rig):
    """frames, rig: pieces. Returns flash and the mean of instructions."""
    pieces = joined(frames)
    own, shared, once = by_row(program, pieces), shared_out(program, pieces), by_row(program, rig)
    total = sum(own.values())
    line = "%-32s %6s %9s %6s %12s %12s %5s %10s"
    print(line % ("", "code", "constants", "flash", "own", "with help", "", "rig, once"))
    print(line % ("stage", "B", "B", "B", "instr/frame", "instr/frame", "%", "instr"))
    for row in sorted(table, key=lambda row: (-shared.get(row, 0), -own.get(row, 0), row)) + list(ROWS_OUTSIDE):
        code, constants = table[row] if row in table else (outside_flash(program, row), 0)
        part = shared.get(row, 0)
        print(line % (ROWS_OUTSIDE.get(row, row), code, constants, code + constants,
                      round(own.get(row, 0) / len(frames)),
                      "shared out" if row in HELPERS else round(part / len(frames)),
                      "" if row in HELPERS else "%.1f" % (100 * part / total), once.get(row, 0)))
    code, constants = (sum(sizes[i] for sizes in table.values()) for i in (0, 1))
    totals = [sum(by_row(program, frame).values()) for frame in frames]
    print(line % ("all; flash: the core's own", code, constants, code + constants, round(total / len(frames)),
                  round(sum(shared.values()) / len(frames)), "100", sum(once.values())))
    print("instr/frame: mean of %d frames; their least %d, median %d, worst %d. with help: and of the helpers,\n"
          "ih_fix, memcpy and 64-bit arithmetic, what they spend for the stage, in proportion to its calls.\n"
          % (len(frames), min(totals), statistics.median(totals), max(totals)))
    return code + constants, round(total / len(frames))


def print_ram(directory):
    sizes, ram_max = ram.sizes(COMPILER, PREFIX + "nm", directory)
    print("RAM, bytes (stages never run at the same time: scratch is as large as its largest part)")
    for name, size in sizes.items():
        print("  %-24s %7d" % (name, size))
    print("  %-24s %7d\n" % ("writable static data", 0))
    return sizes[ram.WHOLE], ram_max


def print_stack(stack, callees, program, phases):
    """Bytes of the worst of ENTRIES. What the emulator saw must not be more than the bound."""
    # gcc also reports calls that it removed; what is not linked is not called.
    outside = {name: program.stack_of(name) if name in program.code else 0
               for name in check_calls(stack, callees)}
    call_graph.check_all(stack, callees, outside)
    print("stack, bytes; recursion: none; calls through pointers: none")
    worst = 0
    for entry in ENTRIES:
        size, chain = call_graph.deepest(stack, callees, entry, outside)
        seen = [first - lowest + program.first_push(entry) for mark, first, lowest, _ in phases
                if mark == entry and first]
        if seen and max(seen) > size:
            raise Broken("stack: %s took %d bytes, more than the bound of %d" % (entry, max(seen), size))
        print("  %-24s %7d   %s%s" % (entry, size, " -> ".join(
            "%s %d" % (name, stack.get(name, outside.get(name))) for name in chain),
            "; seen: %d" % max(seen) if seen else ""))
        worst = max(worst, size)
    print("  calls outside the core, with what these call: %s\n"
          % ", ".join("%s %s" % (name, size if name in program.code else "(in no code)")
                      for name, size in outside.items()))
    return worst


def judge(found):
    """Prints the bounds; how many are passed."""
    bounds = limits.read()
    print("%-32s %12s %12s %6s" % ("bound (tests/limits.conf)", "found", "limit", "%"))
    for name, value in found.items():
        print("%-32s %12d %12d %6.1f%s" % (name, value, bounds[name], 100 * value / bounds[name],
                                           "   PASSED" if value > bounds[name] else ""))
    return sum(value > bounds[name] for name, value in found.items())


def measure(arguments, directory):
    objects = sorted(glob.glob(os.path.join(arguments.build, "firmware/core/CMakeFiles/isohead_core.dir/**/*.obj"),
                               recursive=True))
    program = Program(os.path.join(arguments.build, "firmware/app/isohead_cortexm"))
    table = flash(objects)
    if set(table) != {os.path.basename(path) for path in glob.glob(os.path.join(ram.CORE, "**", "*.c"), recursive=True)}:
        raise Broken("build: %s: other objects than firmware/core has sources" % arguments.build)
    stack, callees = graph(objects, program)
    phases = count(program, arguments.plugin, arguments.rig, arguments.frames)
    frames = [pieces for mark, _, _, pieces in phases if mark == FRAME][-MEASURED:]
    rig = joined(pieces for mark, _, _, pieces in phases if mark in (DECODE, INIT))
    print("Cortex-M7 (%s), %s\n" % (BOARD, run(PREFIX + "gcc", "--version").splitlines()[0]))
    found = {}
    found["flash_bytes"], found["cortexm7_frame_instructions"] = print_stages(table, program, frames, rig)
    found["ram_bytes"], ram_max = print_ram(directory)
    found["stack_bytes"] = print_stack(stack, callees, program, phases)
    if ram_max != limits.read()["ram_bytes"]:
        raise Broken("RAM: IH_RAM_MAX is %d, tests/limits.conf says %d" % (ram_max, limits.read()["ram_bytes"]))
    return judge(found)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True)
    parser.add_argument("--plugin", required=True)
    parser.add_argument("--rig", required=True)
    parser.add_argument("frames", nargs="+")
    try:
        with tempfile.TemporaryDirectory() as directory:
            passed = measure(parser.parse_args(), directory)
    except (Broken, limits.Wrong) as broken:
        print("size: %s" % broken, file=sys.stderr)
        return 1
    return 1 if passed else 0


if __name__ == "__main__":
    sys.exit(main())
