"""Cases of the laser's line: each returns what was seen; its first line says what is done."""

import json
import math
import re
import time

from frames import MOVED_DEG, host_records, picked
from run import (CAP_MS, FRAME_S, HEARTBEAT, HEIGHT, INTERLOCK, LASER, LIVE_FIELDS, RATE, SILENT_S, SOON_S,
                 WIDTH, expect, same_but)

# Their process numbers, for the board's shell, and that of one of them.
GUARD = "$(pidof isohead-guard)"
ONE_GUARD = "$(pidof isohead-guard | cut -d ' ' -f 1)"
# They end when the program has shown no sign of life for so long (hal_guard.h).
GUARD_S = 2
# Longer than a frame is looked at, so that each counts.
CHECK_FRAME_S = 0.05
# Longest time of a check, on a machine under load.
CHECK_S = 300


def case_interlock(run):
    """interlock opened while the laser is on, then closed again"""
    frames, board = run.alternating, run.board
    run.start(run.alternating, "gated")
    run.lit_frame(frames, 0)
    low_ms = run.low_after(pins=[(INTERLOCK, 0)])
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
    run.start_at("/dev/video0", frames.rig, "always", "--format GREY")
    rises = board.rises[LASER]
    board.settle(2)
    expect(board.rises[LASER] == rises, "the laser went on: started with the interlock open")
    run.stop()
    return f"low {low_ms:.1f} ms later, no rise while it is open, goes on when it is closed"


def case_reload(run):
    """SIGHUP with a broken rig, then with a good one"""
    frames, board = run.alternating, run.board
    rig = f"/rig/{frames.rig}.json"
    run.start(frames, "gated")
    run.lit_frame(frames, 0)
    run.laser(1)
    board.command(f"cp {rig} /rig/good.json; echo broken >{rig}")
    low_ms = run.low_after("kill -HUP $program")
    rises = board.rises[LASER]
    run.give(frames, 1)
    board.settle(2 * FRAME_S)
    expect(not board.records, f"a record without a rig: {list(board.records)}")
    expect(board.rises[LASER] == rises, "the laser went on without a rig")
    board.command(f"cp /rig/good.json {rig}")
    board.signal("HUP")
    board.wait(lambda: any("reloaded" in line for line in board.log), SOON_S, "reloaded rig")
    # A camera gives frames while the laser is off too.
    run.give(frames, 3, sequence=2)
    record = json.loads(run.lit_frame(frames, 2, sequence=3))
    expect(record["file"] == "000003.pgm" and record["labelled"] > 100,
           f"the first record afterwards: {record}")
    expect(record.get("strobe") != "reopened", f"the camera was opened anew: {record}")
    run.stop()
    return f"low {low_ms:.1f} ms later, no records with the broken one; goes on with the good one"


def case_moved(run):
    """the rig file is replaced by one that is 0.2 degrees off, and reloaded: heads go on in the next frame"""
    gated, board = run.gated, run.board
    rig = f"/rig/{gated.rig}.json"

    def part(name, *indices):
        return picked(run, name, gated, [(i, gated.time_us(i)) for i in indices])
    before = part("before", *range(60, 64))
    after, right = (part(name, *range(64, 72)) for name in ("after", "right"))
    host_records(run, after, "--rig", run.moved_rig)
    run.start(gated, "gated")
    for number, line in enumerate(host_records(run, before)):
        same_but(run.lit_frame(before, number), line)
    board.command(f"cp {rig} /rig/good.json; cp /rig/moved.json {rig}")
    board.signal("HUP")
    board.wait(lambda: any("reloaded" in line for line in board.log), SOON_S, "reloaded rig")
    errors_mm = []
    for number, (line, wanted) in enumerate(zip(after.records, host_records(run, right))):
        record = run.lit_frame(after, number, sequence=len(before) + number)
        same_but(record, line)
        errors_mm.append(math.dist(*(head_mm(each) for each in (record, wanted))))
    moved = json.loads(record)["rig"]
    expect(moved["state"] == "moved" and abs(moved["rotation_deg"][0] + MOVED_DEG) < MOVED_DEG / 2,
           f"how the rig has moved: {moved}")
    expect(max(errors_mm) < 50, f"heads are off by {errors_mm} mm")
    board.wait(lambda: any("the rig has moved" in line for line in board.log), SOON_S, "warning of a rig that moved")
    run.stop()
    board.command(f"cp /rig/good.json {rig}")
    return f"{len(errors_mm)} heads in as many frames, at most {max(errors_mm):.0f} mm from those with the right file"


