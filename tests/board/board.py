"""An ARM board that is not there: Debian's kernel in QEMU, and the host's hands on its pins.

    with Board(kernel, initramfs, console) as board:
        board.command("feed 752 582 GREY")
        board.command("start /bin/isohead_board --laser ...")
        board.wait_level(LASER, 1, 5)         the laser's line, as its driver would see it
        board.send_frame(sequence, time_us, samples)
        record = board.record(5)

QEMU's test socket reports every edge of the GPIO chip's pins at once and drives its inputs; four
virtio-serial ports carry frames, records, the program's log and commands. A serial line (ttyS0) and
a network (eth0; this machine is HOST on it) are there too. Nothing waits without a limit: BoardError
says what did not come, and shows the end of the logs. Seconds throughout, of time.monotonic().
"""

import collections
import contextlib
import json
import os
import re
import selectors
import signal
import socket
import struct
import subprocess
import time

from frames import as_of_host
from watch import held_port

PORTS = ["frames", "records", "log", "control"]
# Longest time from power-on to the first process's "ready": thirty times what it takes when idle.
BOOT_S = 180
MEMORY_MB = 256
# Longest time that QEMU or the board's shell may take for an answer.
ANSWER_S = 60
GPIO_TYPE = "child<pl061>"
# What QEMU calls this machine and the board on their network, and the board's port that this machine
# reaches, at board.view_port.
HOST, GUEST, VIEW_PORT = "10.0.2.2", "10.0.2.15", 8080

Edge = collections.namedtuple("Edge", "time_s line level")


class BoardError(Exception):
    pass


