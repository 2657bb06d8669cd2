#!/usr/bin/env python3
"""The image of tools/image on an emulated UEFI board: it boots into the firmware, which finds the
heads in the frames it is fed; slots that are damaged or whose firmware fails are left by themselves.

image.py --image DIR --program FILE --board DIR --frames DIR --host-sim FILE --work DIR [CASE...]

--image: what tools/image/image.sh has made of --program; --board: what get.sh has made; --frames: a rendered
frames directory. The image is used as it is, but for its data partition: that gets a rig, settings,
and a start.sh that makes a camera of v4l2loopback, for frames that come over a virtio-serial port.
Records go over a line of their own: on the console, others write between a record's pieces.
Cases run at the same time. Exit status 1 if one fails.
"""

import argparse
import concurrent.futures
import hashlib
import json
import os
import re
import selectors
import shutil
import socket
import struct
import subprocess
import sys
import time

from frames import as_of_host

HERE = os.path.dirname(os.path.abspath(__file__))
FIRMWARE = "/usr/share/AAVMF"
FRAME_COUNT = 10
# Time stamps start here: v4l2loopback takes 0 for none.
TIME_0_US = 1000000
# Longest times: a start takes 20 s when idle, and several may run at once.
START_S, ANSWER_S = 300, 180
MONITOR_S = 3  # for QEMU's monitor to answer

CONFIG = """device = /dev/video0
format = GREY
rate = 1
exposure = keep
gain = keep
laser = off
output = serial:/run/records
status = 0
"""
START = """ln -s /dev/hvc0 /run/records
cp /data/test/feeder /run/feeder
modprobe videodev
insmod /data/test/v4l2loopback.ko devices=1 video_nr=0 max_buffers=4
for port in /sys/class/virtio-ports/*; do
    [ "$(cat $port/name 2>/dev/null)" != frames ] || /run/feeder /dev/${port##*/} /dev/video0 %d %d GREY
done
"""


class Wrong(Exception):
    """The board did something else than it should."""


def expect(condition, text):
    if not condition:
        raise Wrong(text)


def run(*arguments, **options):
    return subprocess.run(arguments, check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, **options).stdout


# --- frames ---


class Frames:
    """The first frames of a directory, with time stamps that a driver takes; what host_sim says."""

    def __init__(self, source, work, host_sim):
        shutil.rmtree(work, ignore_errors=True)
        os.makedirs(work)
        with open(os.path.join(source, "frames.jsonl"), encoding="ascii") as file:
            entries = [json.loads(line) for line in file][:FRAME_COUNT]
        self.samples = []
        with open(os.path.join(work, "frames.jsonl"), "w", encoding="ascii") as file:
            for entry in entries:
                entry["time_us"] += TIME_0_US
                file.write(json.dumps(entry) + "\n")
                shutil.copy(os.path.join(source, entry["file"]), work)
                self.samples.append(self._read(os.path.join(work, entry["file"])))
        self.times_us = [entry["time_us"] for entry in entries]
        self.rig = shutil.copy(os.path.join(source, "rig.json"), work)
        self.records = run(host_sim, "--json", work).splitlines()
        expect(len(self.records) == FRAME_COUNT, f"host_sim gives {len(self.records)} records")
        expect(any(json.loads(record)["heads"] for record in self.records),
               f"no head in the first {FRAME_COUNT} frames of {source}")

    def _read(self, path):
        with open(path, "rb") as file:
            magic, size, maximum, samples = file.read().split(b"\n", 3)
        expect((magic, maximum) == (b"P5", b"255"), f"{path} is not an 8-bit PGM as render writes")
        self.width, self.height = [int(word) for word in size.split()]
        return samples


# --- the disk ---


