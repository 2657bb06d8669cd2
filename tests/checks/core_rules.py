#!/usr/bin/env python3
"""The rules of firmware/core, shown by building it: gcc -O2 -mgeneral-regs-only for this machine.

  float      no floating-point register is touched: the compiler refuses it
  symbols    nothing is called outside the core but a short list
  data       no writable static data: .data, .bss, their thread-local kin and commons are empty
  calls      no recursion, no call through a pointer, no alloca, no variable-length array
  stack      the deepest call chain from each public function, within tests/limits.conf
  size       code and constants, and struct isohead, within tests/limits.conf
  commands   every build really compiles the core with -mgeneral-regs-only, but for the files whose
             loops may become vectors

core_rules.py [--compile-commands FILE]    exit status 1 if a rule is broken
core_rules.py --self-test                  breaks each rule in a copy and sees it noticed
"""

import argparse
import glob
import json
import os
import re
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CORE = os.path.join(ROOT, "firmware", "core")
sys.path.insert(0, os.path.join(ROOT, "tools", "size"))
import call_graph
import limits
import ram
from call_graph import Broken

# The only functions the core may leave to others. Compilers call these four on their own, for
# struct copies and initial values, so that even freestanding C must have them.
SYMBOLS_ALLOWED = {"memcpy", "memmove", "memset", "memcmp"}
# Stack charged for a call of one of them.
# Files whose loops may become vectors, and so are not built with -mgeneral-regs-only; here they are.
VECTORS = {"ih_scanline.c", "ih_bandpass.c", "ih_bandpass_respond.c", "ih_bandpass_bytes.c",
           "ih_block_median.c", "ih_noise.c", "ih_dot_maxima.c", "ih_dot_centre.c", "ih_dots.c", "ih_align_vote.c",
           "ih_normal_equations.c", "ih_normal_solve.c", "ih_multiquadric.c", "ih_surface.c",
           "ih_surface_rows.c", "ih_surface_grid.c",
           "ih_contours.c", "ih_arcs.c", "ih_arc_fans.c", "ih_ellipse.c",
           "ih_scan.c", "ih_fit_weights.c", "ih_fit_equations.c",
           "ih_align_fit.c", "ih_label_seeds.c",
           "ih_ellipsoid.c", "ih_evidence.c", "ih_surroundings.c", "ih_pose_look.c"}
OUTSIDE = {name: 64 for name in SYMBOLS_ALLOWED}
ENTRIES = ("isohead_init", "isohead_frame", "isohead_label", "isohead_find", "ih_cloud_draw")

COMPILE = ["gcc", "-std=c11", "-O2", "-mgeneral-regs-only", "-fcallgraph-info=su", "-Wvla",
           "-Werror=vla", "-fno-stack-protector", "-U_FORTIFY_SOURCE", "-fno-pic", "-I", CORE, "-c"]
WRITABLE = re.compile(r"^\.?(l?data|l?bss|tdata|tbss|COMMON)(\.|$)")


def run(command, **options):
    return subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE, **options).stdout


def compile_one(source, directory):
    output = os.path.join(directory, os.path.basename(source)[:-2] + ".o")
    done = subprocess.run(COMPILE + [source, "-o", output], text=True, stderr=subprocess.PIPE,
                          check=False)
    if done.returncode:
        first = [line for line in done.stderr.splitlines() if "error:" in line] or [done.stderr]
        word = "calls" if "variable length" in done.stderr or "vla" in first[0] else "float"
        raise Broken("%s: %s does not compile: %s" % (word, os.path.basename(source), first[0]))
    return output


def core_sources():
    return sorted(glob.glob(os.path.join(CORE, "**", "*.c"), recursive=True))


def check_symbols(objects):
    wanted, defined = set(), set()
    for line in run(["nm", "--format=posix"] + objects).splitlines():
        part = line.split()
        if len(part) >= 2 and part[1] == "U":
            wanted.add(part[0])
        elif len(part) >= 2 and part[1].isupper():
            defined.add(part[0])
    foreign = wanted - defined
    strange = sorted(foreign - SYMBOLS_ALLOWED)
    if strange:
        raise Broken("symbols: not the core's own and not allowed: " + ", ".join(strange))
    return sorted(foreign)


