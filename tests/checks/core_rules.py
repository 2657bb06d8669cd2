#!/usr/bin/env python3
"""The rules of firmware/core, shown by building it: gcc -O2 -mgeneral-regs-only for this machine.

  float      no floating-point register is touched: the compiler refuses it
  symbols    nothing is called outside the core but a short list
  data       no writable static data: .data, .bss, their thread-local kin and commons are empty
  calls      no recursion, no call through a pointer, no alloca, no variable-length array
  stack      the deepest call chain from each public function, below STACK_MAX_BYTES
  commands   every build really compiles the core with -mgeneral-regs-only, but for the files whose
             loops may become vectors

core_rules.py [--compile-commands FILE]    exit status 1 if a rule is broken
core_rules.py --self-test                  breaks each rule in a copy and sees it noticed
"""

import argparse
import functools
import json
import os
import re
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CORE = os.path.join(ROOT, "firmware", "core")

# The only functions the core may leave to others. Compilers call these four on their own, for
# struct copies and initial values, so that even freestanding C must have them.
SYMBOLS_ALLOWED = {"memcpy", "memmove", "memset", "memcmp"}
# Stack charged for a call of one of them.
LIBRARY_STACK_BYTES = 64
# Files whose loops may become vectors, and so are not built with -mgeneral-regs-only; here they are.
VECTORS = {"ih_band.c", "ih_noise.c", "ih_dots.c", "ih_cholesky.c", "ih_surface.c",
           "ih_ellipse.c", "ih_scan.c"}
# The measured value (1,568), rounded up. The aim for small boards is 4,096.
STACK_MAX_BYTES = 2048
ENTRIES = ("isohead_init", "isohead_frame", "isohead_label", "isohead_find", "ih_cloud_draw")

COMPILE = ["gcc", "-std=c11", "-O2", "-mgeneral-regs-only", "-fcallgraph-info=su", "-Wvla",
           "-Werror=vla", "-fno-stack-protector", "-U_FORTIFY_SOURCE", "-fno-pic", "-I", CORE, "-c"]
WRITABLE = re.compile(r"^\.?(l?data|l?bss|tdata|tbss|COMMON)(\.|$)")


class Broken(Exception):
    """A rule that is not kept; the first word names it."""


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
    return [os.path.join(CORE, name) for name in sorted(os.listdir(CORE)) if name.endswith(".c")]


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
    for path in objects:
        for line in run(["size", "-A", path]).splitlines():
            part = line.split()
            if len(part) != 3 or not part[1].isdigit():
                continue
            name, size = part[0], int(part[1])
            if WRITABLE.match(name) and size > 0:
                raise Broken("data: %s has %d bytes of %s" % (os.path.basename(path), size, name))
            if name.startswith(".text"):
                total["code"] += size
            elif name.startswith(".rodata"):
                total["constants"] += size
        for line in run(["nm", "--format=posix", path]).splitlines():
            if len(line.split()) >= 2 and line.split()[1] in "CcDdBb":
                raise Broken("data: %s: %s is writable" % (os.path.basename(path), line.split()[0]))
    return total


def plain(title):
    """A static function's title is PATH/FILE:NAME; two files may have one of the same name."""
    return os.path.basename(title)


def call_graph(objects):
    """(stack bytes by function, callees by function) from what the compiler wrote beside them."""
    stack, callees = {}, {}
    for path in objects:
        with open(path[:-2] + ".ci", encoding="utf-8") as file:
            text = file.read()
        for title, label in re.findall(r'node: \{ title: "([^"]*)" label: "([^"]*)"', text):
            size = re.search(r"(\d+) bytes \(([^)]*)\)", label)
            if not size:
                continue
            if size[2] not in ("static", "dynamic,bounded"):  # the latter's bytes are the bound
                raise Broken("calls: %s has a stack frame that is %s" % (title, size[2]))
            stack[plain(title)] = int(size[1])
            callees.setdefault(plain(title), set())
        for source, target in re.findall(r'edge: \{ sourcename: "([^"]*)" targetname: "([^"]*)"', text):
            if target == "__indirect_call":
                raise Broken("calls: %s calls through a pointer" % source)
            callees.setdefault(plain(source), set()).add(plain(target))
    return stack, callees


