#!/usr/bin/env python3
"""The live view under watch and attack: what it serves is what the loop saw, what is not allowed is
refused, and the loop's records are those of a run without it.

test_view.py ISOHEAD_BOARD HOST_SIM FRAMES      exit status 1 if something is wrong
"""

import contextlib
import http.client
import json
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from urllib.parse import urlsplit

import numpy as np

from watch import Watcher, held_port, schedule_as_others, shrunk, split, view_pid

PAGE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "firmware", "app")
RATE, FAST_RATE = 8, 1000
# The watcher sees so many frames; so many come after a fault.
WATCHED, MORE = 12, 5
# hal_serve.h
CONNECTIONS, STRANGERS, REQUEST_S, TOKEN_S, PATIENCE_S = 8, 16, 10, 3, 3
# So long a stranger may take to send what he has to say when others wait (hal_serve.c has a little more).
ROOM_S = 0.2
# Three streams, socket pair, listening socket, mailbox, epoll and its event, and one to spare.
OWN_DESCRIPTORS = 9
# Longest time for what follows at once, on a machine under load.
SOON_S = 30
# Longest time for frames that the view shows only when the machine has nothing else to do.
LONG_S = 300
HEADERS = {"x-content-type-options": "nosniff", "referrer-policy": "no-referrer", "x-frame-options": "DENY",
           "cache-control": "no-store", "cross-origin-resource-policy": "same-origin"}
LEVEL_STEP = 3  # app_live.c

failures = []
processes = []


def check(condition, text):
    if not condition:
        failures.append(text)
        print("FAIL", text, flush=True)


def wait(condition, what):
    end = time.monotonic() + LONG_S
    while not (is_so := condition()) and time.monotonic() < end:
        time.sleep(0.02)
    check(is_so, f"no {what} within {LONG_S} s")


class Loop:
    """The program with a directory as its camera, its records and its messages."""

    def __init__(self, rate, with_view=True):
        port, self.held = held_port()
        view = ["--view", str(port)] if with_view else []
        self.out = tempfile.TemporaryFile()
        self.process = subprocess.Popen([program, "--device", frames, "--loop", "--rate", str(rate), *view],
                                        stdout=self.out, stderr=subprocess.PIPE, text=True)
        processes.append(self.process)
        self.url = urlsplit(self.hear("live view: ")) if with_view else None
        self.messages = ""

    def hear(self, said):
        """What follows that in its messages."""
        line = ""
        while said not in line:
            line = self.process.stderr.readline()
            if not line:
                raise EOFError(f"the program has ended without '{said}'")
        return line.split(said)[1].strip()

    def records(self):
        # The program writes where this file's position is, so reading must not move it.
        file = self.out.fileno()
        return os.pread(file, os.fstat(file).st_size, 0)

    def count(self):
        return self.records().count(b"\n")

    def end(self):
        """Stopped; its exit status."""
        self.process.terminate()
        self.messages = self.process.communicate()[1]
        return self.process.returncode

    def view_pid(self):
        return view_pid(self.process.pid)

    def watcher(self):
        return Watcher(self.url.hostname, self.url.port, self.url.path + "frame", SOON_S)

    def socket(self, receive_bytes=None):
        sock = socket.socket()
        if receive_bytes:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
        sock.settimeout(SOON_S)
        sock.connect((self.url.hostname, self.url.port))
        return sock

    def ask(self, path, method="GET", **more):
        """(status, headers, body) of a request on a connection of its own."""
        connection = http.client.HTTPConnection(self.url.hostname, self.url.port, timeout=SOON_S)
        with contextlib.closing(connection):
            connection.request(method, path, **more)
            answer = connection.getresponse()
            return answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read()


# --- what is served ---

