"""Cases of frames: each returns what was seen; its first line says what is done."""

import json
import time

from frames import TIME_0_US, clipped, host_records, picked, render
from run import (CAP_MS, FRAME_S, HEIGHT, INTERLOCK, LASER, LIVE_FIELDS, SILENT_S, SOON_S, WIDTH, expect,
                 gated_loop, same_but)


def case_gated(run):
    """closed loop, gated: each frame after the laser's rising edge"""
    expected = host_records(run, run.gated)
    run.start(run.gated, "gated")
    run.laser(1)
    begin = time.monotonic()
    gated_loop(run, len(expected))
    frame_ms = 1000 * (time.monotonic() - begin) / len(expected)
    resident_kb, max_kb = run.board.memory_kb()
    run.stop()
    run.facts.append(f"memory: {resident_kb} kB resident, at most {max_kb} kB")
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


def case_always(run):
    """always on while frames come"""
    frames = run.gated
    expected = host_records(run, frames)
    run.start(frames, "always")
    run.laser(1)
    rises = run.board.rises[LASER]
    for index in range(6):
        run.give(frames, index)
        record, line = run.board.record(SOON_S), expected[index]
        expect(record == line, f"frame {index}:\nboard    {record}\nhost_sim {line}")
    expect(run.board.levels[LASER] == 1 and run.board.rises[LASER] == rises,
           "the laser's line has moved while frames came")
    run.stop()
    return "6 records identical, the line stays high"


# What the camera gives, bits per sample, and where its colours are put. (v4l2loopback's Y10 and Y12
# have rows that are too short for them.)
KINDS = [("YUYV", 8, "after"), ("UYVY", 8, "before"), ("Y16", 16, None)]
# V4L2: white of a picture with colours, where the driver says nothing else of its range.
LIMITED_WHITE = 235


def with_colour(samples, place):
    """YUYV or UYVY of a grey picture, its colours grey as well."""
    both = bytearray(b"\x80" * (2 * len(samples)))
    start = 0 if place == "after" else 1
    both[start::2] = samples
    return bytes(both)


def case_kinds(run):
    """cameras with colours and with more than 8 bits"""
    for kind, bits, colour in KINDS:
        frames = render(run, "gated", "--sequence", "1", "--seed", "1", "--frames", "2", "--bits",
                        str(bits))
        if colour:
            frames = clipped(run, "limited", frames, LIMITED_WHITE)
        expected = host_records(run, frames)
        run.start(frames, "always", kind=kind)
        run.laser(1)
        for index, line in enumerate(expected):
            samples = frames.samples(index)
            run.give_samples(frames, index, with_colour(samples, colour) if colour else samples)
            record = run.board.record(SOON_S)
            expect(record == line, f"{kind}, {index}:\nboard    {record}\nhost_sim {line}")
        run.stop()
    return f"{', '.join(kind for kind, _, _ in KINDS)}: records identical to host_sim's"


def case_dropped(run):
    """two frames lost in transfer: a gap in the camera's numbers"""
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
    expected = []
    for name, twice in [("doubled", [again, again]), ("newest", [again])]:
        picks = [(i, gated.time_us(i)) for i in [*range(again), *twice, 4, 5]]
        expected.append(host_records(run, picked(run, name, gated, picks)))
    run.start(gated, "gated")
    for index in range(again):
        same_but(run.lit_frame(gated, index), expected[0][index])
    run.laser(1)
    run.give(gated, again)
    run.give(gated, again)
    # Both in turn, or the newest alone when both wait by the time that the program looks.
    first = run.board.record(SOON_S)
    skipped = json.loads(first).get("skipped", 0)
    wanted = expected[skipped][again:]
    same_but(first, wanted.pop(0), **({"skipped": 1} if skipped else {}))
    if not skipped:
        same_but(run.board.record(SOON_S), wanted.pop(0))
    for index, line in zip([4, 5], wanted):
        same_but(run.lit_frame(gated, index), line)
    run.stop()
    return f"{2 - skipped} of 2 have a record (skipped {skipped}), those after them as in host_sim"


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


