#!/usr/bin/env python3
"""The package's unit under a real systemd, on the emulated board: see unit.sh, which starts this.

test_unit.py --kernel FILE --initramfs FILE --console FILE

The camera is the kernel's own test driver, vivid: frames without dots, which are enough for the laser
to be on. Exit status 1 if something is not as it should be; a table says what was seen.
"""

import argparse
import sys
import time

from board import Board, BoardError

LASER = 0
# A whole Debian starts, on a processor that is emulated by a machine that may be busy.
BOOT_S = 300
MEMORY_MB = 768
# Longest time for what follows at once, and for what RestartSec or WatchdogSec come before.
SOON_S, LATE_S = 60, 120

# A slow camera: an emulated processor under load must not count as one that fell silent.
SETTINGS = """rig = /etc/isohead/rig.json
format = GREY
rate = 2
exposure = keep
gain = keep
laser-cap = 1000
gpio-chip = /dev/gpiochip0
laser-line = 0
laser-active-low = off
interlock-line = none
status = 0
"""


class Wrong(Exception):
    """The unit did something else than it should."""


def expect(condition, text):
    if not condition:
        raise Wrong(text)


class Unit:
    """isohead.service, through the board's shell."""

    def __init__(self, board):
        self.board = board

    def command(self, text):
        return self.board.command(text, SOON_S)

    def show(self, name):
        return self.command(f"systemctl show --property={name} --value isohead")

    def configure(self, text):
        lines = "\\n".join(text.splitlines())
        self.command(f"printf '{lines}\\n' >/etc/isohead/isohead.conf")

    def wait_for(self, name, value, limit_s):
        """Until the property is so."""
        end = time.monotonic() + limit_s
        while self.show(name) != value:
            expect(time.monotonic() < end, f"{name} is {self.show(name)}, not {value}, after {limit_s} s:\n"
                   + self.journal())
            self.board.settle(0.2)

    def journal(self):
        return self.command("journalctl --no-pager --lines=20 --output=cat --unit=isohead")

    def start(self):
        """Returns when it has said READY=1."""
        try:
            self.command("systemctl reset-failed isohead; systemctl restart isohead")
        except BoardError as error:
            raise Wrong(f"{error}\n{self.journal()}") from error
        expect(self.show("ActiveState") == "active", "not active after its start:\n" + self.journal())
        return int(self.show("MainPID"))

    def wait_laser(self, level, limit_s):
        try:
            self.board.wait_level(LASER, level, limit_s)
        except BoardError as error:
            raise Wrong(f"{error}\n{self.journal()}") from error

    def stop_post(self):
        """What `isohead_board --laser-off` said after the last end, as systemd shows it."""
        return self.show("ExecStopPost")


def boots_without_it(unit):
    """Installed, it neither runs nor is enabled, and the laser's line was never touched."""
    expect(unit.show("ActiveState") == "inactive", "it runs without being enabled")
    expect(unit.show("UnitFileState") == "disabled", "it is enabled")
    expect(not unit.board.edges, "a pin moved")
    owner = unit.command("udevadm settle; stat -c %U:%G:%a /dev/gpiochip0 /dev/video0")
    expect(owner == "root:gpio:660\nroot:video:660", f"devices' owners and modes: {owner}")
    return "disabled; devices belong to gpio and video"


def sandboxed(unit):
    """Without the laser; what the process may do, as the kernel says."""
    unit.configure(SETTINGS)
    pid = unit.start()
    status = dict(line.split(":\t", 1) for line in unit.command(f"cat /proc/{pid}/status").splitlines())
    user = unit.command("id -u isohead")
    expect(status["Uid"].split() == [user] * 4, f"runs as {status['Uid']}")
    expect(status["CapBnd"].strip("0") == "" and status["CapEff"].strip("0") == "", "has capabilities")
    expect(status["NoNewPrivs"] == "1" and status["Seccomp"] == "2", "no new privileges, system calls")
    expect(not unit.board.edges, "a pin moved, though the laser is off")
    return f"user isohead, no capability, seccomp; {status['VmRSS'].split()[0]} kB resident"


def lights(unit):
    """The laser is on while frames come: so cameras and GPIO chips are within reach."""
    unit.configure(SETTINGS + "laser = on\n")
    pid = unit.start()
    unit.wait_laser(1, SOON_S)
    unit.command("systemctl reload isohead")
    unit.board.settle(1)
    expect(int(unit.show("MainPID")) == pid, "another process after the reload:\n" + unit.journal())
    unit.wait_laser(1, SOON_S)
    return "laser on; reload keeps the process"


