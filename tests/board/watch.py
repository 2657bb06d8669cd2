"""Somebody who looks at the live view, as its page does."""

import http.client
import json
import threading
import time


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