class Disk:
    """A copy of the image, and what lies where in it."""

    def __init__(self, image, path):
        run("cp", "--sparse=always", image, path)
        self.path = path
        table = json.loads(run("/sbin/sfdisk", "--json", path))["partitiontable"]
        self.places = self.places_of(table)

    @staticmethod
    def places_of(table):
        """Name to begin and size, in bytes."""
        return {part["name"]: (part["start"] * 512, part["size"] * 512) for part in table["partitions"]}

    def fat(self, name):
        return f"{self.path}@@{self.places[name][0]}"

    def put(self, sources, folder):
        """Files and folders into a folder of the data partition."""
        run("mcopy", "-o", "-s", "-i", self.fat("isohead-data"), *sources, "::" + folder)

    def make_folder(self, folder):
        run("mmd", "-i", self.fat("isohead-data"), "::" + folder)

    def entries(self):
        """Names of the boot loader's entries."""
        names = run("mdir", "-b", "-i", self.fat("isohead-esp"), "::/loader/entries").split()
        return sorted(os.path.basename(name) for name in names)

    def content(self, name, size=None):
        start, whole = self.places[name]
        with open(self.path, "rb") as file:
            file.seek(start)
            return file.read(whole if size is None else size)

    def write(self, name, content):
        self.write_at(self.places[name][0], content)

    def write_at(self, start, content):
        with open(self.path, "r+b") as file:
            file.seek(start)
            file.write(content)

    def zero(self, name):
        self.write(name, bytes(self.places[name][1]))

    def check_esp(self, work):
        """Is the ESP whole, and unmounted cleanly?"""
        path = os.path.join(work, "esp.fat")
        with open(path, "wb") as file:
            file.write(self.content("isohead-esp"))
        result = subprocess.run(["/sbin/fsck.vfat", "-n", path], stdout=subprocess.PIPE, text=True,
                                check=False)
        os.remove(path)
        expect(result.returncode == 0, f"the ESP is not whole:\n{result.stdout}")


# --- the board ---


