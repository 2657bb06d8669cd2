"""Cases of where records go: over the network and over a serial line."""

import re
import socket

from board import GUEST, HOST
from cases_end import end_ms
from frames import as_of_host, host_records
from run import LASER, SOON_S, expect

FRAMES = 20
# What a slow line carries in the time of a frame, at most; a record has 250 to 600.
SLOW_BYTES = 50
SERIAL = "/dev/ttyS0"
# A port without a receiver.
NOBODY = "udp:127.0.0.1:9"
# A frame must not take so much longer, by the board's clock; 9600 baud carry 50 bytes in it.
MORE_MS = 50
# The kernel waits for the 16 bytes that the chip itself has, at 9600 baud and with some to spare.
STILL_END_MS = 150
# Frames until a line that is quick again has caught up: a rest leaves with the next record.
MORE_FRAMES = 20


def network(run):
    run.board.command("[ -d /sys/class/net/eth0 ] || modprobe virtio_net; ip link set lo up; "
                      f"ip link set eth0 up; ip addr add {GUEST}/24 dev eth0 2>/dev/null; true")


def give(run, index):
    """Closed loop without records on standard output."""
    run.laser(1)
    edges = len(run.board.edges)
    run.give(run.gated, index)
    # It falls for the frame and rises for the next one once this one's record is given away.
    run.board.wait(lambda: len([edge for edge in run.board.edges[edges:] if edge.line == LASER]) > 1,
                   SOON_S, f"laser on after frame {index}")


def loop(run, after):
    """after(index) follows each frame. How long the program was busy with each, in ms by the board's
    clock."""
    run.board.watch_pins()
    for index in range(FRAMES):
        give(run, index)
        after(index)
    times = run.high_times()
    return [1000 * (rise_s - fall_s) for (_, fall_s), (rise_s, _) in zip(times, times[1:])]


def slower(busy_ms, before_ms):
    """By how much, for the frame that shows it most."""
    more_ms = max(now_ms - then_ms for now_ms, then_ms in zip(busy_ms, before_ms))
    expect(more_ms < MORE_MS, f"a frame takes {more_ms:.1f} ms more")
    return more_ms


def unsent(run):
    """As all status lines together say."""
    return sum(int(count) for line in run.board.log
               for count in re.findall(r"unsent (\d+)", line))


def case_udp(run):
    """records over the network; then to a receiver that is not there"""
    expected = host_records(run, run.gated)
    network(run)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(SOON_S)
        run.start(run.gated, "gated", f"--output udp:{HOST}:{receiver.getsockname()[1]}")

        def receive(index):
            datagram = receiver.recv(65536)
            expect(as_of_host(datagram.decode()[:-1]) == expected[index] and datagram.endswith(b"}\n"),
                   f"frame {index}:\ndatagram {datagram}\nhost_sim {expected[index]}")
        with_ms = loop(run, receive)
        run.stop()
    run.start(run.gated, "gated", f"--status 1 --output {NOBODY}")
    more_ms = slower(loop(run, lambda index: None), with_ms)
    run.board.wait(lambda: unsent(run) >= FRAMES - 1, SOON_S, f"{FRAMES - 1} unsent records")
    run.stop()
    reported = unsent(run)
    expect(reported == FRAMES - 1, f"unsent {reported} of {FRAMES}: all but the last, nobody says of it")
    return (f"{FRAMES} datagrams identical; without a receiver {reported} of {FRAMES} unsent, a frame "
            f"takes {more_ms:+.1f} ms")


def case_serial(run):
    """records over a serial line; then over one that is too slow, and one that stands still"""
    expected = host_records(run, run.gated)
    run.start(run.gated, "gated", f"--output serial:{SERIAL}:115200")
    with run.board.serial_lines() as lines:
        def receive(index):
            run.board.wait(lambda: len(lines) > (index == 0), SOON_S, "line")
            expect(index > 0 or lines.popleft() == "", "the first line is not empty")
            found = as_of_host(lines.popleft())
            expect(found == expected[index],
                   f"frame {index}:\nline     {found}\nhost_sim {expected[index]}")
        quick_ms = loop(run, receive)
        run.stop()
        expect(not lines and not run.board.received["serial"], f"more on the line: {lines}")
    results = []
    for name, slow_bytes in [("slow", SLOW_BYTES), ("still", 0)]:
        results.append(slow_line(run, name, slow_bytes, quick_ms))
    results.append(f"SIGTERM while it stands still: the end {still_end_ms(run):.1f} ms later")
    return f"{FRAMES} lines identical; " + "; ".join(results)


def slow_line(run, name, slow_bytes, quick_ms):
    content = bytearray()
    run.start(run.gated, "gated", f"--status 1 --output serial:{SERIAL}:9600")
    busy_ms = loop(run, lambda index: content.extend(run.board.take_serial(slow_bytes)))
    more_ms = slower(busy_ms, quick_ms)
    count = FRAMES
    *found, remainder = content.decode().split("\n")
    with run.board.serial_lines() as lines:
        run.board.received["serial"] = remainder.encode()
        while len(found) + len(lines) + unsent(run) < count + 1 or count == FRAMES:
            expect(count < FRAMES + MORE_FRAMES, f"{name}: of {count} records {len(found)} and "
                   f"{len(lines)} lines came, unsent {unsent(run)}")
            give(run, count)
            count += 1
            run.board.settle(0.5)
        run.stop()
        found += lines
        lines.clear()
        expect(not run.board.received["serial"], f"half a line: {run.board.received['serial']}")
    expect(found.pop(0) == "", f"{name}: the first line is not empty")
    dropped = unsent(run)
    expect(len(found) + dropped == count, f"{name}: of {count} {len(found)} lines, {dropped} unsent")
    expected = host_records(run, run.gated)[:count]
    found = [as_of_host(line) for line in found]
    strange = [line for line in found if line not in expected]
    expect(not strange, f"{name}: lines that are no records of host_sim: {strange}")
    places = [expected.index(line) for line in found]
    expect(places == sorted(set(places)), f"{name}: records in another order: {places}")
    expect(dropped > 0 and len(found) > 0, f"{name}: {dropped} unsent, {len(found)} lines")
    return f"{name}: {len(found)} whole lines and {dropped} unsent, a frame takes {more_ms:+.1f} ms"


def still_end_ms(run):
    """SIGTERM when the line stands still and is full."""
    run.start(run.gated, "gated", f"--output serial:{SERIAL}:9600")
    for index in range(FRAMES):
        give(run, index)
    found_ms = end_ms(run)
    expect(found_ms < STILL_END_MS, f"the end {found_ms:.0f} ms after SIGTERM, {STILL_END_MS} at most")
    while run.board.take_serial(65536):
        run.board.settle(0.1)
    return found_ms


CASES = [case_udp, case_serial]
