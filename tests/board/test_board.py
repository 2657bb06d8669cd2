#!/usr/bin/env python3
"""isohead_board on the emulated board (board.py): what it does with frames, faults and signals, and
where the laser's line stands meanwhile.

test_board.py --program FILE --sysroot DIR --host-sim FILE --render FILE --board DIR [CASE...]

--board: what get.sh has made; logs and rendered frames go there too. Frames come when the laser's
line says so, never by the clock, so that a slow machine changes no result. Exit status 1 if a case
fails; a table says what was seen.
"""

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import time

import initramfs
from board import Board, BoardError

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
# Time stamps start here: v4l2loopback takes 0 for none.
TIME_0_US = 1000000
GATED_COUNT, ALTERNATING_COUNT, SMALL_COUNT = 200, 40, 12
LIVE_FIELDS = ["lost", "skipped", "strobe"]


class Wrong(Exception):
    """The program did something else than it should."""


def expect(condition, text):
    if not condition:
        raise Wrong(text)


# --- frames ---


class Frames:
    """A rendered frames directory, as the board's camera gives it and as host_sim reads it."""

    def __init__(self, directory, rig):
        self.directory = directory
        self.rig = rig  # its name on the board
        self.records = None  # host_sim's, once they are known
        with open(os.path.join(directory, "frames.jsonl"), encoding="ascii") as file:
            self.entries = [json.loads(line) for line in file]

    def __len__(self):
        return len(self.entries)

    def samples(self, index):
        with open(os.path.join(self.directory, self.entries[index]["file"]), "rb") as file:
            content = file.read()
        head = content.split(b"\n", 3)
        if head[0] != b"P5" or head[2] != b"255":
            raise ValueError(f"{self.directory}: frame {index} is not an 8-bit PGM as render writes")
        return head[3]

    def time_us(self, index):
        return self.entries[index]["time_us"]

    def lit(self, index):
        return self.entries[index]["laser"]


def render(run, rig, *options):
    """Frames with time stamps from TIME_0_US on, rendered if they are not there."""
    directory = os.path.join(run.work, "frames", "_".join(options).replace("--", ""))
    if not os.path.exists(os.path.join(directory, "rig.json")):
        shutil.rmtree(directory, ignore_errors=True)
        os.makedirs(directory)
        subprocess.run([run.render, *options, directory], check=True, stdout=subprocess.DEVNULL)
        frames = Frames(directory, rig)
        with open(os.path.join(directory, "frames.jsonl"), "w", encoding="ascii") as file:
            for entry in frames.entries:
                entry["time_us"] += TIME_0_US
                file.write(json.dumps(entry) + "\n")
    return Frames(directory, rig)


def picked(run, name, frames, picks):
    """Some of the frames, at other times: picks are (index, time_us)."""
    directory = os.path.join(run.work, "frames", name)
    shutil.rmtree(directory, ignore_errors=True)
    os.makedirs(directory)
    shutil.copy(os.path.join(frames.directory, "rig.json"), directory)
    with open(os.path.join(directory, "frames.jsonl"), "w", encoding="ascii") as file:
        for number, (index, time_us) in enumerate(picks):
            entry = dict(frames.entries[index], file=f"{number:06}.pgm", time_us=time_us)
            file.write(json.dumps(entry) + "\n")
            os.symlink(os.path.abspath(os.path.join(frames.directory, frames.entries[index]["file"])),
                       os.path.join(directory, entry["file"]))
    return Frames(directory, frames.rig)


def host_records(run, frames):
    """What host_sim says, a line per lit frame."""
    if frames.records is None:
        frames.records = subprocess.run([run.host_sim, "--json", frames.directory], check=True,
                                        stdout=subprocess.PIPE, text=True).stdout.splitlines()
    return frames.records


