"""Cases of the live view: somebody watches, from this machine, while the laser is on."""

import contextlib
import json
import re
import socket
import threading
import time

from board import GUEST, VIEW_PORT
from cases_output import network
from frames import as_of_host, host_records
from run import HEIGHT, LASER, SOON_S, WIDTH, expect, gated_loop
from watch import Watcher, shrunk, split

FRAMES, PAUSED, AFTER = 60, 10, 5
# A frame may take so much longer by the board's clock, which counts its instructions.
MORE = 0.05
VIEW = f"--view {GUEST}:{VIEW_PORT}"


def url_path(run):
    """Of the live view, as the program said."""
    run.board.wait(lambda: any("live view: " in line for line in run.board.log), SOON_S, "URL of the live view")
    line = next(line for line in run.board.log if "live view: " in line)
    found = re.search(r"http://[0-9.]+:(\d+)(/[0-9a-f]{32}/)(.*)", line)
    expect(found and int(found[1]) == VIEW_PORT, f"the message: {line}")
    expect("without encryption" in found[3], f"no word of encryption: {line}")
    return found[2]


def timed_loop(run):
    """FRAMES frames with host_sim's records: ms of the loop's work each, and in all of this machine."""
    run.laser(1)
    run.board.watch_pins()
    begin = time.monotonic()
    gated_loop(run, FRAMES)
    real_ms = 1000 * (time.monotonic() - begin) / FRAMES
    run.laser(1)
    times = run.high_times()
    busy_ms = [1000 * (rise_s - fall_s) for (_, fall_s), (rise_s, _) in zip(times, times[1:])]
    expect(len(busy_ms) >= FRAMES - 2, f"{len(busy_ms)} frames by the laser's line")
    return sum(busy_ms) / len(busy_ms), real_ms


def watch(run, path):
    return Watcher("127.0.0.1", run.board.view_port, path + "frame", SOON_S)


def seen_in_pauses(run, watcher):
    """The board has one processor, and frames one upon the other leave nothing of it to the view. With
    pauses between them each is seen."""
    for index in range(FRAMES, FRAMES + PAUSED):
        before = len(watcher.answers)
        run.lit_frame(run.gated, index)
        run.board.wait(lambda seen=before: len(watcher.answers) > seen, SOON_S, f"frame {index} in the view")


def check_answers(run, answers):
    expected = host_records(run, run.gated)
    for body in answers:
        view, record, samples = split(body)
        index = view["frame"] - 1
        expect(as_of_host(record.decode()[:-1]) == expected[index] and record.endswith(b"}\n"), f"frame {index} in the view:\n{record}\n{expected[index]}")
        expect(samples == shrunk(run.gated.samples(index), WIDTH, HEIGHT, 2),
               f"frame {index} in the view has another picture")
        expect(len(view["dots"]) == json.loads(record)["dots"], f"frame {index} in the view has other dots")


def status_of(run, path):
    with socket.create_connection(("127.0.0.1", run.board.view_port), SOON_S) as sock:
        sock.sendall(f"GET {path} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n".encode())
        return int(sock.recv(4096).split()[1])


def case_view(run):
    """live view: the frames' time without it, with nobody looking, with somebody looking"""
    network(run)
    results = []
    for name, more in [("without", ""), ("nobody looks", VIEW), ("watched", VIEW)]:
        run.start(run.gated, "gated", more)
        watcher = watch(run, url_path(run)) if name == "watched" else None
        results.append((name, *timed_loop(run)))
        if watcher:
            in_time = len(watcher.answers)
            seen_in_pauses(run, watcher)
            watcher.stop()
        run.stop()
    check_answers(run, watcher.answers)
    before_ms = results[0][1]
    for name, busy_ms, _ in results[1:]:
        expect(busy_ms < before_ms * (1 + MORE), f"{name}: {busy_ms:.2f} ms a frame, {before_ms:.2f} without a view")
    reported = ", ".join(f"{name} {busy_ms:.2f} ms a frame ({real_ms:.0f} closed loop)" for name, busy_ms, real_ms in results)
    return (f"{reported}; {in_time} of {FRAMES} frames watched, {len(watcher.answers) - in_time} of {PAUSED} "
            "with pauses; records as host_sim's")


def flood(run, path, held):
    """Connections that ask for nothing, for a frame, or for what is no HTTP; none is read from."""
    for index in range(100):
        with contextlib.suppress(OSError):
            sock = socket.create_connection(("127.0.0.1", run.board.view_port), 1)
            held.append(sock)
            sock.sendall([b"GET ", f"GET {path}frame HTTP/1.1\r\n\r\n".encode(), b"\0" * 9000][index % 3])


def deaths(run):
    return [line for line in run.board.log if "view: its process" in line]


def case_view_attacked(run):
    """live view: wrong tokens, a flood, slow and silent connections, while the laser is on"""
    network(run)
    run.start(run.gated, "gated", VIEW)
    path = url_path(run)
    for wrong in ["/", path[:-1], path[:-2] + "/", "/" + "0" * 32 + "/frame"]:
        status = status_of(run, wrong)
        expect(status == 403, f"'{wrong}': status {status}, expected 403")
    expect(status_of(run, path) == 200 and status_of(run, path + "x") == 404, "the page is not there")
    held = []
    attack = threading.Thread(target=flood, args=[run, path, held], daemon=True)
    attack.start()
    gated_loop(run, FRAMES)
    # The process dies while the laser is on; frames go on, as a camera without them is opened anew.
    run.laser(1)
    run.board.command("pid=$(pidof isohead_live); kill -KILL $pid; "
                      "while [ -e /proc/$pid ] && ! grep -q '^State:.Z' /proc/$pid/status; do sleep 0.01; done")
    expected = host_records(run, run.gated)
    for index in range(FRAMES, FRAMES + AFTER):
        record = run.lit_frame(run.gated, index)
        expect(record == expected[index], f"frame {index}:\nboard    {record}\nhost_sim {expected[index]}")
    # It is reported with the next frame; the line may come after that one's record.
    run.board.wait(lambda: deaths(run), SOON_S, "message of its death")
    reported = deaths(run)
    expect(len(reported) == 1 and "signal 9" in reported[0], f"messages of its death: {reported}")
    run.stop()
    attack.join(SOON_S)
    for sock in held:
        sock.close()
    return f"403; {FRAMES} records identical among {len(held)} connections, {AFTER} after its death"


def case_view_ends(run):
    """live view: a port in use; and its process ends with the program, whatever ended that"""
    network(run)
    run.start(run.gated, "gated", VIEW)
    url_path(run)
    run.laser(1)
    edges = len(run.board.edges)
    # Another program with the same port, which would fail at the laser's line later.
    text = run.board.command(f"{run.name} --rig /rig/{run.gated.rig}.json --device /dev/video9 --laser "
                             f"{run.gpio_options()} {VIEW} 2>&1; echo status $?")
    expect("status 1" in text and "Address already in use" in text and str(VIEW_PORT) in text, f"it says: {text}")
    expect(not [edge for edge in run.board.edges[edges:] if edge.line == LASER], "the laser's line has moved")
    run.board.command("pidof isohead_live")
    run.board.signal("KILL")
    run.board.exit_status(SOON_S)
    run.laser(0)
    run.board.command("tries=0; while pidof isohead_live; do tries=$((tries + 1)); [ $tries -lt 100 ]; sleep 0.05; done")
    expect(run.board.command("pidof isohead_live || echo none") == "none", "it has outlived the program")
    return "status 1 with the reason, the first program's laser untouched; SIGKILL ends both"


CASES = [case_view, case_view_attacked, case_view_ends]
