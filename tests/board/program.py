#!/usr/bin/env python3
"""isohead_board on a machine without a board: its options, what is wrong with its files and devices, its ends and their
exit statuses.

program.py ISOHEAD_BOARD HOST_SIM RENDER FRAMES      exit status 1 if something is wrong
"""

import fcntl
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import termios
import time
from concurrent.futures import ThreadPoolExecutor

from frames import Frames, as_of_host, moved_rig
from watch import held_port

# app_health.h; and what ends a program that hangs, on a machine under load.
CHECK_S, SOON_S = 15, 300
# Records of a directory that is read again and again.
AGAIN = 20

failures = []


def check(condition, text):
    if not condition:
        failures.append(text)
        print("FAIL", text, flush=True)


def run(*options, limit_s=SOON_S, **more):
    """Its records go to a file: a pipe that is not read in time would be a slow reader, to whom records are lost."""
    with tempfile.TemporaryFile("w+", encoding="utf-8") as out:
        done = subprocess.run([program, *options], stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.PIPE, text=True,
                              timeout=limit_s, check=False, **more)
        out.seek(0)
        done.stdout = out.read()
    check("Sanitizer" not in done.stderr and "runtime error" not in done.stderr, f"{options}: {done.stderr}")
    return done


def expect(status, pattern, *options, **more):
    """This exit status and message, and no records."""
    done = run(*options, **more)
    check(done.returncode == status and re.search(pattern, done.stderr) and not done.stdout,
          f"{options}: status {done.returncode}, expected {status}; no '{pattern}' in: {done.stderr}")


def write(name, text):
    path = os.path.join(work, name)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    return path