class Board:
    def __init__(self, kernel, initramfs, console, memory_mb=MEMORY_MB, boot_s=BOOT_S):
        self.console = console
        self.edges = []  # of output pins, since power-on
        self.levels = collections.defaultdict(int)
        self.rises = collections.Counter()
        self.log = []  # lines of the program's standard error
        self.records = collections.deque()
        self.received = collections.defaultdict(bytes)  # begun lines, by socket
        self.lines = collections.defaultdict(collections.deque)
        self.sending = {}
        self.selector = selectors.DefaultSelector()
        self.sockets = {}
        self.qemu = None
        self.view_port, self.held = held_port()
        try:
            self._start(kernel, initramfs, memory_mb)
            self._find_gpio()
            self.wait(lambda: self.lines["control"], boot_s, "the board's first process")
            self.lines["control"].popleft()
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        if self.qemu:
            self.qemu.kill()
            self.qemu.wait()
            self.qemu = None
        for sock in self.sockets.values():
            sock.close()
        self.held.close()
        self.selector.close()

    # --- QEMU ---

    def _start(self, kernel, initramfs, memory_mb):
        # icount: a nanosecond of the board's time per instruction while it computes, the host's
        # time while it waits. A host under load then makes no frame late.
        arguments = ["qemu-system-aarch64", "-M", "virt,acpi=off", "-cpu", "cortex-a53",
                     "-m", str(memory_mb), "-icount", "shift=0",
                     "-nodefaults", "-display", "none", "-no-reboot",
                     "-serial", "file:" + self.console,
                     "-kernel", kernel, "-initrd", initramfs,
                     "-append", "console=ttyAMA0 loglevel=5 panic=-1 nokaslr",
                     "-device", "virtio-serial-device"]
        theirs = []
        for name in PORTS + ["qtest", "qmp", "serial"]:
            ours, other = socket.socketpair()
            theirs.append(other)
            ours.setblocking(False)
            self.sockets[name] = ours
            if name != "serial":  # that one is read when a case says so
                self.sending[name] = bytearray()
                self.selector.register(ours, selectors.EVENT_READ, name)
            arguments += ["-chardev", f"socket,id={name},fd={other.fileno()}"]
            if name in PORTS:
                arguments += ["-device", f"virtserialport,chardev={name},name={name}"]
        arguments += ["-qtest", "chardev:qtest", "-qtest-log", "none",
                      "-mon", "chardev=qmp,mode=control",
                      "-device", "pci-serial,chardev=serial",
                      "-netdev", f"user,id=net,hostfwd=tcp:127.0.0.1:{self.view_port}-{GUEST}:{VIEW_PORT}",
                     "-device", "virtio-net-device,netdev=net"]
        self.qemu = subprocess.Popen(arguments, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                     pass_fds=[sock.fileno() for sock in theirs], text=True)
        for sock in theirs:
            sock.close()

    def _find_gpio(self):
        self.wait(lambda: self.lines["qmp"], ANSWER_S, "QEMU's greeting")
        self.lines["qmp"].popleft()
        self.qmp("qmp_capabilities")
        items = self.qmp("qom-list", path="/machine/unattached")
        names = [item["name"] for item in items if item["type"] == GPIO_TYPE]
        if len(names) != 1:
            raise BoardError(f"{len(names)} GPIO chips of type {GPIO_TYPE} in QEMU, not one")
        self.gpio = "/machine/unattached/" + names[0]
        self.qtest("irq_intercept_out " + self.gpio)

    def qmp(self, verb, **arguments):
        message = {"execute": verb, "arguments": arguments}
        self._send("qmp", json.dumps(message).encode() + b"\n")
        while True:
            self.wait(lambda: self.lines["qmp"], ANSWER_S, f"QEMU's answer to {verb}")
            answer = json.loads(self.lines["qmp"].popleft())
            if "error" in answer:
                raise BoardError(f"QEMU refuses {verb}: {answer['error']['desc']}")
            if "return" in answer:
                return answer["return"]

    def qtest(self, line):
        self._send("qtest", line.encode() + b"\n")
        self.wait(lambda: self.lines["qtest"], ANSWER_S, f"QEMU's answer to {line}")
        answer = self.lines["qtest"].popleft()
        if not answer.startswith("OK"):
            raise BoardError(f"QEMU's test socket refuses '{line}': {answer}")

    # --- waiting ---

    def wait(self, condition, limit_s, what):
        """Until the condition holds; it is looked at after everything that happens."""
        end = time.monotonic() + limit_s
        while not condition():
            left = end - time.monotonic()
            if left <= 0:
                raise BoardError(f"no {what} within {limit_s:g} s\n{self.story()}")
            self._pump(left)
        self._pump(0)  # what happened before, but came over a socket that is read later

    def settle(self, duration_s):
        """Take in what happens for so long."""
        end = time.monotonic() + duration_s
        while time.monotonic() < end:
            self._pump(end - time.monotonic())

    def story(self):
        """The ends of the logs, for a message."""
        with open(self.console, encoding="utf-8", errors="replace") as file:
            console = file.read().splitlines()
        parts = ["console: " + line for line in console[-8:]]
        return "\n".join(parts + ["log: " + line for line in self.log[-12:]])

    def _pump(self, limit_s):
        if self.qemu.poll() is not None:
            raise BoardError(f"QEMU ended with status {self.qemu.returncode}: "
                             f"{self.qemu.stderr.read().strip()}\n{self.story()}")
        # Not longer than this, to see soon when QEMU has died.
        for key, events in self.selector.select(min(limit_s, 1)):
            if events & selectors.EVENT_WRITE:
                self._write(key.data)
            if events & selectors.EVENT_READ:
                self._read(key.data)

    def _send(self, name, content):
        self.sending[name] += content
        self._write(name)

    def _write(self, name):
        waiting = self.sending[name]
        try:
            while waiting:
                count = self.sockets[name].send(waiting[:65536])
                del waiting[:count]
        except BlockingIOError:
            pass
        except BrokenPipeError:
            waiting.clear()  # _pump says that QEMU has ended
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if waiting else 0)
        self.selector.modify(self.sockets[name], events, name)

    def _read(self, name):
        try:
            content = self.sockets[name].recv(65536)
        except (BlockingIOError, ConnectionResetError):
            return
        if not content:
            time.sleep(0.01)  # QEMU is going: _pump says so
        *lines, self.received[name] = (self.received[name] + content).split(b"\n")
        for line in lines:
            self._line(name, line.decode("utf-8", errors="replace"))

    def _line(self, name, line):
        words = line.split()
        if name == "qtest" and words and words[0] == "IRQ":
            level, number = int(words[1] == "raise"), int(words[2])
            self.levels[number] = level
            self.rises[number] += level
            self.edges.append(Edge(time.monotonic(), number, level))
        elif name == "records":
            self.records.append(as_of_host(line))
        elif name == "log":
            self.log.append(line)
        elif name != "qmp" or '"event"' not in line:
            self.lines[name].append(line)

    # --- the board ---

    def set_input(self, line, level):
        """Drive a pin from outside."""
        self.qtest(f"set_irq_in {self.gpio} unnamed-gpio-in {line} {level}")

    def wait_level(self, line, level, limit_s):
        self.wait(lambda: self.levels[line] == level, limit_s, f"level {level} of line {line}")

    def wait_rises(self, line, count, limit_s):
        """Until the line has risen so often since power-on."""
        self.wait(lambda: self.rises[line] >= count, limit_s, f"rise {count} of line {line}")

    def command(self, text, limit_s=ANSWER_S):
        """A line for the board's shell; what it prints. It must succeed."""
        self._send("control", text.encode() + b"\n")
        output = []
        while True:
            self.wait(lambda: self.lines["control"], limit_s, f"answer to '{text}'")
            line = self.lines["control"].popleft()
            if line.startswith("= "):
                break
            output.append(line)
        if line != "= 0":
            raise BoardError(f"'{text}' failed on the board with {line[2:]}: {output}")
        return "\n".join(output)

    def watch_pins(self, then=":"):
        """From now on the kernel notes what pins it sets and when: for pins(). then: what the
        board's shell does next; mark() says when."""
        self.command("cd /sys/kernel/tracing; echo 1 >events/gpio/gpio_value/enable; echo >trace; "
                     f"echo mark >trace_marker; cd /; {then}")

    def mark(self):
        """When watch_pins() was called to do something, by the board's clock."""
        text = self.command("cat /sys/kernel/tracing/trace")
        return float(re.search(r"([0-9.]+): tracing_mark_write: mark", text)[1])

    def pins(self):
        """Edges of output pins since watch_pins(), by the board's clock: what a time limit of the
        program has to be held against, as the host's runs differently while the board computes."""
        base = int(self.command("cat /sys/class/gpio/gpiochip*/base"))
        text = self.command("cat /sys/kernel/tracing/trace")
        edges, levels = [], {}
        for time_s, number, level in re.findall(r"([0-9.]+): gpio_value: (\d+) set ([01])", text):
            edge = Edge(float(time_s), int(number) - base, int(level))
            if levels.get(edge.line) != edge.level:
                edges.append(edge)
            levels[edge.line] = edge.level
        return edges

    def send_frame(self, sequence, time_us, samples, held=False):
        """Into the camera that `feed` has made. held: together with the next."""
        head = struct.pack("<qIIII", time_us, sequence, len(samples), held, 0)
        self._send("frames", head + samples)
        # All of it, as who sends it may have something else to do than to wait for the board.
        self.wait(lambda: not self.sending["frames"], ANSWER_S, "reader of the frames port")

    def take_serial(self, count):
        """So many bytes of the serial line, fewer where no more wait: some hundred do, then the line
        stands still."""
        content = b""
        with contextlib.suppress(BlockingIOError):
            while len(content) < count:
                content += self.sockets["serial"].recv(count - len(content))
        return content

    @contextlib.contextmanager
    def serial_lines(self):
        """Read the serial line as fast as it comes: its whole lines in turn."""
        self.selector.register(self.sockets["serial"], selectors.EVENT_READ, "serial")
        try:
            yield self.lines["serial"]
        finally:
            self.selector.unregister(self.sockets["serial"])

    def record(self, limit_s):
        """The next line of the program's standard output."""
        self.wait(lambda: self.records, limit_s, "record")
        return self.records.popleft()

    def start(self, arguments):
        self.command("start " + arguments)

    def signal(self, name, process="$program"):
        self.command(f"kill -{name} {process}")

    def exit_status(self, limit_s):
        """Wait for the program's end; -N when signal N ended it, as in subprocess."""
        end = time.monotonic() + limit_s
        while True:
            words = self.command("state").split()
            if words[0] == "exited":
                status = int(words[1])
                return 128 - status if status > 128 else status
            if time.monotonic() > end:
                raise BoardError(f"the program did not end within {limit_s:g} s\n{self.story()}")
            self.settle(0.05)

    def memory_kb(self):
        """(resident now, most ever), as the kernel counts."""
        text = self.command("cat /proc/$program/status")
        fields = dict(line.split(":", 1) for line in text.splitlines() if ":" in line)
        return int(fields["VmRSS"].split()[0]), int(fields["VmHWM"].split()[0])
