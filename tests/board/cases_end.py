"""Cases of the end: how soon after SIGTERM, by the board's clock."""

import re

from cases_camera import DEVICE, plug_in
from run import FRAME_S, SOON_S, expect

# With frames: what the emulated processor keeps up with.
RATE, FRAMES_RATE = 25, 10
TRIES = 5
# What the shell does while it is timed; its own time counts.
END = ("echo begin >/sys/kernel/tracing/trace_marker; kill -TERM $program; wait $program; "
       "echo status $?; echo end >/sys/kernel/tracing/trace_marker")


def end_ms(run):
    """From SIGTERM until the program is gone; it ends by itself, laser off."""
    board = run.board
    board.watch_pins()
    status = board.command(END)
    expect("status 0" in status, f"after SIGTERM: {status}, expected status 0")
    expect(not run.is_on(), "the laser is on after SIGTERM")
    text = board.command("cat /sys/kernel/tracing/trace")
    begin, end = (float(re.search(rf"([0-9.]+): tracing_mark_write: {word}", text)[1])
                  for word in ["begin", "end"])
    return 1000 * (end - begin)


def among_frames(run, number):
    """Frames come that need less than their time; SIGTERM at another moment within one each time."""
    plug_in(run)
    run.start_at(DEVICE, "small", "always", f"--rate {FRAMES_RATE} --format GREY")
    run.laser(1)
    run.board.record(SOON_S)
    run.board.settle(0.023 * number)
    return end_ms(run)


def without_frames(run, _):
    run.start(run.gated, "always", f"--rate {RATE}")
    run.laser(1)
    return end_ms(run)


def amid_frame(run, number):
    """SIGTERM while a frame is looked at, which is done first."""
    run.start(run.gated, "gated")
    run.laser(1)
    run.give(run.gated, number)
    run.laser(0)
    return end_ms(run)


def case_end(run):
    """SIGTERM: the end in under a frame time"""
    results = []
    for what, ways, limit_ms in [("frames come", among_frames, 1000 / FRAMES_RATE),
                                 ("no frames", without_frames, 1000 / RATE),
                                 ("a frame of 2 a second is looked at", amid_frame, 1000 * FRAME_S)]:
        times_ms = [ways(run, number) for number in range(TRIES)]
        expect(max(times_ms) < limit_ms, f"{what}: {times_ms} ms, expected less than {limit_ms:g}")
        results.append(f"{what}: {max(times_ms):.1f} ms")
    return f"at most of {TRIES}: " + ", ".join(results)


CASES = [case_end]