def check_usage():
    done = run("--help")
    check(done.returncode == 0 and "--laser-off" in done.stdout and not done.stderr, f"--help: {done}")
    done = run("--version")
    check(done.returncode == 0 and re.fullmatch(r"isohead_board \d+\.\d+\.\d+\n", done.stdout), f"--version: {done}")
    with open("/dev/full", "w", encoding="ascii") as full:
        done = subprocess.run([program, "--help"], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
        check(done.returncode == 1 and "standard output" in done.stderr, f"--help, full: {done}")
    expect(2, "rig", "--device", "/dev/null")
    expect(2, "perhaps .device. is meant", "--devise", "x", "--rig", rig)
    expect(2, "duty", "--rig", rig, "--duty", "101")
    expect(2, "No such file", "--config", "/nowhere/isohead.conf")
    expect(2, "No such file", "--rig", "/nowhere/rig.json")
    expect(2, "a directory", "--rig", work)
    expect(2, "not JSON", "--rig", write("bad.json", "{"))
    with open(rig, encoding="ascii") as file:
        text = file.read()
    expect(2, "near", "--rig", write("near.json", re.sub(r'"near_mm" *: *\d+', '"near_mm":-5', text)))
    range_rig = '{"kind":"range",' + text.split("{", 1)[1]
    expect(2, "range", "--rig", write("range.json", range_rig), "--device", "/dev/null")


def check_outputs():
    expect(1, "output: .*No such file", "--rig", rig, "--output", "serial:/nowhere/ttyS0")
    expect(1, "output: ", "--rig", rig, "--output", "serial:" + write("file", ""))
    # No name server is asked for a name like this.
    expect(1, "output: ", "--rig", rig, "--output", "udp:no..host:9")
    expect(1, "watchdog: ", "--rig", rig, "--watchdog", "/nowhere/watchdog")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        expect(1, "view: .*Address already in use", "--rig", rig, "--view", str(taken.getsockname()[1]))


def check_laser():
    conf = write("none.conf", "laser = off\n")
    check(run("--config", conf, "--laser-off").returncode == 0, "--laser-off of a board without a laser")
    expect(2, "gpio-chip and laser-line", "--laser-off")
    expect(3, "/nowhere/gpiochip0", "--laser-off", "--gpio-chip", "/nowhere/gpiochip0", "--laser-line", "3")
    expect(2, "status", "--laser-off", "--config", write("wrong.conf", "laser = on\nstatus = soon\n"))
    # A watchdog that runs from before, for a line that is stuck, gets no sign of life and is not stopped.
    dog = write("dog", "")
    expect(1, "/nowhere/gpiochip0", "--rig", rig, "--laser", "--gpio-chip", "/nowhere/gpiochip0", "--laser-line", "3", "--device",
           "/nowhere/video0", "--watchdog", dog)
    with open(dog, "rb") as file:
        check(file.read() == b"", "the watchdog was written to although the laser's line could not be taken")


def end(number, *options, until="trying again", ready=None, **more):
    """Started, ended by the signal once it says so, and is ready; exit status, standard error."""
    more = {"stdout": subprocess.PIPE} | more
    with subprocess.Popen([program, "--rig", rig, "--device", "/nowhere/video0", *options], stdin=subprocess.DEVNULL,
                          stderr=subprocess.PIPE, text=True, **more) as process:
        text = ""
        while until not in text:
            line = process.stderr.readline()
            if not line:
                break
            text += line
        while ready and not ready() and process.poll() is None:
            time.sleep(0.05)
        if number == signal.SIGHUP:
            process.send_signal(number)
            while "reloaded" not in text:
                text += process.stderr.readline() or "reloaded? it has ended"
            number = signal.SIGTERM
        if number == signal.SIGUSR1:
            process.send_signal(number)
            while "requested" not in text:
                text += process.stderr.readline() or "requested? it has ended"
            number = signal.SIGTERM
        process.send_signal(number)
        text += process.communicate(timeout=SOON_S)[1]
    check("Sanitizer" not in text and "runtime error" not in text, text)
    return process.returncode, text


def has_v6():
    """Some machines have no IPv6, not even of their own."""
    try:
        with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as sock:
            sock.connect(("::1", 9))
        return True
    except OSError as error:
        print("no IPv6 here, which is not tried:", error)
        return False


def check_ends():
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        status, text = end(number)
        check(status == 0 and "No such file" in text, f"{number!r} without a camera: status {status}: {text}")
    for number in (signal.SIGABRT, signal.SIGKILL):
        status, _ = end(number)
        check(status != 0, f"{number!r}: status {status}")
    status, text = end(signal.SIGTERM, "--view", "127.0.0.1:0", until="trying again")
    check(status == 2 and "view" in text, f"port 0: status {status}: {text}")
    port, held = held_port()
    with held:
        status, text = end(signal.SIGTERM, "--view", str(port))
    check(status == 0 and f"live view: http://127.0.0.1:{port}/" in text, f"with a view: status {status}: {text}")
    for output in ("udp:127.0.0.1:9", *(["udp:[::1]:9"] if has_v6() else [])):
        status, text = end(signal.SIGTERM, "--output", output)
        check(status == 0, f"{output}: status {status}: {text}")


def check_terminal():
    """A terminal that is gone takes the program with it."""
    master, slave = os.openpty()
    with subprocess.Popen([program, "--rig", rig, "--device", "/nowhere/video0"], stdin=slave, stdout=slave, stderr=subprocess.PIPE,
                          text=True, start_new_session=True,
                          preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0)) as process:
        os.close(slave)
        while (line := process.stderr.readline()) and "trying again" not in line:
            pass
        os.close(master)
        process.communicate(timeout=SOON_S)
    check(process.returncode == 0, f"lost terminal: status {process.returncode}")


def check_check():
    """--check: ended before its answer, it has not found that the rig fits."""
    status, text = end(signal.SIGTERM, "--check")
    check(status == 1 and "ended after 0 of 60" in text, f"--check, ended: status {status}: {text}")