def check_page(loop):
    for name, source, kind in [("", "app_live.html", "text/html"), ("live.js", "app_live.js", "text/javascript"),
                               ("live.css", "app_live.css", "text/css")]:
        status, headers, body = loop.ask(loop.url.path + name)
        with open(os.path.join(PAGE, source), "rb") as file:
            check(status == 200 and body == file.read(), f"'{name}': status {status}, {len(body)} bytes")
        check(headers.get("content-type", "").startswith(kind), f"'{name}' is {headers.get('content-type')}")
        for key, value in HEADERS.items():
            check(headers.get(key) == value, f"'{name}': {key} is {headers.get(key)}")
        check("default-src 'none'" in headers.get("content-security-policy", ""), f"'{name}': no policy")


def check_refusals(loop):
    token = loop.url.path.strip("/")
    check(re.fullmatch("[0-9a-f]{32}", token), f"the token is {token}")
    first, last = ["0" if figure != "0" else "1" for figure in (token[0], token[-1])]
    wrong = ["", "/", "/frame", "/live.js", "/favicon.ico", f"/{token}", f"/{token[:-1]}/", f"/{token[:-1]}{last}/",
             f"/{first}{token[1:]}/frame", f"/{token}0/", f"/{token.upper()}x/", f"//{token}/", f"/{'0' * 32}/frame",
             f"/{token}%00/", "/../" + token + "/", f"/?token={token}", "/%2e%2e/etc/passwd"]
    for path in wrong:
        status, _, body = loop.ask(path or "*")
        check(status == 403 and not body, f"'{path}' without the token: status {status}, {len(body)} bytes")
    for name in ["x", "frame/", "frame?", "live.js/..", "../", ".", "%2e%2e/", "app_live.c", "FRAME"]:
        status, _, body = loop.ask(f"/{token}/{name}")
        wanted = (404,) if name != "frame?" else (200, 204)  # an empty query is no other name
        check(status in wanted and (status == 200 or not body), f"'{name}': status {status}, {len(body)} bytes")
    for method in ["POST", "PUT", "DELETE", "HEAD", "OPTIONS", "PATCH", "TRACE", "CONNECT", "BREW"]:
        status, headers, body = loop.ask(loop.url.path, method)
        check(status == 405 and headers.get("allow") == "GET" and not body, f"{method}: status {status}")
    status, _, _ = loop.ask(loop.url.path, body=b"x" * 100)
    check(status == 413, f"GET with a body: status {status}")
    status, _, _ = loop.ask(loop.url.path, "POST", body=b"x" * 100000)
    check(status == 405, f"an upload: status {status}")


