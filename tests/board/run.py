"""What the cases share: the program on the board, what is expected of it, and how that is reported."""

import contextlib
import json
import os
import subprocess

import initramfs
from board import Board
from frames import host_records, moved_rig, render

HERE = os.path.dirname(os.path.abspath(__file__))
# Pins of the board's only GPIO chip. 3 is its power button.
LASER, HEARTBEAT, INTERLOCK = 0, 1, 6
WIDTH, HEIGHT = 752, 582
# A slow camera: an emulated processor under load must not count as a camera that fell silent.
RATE = 2
FRAME_S = 1 / RATE
# The longest cap that there is, and the shortest for so few frames.
CAP_MS = 1000
SILENT_S = 3 * FRAME_S
# Longest time for what follows from a pin or a frame at once; hundreds of times what it takes.
SOON_S = 60
GATED_COUNT, ALTERNATING_COUNT, SMALL_COUNT = 200, 40, 12
# The program on the board, by the version of libgpiod that is in it.
NAMES = {1: "/bin/isohead_board", 2: "/bin/isohead_board_gpiod2"}
# The live view's, where it is on the board, and from the program's folder where that was built.
LIVE, LIVE_BUILT = "/lib/isohead/isohead_live", "../lib/isohead/isohead_live"
# What a live camera adds to a record.
LIVE_FIELDS = ["lost", "skipped", "strobe"]


class Wrong(Exception):
    """The program did something else than it should."""


def expect(condition, text):
    if not condition:
        raise Wrong(text)


def program_size(path):
    text = subprocess.run(["aarch64-linux-gnu-size", path], check=True, stdout=subprocess.PIPE,
                          text=True).stdout
    code, data, bss = (int(field) for field in text.splitlines()[1].split()[:3])
    return f"program: {code} bytes of code and constants, {data} of data, {bss} zeroed"