def check_dark():
    """--check of a rig without a camera waits for one, and gives up."""
    begin = time.monotonic()
    expect(1, "cannot be determined: no lit frame for 15 s", "--check", "--rig", rig, "--device", "/nowhere/video0",
           limit_s=CHECK_S + SOON_S)
    check(time.monotonic() - begin >= CHECK_S, "--check did not wait for the camera")


def records_of_host(directory, *options):
    return subprocess.run([host_sim, "--json", *options, directory], stdout=subprocess.PIPE, text=True, check=False).stdout.splitlines()


def same_as_host(directory, *options):
    """With this directory as its camera, every record is host_sim's, and the end is good."""
    done = run("--device", directory, "--rate", "1000", *options)
    check(done.returncode == 0, f"{directory}: status {done.returncode}: {done.stderr}")
    found = [as_of_host(line) for line in done.stdout.splitlines()]
    check(found and found == records_of_host(directory, *options), f"{directory} {options}: other records than host_sim's")


def rendered(name, *options):
    path = os.path.join(work, name)
    subprocess.run([render, *options, path], check=True, stdout=subprocess.DEVNULL)
    return path


def small_directory(name, *contents):
    """Frames that are no pictures of anything, with the rig."""
    path = os.path.join(work, name)
    os.makedirs(path)
    shutil.copy(rig, path)
    for number, content in enumerate(contents):
        with open(os.path.join(path, f"take{number}.pgm"), "wb") as file:
            file.write(content)
    return path


BLACK = b"P5 752 582 255\n" + bytes(752 * 582)


def check_directory():
    """Frames from a directory: records as host_sim's, again and again, never with a laser; what is no camera at all."""
    same_as_host(frames)
    alternating = rendered("alternating", "--sequence", "2", "--seed", "3", "--laser", "alternate", "--frames", "40")
    same_as_host(alternating)
    moved = moved_rig(Frames(alternating, "moved"), os.path.join(work, "moved.json"))
    same_as_host(alternating, "--rig", moved)
    taken = small_directory("taken", BLACK, BLACK[:1000], b"P5 2 2 255\nxxxx")
    done = run("--device", taken)
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    check([line["file"] for line in lines] == ["000000.pgm", "000001.pgm", "000002.pgm"], f"names: {done.stdout}")
    check("error" not in lines[0] and "take1.pgm: " in lines[1]["error"] and "2x2 px" in lines[2]["error"], f"errors: {done.stdout}")
    check(done.returncode == 0 and "no more frames" in done.stderr, f"its end: {done.returncode}: {done.stderr}")
    out = os.path.join(work, "out")

    def records_so_far():
        with open(out, "rb") as file:
            return file.read().splitlines()

    with open(out, "wb") as file:
        status, text = end(signal.SIGTERM, "--device", taken, "--loop", "--rate", "1000", "--status", "1", until="bad",
                           ready=lambda: len(records_so_far()) > AGAIN, stdout=file)
    lines = [json.loads(line) for line in records_so_far()]
    times = [line["time_us"] for line in lines if "time_us" in line]
    check(status == 0 and len(lines) > AGAIN and [line["file"] for line in lines] == [f"{i:06}.pgm" for i in range(len(lines))],
          f"again and again: status {status}, {len(lines)} records: {text}")
    check(times == [120000 * i for i in range(len(times))], f"times of the passes: {times[:9]}")
    laser = ["--laser", "--gpio-chip", "/nowhere/gpiochip0", "--laser-line", "3"]
    expect(2, "--laser: on, but the device is a directory", "--device", frames, *laser)
    expect(2, "no frames", "--device", small_directory("none"))
    expect(2, "rig.json: No such file", "--device", work)
    fifo = os.path.join(work, "fifo")
    os.mkfifo(fifo)
    for path in (rig, fifo):
        expect(2, "--device: neither a camera nor a directory", "--device", path, "--rig", rig)