def distort(rig, slope):
    """Normalised coordinates to pixels, as OpenCV's manual has it."""
    k1, k2, p1, p2, k3 = rig["distortion_coefficients"]["data"]
    fx, _, cx, _, fy, cy = rig["camera_matrix"]["data"][:6]
    x, y = slope[:, 0], slope[:, 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.stack([fx * u + cx, fy * v + cy], axis=1)


def check_contours(view, trace, rig):
    field = trace["surface"]["field"]
    centre = np.array([field["centre_x_q28"], field["centre_y_q28"]]) / 2**28
    expected = [contour for cut in trace["cuts"][::LEVEL_STEP] for contour in cut["contour"]]
    check(len(expected) == len(view["contours"]) > 0, f"{len(view['contours'])} contours, not {len(expected)}")
    worst = 0.0
    for found, contour in zip(view["contours"], expected):
        grid = (np.array(contour["x_y_q9"]) / 512 - 23) * 10 / 11
        places = distort(rig, centre + grid * field["unit_q28"] / 2**28)
        ours = np.array(found["px"]).reshape(-1, 2)
        check(len(ours) == len(places) and found["closed"] == contour["closed"], "a contour of another length")
        worst = max(worst, np.abs(ours - places).max()) if len(ours) == len(places) else worst
    check(worst < 0.51, f"contours are up to {worst:.2f} px beside where they should be")


def check_frames(bodies, records, traces):
    with open(os.path.join(frames, "rig.json"), encoding="ascii") as file:
        rig = json.load(file)
    lines = records.splitlines(keepends=True)
    names = sorted(name for name in os.listdir(frames) if name.endswith(".pgm"))
    numbers = []
    for index, body in enumerate(bodies):
        view, record, samples = split(body)
        numbers.append(view["frame"])
        check(record == lines[view["frame"] - 1], f"frame {view['frame']}: not the record that was sent")
        name = names[(view["frame"] - 1) % len(names)]
        with open(os.path.join(frames, name), "rb") as file:
            content = file.read()
        if index % 10:
            continue
        size = view["width"], view["height"]
        check(samples == shrunk(content[-size[0] * size[1]:], *size, 2) and view["scale"] == 2,
              f"{name}: not the camera's picture")
        if view["frame"] > len(names):
            continue  # tracks and alignment go on, and so does what follows from them
        with open(os.path.join(traces, os.path.basename(frames), name.replace(".pgm", ".json")), encoding="ascii") as file:
            trace = json.load(file)
        dots = np.stack([trace["dots"]["u_px_q12"], trace["dots"]["v_px_q12"]], axis=1) / 4096
        check(len(dots) == len(view["dots"]) and np.abs(dots - view["dots"]).max() < 0.0051, f"{name}: other dots")
        check(view["labelled"] == [slot["dot"] for slot in trace["labels"]["slot"] if slot], f"{name}: other labels")
        check_contours(view, trace, rig)
    check(numbers == sorted(set(numbers)), "frames come twice or out of order")


# --- what is done to it ---

def ends(sock, limit_s):
    """Whether the other side ends the connection within limit_s; what it said is thrown away."""
    end = time.monotonic() + limit_s
    try:
        while time.monotonic() < end:
            sock.settimeout(max(0.01, end - time.monotonic()))
            if not sock.recv(65536):
                return True
    except TimeoutError:
        return False
    except OSError:
        return True
    return False


def attack_requests(loop):
    """Requests that are too long, or none at all: an error or an end, soon, and no frame."""
    lines = {"a long line": b"GET /" + b"a" * 100000 + b" HTTP/1.1\r\nHost: x\r\n\r\n",
             "a long header": b"GET / HTTP/1.1\r\nHost: x\r\nX: " + b"b" * 100000 + b"\r\n\r\n",
             "many headers": b"GET / HTTP/1.1\r\nHost: x\r\n" + b"X-A: b\r\n" * 10000 + b"\r\n",
             "garbage": bytes(range(256)) * 64 + b"\r\n\r\n",
             "TLS": b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + b"\0" * 500,
             "zeros": b"\0" * 20000,
             "a chunked body": b"GET / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nffffffff\r\n" + b"c" * 9999}
    for name, content in lines.items():
        with loop.socket() as sock:
            with contextlib.suppress(OSError):
                sock.sendall(content)
            answer = b""
            with contextlib.suppress(OSError):
                sock.settimeout(REQUEST_S + SOON_S)
                answer = sock.recv(65536)
            check(b" 200 " not in answer.split(b"\r\n")[0], f"{name}: {answer[:60]}")


def attack_slowly(loop):
    """Who shows no token is cut after TOKEN_S, whatever drips meanwhile; who reads too slowly after REQUEST_S."""
    begin = time.monotonic()
    dripping, silent, reading = loop.socket(), loop.socket(), loop.socket(receive_bytes=2048)
    with dripping, silent, reading:
        dripping.sendall(b"GET / HTTP/1.1\r\nX: ")
        reading.sendall(f"GET {loop.url.path}frame HTTP/1.1\r\nHost: x\r\n\r\n".encode())
        cut_s = None
        while cut_s is None and time.monotonic() - begin < REQUEST_S + SOON_S:
            time.sleep(0.25)
            with contextlib.suppress(OSError):
                reading.recv(16)
            try:
                dripping.send(b"y")
                dripping.settimeout(0.01)
                if not dripping.recv(100):
                    cut_s = time.monotonic() - begin
            except TimeoutError:
                pass
            except OSError:
                cut_s = time.monotonic() - begin
        check(cut_s is not None and cut_s > TOKEN_S - 1, f"a dripping request was cut after {cut_s} s")
        check(ends(silent, SOON_S), "a silent connection is not cut")
        # What was sent before still comes, then the end.
        check(ends(reading, SOON_S), "a slow reader is not cut")
    return cut_s


class Starver(threading.Thread):
    """Holds slow connections without the token, from so many addresses, and opens those anew that are cut."""

    def __init__(self, loop, count, addresses):
        super().__init__(daemon=True)
        self.loop, self.count, self.addresses = loop, count, addresses
        self.is_over, self.cut_count = False, 0

    def open(self, index):
        sock = socket.socket()
        sock.setblocking(False)
        sock.bind((f"127.0.0.{1 + index % self.addresses}", 0))
        with contextlib.suppress(BlockingIOError):
            sock.connect((self.loop.url.hostname, self.loop.url.port))
        return sock

    def run(self):
        sockets = [self.open(index) for index in range(self.count)]
        while not self.is_over:
            for index, sock in enumerate(sockets):
                try:
                    sock.send(b"G")
                    is_cut = not sock.recv(100)
                except BlockingIOError:
                    is_cut = False
                except OSError:
                    is_cut = True
                if is_cut:
                    sock.close()
                    sockets[index] = self.open(index)
                    self.cut_count += 1
            time.sleep(0.2)
        for sock in sockets:
            sock.close()


def ask_at_once(loop, path):
    """The status, or what went wrong, of a request that was sent as soon as the connection was asked for. Where it was not,
    as this process had no processor, nothing is known, and it is sent again."""
    while True:
        connection = http.client.HTTPConnection(loop.url.hostname, loop.url.port, timeout=SOON_S)
        begin, sent_s = time.monotonic(), None
        try:
            with contextlib.closing(connection):
                connection.request("GET", path)
                sent_s = time.monotonic() - begin
                return connection.getresponse().status
        except (OSError, http.client.HTTPException) as error:
            if (sent_s or time.monotonic() - begin) < ROOM_S:
                return error


def attack_by_starving(loop):
    """Slow connections without the token, few from one address and many from several, keep nobody out who knows it."""
    for count, addresses in ((6, 1), (60, 5)):
        starver = Starver(loop, count, addresses)
        starver.start()
        time.sleep(1)
        for name in ["", "live.js", "frame"] * 2:
            status = ask_at_once(loop, loop.url.path + name)
            # Without a frame in time the answer is 204.
            check(status in ((200, 204) if name == "frame" else (200,)), f"'{name}' beside {count} slow connections: {status}")
        starver.is_over = True
        starver.join()
        check(count < STRANGERS or starver.cut_count > 0, f"none of {count} slow connections was cut")


def check_many_with_token(loop, watcher):
    """More than have a slot are refused, and served once one is free."""
    seen = len(watcher.answers)
    wait(lambda: len(watcher.answers) > seen, "frame for the watcher, who has a slot, too")
    request = f"GET {loop.url.path}live.css HTTP/1.1\r\nHost: x\r\n\r\n".encode()
    with contextlib.ExitStack() as stack:
        statuses = []
        for _ in range(CONNECTIONS + 1):
            sock = stack.enter_context(loop.socket())
            sock.sendall(request)
            statuses.append(sock.recv(65536).split(b" ")[1])
        check(statuses == [b"200"] * (CONNECTIONS - 1) + [b"503"] * 2, f"many with the token: {statuses}")
    wait(lambda: loop.ask(loop.url.path)[0] == 200, "page after many connections")


def descriptors(loop):
    return len(os.listdir(f"/proc/{loop.view_pid()}/fd"))


def attack_flood(loop):
    """More connections than there may be: those at once, of one address and of several, stay within the
    limit, and all is well once they have gone."""
    sockets = []
    for index in range(200):
        sock = socket.socket()
        sock.setblocking(False)
        sock.bind((f"127.0.0.{1 + index // 40}", 0))
        with contextlib.suppress(BlockingIOError):
            sock.connect((loop.url.hostname, loop.url.port))
        sockets.append(sock)
    held = 0
    for index, sock in enumerate(sockets):
        with contextlib.suppress(OSError):
            sock.send([b"GET /", b"G", b"\xff\xff", b"GET / HTTP/1.1\r\nHost: x\r\n\r\n"][index % 4])
        held = max(held, descriptors(loop))
    time.sleep(0.2)
    held = max(held, descriptors(loop))
    for index, sock in enumerate(sockets):
        if index % 2:  # the other half ends by a reset
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        sock.close()
    check(held <= CONNECTIONS + STRANGERS + OWN_DESCRIPTORS, f"{held} descriptors are open in the flood")
    wait(lambda: descriptors(loop) <= OWN_DESCRIPTORS + 1, "end of the flood's connections")
    return held


def check_confined(pid):
    with open(f"/proc/{pid}/status", encoding="ascii") as file:
        status = dict(line.rstrip("\n").split(":\t", 1) for line in file if ":\t" in line)
    check(status["Seccomp"] == "2" and status["NoNewPrivs"] == "1", f"not in jail: {status['Seccomp']}")
    check(os.sched_getscheduler(pid) == os.SCHED_IDLE, "as important as the loop")
    schedule_as_others(pid)  # seen
    if os.geteuid() == 0:
        check(status["Uid"].split() == ["65534"] * 4 and not status["Groups"].strip(), f"user {status['Uid']}")


def attacked(loop, traces):
    """Everything, while somebody watches."""
    watcher = loop.watcher()
    check_confined(loop.view_pid())
    check_page(loop)
    check_refusals(loop)
    held = attack_flood(loop)
    attack_by_starving(loop)
    check_many_with_token(loop, watcher)
    slow = threading.Thread(target=attack_slowly, args=[loop], daemon=True)
    slow.start()
    attack_requests(loop)
    slow.join()
    # Without a frame in time the answer is 204.
    wait(lambda: loop.ask(loop.url.path + "frame")[0] == 200, "frame after the attacks")
    wait(lambda: len(watcher.answers) >= WATCHED, "the watcher's frames")
    check(loop.end() == 0, f"the loop's end: {loop.messages}")
    watcher.stop()
    check_frames(watcher.answers, loop.records(), traces)
    print(f"attacked: {loop.count()} frames, {len(watcher.answers)} seen by the watcher, at most {held} descriptors")


def state_of(pid):
    """The letter that the kernel has for it; X: it is not there."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii") as file:
            return file.read().rsplit(")", 1)[1].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return "X"


def fault(name, number):
    """Its process killed or stopped while somebody watches: the loop does not notice. Its records."""
    loop = Loop(RATE)
    watcher = loop.watcher()
    wait(lambda: watcher.answers, f"a frame before it is {name}")
    pid = loop.view_pid()
    os.kill(pid, number)
    # Being killed takes a processor's time, too, and it gets little.
    wait(lambda: state_of(pid) in "ZXT", f"state of a process that is {name}")
    before = loop.count()
    wait(lambda: loop.count() >= before + MORE, f"records after it was {name}")
    check(loop.end() == 0, f"{name}: the loop's end: {loop.messages}")
    watcher.stop()
    reported = loop.messages.count("view: ")
    check(reported == (1 if name == "killed" else 0), f"{name}: reported {reported} times: {loop.messages}")
    return loop.records()


def check_records(with_view):
    """Each run's are the first ones of a run without."""
    count = max(records.count(b"\n") for records in with_view)
    without = Loop(FAST_RATE, with_view=False)
    wait(lambda: without.count() >= count, f"{count} records without a view")
    check(without.end() == 0, f"without a view: {without.messages}")
    for records in with_view:
        check(records and without.records().startswith(records), "other records than without a view")


def main():
    with tempfile.TemporaryDirectory() as traces:
        subprocess.run([host_sim, "--json", "--trace", traces, frames], check=True, stdout=subprocess.DEVNULL)
        loop = Loop(RATE)
        attacked(loop, traces)
        check_records([loop.records(), fault("killed", signal.SIGKILL), fault("stopped", signal.SIGSTOP)])
    print(f"live view: {len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    program, host_sim, frames = [os.path.abspath(path) for path in sys.argv[1:]]
    try:
        sys.exit(main())
    finally:
        for process in processes:
            process.kill()