def head_mm(record):
    found = json.loads(record)
    expect(found["head"] is not None, f"no head: {record}")
    return found["hypotheses"][found["head"]]["centre_mm"]


def case_check(run):
    """--check with the right rig file, and with the one that is 0.2 degrees off"""
    gated, board = run.gated, run.board
    found = []
    for rig, status, words in ((gated.rig, 0, "it fits"), ("moved", 1, "it has moved")):
        board.command(f"feed {WIDTH} {HEIGHT} GREY")
        board.set_input(INTERLOCK, 1)
        board.log.clear()
        run.start_at("/dev/video0", rig, "always", "--format GREY --check")
        run.laser(1)
        # As many as it needs, over and over: of those that come while it looks at one the camera keeps but a few.
        span_us = gated.time_us(len(gated) - 1) + FRAME_S * 1e6
        sequence, end = 0, time.monotonic() + CHECK_S
        while not any("checked" in line or "cannot be determined" in line for line in board.log) and time.monotonic() < end:
            lap, index = divmod(sequence, len(gated))
            run.give(gated, index, sequence, int(gated.time_us(index) + lap * span_us))
            board.settle(CHECK_FRAME_S)
            sequence += 1
        is_status = board.exit_status(SOON_S)
        line = next((line for line in board.log if "checked 60 frames" in line), "")
        expect(is_status == status and words in line, f"exit status {is_status}, {board.log[-3:]}")
        expect(not board.records and not run.is_on(), f"records, or the laser is on: {list(board.records)[:1]}")
        found.append(f"{rig}: status {status}")
    return ", ".join(found)


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


# Signals and how the program ends: with status 0, else by the signal itself.
SIGNALS = {"TERM": 0, "INT": 0, "QUIT": -3, "ILL": -4, "TRAP": -5, "ABRT": -6, "BUS": -7, "FPE": -8,
           "USR1": -10, "SEGV": -11, "USR2": -12, "ALRM": -14, "XCPU": -24, "SYS": -31}


def case_signals(run):
    """killed by each signal while the laser is on"""
    return signals(run, SIGNALS)


def signals(run, names):
    board, slowest_ms = run.board, 0
    for name in names:
        wanted = SIGNALS[name]
        run.start(run.gated, "gated")
        run.lit_frame(run.gated, 0)
        slowest_ms = max(slowest_ms, run.low_after(f"kill -{name} $program"))
        status = board.exit_status(SOON_S)
        expect(status == wanted, f"exit status {status} after SIG{name}, not {wanted}")
        expect(not run.is_on(), f"the laser is on after SIG{name}")
    return f"{len(names)} signals: low after at most {slowest_ms:.1f} ms, exit status as expected"


def case_killed(run):
    """SIGKILL while the laser is on: the guard process acts"""
    board = run.board
    run.start(run.gated, "gated")
    run.lit_frame(run.gated, 0)
    run.laser(1)
    board.wait_rises(HEARTBEAT, board.rises[HEARTBEAT] + 2, SOON_S)
    low_ms = run.low_after("kill -KILL $program")
    status = board.exit_status(SOON_S)
    expect(status == -9, f"exit status {status} after SIGKILL")
    expect(not run.is_on(), "the laser is on after SIGKILL")
    return f"low {low_ms:.1f} ms later"


def case_all_killed(run):
    """SIGKILL for program and guard at once: hardware and systemd are left"""
    board = run.board
    run.start(run.gated, "gated")
    run.lit_frame(run.gated, 0)
    run.laser(1)
    board.signal("KILL", f"$program {GUARD}")
    status = board.exit_status(SOON_S)
    expect(status == -9, f"exit status {status} after SIGKILL")
    stuck = "high" if board.levels[LASER] else "low"
    edges = len(board.edges)
    board.settle(1)
    expect(len(board.edges) == edges, "a line moves although all are dead")
    # Lines that do not exist are nothing to it.
    run.laser_off("--interlock-line nothing --heartbeat-line 99")
    return f"the line stays {stuck}, the heartbeat stops; low after --laser-off"


def case_stopped(run):
    """SIGSTOP while the laser is on: the guards act after the cap"""
    board = run.board
    run.start(run.gated, "gated")
    run.lit_frame(run.gated, 0)
    low_ms = run.low_after("kill -STOP $program", CAP_MS / 1000 + FRAME_S)
    rises = board.rises[LASER]
    board.settle(2 * GUARD_S)
    board.signal("CONT")
    status = board.exit_status(SOON_S)
    expect(status == 1, f"exit status {status} after SIGCONT, not 1: {board.log[-3:]}")
    expect(board.rises[LASER] == rises, "the laser went on after SIGCONT")
    return f"low {low_ms:.0f} ms later; the program ends when it goes on"