def check_answers():
    """--check's answers, each with its status, on frames from a directory."""
    expect(0, "checked 60 frames, it fits", "--check", "--device", frames, "--rate", "1000")
    moved = moved_rig(Frames(frames, "moved"), os.path.join(work, "moved.json"))
    expect(1, "checked 60 frames, it has moved", "--check", "--device", frames, "--rate", "1000", "--rig", moved)
    expect(1, "ended after 50 of 60", "--check", "--device", frames, "--rate", "1000", "--loop=off")
    expect(1, "cannot be determined: of 0 dots", "--check", "--device", small_directory("black", BLACK), "--rate", "1000")


def recorded(directory, *options):
    """A recording of it, replayed by host_sim, gives the records of the program."""
    target = os.path.join(work, "recorded")
    shutil.rmtree(target, ignore_errors=True)
    done = run("--device", directory, "--rate", "20", "--record", target, *options)
    check(done.returncode == 0 and "record:" not in done.stderr, f"recording {directory}: status {done.returncode}: {done.stderr}")
    found = [as_of_host(line) for line in done.stdout.splitlines()]
    part = os.path.join(target, "000001")
    check(os.listdir(target) == ["000001"] and found and records_of_host(part) == found, f"{directory}: the recording gives other records")
    with open(os.path.join(part, "settings.json"), encoding="ascii") as file:
        settings = json.load(file)
    check(settings["settings"]["record"] == target and settings["settings"]["laser"] is False, f"settings: {settings}")
    return part


def check_record():
    """--record: replayed to the same bytes, with ambient frames and a rig that has moved; bounded, and of what cannot be written."""
    alternating = os.path.join(work, "alternating")
    part = recorded(alternating)
    moved = os.path.join(work, "moved.json")
    moved_rig(Frames(alternating, "moved"), moved)
    part = recorded(alternating, "--rig", moved)
    with open(os.path.join(part, "rig.json"), "rb") as copy, open(moved, "rb") as file:
        check(copy.read() == file.read(), "another rig than the one that was used")
    small = os.path.join(work, "small")
    done = run("--device", alternating, "--rate", "20", "--record", small, "--record-max", "2")
    size = sum(os.path.getsize(os.path.join(folder, name)) for folder, _, names in os.walk(small) for name in names)
    check(done.returncode == 0 and done.stderr.count("record-max") == 1 and 1000000 < size <= 2000000,
          f"--record-max 2: {size} bytes: {done.stderr}")
    status, text = end(signal.SIGUSR1, "--device", alternating, "--record", os.path.join(work, "event"), "--record-when", "signal",
                       "--loop", "--status", "1", until="frames/s")
    check(status == 0 and "record: requested: the last 10 s" in text and os.path.exists(os.path.join(work, "event", "000001", "rig.json")),
          f"SIGUSR1: status {status}: {text}")
    expect(1, "record: making /proc/none", "--device", alternating, "--record", "/proc/none")
    expect(1, "record: record-memory: 1000000 bytes, expected at least 4 frames", "--device", alternating, "--record", small,
           "--record-memory", "1")
    expect(2, "record-when: given, but no record", "--device", alternating, "--record-when", "moved")


def accelerometer(x, y, z):
    """A directory as sysfs has one for it, which reads this, in m/s2."""
    path = os.path.join(work, "iio:device0")
    os.makedirs(path, exist_ok=True)
    for name, text in (("name", "bmi160"), ("in_accel_scale", "0.001"), ("in_mount_matrix", "0, 1, 0; 1, 0, 0; 0, 0, -1"),
                       ("in_accel_x_raw", y * 1000), ("in_accel_y_raw", x * 1000), ("in_accel_z_raw", -z * 1000)):
        with open(os.path.join(path, name), "w", encoding="ascii") as file:
            file.write(f"{text}\n")
    return "iio:" + path