class Run:
    """What all cases need."""

    def __init__(self, arguments):
        self.render = arguments.render
        self.host_sim = arguments.host_sim
        self.work = arguments.board
        self.name = NAMES[1]
        self.active_low = False  # low switches the laser on
        self.board = None
        self.facts = [program_size(arguments.program)]
        self.gated = render(self, "gated", "--sequence", "1", "--seed", "1", "--frames",
                            str(GATED_COUNT))
        self.alternating = render(self, "alternating", "--sequence", "2", "--seed", "3", "--laser",
                                  "alternate", "--frames", str(ALTERNATING_COUNT))
        self.small = render(self, "small", "--size", "640x480", "--frames", str(SMALL_COUNT))
        # Now, as the board does not wait for what host_sim says.
        for frames in [self.gated, self.alternating]:
            host_records(self, frames)
        self.moved_rig = moved_rig(self.gated, os.path.join(self.work, "moved.json"))
        self.image = os.path.join(self.work, "initramfs")
        initramfs.build(self.image, os.path.join(self.work, "root"),
                        {NAMES[1][1:]: arguments.program, NAMES[2][1:]: arguments.program2,
                         LIVE[1:]: os.path.join(os.path.dirname(arguments.program), LIVE_BUILT)},
                        arguments.sysroot, [self._tool("feeder"), self._tool("control")],
                        {f"rig/{frames.rig}.json": os.path.join(frames.directory, "rig.json")
                         for frames in [self.gated, self.alternating, self.small]} |
                        {"rig/moved.json": self.moved_rig})

    def _tool(self, name):
        path = os.path.join(self.work, name)
        subprocess.run(["aarch64-linux-gnu-gcc", "-std=c11", "-D_GNU_SOURCE", "-O2", "-Wall",
                        "-Wextra", "-Werror", "-static", "-o", path,
                        os.path.join(HERE, name + ".c")], check=True)
        return path

    def boot(self):
        self.board = Board(os.path.join(self.work, "Image"), self.image,
                           os.path.join(self.work, "console.log"))

    def shut_down(self):
        if self.board:
            self.board.close()
        self.board = None

    @contextlib.contextmanager
    def using(self, gpiod=1, active_low=False):
        """Another program, or a laser that the other level switches on."""
        self.name, self.active_low = NAMES[gpiod], active_low
        try:
            yield
        finally:
            self.name, self.active_low = NAMES[1], False

    def is_on(self):
        return self.board.levels[LASER] != self.active_low

    def gpio_options(self):
        return (f"--gpio-chip /dev/gpiochip0 --laser-line {LASER} "
                f"{'--laser-active-low' if self.active_low else ''}")

    def laser_off(self, more=""):
        """The program's --laser-off."""
        self.board.start(f"{self.name} --laser-off {self.gpio_options()} {more}")
        status = self.board.exit_status(SOON_S)
        expect(status == 0, f"exit status {status} of --laser-off: {self.board.log[-3:]}")
        expect(not self.is_on(), "the laser is on after --laser-off")

    def start(self, frames, strobe, more="", kind="GREY"):
        """The program with a fresh camera and a closed interlock; laser low before."""
        board = self.board
        board.command(f"feed {WIDTH} {HEIGHT} '{kind:4}'")
        board.set_input(INTERLOCK, 1)
        board.records.clear()
        board.log.clear()
        self.start_at("/dev/video0", frames.rig, strobe, f"--format {kind} {more}")

    def start_at(self, device, rig, strobe, more=""):
        expect(not self.is_on(), "the laser is on before the program starts")
        self.board.start(
            f"{self.name} --rig /rig/{rig}.json --device {device} --rate {RATE} "
            f"--exposure keep --gain keep --laser --laser-cap {CAP_MS} --strobe {strobe} {self.gpio_options()} "
            f"--heartbeat-line {HEARTBEAT} --interlock-line {INTERLOCK} --output - {more}")

    def stop(self):
        """By SIGTERM: ends by itself, laser off."""
        self.board.signal("TERM")
        status = self.board.exit_status(SOON_S)
        expect(status == 0, f"exit status {status} after SIGTERM, not 0: {self.board.log[-3:]}")
        expect(not self.is_on(), "the laser is on after SIGTERM")

    def laser(self, on, limit_s=SOON_S):
        """Wait until it is on, or off."""
        self.board.wait(lambda: self.is_on() == on, limit_s, f"laser {'on' if on else 'off'}")

    def low_after(self, text=":", limit_s=FRAME_S, pins=()):
        """Let the board's shell do something, or set input pins, while the laser is on, after which
        it has to go off within limit_s; after how many ms it did, by the board's clock."""
        self.laser(1)
        self.board.watch_pins(text)
        for line, level in pins:
            self.board.set_input(line, level)
        self.laser(0)
        falls = [edge for edge in self.board.pins()
                 if edge.line == LASER and edge.level == self.active_low]
        low_s = falls[-1].time_s - self.board.mark()
        expect(low_s < limit_s, f"the laser's line was high for {low_s:.2f} s more, not {limit_s:g}")
        return 1000 * low_s

    def high_times(self):
        """(rise, fall) of the laser's line since board.watch_pins(), by the board's clock."""
        edges = [edge for edge in self.board.pins() if edge.line == LASER]
        return [(rise.time_s, fall.time_s) for rise, fall in zip(edges, edges[1:]) if rise.level]

    def give(self, frames, index, sequence=None, time_us=None, held=False):
        self.give_samples(frames, index, frames.samples(index), sequence, time_us, held)

    def give_samples(self, frames, index, samples, sequence=None, time_us=None, held=False):
        self.board.send_frame(index if sequence is None else sequence,
                              frames.time_us(index) if time_us is None else time_us, samples, held)

    def lit_frame(self, frames, index, sequence=None, time_us=None):
        """Wait for the laser, give the frame, and take the record; the laser went off for it."""
        self.laser(1)
        edges = len(self.board.edges)
        self.give(frames, index, sequence, time_us)
        record = self.board.record(SOON_S)
        # It may be on again for the next one.
        off = [edge for edge in self.board.edges[edges:]
               if edge.line == LASER and edge.level == self.active_low]
        expect(off, f"the laser stayed on while frame {index} was looked at")
        return record


def gated_loop(run, count):
    """The first frames of run.gated, each after the laser went on; records as host_sim's."""
    expected = host_records(run, run.gated)
    for index, line in enumerate(expected[:count]):
        record = run.lit_frame(run.gated, index)
        expect(record == line, f"frame {index}:\nboard    {record}\nhost_sim {line}")


def same_but(record, expected, **live):
    """As host_sim says, and these fields besides; what a live camera adds has no other place."""
    found = json.loads(record)
    added = {name: found.pop(name) for name in LIVE_FIELDS if name in found}
    wanted = json.loads(expected)
    found.pop("file"), wanted.pop("file")
    found.pop("time_us"), wanted.pop("time_us")
    expect(found == wanted, f"record {record}\nhost_sim says {expected}")
    expect(added == live, f"beside host_sim's fields the record has {added}, expected {live}")