def check_data(objects):
    """Bytes of the read-only sections, by kind."""
    total = {"code": 0, "constants": 0}
    path = None
    for line in run(["size", "-A"] + objects).splitlines():
        part = line.split()
        if line.endswith(":") and len(part) == 2:
            path = part[0]
        if len(part) != 3 or not part[1].isdigit():
            continue
        name, size = part[0], int(part[1])
        if WRITABLE.match(name) and size > 0:
            raise Broken("data: %s has %d bytes of %s" % (os.path.basename(path), size, name))
        if name.startswith(".text"):
            total["code"] += size
        elif name.startswith(".rodata"):
            total["constants"] += size
    for line in run(["nm", "-A", "--format=posix"] + objects).splitlines():
        path, *part = line.split()
        if len(part) >= 2 and part[1] in "CcDdBb":
            raise Broken("data: %s: %s is writable" % (os.path.basename(path.rstrip(":")), part[0]))
    return total


def check_stack(objects, limit_bytes):
    stack, callees = call_graph.read(path[:-2] + ".ci" for path in objects)
    call_graph.check_all(stack, callees, OUTSIDE)
    worst = {entry: call_graph.deepest(stack, callees, entry, OUTSIDE) for entry in ENTRIES}
    for entry, (size, chain) in worst.items():
        check_limit("stack", "stack of %s (%s)" % (entry, " -> ".join(chain)), size, limit_bytes)
    return worst


def check_limit(rule, what, size, limit):
    if size > limit:
        raise Broken("%s: %s: %d bytes, the limit is %d" % (rule, what, size, limit))


def check_commands(path):
    # The tests build the same sources once more, with other vectors: those are not the library.
    with open(path, encoding="utf-8") as file:
        commands = {os.path.realpath(os.path.join(c["directory"], c["file"])):
                    command for c in json.load(file)
                    for command in [c.get("command") or " ".join(c["arguments"])]
                    if not re.search(r"/isohead_core_\w+\.dir/", command)}
    for source in core_sources():
        command = commands.get(os.path.realpath(source))
        if command is None:
            raise Broken("commands: %s is not built: list it in firmware/core/CMakeLists.txt"
                         % os.path.basename(source))
        if (os.path.basename(source) not in VECTORS) != ("-mgeneral-regs-only" in command.split()):
            raise Broken("commands: %s is built %s -mgeneral-regs-only" % (
                os.path.basename(source),
                "with" if "-mgeneral-regs-only" in command.split() else "without"))


def check(arguments):
    bounds = limits.read()
    with tempfile.TemporaryDirectory() as directory:
        objects = [compile_one(source, directory) for source in core_sources()]
        symbols = check_symbols(objects)
        total = check_data(objects)
        worst = check_stack(objects, bounds["x86_stack_bytes"])
        sizes, ram_max = ram.sizes(["gcc"], "nm", directory)
        check_limit("size", "struct isohead", sizes[ram.WHOLE], bounds["ram_bytes"])
        check_limit("size", "IH_RAM_MAX", ram_max, bounds["ram_bytes"])
        check_limit("size", "code and constants", sum(total.values()), bounds["x86_code_bytes"])
        if arguments.compile_commands:
            check_commands(arguments.compile_commands)
        print("calls outside the core: %s" % (", ".join(symbols) or "none"))
        print("writable static data: 0 bytes; code %(code)d bytes, constants %(constants)d bytes" % total)
        for entry, (size, chain) in worst.items():
            print("stack of %s: %d bytes, limit %d (%s)"
                  % (entry, size, bounds["x86_stack_bytes"], " -> ".join(chain)))
        for name, size in sizes.items():
            print("%8d bytes %s" % (size, name))