# --- the program ---


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

    def start(self, frames, strobe, more=""):
        """The program with a fresh camera and a closed interlock; laser low before."""
        board = self.board
        board.command(f"feed {WIDTH} {HEIGHT} GREY")
        board.set_input(INTERLOCK, 1)
        board.records.clear()
        board.log.clear()
        self.start_at("/dev/video0", frames.rig, strobe, more)

    def start_at(self, device, rig, strobe, more=""):
        expect(self.board.levels[LASER] == 0, "the laser's line is high before the program starts")
        self.board.start(
            f"{self.name} --rig /rig/{rig}.json --device {device} --format GREY --rate {RATE} "
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

    def last_edge(self, line):
        return next(edge.time_s for edge in reversed(self.board.edges) if edge.line == line)

    def high_share(self, begin_s, end_s):
        """For which part of that time the laser's line was high; it was so at its begin."""
        high_s, since_s = 0, begin_s
        for edge in self.board.edges:
            if edge.line == LASER and begin_s < edge.time_s < end_s:
                high_s += 0 if edge.level else edge.time_s - since_s
                since_s = edge.time_s
        return (high_s + self.board.levels[LASER] * (end_s - since_s)) / (end_s - begin_s)

    def give(self, frames, index, sequence=None, time_us=None):
        self.board.send_frame(index if sequence is None else sequence,
                              frames.time_us(index) if time_us is None else time_us,
                              frames.samples(index))

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


# --- cases: each returns what was seen ---


def case_gated(run):
    """closed loop, gated: each frame after the laser's rising edge"""
    expected = host_records(run, run.gated)
    run.start(run.gated, "gated")
    run.laser(1)
    begin = time.monotonic()
    for index, line in enumerate(expected):
        record = run.lit_frame(run.gated, index)
        expect(record == line, f"frame {index}:\nboard    {record}\nhost_sim {line}")
    frame_ms = 1000 * (time.monotonic() - begin) / len(expected)
    resident_kb, most_kb = run.board.memory_kb()
    run.stop()
    run.facts.append(f"memory: {resident_kb} kB resident after {len(expected)} frames, at most {most_kb} kB")
    return f"{len(expected)} records identical to host_sim's, {frame_ms:.0f} ms each"


def case_alternating(run):
    """alternating: a lit frame while the line is high, a dark one while it is low"""
    frames = run.alternating
    expected = iter(host_records(run, frames))
    run.start(run.alternating, "alternating")
    identical = 0
    for index in range(len(frames)):
        run.laser(int(frames.lit(index)))
        run.give(frames, index)
        if frames.lit(index):
            record, line = run.board.record(SOON_S), next(expected)
            expect(record == line, f"frame {index}:\nboard    {record}\nhost_sim {line}")
            identical += 1
    run.stop()
    expect(not run.board.records, f"records of dark frames: {list(run.board.records)}")
    return f"{identical} lit and {len(frames) - identical} dark frames, records identical"

def case_dropped(run):
    """two frames lost on the way: a gap in the camera's numbers"""
    indices = [0, 1, 2, 3, 6, 7, 8]
    frames = picked(run, "dropped", run.gated, [(i, run.gated.time_us(i)) for i in indices])
    expected = host_records(run, frames)
    run.start(run.gated, "gated")
    for number, index in enumerate(indices):
        record = run.lit_frame(frames, number, sequence=index)
        live = {"lost": 2} if index == 6 else {}
        same_but(record, expected[number], **live)
        expect(json.loads(record)["file"] == f"{index:06}.pgm", f"frame {index}'s name: {record}")
    run.stop()
    return "lost 2 in the record after the gap, its head as in host_sim, nothing later"


def case_doubled(run):
    """a frame that comes twice: both after one rise of the line"""
    gated, again = run.gated, 3
    run.start(gated, "gated")
    for index in range(again):
        same_but(run.lit_frame(gated, index), host_records(run, gated)[index])
    run.laser(1)
    run.give(gated, again)
    run.give(gated, again)
    # Both in turn, or the newest alone when both wait by the time that the program looks.
    first = json.loads(run.board.record(SOON_S))
    skipped = first.get("skipped", 0)
    twice = [again] if skipped else [again, again]
    indices = [*range(again), *twice, 4, 5]
    frames = picked(run, "doubled", gated, [(i, gated.time_us(i)) for i in indices])
    expected = host_records(run, frames)
    same_but(json.dumps(first), expected[again], **({"skipped": 1} if skipped else {}))
    if not skipped:
        same_but(run.board.record(SOON_S), expected[again + 1])
    for index in [4, 5]:
        same_but(run.lit_frame(gated, index), expected[index + len(twice) - 1])
    run.stop()
    return f"{len(twice)} of 2 have a record (skipped {skipped}), those after them as in host_sim"


def case_in_flight(run):
    """alternating: a frame is late by one, so that light and line disagree"""
    frames = run.alternating
    # What the camera gives: from the fourth on each was exposed before the line last moved.
    order = [0, 1, 2, 2, 3, 4, 5]
    run.start(run.alternating, "alternating")
    records = []
    sent = 0
    for index in order:
        run.give(frames, index, sequence=sent, time_us=TIME_0_US + 100000 * sent)
        sent += 1
        if frames.lit(index):
            records.append(json.loads(run.board.record(SOON_S)))
            expect(records[-1]["labelled"] > 100, f"a lit frame's record: {records[-1]}")
            run.laser(0)
        else:
            run.laser(1)
    run.stop()
    expect(not run.board.records, f"records of dark frames: {list(run.board.records)}")
    return f"{len(records)} lit of {len(order)} frames have their record, the line follows at once"


def case_late(run):
    """no frame for longer than 3 frame times, then a dark one, then all is well"""
    frames, lit, dark = run.alternating, [0, 2, 4, 6], 1
    run.start(run.alternating, "gated")
    for index in lit[:2]:
        run.lit_frame(frames, index)
    run.laser(1)
    begin = run.last_edge(LASER)
    run.laser(0)
    high_s = run.last_edge(LASER) - begin
    expect(high_s < SILENT_S + FRAME_S, f"the line stayed high for {high_s:.2f} s without a frame")
    # What a camera sees while the line is low; the frame was only late, not lost.
    run.give(frames, dark, sequence=3)
    record = json.loads(run.lit_frame(frames, lit[2]))
    expect(record.get("strobe") == "late" and record.get("skipped") == 1,
           f"the record after a late frame: {record}")
    record = json.loads(run.lit_frame(frames, lit[3], sequence=5))
    expect(not set(LIVE_FIELDS) & set(record), f"the second record after a late frame: {record}")
    run.stop()
    return f"low {high_s:.2f} s after its rise (3 frame times: {SILENT_S:.2f} s); the record says late"


def case_silent(run):
    """no frame for 10 frame times: the camera is opened anew"""
    run.start(run.gated, "gated")
    run.lit_frame(run.gated, 0)
    run.board.wait(lambda: any("open, a frame" in line for line in run.board.log[1:]), SOON_S,
                   "second opening of the camera")
    # v4l2loopback gives whoever opens it what was written last.
    record = json.loads(run.board.record(SOON_S))
    expect(record.get("strobe") == "reopened", f"the first record afterwards: {record}")
    record = json.loads(run.lit_frame(run.gated, 1))
    expect(not set(LIVE_FIELDS) & set(record), f"the second record afterwards: {record}")
    run.stop()
    return "the record says reopened, the next one is clean"


def case_truncated(run):
    """half a frame: an error record, then all is well"""
    expected = host_records(run, run.gated)
    run.start(run.gated, "gated")
    same_but(run.lit_frame(run.gated, 0), expected[0])
    run.laser(1)
    run.board.send_frame(1, run.gated.time_us(1), run.gated.samples(1)[:WIDTH * HEIGHT // 2])
    record = json.loads(run.board.record(SOON_S))
    expect(record["file"] == "000001.pgm" and "error" in record, f"half a frame's record: {record}")
    record = json.loads(run.lit_frame(run.gated, 2))
    expect("error" not in record and record["labelled"] > 100, f"the record after it: {record}")
    run.stop()
    return "error record, the next one is good"


def case_unplugged(run):
    """camera pulled out while the laser is on, and put back (the kernel's virtual camera)"""
    board = run.board
    board.command("modprobe vivid n_devs=1 num_inputs=1 input_types=0 node_types=1 vid_cap_nr=1")
    board.log.clear()
    board.set_input(INTERLOCK, 1)
    run.start_at("/dev/video1", "small", "always")
    run.laser(1)
    board.record(SOON_S)
    # The shell keeps the device open, so that it does not come back yet.
    pulled = time.monotonic()
    board.command("exec 6</dev/video1; unplug /dev/video1")
    run.laser(0)
    low_ms = 1000 * (run.last_edge(LASER) - pulled)
    rises = board.rises[LASER]
    board.wait(lambda: sum("trying again" in line for line in board.log) >= 3, SOON_S,
               "third try to open the camera")
    expect(board.rises[LASER] == rises, "the laser went on without a camera")
    board.records.clear()
    board.command("exec 6<&-")
    run.laser(1)
    record = json.loads(board.record(SOON_S))
    expect(record.get("strobe") == "reopened", f"the first record afterwards: {record}")
    run.stop()
    return f"low {low_ms:.0f} ms later, no rise while it is gone, goes on by itself"


def case_interlock(run):
    """interlock opened while the laser is on, then closed again"""
    frames, board = run.alternating, run.board
    run.start(run.alternating, "gated")
    run.lit_frame(frames, 0)
    run.laser(1)
    begin = time.monotonic()
    board.set_input(INTERLOCK, 0)
    run.laser(0, SOON_S)
    low_ms = 1000 * (run.last_edge(LASER) - begin)
    rises = board.rises[LASER]
    for sequence in range(1, 4):
        run.give(frames, 1, sequence=sequence)
        board.settle(FRAME_S)
    expect(board.rises[LASER] == rises, "the laser went on with the interlock open")
    board.set_input(INTERLOCK, 1)
    record = json.loads(run.lit_frame(frames, 2, sequence=4))
    expect(record["labelled"] > 100, f"the first record afterwards: {record}")
    record = json.loads(run.lit_frame(frames, 4, sequence=5))
    expect(not set(LIVE_FIELDS) & set(record), f"the second record afterwards: {record}")
    run.stop()
    board.set_input(INTERLOCK, 0)
    board.command(f"feed {WIDTH} {HEIGHT} GREY")
    run.start_at("/dev/video0", frames.rig, "always")
    rises = board.rises[LASER]
    board.settle(2)
    expect(board.rises[LASER] == rises, "the laser went on: started with the interlock open")
    run.stop()
    return f"low {low_ms:.1f} ms after the pin, no rise while it is open, goes on when it is closed"


def case_reload(run):
    """SIGHUP with a broken rig, then with a good one"""
    board = run.board
    run.start(run.gated, "gated")
    run.lit_frame(run.gated, 0)
    run.laser(1)
    board.command("cp /rig/gated.json /rig/good.json; echo broken >/rig/gated.json")
    board.signal("HUP")
    run.laser(0)
    rises = board.rises[LASER]
    run.give(run.gated, 1)
    board.settle(2 * FRAME_S)
    expect(not board.records, f"a record without a rig: {list(board.records)}")
    expect(board.rises[LASER] == rises, "the laser went on without a rig")
    board.command("cp /rig/good.json /rig/gated.json")
    board.signal("HUP")
    record = json.loads(run.lit_frame(run.gated, 2))
    expect(record["labelled"] > 100, f"the first record afterwards: {record}")
    run.stop()
    return "laser off and no records with the broken one; goes on with the good one"


def case_unasked(run):
    """without --laser, and with a bad rig: the line is never touched"""
    board = run.board
    board.command(f"feed {WIDTH} {HEIGHT} GREY")
    rises = board.rises[LASER]
    run_options = f"--device /dev/video0 --format GREY --rate {RATE} --exposure keep --gain keep"
    board.start(f"{run.name} --rig /rig/gated.json {run_options}")
    board.wait(lambda: any("open, a frame" in line for line in board.log), SOON_S, "open camera")
    run.give(run.gated, 0)
    same_but(board.record(SOON_S), host_records(run, run.gated)[0])
    run.stop()
    board.start(f"{run.name} --rig /proc/version {run_options} --laser "
                f"--gpio-chip /dev/gpiochip0 --laser-line {LASER}")
    status = board.exit_status(SOON_S)
    expect(status == 2, f"exit status {status} with a bad rig, not 2")
    expect(board.rises[LASER] == rises, "the line has risen")
    return "a record without the laser; exit status 2 for the bad rig"


# Signals and how the program ends: 0 as asked, else by the signal itself.
SIGNALS = {"TERM": 0, "INT": 0, "QUIT": -3, "ILL": -4, "TRAP": -5, "ABRT": -6, "BUS": -7, "FPE": -8,
           "USR1": -10, "SEGV": -11, "USR2": -12, "ALRM": -14, "XCPU": -24, "SYS": -31}


def case_signals(run):
    """killed by each signal while the laser is on"""
    board = run.board
    slowest_ms = 0
    for name, wanted in SIGNALS.items():
        run.start(run.gated, "gated")
        run.lit_frame(run.gated, 0)
        run.laser(1)
        begin = time.monotonic()
        board.signal(name)
        run.laser(0)
        slowest_ms = max(slowest_ms, 1000 * (run.last_edge(LASER) - begin))
        status = board.exit_status(SOON_S)
        expect(status == wanted, f"exit status {status} after SIG{name}, not {wanted}")
        expect(board.levels[LASER] == 0, f"the laser's line is high after SIG{name}")
    return f"{len(SIGNALS)} signals: low after at most {slowest_ms:.0f} ms, exit status as expected"


def case_killed(run):
    """SIGKILL while the laser is on: what hardware and systemd are for"""
    board = run.board
    run.start(run.gated, "gated")
    run.lit_frame(run.gated, 0)
    run.laser(1)
    beats = board.rises[HEARTBEAT]
    board.wait_rises(HEARTBEAT, beats + 2, SOON_S)
    board.signal("KILL")
    status = board.exit_status(SOON_S)
    expect(status == -9, f"exit status {status} after SIGKILL")
    stuck = "high" if board.levels[LASER] else "low"
    beats = len(board.edges)
    board.settle(1)
    expect(len(board.edges) == beats, "a line moves although the program is dead")
    board.start(f"{run.name} --laser-off --gpio-chip /dev/gpiochip0 --laser-line {LASER}")
    status = board.exit_status(SOON_S)
    expect(status == 0, f"exit status {status} of --laser-off: {board.log[-3:]}")
    expect(board.levels[LASER] == 0, "the laser's line is high after --laser-off")
    return f"heartbeat stops, the line stays {stuck}; low after --laser-off"

def case_stopped(run):
    """SIGSTOP while the laser is on: the guard process acts"""
    board = run.board
    run.start(run.gated, "gated")
    run.lit_frame(run.gated, 0)
    run.laser(1)
    begin = time.monotonic()
    board.signal("STOP")
    run.laser(0)
    low_s = run.last_edge(LASER) - begin
    rises = board.rises[LASER]
    board.signal("CONT")
    status = board.exit_status(SOON_S)
    expect(status == 1, f"exit status {status} after SIGCONT, not 1: {board.log[-3:]}")
    expect(board.rises[LASER] == rises, "the laser went on after SIGCONT")
    return f"low {low_s:.1f} s later; the program ends when it goes on"


def case_guard_killed(run):
    """the guard process killed while the laser is on"""
    board = run.board
    run.start(run.gated, "gated")
    run.lit_frame(run.gated, 0)
    run.laser(1)
    begin = time.monotonic()
    board.signal("KILL", "$(pidof isohead-guard)")
    run.laser(0)
    low_ms = 1000 * (run.last_edge(LASER) - begin)
    status = board.exit_status(SOON_S)
    expect(status == 1, f"exit status {status}, not 1: {board.log[-3:]}")
    expect(board.levels[LASER] == 0, "the laser's line is high after the end")
    return f"low {low_ms:.0f} ms later, exit status 1"


def case_duty(run):
    """duty limit of 30 %, laser always on"""
    run.start(run.gated, "always", "--duty 30")
    run.laser(1)
    begin = time.monotonic()
    run.board.settle(2 * SILENT_S)
    share = run.high_share(begin, time.monotonic())
    # A burst of 100 ms is allowed at the start.
    expect(0.2 < share < 0.4, f"the line was high for {100 * share:.0f} % of the time, expected 30")
    run.stop()
    return f"high for {100 * share:.0f} % of {2 * SILENT_S:.0f} s"


CASES = [case_gated, case_alternating, case_dropped, case_doubled, case_in_flight, case_late,
         case_silent, case_truncated, case_unplugged, case_interlock, case_reload, case_unasked,
         case_signals, case_killed, case_stopped, case_guard_killed, case_duty]


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
    for name in ["program", "sysroot", "host-sim", "render", "board"]:
        parser.add_argument("--" + name, required=True)
    parser.add_argument("case", nargs="*")
    arguments = parser.parse_args()
    chosen = [case for case in CASES
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