def check_up():
    """--up: for a rig that has none, in a recording too; off from one that has; not to be had; with --check."""
    level = accelerometer(0, -9.81, 0)
    with open(rig, encoding="ascii") as file:
        fields = json.load(file)
    fields.pop("up", None)
    plain = write("plain.json", json.dumps(fields))
    tilted = write("tilted.json", json.dumps({**fields, "up": [0, -0.8, -0.6]}))
    quick = ["--device", frames, "--rate", "1000", "--rig", plain]
    done = run(*quick, "--up", level)
    check("up: bmi160 (iio:device0) reads 9.81 m/s2: up is [0.000, -1.000, 0.000], tilt 0.0 and roll 0.0 degrees" in done.stderr
          and "plain.json: has no up, the accelerometer's is used" in done.stderr, f"--up: {done.stderr}")
    check([as_of_host(line) for line in done.stdout.splitlines()] == records_of_host(frames), "--up of a level camera: other records")
    down = accelerometer(0, -8, -6)
    done = run(*quick, "--up", down)
    check([as_of_host(line) for line in done.stdout.splitlines()] == records_of_host(frames, "--rig", tilted) != records_of_host(frames),
          f"--up: other records than with up in the rig: {done.stderr}")
    part = recorded(frames, "--up", down, "--rig", plain)
    with open(os.path.join(part, "rig.json"), encoding="ascii") as file:
        text = json.load(file)
    up = text.pop("up")
    check(text == fields and [round(part, 6) for part in up] == [0, -0.8, -0.6], f"the recording's rig: {up}")
    with open(os.path.join(part, "settings.json"), encoding="ascii") as file:
        check(json.load(file)["settings"]["up"] == down, "settings.json: up")
    done = run(*quick, "--up", accelerometer(9.81, 0, 0), "--rig", tilted)
    check("tilted.json: its up is [0.000, -0.800, -0.600], tilt 36.9 and roll 0.0 degrees; by the accelerometer it is "
          "[1.000, 0.000, 0.000], tilt 0.0 and roll 90.0 degrees: 90.0 degrees from it" in done.stderr, f"--up, off: {done.stderr}")
    check([as_of_host(line) for line in done.stdout.splitlines()] == records_of_host(frames, "--rig", tilted), "--up, off: not the rig's is used")
    for z, why in ((9.81, "the camera looks straight up or down"), (None, "No such file"), (0, "it reads 0.00 m/s2")):
        up = "iio:/nowhere/iio:device0" if z is None else accelerometer(0, 0, z)
        done = run(*quick, "--up", up)
        check(done.returncode == 0 and f"up: {up}: " in done.stderr and why in done.stderr and "level camera where it has none" in done.stderr
              and "accelerometer's is used" not in done.stderr, f"--up {up}: {done.stderr}")
        check([as_of_host(line) for line in done.stdout.splitlines()] == records_of_host(frames), f"--up {up}: other records")
    expect(0, r"(?s)its up is .*checked 60 frames, it fits", "--check", "--device", frames, "--rate", "1000", "--rig", tilted, "--up",
           accelerometer(0, 9.81, 0))
    for wrong in ("iio:", "bmi160", "on"):
        expect(2, f'--up: "{wrong}", expected iio: and the name of an accelerometer', *quick, "--up", wrong)


def check_modes():
    """Settings that only the camera would see: they are taken."""
    for options in (["--exposure", "auto", "--gain", "auto"], ["--exposure", "500", "--gain", "7"], ["--exposure", "keep", "--gain", "keep"],
                    ["--exposure", "steer"]):
        status, text = end(signal.SIGTERM, *options)
        check(status == 0, f"{options}: status {status}: {text}")


def main():
    with ThreadPoolExecutor(1) as beside:
        dark = beside.submit(check_dark)  # it waits for most of its time
        for part in (check_usage, check_outputs, check_laser, check_ends, check_terminal, check_check, check_directory,
                     check_answers, check_record, check_up, check_modes):
            part()
        dark.result()
    print(f"isohead_board without a board: {len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    program, host_sim, render, frames = [os.path.abspath(path) for path in sys.argv[1:]]
    rig = os.path.join(frames, "rig.json")
    with tempfile.TemporaryDirectory() as work:
        sys.exit(main())
