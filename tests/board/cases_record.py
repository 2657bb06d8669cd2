"""Cases of a recording: made on the board, brought home, and replayed by host_sim."""

import os
import shutil
import subprocess

from frames import Frames
from run import SOON_S, expect

# Beside these the board's 256 MB hold a root file system in memory.
FRAMES, MEMORY_MB, MAX_MB = 12, 4, 60
DIR = "/tmp/record"


def wait_for_writer(run):
    """The process that writes goes on alone where the program has waited long enough for it."""
    run.board.command("while pidof isohead-record; do sleep 0.05; done >/dev/null", SOON_S)


def fetch(run, name):
    """A part of the recording, byte for byte, as a directory of this machine."""
    target = os.path.join(run.work, "recorded")
    shutil.rmtree(target, ignore_errors=True)
    os.makedirs(target)
    listed = run.board.command(f"ls {DIR}/{name}").split()
    for file in listed:
        text = run.board.command(f"gzip -c {DIR}/{name}/{file} | base64")
        content = subprocess.run("base64 -d | gzip -dc", shell=True, input=text.encode(), stdout=subprocess.PIPE, check=True).stdout
        with open(os.path.join(target, file), "wb") as out:
            out.write(content)
    return Frames(target, None)


def replayed(run, frames):
    return subprocess.run([run.host_sim, "--json", frames.directory], check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()


def loop(run, frames, count):
    """Alternating frames, each after the laser has gone where it shall be; the lit ones' records."""
    records = []
    for index in range(count):
        run.laser(frames.lit(index))
        run.give(frames, index)
        if frames.lit(index):
            records.append(run.board.record(SOON_S))
    run.laser(frames.lit(count))
    return records


def record_loop(run, what, rig):
    board = run.board
    board.command(f"rm -rf {DIR}; mkdir {DIR}")
    run.start(run.alternating, "alternating", f"--rig /rig/{rig}.json --record {DIR} --record-memory {MEMORY_MB} --record-max {MAX_MB}")
    records = loop(run, run.alternating, FRAMES)
    resident, _ = board.memory_kb()
    run.stop()
    wait_for_writer(run)
    frames = fetch(run, "000001")
    expect(len(frames) == FRAMES, f"{what}: {len(frames)} frames of {FRAMES} are recorded: {board.log[-3:]}")
    expect([entry["laser"] for entry in frames.entries] == [run.alternating.lit(index) for index in range(FRAMES)], f"{what}: laser")
    expect(replayed(run, frames) == records, f"{what}: replayed, it gives other records\n{replayed(run, frames)[:2]}\n{records[:2]}")
    return len(records), resident


def busy_ms(run, more):
    """The loop's work for a frame, by the board's clock: from the fall of the laser's line to its rise."""
    run.start(run.gated, "gated", more)
    run.laser(1)
    run.board.watch_pins()
    for index in range(FRAMES):
        run.lit_frame(run.gated, index)
    run.laser(1)
    times = run.high_times()
    resident, _ = run.board.memory_kb()
    run.stop()
    wait_for_writer(run)
    spans = [1000 * (rise_s - fall_s) for (_, fall_s), (rise_s, _) in zip(times, times[1:])]
    return sum(spans) / len(spans), resident


def case_record(run):
    """--record: made here, replayed by host_sim to the same bytes, also with a rig that has moved; its cost"""
    count, _ = record_loop(run, "as calibrated", run.alternating.rig)
    record_loop(run, "moved", "moved")
    run.board.command(f"rm -rf {DIR}; mkdir {DIR}")
    without_ms, without_kb = busy_ms(run, "")
    with_ms, with_kb = busy_ms(run, f"--record {DIR} --record-memory {MEMORY_MB} --record-max {MAX_MB}")
    run.board.command(f"rm -rf {DIR}")
    return (f"{count} records of {FRAMES} frames, twice, as host_sim's; a frame takes {with_ms:.2f} ms, {without_ms:.2f} without; "
            f"resident {with_kb} kB, {without_kb} without")


def case_record_full(run):
    """--record on a disk that is full, then has room again: records and laser go on"""
    board = run.board
    board.command(f"rm -rf {DIR}; mkdir {DIR}; mount -t tmpfs -o size=2m none {DIR}")
    run.start(run.gated, "gated", f"--record {DIR} --record-memory {MEMORY_MB} --record-max {MAX_MB}")
    try:
        for index in range(FRAMES):
            record = run.lit_frame(run.gated, index)
            expect(record == run.gated.records[index], f"frame {index}: {record}")
            board.settle(0.2)  # the process that writes has a processor only when nobody else wants it
        board.wait(lambda: any("No space left" in line for line in board.log), SOON_S, "message of the full disk")
        reported = [line for line in board.log if "record: writing" in line]
        expect(len(reported) == 1, f"reported {len(reported)} times: {reported}")
        frames = fetch(run, "000001")
        expect(0 < len(frames) < FRAMES and replayed(run, frames) == run.gated.records[:len(frames)], "what was written before is not whole")
    finally:
        run.stop()
        wait_for_writer(run)
        board.command(f"umount {DIR}")
    return f"{len(frames)} frames fit and give host_sim's records; {FRAMES} records, one message"


CASES = [case_record, case_record_full]