# Bursts, each before the program looks once: letters of lit and dark frames, as the line was when
# each was exposed, which may be before it last moved.
ALTERNATING_BURSTS = ["L", "D", "DLL", "LDD", "DDL", "LLD", "DL", "D", "L"]
GATED_BURSTS = ["L", "DDL", "LDD", "DDD", "L", "LLL"]


def case_queue(run):
    """up to three frames wait in the driver's queue, exposed before the laser was switched"""
    return "; ".join(bursts(run, strobe, plan) for strobe, plan in
                     [("alternating", ALTERNATING_BURSTS), ("gated", GATED_BURSTS)])


def bursts(run, strobe, plan):
    frames, lit, dark, sequence = run.alternating, 0, 1, 0
    used, skipped = [], []  # the frames that count, and what was skipped before the lit ones
    records = []
    passed = 0
    run.start(frames, strobe)
    run.laser(1)
    for letters in plan:
        on, rises = run.is_on(), run.board.rises[LASER]
        for place, letter in enumerate(letters):
            index = lit if letter == "L" else dark
            lit, dark = lit + 2 * (letter == "L"), dark + 2 * (letter == "D")
            time_us = TIME_0_US + 100000 * sequence
            run.give(frames, index, sequence, time_us, held=place < len(letters) - 1)
            sequence += 1
        passed += len(letters) - 1
        if letters[-1] == "L":
            used.append((index, time_us))
            skipped.append(passed)
            records.append(run.board.record(SOON_S))
            passed = 0
        elif strobe == "alternating":
            used.append((index, time_us))
        else:
            passed += 1
        # The program has looked: it switched the laser over, or off and on again.
        if strobe == "alternating":
            run.laser(not on)
        else:
            run.board.wait_rises(LASER, rises + 1, SOON_S)
    run.stop()
    expect(not run.board.records, f"records of dark frames: {list(run.board.records)}")
    expected = host_records(run, picked(run, "queue", frames, used))
    expect(len(expected) == len(records), f"{len(records)} records, host_sim {len(expected)}")
    for record, line, count in zip(records, expected, skipped):
        same_but(record, line, **({"skipped": count} if count else {}))
    return (f"{strobe}: {len(records)} records of {sequence} frames as host_sim's, "
            f"{sum(skipped)} skipped")


def case_late(run):
    """no frame for longer than the cap and 3 frame times, then a dark one, then all is well"""
    frames, lit, dark = run.alternating, [0, 2, 4, 6], 1
    run.start(run.alternating, "gated")
    run.lit_frame(frames, lit[0])
    run.board.watch_pins()
    run.lit_frame(frames, lit[1])
    run.laser(1)
    run.laser(0)
    rise_s, fall_s = run.high_times()[-1]
    high_s = fall_s - rise_s
    expect(high_s < CAP_MS / 1000 + FRAME_S, f"the line stayed high for {high_s:.2f} s without a frame")
    run.board.settle(SILENT_S)
    # What a camera sees while the line is low; the frame was only late, not lost.
    run.give(frames, dark, sequence=3)
    record = json.loads(run.lit_frame(frames, lit[2]))
    expect(record.get("strobe") == "late" and record.get("skipped") == 1,
           f"the record after a late frame: {record}")
    record = json.loads(run.lit_frame(frames, lit[3], sequence=5))
    expect(not set(LIVE_FIELDS) & set(record), f"the second record after a late frame: {record}")
    run.stop()
    return f"low {high_s:.2f} s after its rise (cap: {CAP_MS / 1000:.2f} s); recorded as late"


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
    run.start_at("/dev/video1", "small", "always", "--format GREY")
    run.laser(1)
    board.record(SOON_S)
    # The shell keeps the device open, so that it does not come back yet.
    low_ms = run.low_after("exec 6</dev/video1; control /dev/video1 Disconnect 1")
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
    return f"low {low_ms:.1f} ms later, no rise while it is gone, goes on by itself"


CASES = [case_gated, case_alternating, case_always, case_kinds, case_dropped, case_doubled,
         case_in_flight, case_queue, case_late, case_silent, case_truncated, case_unplugged]