def killed(unit):
    """All of its processes at once by SIGKILL: the unit's last command makes the line low."""
    pid = unit.show("MainPID")
    unit.wait_laser(1, SOON_S)
    unit.command("systemctl kill --signal=KILL isohead")
    unit.wait_laser(0, SOON_S)
    unit.wait_for("SubState", "auto-restart", SOON_S)
    expect("--laser-off" in unit.stop_post() and "status=0" in unit.stop_post(),
           "the command after the end: " + unit.stop_post())
    unit.wait_for("ActiveState", "active", LATE_S)
    expect(unit.show("MainPID") not in (pid, "0"), "not started again:\n" + unit.journal())
    unit.wait_laser(1, SOON_S)
    return "line low; started again by itself"


def edited(unit):
    """Rubbish where its settings were, while it runs: it still knows which line to make low."""
    unit.configure("laser-line = 7\nrubbish\n")
    unit.command("systemctl kill --signal=KILL isohead")
    unit.wait_laser(0, SOON_S)
    unit.wait_for("SubState", "failed", LATE_S)
    expect(unit.show("ExecMainStatus") == "2", "status " + unit.show("ExecMainStatus"))
    lights(unit)
    return "line low; not started again"


def hangs(unit):
    """A process that does not go on: its guard makes the line low, systemd ends it."""
    unit.wait_laser(1, SOON_S)
    unit.command("kill -STOP $(systemctl show --property=MainPID --value isohead)")
    unit.wait_laser(0, SOON_S)
    unit.wait_for("Result", "watchdog", SOON_S)
    unit.wait_for("ActiveState", "active", LATE_S)
    unit.wait_laser(1, SOON_S)
    return "line low; ended by the watchdog, started again"


def sleeps(unit):
    """What suspends the machine needs sleep.target before: the unit is stopped first, and stays so."""
    unit.wait_laser(1, SOON_S)
    unit.command("printf '[Unit]\\nRequires=sleep.target\\nAfter=sleep.target\\n[Service]\\nType=oneshot\\n"
                 "ExecStart=/bin/sh -c \"systemctl is-active isohead >/run/nap; true\"\\n' >/run/systemd/system/nap.service")
    unit.command("systemctl daemon-reload; systemctl start nap")
    expect(unit.board.levels[LASER] == 0, "the laser is on in the machine's sleep")
    state = unit.command("cat /run/nap")
    expect(state == "inactive", f"it is {state} when the machine goes to sleep")
    expect(unit.show("Result") == "success", "it did not end by itself:\n" + unit.journal())
    unit.start()
    return "line low and stopped before the machine sleeps"


def stops(unit):
    unit.wait_laser(1, SOON_S)
    unit.command("systemctl stop isohead")
    unit.wait_laser(0, SOON_S)
    expect(unit.show("ActiveState") == "inactive", "it did not stop")
    expect(unit.show("Result") == "success", "it did not end by itself:\n" + unit.journal())
    return "line low; ended with status 0"


def refuses(unit):
    """A wrong configuration is no reason to try again."""
    unit.configure(SETTINGS + "strobe = sometimes\n")
    unit.command("! systemctl restart isohead")
    expect(unit.show("ActiveState") == "failed", "not failed, but " + unit.show("SubState"))
    expect(unit.show("ExecMainStatus") == "2", "status " + unit.show("ExecMainStatus"))
    expect("isohead.conf:12" in unit.journal(), "the journal does not name the line:\n" + unit.journal())
    expect(unit.board.levels[LASER] == 0, "the laser is on")
    return "status 2, not tried again, the journal names the line"


CASES = [boots_without_it, sandboxed, lights, killed, edited, hangs, sleeps, stops, refuses]


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    for name in ("kernel", "initramfs", "console"):
        parser.add_argument("--" + name, required=True)
    options = parser.parse_args()
    began = time.monotonic()
    with Board(options.kernel, options.initramfs, options.console, memory_mb=MEMORY_MB,
               boot_s=BOOT_S) as board:
        unit = Unit(board)
        print(f"unit: {time.monotonic() - began:4.0f} s  systemd is up", flush=True)
        for case in CASES:
            try:
                seen = case(unit)
            except (Wrong, BoardError) as error:
                print(f"unit: FAILED: {case.__name__}: {error}", file=sys.stderr)
                return 1
            print(f"unit: {time.monotonic() - began:4.0f} s  {case.__name__}: {seen}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