class Board:
    """QEMU's virt board with UEFI, its console, a line for records, a port for frames and QEMU's own monitor.

    Its time is a nanosecond per instruction while it computes: how busy this machine is shortens none of its limits.
    """

    LINES = ("console", "records", "frames", "monitor")
    START_S = START_S

    @staticmethod
    def machine(disk, work):
        """QEMU's arguments; a character device is there for each of LINES."""
        variables = shutil.copy(os.path.join(FIRMWARE, "AAVMF_VARS.fd"), work)
        return [
            "-M", "virt,acpi=off", "-cpu", "cortex-a53", "-m", "512", "-icount", "shift=0",
            "-drive", f"if=pflash,format=raw,readonly=on,file={FIRMWARE}/AAVMF_CODE.fd",
            "-drive", f"if=pflash,format=raw,file={variables}",
            "-drive", f"if=none,id=disk,format=raw,file={disk.path}",
            "-device", "virtio-blk-device,drive=disk", "-device", "i6300esb",
            "-device", "virtio-serial-device", "-device", "virtconsole,chardev=records",
            "-device", "virtserialport,chardev=frames,name=frames",
            "-serial", "chardev:console", "-monitor", "chardev:monitor"]

    def __init__(self, disk, work):
        arguments = ["qemu-system-aarch64", "-nodefaults", "-display", "none", *self.machine(disk, work)]
        self.work, self.sockets, theirs = work, {}, []
        for name in self.LINES:
            self.sockets[name], other = socket.socketpair()
            theirs.append(other)
            arguments += ["-chardev", f"socket,id={name},fd={other.fileno()}"]
        self.text = {name: "" for name in self.LINES if name != "frames"}
        # Written as it comes, for whoever looks on; of all boards of a case.
        self.logs = {name: open(os.path.join(work, name + ".log"), "a", encoding="utf-8") for name in self.text}
        self.seen = dict.fromkeys(self.text, 0)  # how far it has been looked at
        self.selector = selectors.DefaultSelector()
        for name in self.text:
            self.selector.register(self.sockets[name], selectors.EVENT_READ, name)
        self.begin = time.monotonic()
        self.qemu = subprocess.Popen(arguments, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                     pass_fds=[sock.fileno() for sock in theirs], text=True)
        for sock in theirs:
            sock.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.qemu.kill()
        self.qemu.wait()
        for sock in self.sockets.values():
            sock.close()
        for log in self.logs.values():
            log.close()

    def now_s(self):
        """Since power-on."""
        return time.monotonic() - self.begin

    def wait(self, pattern, limit_s, name="console"):
        """For the pattern in what has come on that line since the last match; returns the match."""
        end = time.monotonic() + limit_s
        while True:
            match = re.compile(pattern).search(self.text[name], self.seen[name])
            if match:
                self.seen[name] = match.end()
                return match
            if self.qemu.poll() is not None:
                raise Wrong(f"QEMU ended with status {self.qemu.returncode}: {self.qemu.stderr.read()}")
            left = end - time.monotonic()
            if left <= 0:
                raise Wrong(f"no '{pattern}' on the {name} line within {limit_s} s{self.state()}{self.ends()}")
            self.read(min(left, 1))

    def read(self, limit_s):
        """What has come on the lines, or comes within that time; False: nothing."""
        ready = self.selector.select(limit_s)
        for key, _ in ready:
            content = key.fileobj.recv(65536)
            if not content:  # QEMU has ended
                self.selector.unregister(key.fileobj)
            text = content.decode("utf-8", errors="replace").replace("\r", "")
            self.text[key.data] += text
            self.logs[key.data].write(text)
            self.logs[key.data].flush()
        return bool(ready)

    def state(self):
        """Does the board run, and where in memory: QEMU stops it, for one, when the disk of this machine is full."""
        before = len(self.text["monitor"])
        self.sockets["monitor"].sendall(b"info status\ninfo registers\n")
        end = time.monotonic() + MONITOR_S
        while time.monotonic() < end:
            self.read(1)
        said = re.findall(r"VM status: .*|\bPC=\w+", self.text["monitor"][before:])
        return f"; {', '.join(said)}; {shutil.disk_usage(self.work).free >> 20} MiB free below {self.work}"

    def ends(self):
        """What came last on each line, for whoever reads only what this program prints."""
        return "".join(f"; the end of the {name} line:\n" +
                       "\n".join(line[:200] for line in text.splitlines()[-12:])
                       for name, text in self.text.items() if name != "monitor")

    def command(self, text, limit_s=ANSWER_S):
        """For the console's shell; it must succeed. Wakes the shell first."""
        self.sockets["console"].sendall(f"\n{text}; echo status-$?-$((6 * 7))\n".encode())
        match = self.wait(r"status-(\d+)-42\n", limit_s)
        expect(match.group(1) == "0",
               f"'{text}' failed:\n{self.text['console'][match.start() - 500:match.end()]}")

    def send_frame(self, frames, index):
        samples = frames.samples[index]
        head = struct.pack("<qIIII", frames.times_us[index], index, len(samples), 0, 0)
        self.sockets["frames"].sendall(head + samples)

    def first_record(self, frames):
        """Boot with a camera, until the record of the first frame; it is host_sim's."""
        self.wait(r"isohead_board: /dev/video0: open", START_S)
        while self.read(0):
            pass
        self.seen["records"] = len(self.text["records"])  # of the start before
        self.send_frame(frames, 0)
        self.check_record(frames, 0)

    def check_record(self, frames, index):
        match = self.wait(r"(?m)^(.+)\n", ANSWER_S, "records")
        record = as_of_host(match.group(1))
        expect(record == frames.records[index],
               f"frame {index}:\nboard    {record}\nhost_sim {frames.records[index]}{self.ends()}")

    def wait_slot(self, name):
        """For the slot that is started next; True when it is whole."""
        match = self.wait(r"isohead: slot (.) on \S+ is (whole|damaged)", self.START_S)
        expect(match.group(1) == name, f"slot {match.group(1)} was started, not {name}")
        return match.group(2) == "whole"


# --- cases: each returns what was seen ---


def broken_slot(image, work):
    """A slot whose firmware ends at once; its file below work."""
    root = os.path.join(work, "root")
    run("cp", "--archive", "--link", os.path.join(image, "root"), root)
    program = os.path.join(root, "usr/bin/isohead_board")
    os.remove(program)
    with open(program, "w", encoding="ascii") as file:
        # Making the line low works: else the board is reset at once.
        file.write("#!/bin/sh\ncase $* in *--laser-off*) exit 0 ;; esac\necho this firmware is broken >&2\nexit 1\n")
    os.chmod(program, 0o755)
    path = os.path.join(work, "broken.squashfs")
    run("mksquashfs", root, path, "-quiet", "-no-progress", "-all-root", "-comp", "zstd",
        "-Xcompression-level", "3")
    shutil.rmtree(root)
    return path


