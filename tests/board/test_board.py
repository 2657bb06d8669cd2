#!/usr/bin/env python3
"""isohead_board on the emulated board (board.py): what it does with frames, faults and signals, and
where the laser's line stands meanwhile.

test_board.py --program FILE --program2 FILE --sysroot DIR --host-sim FILE --render FILE --board DIR
              [CASE...]

--program, --program2: built with libgpiod 1 and 2.

--board: what get.sh has made; logs and rendered frames go there too. Frames come when the laser's
line says so, never by the clock, so that a slow machine changes no result. Exit status 1 if a case
fails; a table says what was seen.
"""

import argparse
import signal
import sys
import time

import cases_camera
import cases_end
import cases_frames
import cases_gpio
import cases_laser
import cases_output
import cases_record
import cases_view
from board import BoardError
from run import Run, Wrong

MODULES = [cases_frames, cases_camera, cases_laser, cases_gpio, cases_end, cases_output, cases_record, cases_view]


def run_case(run, case):
    """Whether it went well, and what was seen."""
    try:
        if run.board is None:
            run.boot()
        return True, case(run)
    except (BoardError, Wrong) as error:
        run.shut_down()  # the next case gets a fresh board
        return False, str(error)


def main():
    parser = argparse.ArgumentParser()
    for name in ["program", "program2", "sysroot", "host-sim", "render", "board"]:
        parser.add_argument("--" + name, required=True)
    parser.add_argument("case", nargs="*")
    arguments = parser.parse_args()
    chosen = [case for module in MODULES for case in module.CASES
              if not arguments.case or case.__name__[len("case_"):] in arguments.case]
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # by way of "finally"
    begin = time.monotonic()
    run = Run(arguments)
    failures = 0
    try:
        for case in chosen:
            case_begin = time.monotonic()
            good, text = run_case(run, case)
            failures += not good
            print(f"{'ok  ' if good else 'FAIL'} {time.monotonic() - case_begin:6.1f} s  "
                  f"{case.__doc__}\n{'':15}{text}", flush=True)
    finally:
        run.shut_down()
    print("\n".join(run.facts))
    print(f"{len(chosen) - failures} of {len(chosen)} cases, {time.monotonic() - begin:.0f} s")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