def case_guard_killed(run):
    """the guard process killed while the laser is on"""
    board = run.board
    run.start(run.gated, "gated")
    run.lit_frame(run.gated, 0)
    low_ms = run.low_after(f"kill -KILL {GUARD}")
    status = board.exit_status(SOON_S)
    expect(status == 1, f"exit status {status}, not 1: {board.log[-3:]}")
    expect(board.levels[LASER] == 0, "the laser's line is high after the end")
    return f"low {low_ms:.0f} ms later, exit status 1"


def case_guard_stopped(run):
    """one guard stopped, then the program killed: the other guard acts"""
    board = run.board
    run.start(run.gated, "gated")
    run.lit_frame(run.gated, 0)
    low_ms = run.low_after(f"kill -STOP {ONE_GUARD}; kill -KILL $program")
    status = board.exit_status(SOON_S)
    expect(status == -9, f"exit status {status} after SIGKILL")
    run.laser_off()
    left = board.command("pidof isohead-guard || echo none").strip()
    expect(left == "none", f"guards are left after --laser-off: {left}")
    return f"low {low_ms:.1f} ms later; --laser-off ends the one that stands still"


def case_guards_stopped(run):
    """both guards stopped and the program killed at once: --laser-off takes the line from them"""
    board = run.board
    run.start(run.gated, "gated")
    run.lit_frame(run.gated, 0)
    run.laser(1)
    board.signal("STOP", GUARD)
    board.signal("KILL")
    status = board.exit_status(SOON_S)
    expect(status == -9, f"exit status {status} after SIGKILL")
    stuck = "high" if board.levels[LASER] else "low"
    run.laser_off()
    return f"the line stays {stuck}; low after --laser-off, with status 0"


def case_frame_time(run):
    """another program sets the camera's frame time to 1000 s, and no frame comes"""
    board = run.board
    run.start(run.gated, "gated")
    run.lit_frame(run.gated, 0)
    low_ms = run.low_after("control /dev/video0 frame-time 1000", CAP_MS / 1000 + FRAME_S)
    run.stop()
    rises = board.rises[LASER]
    board.log.clear()
    board.start(f"{run.name} --rig /rig/gated.json --device /dev/video0 --format GREY --exposure keep "
                f"--gain keep --laser {run.gpio_options()}")
    board.wait(lambda: any("a frame every 1000000000 us, expected" in line for line in board.log), SOON_S,
               "message about the frame time")
    run.stop()
    expect(board.rises[LASER] == rises, "the laser went on for a camera of a frame in 1000 s")
    return f"low {low_ms:.0f} ms later; refused with a message when started anew, laser never on"


def case_duty(run):
    """duty limit of 30 %, laser always on"""
    run.board.watch_pins()
    run.start(run.gated, "always", "--duty 30")
    run.laser(1)
    run.board.settle(2 * SILENT_S)
    run.stop()
    times = run.high_times()
    high_s = sum(fall_s - rise_s for rise_s, fall_s in times)
    fraction = high_s / (times[-1][1] - times[0][0])
    # A burst of 100 ms is allowed at the start.
    expect(0.2 < fraction < 0.4, f"the line was high for {100 * fraction:.0f} % of the time, expected 30")
    return f"high for {100 * fraction:.0f} % of {times[-1][1] - times[0][0]:.1f} s"


def case_status(run):
    """the status line's duty cycle of the laser, gated"""
    board, index = run.board, 0
    board.watch_pins()
    run.start(run.gated, "gated", "--status 1")
    while not (reported := [line for line in board.log if "laser on" in line]):
        run.lit_frame(run.gated, index)
        index += 1
    run.stop()
    times = run.high_times()
    fraction = 100 * sum(fall_s - rise_s for rise_s, fall_s in times) / (times[-1][1] - times[0][0])
    percent = int(re.search(r"laser on (\d+) %", reported[0])[1])
    expect(abs(percent - fraction) < 5, f"reported {percent} %, the line was high for {fraction:.1f} %")
    return f"reported {percent} %, the line was high for {fraction:.1f} %"


CASES = [case_interlock, case_reload, case_moved, case_check, case_unasked, case_signals, case_killed, case_all_killed,
         case_stopped, case_guard_killed, case_guard_stopped, case_guards_stopped, case_frame_time, case_duty, case_status]