class Case:
    """What a case needs: a disk of its own whose data partition is set up."""

    def __init__(self, shared, name):
        self.work = os.path.join(shared.work, name)
        shutil.rmtree(self.work, ignore_errors=True)
        os.makedirs(self.work)
        self.frames = shared.frames
        self.slot = os.path.join(shared.image, "slot.squashfs")
        self.image = shared.image
        self.disk = Disk(os.path.join(shared.image, "isohead.img"), os.path.join(self.work, "disk"))
        self._write("isohead.conf", CONFIG)
        self._write("start.sh", START % (self.frames.width, self.frames.height))
        self.disk.put([os.path.join(self.work, "isohead.conf"), os.path.join(self.work, "start.sh"),
                       self.frames.rig], "/")
        self.disk.make_folder("/test")
        self.disk.put([shared.feeder, shared.loopback], "/test")

    def _write(self, name, text):
        with open(os.path.join(self.work, name), "w", encoding="ascii") as file:
            file.write(text)

    def data_digest(self):
        return hashlib.sha256(self.disk.content("isohead-data")).hexdigest()

    def update(self, board, path):
        with open(path, "rb") as file:
            digest = hashlib.sha256(file.read()).hexdigest()
        board.command(f"isohead-update /data/{os.path.basename(path)} {digest}", START_S)


def case_update(shared):
    """boots, finds heads; an update whose firmware fails is tried 3 times, then taken back"""
    case = Case(shared, "update")
    broken = broken_slot(case.image, case.work)
    case.disk.put([broken], "/")
    data = case.data_digest()
    with Board(case.disk, case.work) as board:
        expect(board.wait_slot("a"), "slot A is damaged")
        board.first_record(case.frames)
        first_s = board.now_s()
        for index in range(1, FRAME_COUNT):
            board.send_frame(case.frames, index)
            board.check_record(case.frames, index)
        board.wait("slot a is good", ANSWER_S)
        board.command("grep -q ' /data vfat ro,' /proc/mounts")
        board.command("! touch /usr/x")
        firmware = "/proc/$(pidof isohead_board | cut -d ' ' -f 1)"
        board.command(f"[ $(stat -c %U {firmware}) = isohead ]")
        board.command(f"grep -q 'CapPrm:.0*$' {firmware}/status && grep -q 'NoNewPrivs:.1' {firmware}/status")
        board.command("[ $(stat -c %a%U $(readlink -f /dev/console)) != 660isohead ]")
        board.command("ls -l /proc/$(pidof isohead_board)/fd | grep -q /dev/watchdog")
        case.update(board, broken)
        board.command("reboot")
        begin_s = board.now_s()
        for _ in range(3):
            expect(board.wait_slot("b"), "slot B is damaged")
            board.wait("slot b on trial: the firmware ended 3 times; starting again", START_S)
        expect(board.wait_slot("a"), "slot A is damaged")
        board.first_record(case.frames)
        back_s = board.now_s() - begin_s
        board.command("sync")
    entries = case.disk.entries()
    expect(entries == ["slot-a.conf", "slot-b+0-3.conf"], f"boot loader entries: {entries}")
    expect(case.data_digest() == data, "the data partition was written to")
    case.disk.check_esp(case.work)
    return (f"power-on to first record {first_s:.1f} s; {FRAME_COUNT} records identical to "
            f"host_sim's; back in slot A after 3 failed starts of B: first record after {back_s:.1f} s")