def deepest(stack, callees, entry):
    """(bytes, chain) of the worst chain of calls from a function."""
    active = []

    @functools.lru_cache(maxsize=None)
    def below(function):
        if function in active:
            raise Broken("calls: recursion: " + " -> ".join(active[active.index(function):] + [function]))
        if function not in stack:
            if function not in SYMBOLS_ALLOWED:
                raise Broken("calls: %s is called and nowhere defined" % function)
            return LIBRARY_STACK_BYTES, (function,)
        active.append(function)
        worst = max((below(callee) for callee in sorted(callees[function])), default=(0, ()))
        active.pop()
        return stack[function] + worst[0], (function,) + worst[1]

    return below(entry)


def check_stack(objects, limit_bytes):
    stack, callees = call_graph(objects)
    for function in sorted(stack):  # recursion anywhere, reachable or not
        deepest(stack, callees, function)
    worst = {entry: deepest(stack, callees, entry) for entry in ENTRIES}
    for entry, (size, chain) in worst.items():
        if size > limit_bytes:
            raise Broken("stack: %s needs %d bytes, the limit is %d: %s"
                         % (entry, size, limit_bytes, " -> ".join(chain)))
    return worst


def sizes(directory):
    """sizeof the state and of its parts, in the order of their declaration."""
    with open(os.path.join(CORE, "isohead.h"), encoding="utf-8") as file:
        body = re.search(r"\nstruct isohead \{\n(.*?)\n\};", file.read(), re.S)[1]
    outer, inner = re.subn(r"union \{(.*?)\} scratch;", "", body, flags=re.S)[0], \
        re.search(r"union \{(.*?)\} scratch;", body, re.S)
    member = re.compile(r"struct \w+ (\w+);")
    names = member.findall(outer) + ["scratch"] * bool(inner)
    names += ["scratch." + name for name in member.findall(inner[1] if inner else "")]
    lines = "".join('printf("%%zu %s\\n", sizeof h.%s);' % (name, name) for name in names)
    source = os.path.join(directory, "sizes.c")
    with open(source, "w", encoding="utf-8") as file:
        file.write("#include <stdio.h>\n#include \"isohead.h\"\nint main(void){static struct isohead h;"
                   'printf("%%zu struct isohead\\n", sizeof h);%s return 0;}\n' % lines)
    program = os.path.join(directory, "sizes")
    run(["gcc", "-I", CORE, source, "-o", program])
    return [line.split(" ", 1) for line in run([program]).splitlines()]


def check_commands(path):
    with open(path, encoding="utf-8") as file:
        commands = {os.path.realpath(os.path.join(c["directory"], c["file"])):
                    c.get("command") or " ".join(c["arguments"]) for c in json.load(file)}
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
    with tempfile.TemporaryDirectory() as directory:
        objects = [compile_one(source, directory) for source in core_sources()]
        symbols = check_symbols(objects)
        total = check_data(objects)
        worst = check_stack(objects, STACK_MAX_BYTES)
        if arguments.compile_commands:
            check_commands(arguments.compile_commands)
        print("calls outside the core: %s" % (", ".join(symbols) or "none"))
        print("writable static data: 0 bytes; code %(code)d bytes, constants %(constants)d bytes" % total)
        for entry, (size, chain) in worst.items():
            print("stack of %s: %d bytes, limit %d (%s)"
                  % (entry, size, STACK_MAX_BYTES, " -> ".join(chain)))
        for size, name in sizes(directory):
            print("%8s bytes %s" % (size, name))


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
        check_stack(objects, STACK_MAX_BYTES)
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
    except Broken as broken:
        print("core_rules: %s" % broken, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
