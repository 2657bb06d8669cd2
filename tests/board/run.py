"""What the cases share: the program on the board, what is expected of it, and how that is told."""

import json
import os
import subprocess

import initramfs
from board import Board
from frames import render

HERE = os.path.dirname(os.path.abspath(__file__))
# Pins of the board's only GPIO chip. 3 is its power button.
LASER, HEARTBEAT, INTERLOCK = 0, 1, 6
WIDTH, HEIGHT = 752, 582
# A slow camera: an emulated processor under load must not count as a camera that fell silent.
RATE = 2
FRAME_S = 1 / RATE
SILENT_S = 3 * FRAME_S
# Longest time for what follows from a pin or a frame at once; a hundred times what it takes.
SOON_S = 20
GATED_COUNT, ALTERNATING_COUNT, SMALL_COUNT = 200, 40, 12
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
        self.program = arguments.program
        self.work = arguments.board
        self.name = "/bin/" + os.path.basename(arguments.program)
        self.board = None
        self.facts = [program_size(arguments.program)]
        self.gated = render(self, "gated", "--sequence", "1", "--seed", "1", "--frames",
                            str(GATED_COUNT))
        self.alternating = render(self, "alternating", "--sequence", "2", "--seed", "3", "--laser",
                                  "alternate", "--frames", str(ALTERNATING_COUNT))
        self.small = render(self, "small", "--size", "640x480", "--frames", str(SMALL_COUNT))
        self.image = os.path.join(self.work, "initramfs")
        initramfs.build(self.image, os.path.join(self.work, "root"), self.program,
                        arguments.sysroot, [self._tool("feeder"), self._tool("unplug")],
                        {f"rig/{frames.rig}.json": os.path.join(frames.directory, "rig.json")
                         for frames in [self.gated, self.alternating, self.small]})

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

    def start(self, frames, strobe, more="", kind="GREY"):
        """The program with a fresh camera and a closed interlock; laser low before."""
        board = self.board
        board.command(f"feed {WIDTH} {HEIGHT} '{kind:4}'")
        board.set_input(INTERLOCK, 1)
        board.records.clear()
        board.log.clear()
        self.start_at("/dev/video0", frames.rig, strobe, f"--format {kind} {more}")

    def start_at(self, device, rig, strobe, more=""):
        expect(self.board.levels[LASER] == 0, "the laser's line is high before the program starts")
        self.board.start(
            f"{self.name} --rig /rig/{rig}.json --device {device} --rate {RATE} "
            f"--exposure keep --gain keep --laser --strobe {strobe} --gpio-chip /dev/gpiochip0 "
            f"--laser-line {LASER} --heartbeat-line {HEARTBEAT} --interlock-line {INTERLOCK} "
            f"--output - {more}")

    def stop(self):
        """By SIGTERM: ends as asked, laser off."""
        self.board.signal("TERM")
        status = self.board.exit_status(SOON_S)
        expect(status == 0, f"exit status {status} after SIGTERM, not 0: {self.board.log[-3:]}")
        expect(self.board.levels[LASER] == 0, "the laser's line is high after SIGTERM")

    def laser(self, level, limit_s=SOON_S):
        self.board.wait_level(LASER, level, limit_s)

    def low_after(self, text=":", limit_s=FRAME_S, pins=()):
        """Let the board's shell do something, or set input pins, while the laser is on, after which
        it has to go off within limit_s; after how many ms it did, by the board's clock."""
        self.laser(1)
        self.board.watch_pins(text)
        for line, level in pins:
            self.board.set_input(line, level)
        self.laser(0)
        falls = [edge for edge in self.board.pins() if edge.line == LASER and not edge.level]
        low_s = falls[-1].time_s - self.board.mark()
        expect(low_s < limit_s, f"the laser's line was high for {low_s:.2f} s more, not {limit_s:g}")
        return 1000 * low_s

    def high_times(self):
        """(rise, fall) of the laser's line since board.watch_pins(), by the board's clock."""
        edges = [edge for edge in self.board.pins() if edge.line == LASER]
        return [(rise.time_s, fall.time_s) for rise, fall in zip(edges, edges[1:]) if rise.level]

    def give(self, frames, index, sequence=None, time_us=None):
        self.give_samples(frames, index, frames.samples(index), sequence, time_us)

    def give_samples(self, frames, index, samples, sequence=None, time_us=None):
        self.board.send_frame(index if sequence is None else sequence,
                              frames.time_us(index) if time_us is None else time_us, samples)

    def lit_frame(self, frames, index, sequence=None, time_us=None):
        """Wait for the laser, give the frame, and take the record; the laser went off for it."""
        self.laser(1)
        rises = self.board.rises[LASER]
        self.give(frames, index, sequence, time_us)
        record = self.board.record(SOON_S)
        # The line may be up again for the next one.
        expect(self.board.levels[LASER] == 0 or self.board.rises[LASER] > rises,
               f"the laser's line stayed high while frame {index} was looked at")
        return record


def same_but(record, expected, **live):
    """As host_sim says, and these fields besides; what a live camera adds has no other place."""
    found = json.loads(record)
    added = {name: found.pop(name) for name in LIVE_FIELDS if name in found}
    wanted = json.loads(expected)
    found.pop("file"), wanted.pop("file")
    found.pop("time_us"), wanted.pop("time_us")
    expect(found == wanted, f"record {record}\nhost_sim says {expected}")
    expect(added == live, f"beside host_sim's fields the record has {added}, expected {live}")
