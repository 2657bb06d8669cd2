#!/usr/bin/env python3
"""Who may switch the laser on: read from the calls in the sources.

A strobe's set() with anything but a literal false stands in app_laser.c, which decides, and in
hal_guard.c, which passes on what it decided; nobody keeps the function for later. What drives the
line below it, hal_gpio_line_set(), is called by hal_gpio.c alone, and libgpiod's own functions by the
two files that it is wrapped in.

laser.py [--self-test]      exit status 1 if a rule is broken, each with file and line
"""

import os
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SET = re.compile(r"(?:->|\.)set\s*\(\s*[^,()]*(?:\([^()]*\))?[^,()]*,\s*([^,()]+)")
KEPT = re.compile(r"(?:->|\.)set\b(?!\s*[(=])")
LINE = re.compile(r"\bhal_gpio_line_set\b")
LIBRARY = re.compile(r"\bgpiod_(?:line|chip_request|ctxless)\w*\s*\(")
DECIDES = {"firmware/app/app_laser.c", "hal/linux/hal_guard.c"}
DRIVES = {"hal/linux/hal_gpio.c", "hal/linux/hal_gpio_lines.h", "hal/linux/hal_gpio_v1.c",
          "hal/linux/hal_gpio_v2.c"}
WRAPS = {"hal/linux/hal_gpio_v1.c", "hal/linux/hal_gpio_v2.c"}


def judge(path, text):
    """(line number, reason) of everything that is wrong with a file's text."""
    wrong = []

    def add(pattern, reason, is_wrong=lambda found: True):
        wrong.extend((text.count("\n", 0, found.start()) + 1, reason)
                     for found in pattern.finditer(text) if is_wrong(found))

    if path not in DECIDES:
        add(SET, "switches a strobe on", lambda found: found[1].strip() != "false")
        add(KEPT, "keeps what switches a strobe on")
    if path not in DRIVES:
        add(LINE, "drives the line itself")
    if path not in WRAPS:
        add(LIBRARY, "calls libgpiod itself")
    return wrong


def check():
    bad = calls = 0
    for top in ("firmware", "hal", "sim", "tools"):
        for directory, _, files in os.walk(os.path.join(ROOT, top)):
            for name in sorted(files):
                if name.endswith((".c", ".h")):
                    path = os.path.relpath(os.path.join(directory, name), ROOT)
                    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
                        text = file.read()
                    calls += len(SET.findall(text))
                    for number, reason in judge(path, text):
                        bad += 1
                        print("%s:%d: %s: that is app_laser.c's to decide" % (path, number, reason))
    print("laser: %d calls that set a strobe, %d against the rules" % (calls, bad))
    return 1 if bad or not calls else 0


def self_test():
    loop = "firmware/app/app_loop.c"
    on = "strobe->set(strobe->context, true, &error);"
    refused = [(loop, on), (loop, "s.set(\n    s.context, wished, &error)"),
               (loop, "loop->hal.strobe->set(context(loop), !off, &e)"),
               ("hal/linux/hal_signals.c", on), (loop, "hal_gpio_line_set(&line, false)"),
               ("firmware/app/app_laser.c", "hal_gpio_line_set(&line, true)"),
               (loop, "bool (*light)() = strobe->set;"), (loop, "use(loop->hal.strobe->set)"),
               ("hal/linux/hal_gpio.c", "gpiod_line_set_value(line, 1);"),
               ("tools/blink.c", "gpiod_line_request_set_value(request, 3, 1)")]
    good = [("firmware/app/app_laser.c", on), ("hal/linux/hal_guard.c", on),
            (loop, "strobe->set(strobe->context, false, &error);"),
            ("hal/linux/hal_gpio.c", "hal_gpio_line_set(&gpio->laser, true)"),
            ("hal/linux/hal_gpio_v1.c", "gpiod_line_set_value(handle, active)"),
            ("hal/linux/hal_replay.c", "strobe.set = set;")]
    missed = [case for case in refused if not judge(*case)] + [c for c in good if judge(*c)]
    for path, text in missed:
        print("judged wrongly: %s: %s" % (path, text))
    print("laser: %d made-up calls, %d judged wrongly" % (len(refused + good), len(missed)))
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(self_test() if sys.argv[1:] == ["--self-test"] else check())