# What must be noticed: the rule, and what is added to a source of the core.
BREACHES = [
    ("data", "static int32_t injected_count;\n"
             "int32_t ih_injected(void);\nint32_t ih_injected(void) { return ++injected_count; }\n"),
    ("data", "int32_t ih_injected_common = 7;\n"),
    ("data", "_Thread_local int32_t ih_injected_local;\n"),
    ("symbols", "#include <stdlib.h>\nvoid *ih_injected(void);\n"
                "void *ih_injected(void) { return malloc(7); }\n"),
    ("calls", "int32_t ih_injected(int32_t n);\nint32_t ih_injected(int32_t n)\n"
              "{ return n < 2 ? n : ih_injected(n - 1) + ih_injected(n - 3); }\n"),
    ("calls", "int32_t ih_injected(int32_t (*f)(void));\n"
              "int32_t ih_injected(int32_t (*f)(void)) { return f() + 1; }\n"),
    ("calls", "int32_t ih_injected(int32_t n);\nint32_t ih_injected(int32_t n)\n"
              "{ volatile int32_t v[n]; v[n - 1] = n; return v[0]; }\n"),
    ("calls", "int32_t ih_injected(int32_t n);\nint32_t ih_injected(int32_t n)\n"
              "{ volatile char *p = __builtin_alloca((size_t)n); p[n - 1] = 1; return p[0]; }\n"),
    ("float", "double ih_injected(double a);\ndouble ih_injected(double a) { return a * 2.5; }\n"),
    ("symbols float", "int32_t ih_injected(int32_t a);\n"
                      "int32_t ih_injected(int32_t a) { return (int32_t)((float)a * 0.3f); }\n"),
]


def notice(injected, good, directory):
    """The rule that a source with the injected text breaks, with the reason; None when none."""
    source = os.path.join(directory, "isohead.c")
    with open(os.path.join(CORE, "isohead.c"), encoding="utf-8") as file:
        text = file.read()
    with open(source, "w", encoding="utf-8") as file:
        file.write(text + "\n" + injected)
    try:
        objects = [path for path in good if os.path.basename(path) != "isohead.o"]
        objects.append(compile_one(source, directory))
        check_symbols(objects)
        check_data(objects)
        check_stack(objects, limits.read()["x86_stack_bytes"])
    except Broken as broken:
        return str(broken)
    return None


def self_test():
    missed = 0
    with tempfile.TemporaryDirectory() as good_directory, tempfile.TemporaryDirectory() as directory:
        good = [compile_one(source, good_directory) for source in core_sources()]
        if notice("", good, directory):
            raise Broken("self-test: the core itself does not pass: " + notice("", good, directory))
        for rule, injected in BREACHES:
            reason = notice(injected, good, directory)
            seen = reason is not None and reason.split(":")[0] in rule.split()
            missed += not seen
            print("%s: %s" % ("noticed" if seen else "MISSED (%s)" % rule, reason))
        try:
            check_stack(good, 100)
            missed += 1
            print("MISSED: a stack above the limit")
        except Broken as broken:
            print("noticed: %s" % broken)
        missed += not missed_command(directory)
    print("core_rules: %d breaches made, %d missed" % (len(BREACHES) + 2, missed))
    return 1 if missed else 0


def missed_command(directory):
    """Is a build without the option noticed?"""
    path = os.path.join(directory, "compile_commands.json")
    with open(path, "w", encoding="utf-8") as file:
        json.dump([{"directory": CORE, "file": source, "command": "cc -c " + source}
                   for source in core_sources()], file)
    try:
        check_commands(path)
    except Broken as broken:
        print("noticed: %s" % broken)
        return True
    print("MISSED: a build without -mgeneral-regs-only")
    return False


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--compile-commands", metavar="FILE",
                        help="compile_commands.json of a build that must keep the rules too")
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    try:
        if arguments.self_test:
            return self_test()
        check(arguments)
    except (Broken, limits.Wrong) as broken:
        print("core_rules: %s" % broken, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
