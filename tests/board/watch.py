"""Somebody who looks at the live view, as its page does."""

import contextlib
import http.client
import json
import os
import socket
import threading
import time


def held_port():
    """A port that nobody else is given, and the socket that holds it: bound, not listened at. Who asks for it by number gets
    it, as long as he sets SO_REUSEADDR like this one."""
    held = socket.socket()
    held.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    held.bind(("127.0.0.1", 0))
    return held.getsockname()[1], held


def view_pid(program_pid):
    """The view's process, a child of the program's; None: there is none."""
    with open(f"/proc/{program_pid}/task/{program_pid}/children", encoding="ascii") as file:
        pids = file.read().split()
    return int(pids[0]) if pids else None


def schedule_as_others(pid):
    """Like everybody else, where that is allowed: what it shows is not to depend on other work of this machine."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(pid, os.SCHED_OTHER, os.sched_param(0))


class Watcher(threading.Thread):
    """Requests one frame after the other until stopped."""

    def __init__(self, host, port, path, timeout_s):
        super().__init__(daemon=True)
        self.place, self.path, self.timeout_s = (host, port), path, timeout_s
        self.answers, self.refused = [], 0
        self.is_over = threading.Event()
        self.start()

    def run(self):
        connection = None
        while not self.is_over.is_set():
            try:
                connection = connection or http.client.HTTPConnection(*self.place, timeout=self.timeout_s)
                connection.request("GET", self.path)
                answer = connection.getresponse()
                body = answer.read()
                if answer.status == 200:
                    self.answers.append(body)
            except (OSError, http.client.HTTPException):
                self.refused += 1  # a flood was sooner, or the program has ended
                connection.close()
                connection = None
                time.sleep(0.1)

    def stop(self):
        self.is_over.set()
        self.join(self.timeout_s)


def shrunk(samples, width, height, scale):
    """What the view makes of a frame: means of scale x scale samples, cut off to whole numbers."""
    rows, columns = height // scale, width // scale
    return bytes(sum(samples[(scale * row + y) * width + scale * column + x]
                     for y in range(scale) for x in range(scale)) // scale**2
                 for row in range(rows) for column in range(columns))


def split(body):
    """(what is drawn, the record as it was sent, the samples)"""
    first = body.index(b"\n")
    second = body.index(b"\n", first + 1)
    return json.loads(body[:first]), body[first + 1:second + 1], body[second + 1:]