def case_zeroed(shared):
    """slot A zeroed: falls back to B by itself; an update then brings A back"""
    case = Case(shared, "zeroed")
    case.disk.put([case.slot], "/")
    case.disk.zero("isohead-a")
    data = case.data_digest()
    with Board(case.disk, case.work) as board:
        expect(not board.wait_slot("a"), "a zeroed slot counts as whole")
        expect(board.wait_slot("b"), "slot B is damaged")
        board.first_record(case.frames)
        first_s = board.now_s()
        board.wait("slot b is good", ANSWER_S)
        case.update(board, case.slot)
        board.command("reboot")
        expect(board.wait_slot("a"), "slot A is damaged after the update")
        board.first_record(case.frames)
        board.wait("slot a is good", ANSWER_S)
        board.command("sync")
    entries = case.disk.entries()
    expect(entries == ["slot-a.conf", "slot-b.conf"], f"boot loader entries: {entries}")
    with open(case.slot, "rb") as file:
        slot = file.read()
    expect(case.disk.content("isohead-a", len(slot)) == slot, "slot A is not what the update held")
    expect(case.data_digest() == data, "the data partition was written to")
    case.disk.check_esp(case.work)
    return f"power-on to first record, from slot B: {first_s:.1f} s; then slot A updated and good"


def case_same_bytes(shared):
    """built a second time, elsewhere: the same bytes"""
    again = os.path.join(shared.work, "again")
    run(os.path.join(HERE, "..", "..", "tools", "image", "image.sh"), "uefi", shared.program, again)
    sums = []
    for folder in [shared.image, again]:
        with open(os.path.join(folder, "SHA256SUMS"), encoding="ascii") as file:
            sums.append(file.read())
    expect(sums[0] == sums[1], f"first:\n{sums[0]}second:\n{sums[1]}")
    shutil.rmtree(again)
    return f"SHA-256 of the image {sums[0].split()[0]}"


CASES = [case_update, case_zeroed, case_same_bytes]


# --- all of it ---


class Shared:
    """What the cases have in common."""

    def __init__(self, arguments):
        self.work = arguments.work
        self.image = arguments.image
        self.program = arguments.program
        os.makedirs(self.work, exist_ok=True)
        self.frames = Frames(arguments.frames, os.path.join(self.work, "frames"), arguments.host_sim)
        with open(os.path.join(arguments.board, "release"), encoding="ascii") as file:
            release = file.read().strip()
        modules = os.path.join(arguments.board, "root", "lib", "modules", release)
        self.loopback = os.path.join(modules, "v4l2loopback.ko")
        expect(os.path.isdir(os.path.join(self.image, "root", "lib", "modules", release)),
               f"the image's kernel is not {release}, for which v4l2loopback was built: remove "
               f"{arguments.board} and make it anew")
        self.feeder = os.path.join(self.work, "feeder")
        run("aarch64-linux-gnu-gcc", "-std=c11", "-D_GNU_SOURCE", "-O2", "-Wall", "-Wextra", "-Werror",
            "-static", "-o", self.feeder, os.path.join(HERE, "feeder.c"))


def run_case(shared, case):
    """Good, seconds, what was seen or went wrong."""
    begin = time.monotonic()
    try:
        text = case(shared)
    except (Wrong, subprocess.CalledProcessError) as error:
        return False, time.monotonic() - begin, f"{error} {getattr(error, 'output', '')}"
    return True, time.monotonic() - begin, text


def main():
    parser = argparse.ArgumentParser()
    for name in ["image", "program", "board", "frames", "host-sim", "work"]:
        parser.add_argument("--" + name, required=True, type=os.path.abspath)
    parser.add_argument("case", nargs="*")
    arguments = parser.parse_args()
    chosen = [case for case in CASES
              if not arguments.case or case.__name__[len("case_"):] in arguments.case]
    begin = time.monotonic()
    shared = Shared(arguments)
    with concurrent.futures.ThreadPoolExecutor(max_workers=2) as pool:
        results = list(pool.map(lambda case: run_case(shared, case), chosen))
    for case, (good, duration_s, text) in zip(chosen, results):
        print(f"{'ok  ' if good else 'FAIL'} {duration_s:6.1f} s  {case.__doc__}\n{'':15}{text}")
    failures = sum(not good for good, _, _ in results)
    print(f"{len(chosen) - failures} of {len(chosen)} cases, {time.monotonic() - begin:.0f} s")
    return 1 if failures or not chosen else 0


if __name__ == "__main__":
    sys.exit(main())
