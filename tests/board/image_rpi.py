#!/usr/bin/env python3
"""The image for a Raspberry Pi, on QEMU's Raspberry Pi 3: U-Boot from the image starts a slot and counts, the kernel and
the slot are the image's own, frames come from a directory and from the kernel's virtual camera, the laser's line is the processor's.

image_rpi.py --image DIR --frames DIR --host-sim FILE --work DIR [CASE...]

--image: what tools/image/image.sh has made; --frames: a rendered frames directory. QEMU has none of
Raspberry Pi's own firmware: firmware_choice() reads config.txt as that firmware is documented to do, and QEMU gets the
files that it names. Exit status 1 if a case fails.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import time
import zlib

from frames import as_of_host
from image import ANSWER_S, Board, Disk, Frames, Wrong, expect, run

# What a model's firmware puts true in the filters of config.txt, and the names of its device tree, upstream's first.
MODELS = {
    "3": ({"pi3"}, ["bcm2837-rpi-3-b", "bcm2710-rpi-3-b"]),
    "3+": ({"pi3", "pi3+"}, ["bcm2837-rpi-3-b-plus", "bcm2710-rpi-3-b-plus"]),
    "zero 2 w": ({"pi02"}, ["bcm2837-rpi-zero-2-w", "bcm2710-rpi-zero-2-w"]),
    "4": ({"pi4"}, ["bcm2711-rpi-4-b"]),
    "5": ({"pi5"}, ["bcm2712-rpi-5-b"]),
}
# What the processor's own code needs before it can read config.txt; a Raspberry Pi 5 has all of it on its board.
FIRMWARE = {"4": ["start4.elf", "fixup4.dat"], "5": []}
FIRMWARE_BEFORE_4 = ["bootcode.bin", "start.elf", "fixup.dat"]

SECTOR = 512
STATE_SECTORS = (1, 9)
START_S = 600
RECORDS = 3
LASER = 17
GPLEV0 = 0x3F200034
# First the frames of a directory, then a camera of vivid, for which alone the laser may be on.
DIRECTORY = """device = /data/frames
rate = 2
loop = on
status = 0
"""
CAMERA = f"""device = /dev/video0
rate = 5
exposure = keep
gain = keep
laser = on
laser-cap = 1000
gpio-chip = pinctrl-bcm2835
laser-line = {LASER}
status = 0
"""


# --- what the Raspberry Pi's own firmware does, as documented ---


def firmware_choice(config, model, exists):
    """The kernel and device tree that a model's firmware loads by this config.txt; exists(name): is it on the partition?"""
    filters, trees = MODELS[model]
    settings, holds = {}, True
    for line in config.splitlines():
        line = line.split("#")[0].strip()
        name = re.fullmatch(r"\[(.*)\]", line)
        if name:
            holds = name[1] == "all" or (name[1] != "none" and name[1] in filters)
        elif "=" in line and holds:
            key, value = line.split("=", 1)
            settings[key.strip()] = value.strip()
    if settings.get("arm_64bit", "1" if model in "45" else "0") != "1":
        raise Wrong(f"Raspberry Pi {model} would start in 32 bits")
    kernel = settings.get("kernel", "kernel8.img")
    upstream = settings.get("upstream_kernel") == "1"
    prefix = settings.get("os_prefix", "upstream/" if upstream else "")
    if not upstream:
        trees = trees[::-1]
    tree = settings.get("device_tree") or next((name + ".dtb" for name in trees if exists(prefix + name + ".dtb")), None)
    if prefix and not (exists(prefix + kernel) and tree):  # a prefix without a kernel or a tree there is ignored
        prefix = ""
        tree = settings.get("device_tree") or next((name + ".dtb" for name in trees if exists(name + ".dtb")), None)
    if not exists(prefix + kernel) or tree is None:
        raise Wrong(f"Raspberry Pi {model} finds no {kernel} or no device tree")
    return prefix + kernel, prefix + tree


# --- the disk ---


class PiDisk(Disk):
    """A copy of the image on an SD card, whose partitions have numbers."""

    NAMES = ("isohead-esp", "isohead-a", "isohead-b", "isohead-data")

    def __init__(self, image, path):
        super().__init__(image, path)
        os.truncate(path, 512 << 20)  # a card's size is a power of two

    @classmethod
    def places_of(cls, table):
        return {name: (part["start"] * SECTOR, part["size"] * SECTOR)
                for name, part in zip(cls.NAMES, table["partitions"])}

    def boot_files(self):
        return {os.path.basename(name) for name in run("mdir", "-b", "-i", self.fat("isohead-esp"), "::/").split("\n")
                if name and not name.endswith("/")}

    def boot_file(self, name, folder):
        path = os.path.join(folder, name)
        run("mcopy", "-o", "-i", self.fat("isohead-esp"), "::/" + name, path)
        return path

    def state_sector(self, number):
        with open(self.path, "rb") as file:
            file.seek(number * SECTOR)
            sector = file.read(SECTOR)
        if zlib.crc32(sector[4:]) != int.from_bytes(sector[:4], "little"):
            return None
        words = sector[4:].rstrip(b"\0").decode("ascii").split("\0")
        return dict(word.split("=", 1) for word in words)

    def state(self):
        """Of both sectors, which are to be the same."""
        states = [self.state_sector(number) for number in STATE_SECTORS]
        expect(states[0] is not None and states[0] == states[1], f"states {states}")
        return {name: states[0][name] for name in ("first", "a_left", "b_left")}

    def set_state(self, number, changes):
        """One sector; None: half of it is from elsewhere."""
        state = self.state_sector(STATE_SECTORS[0]) or self.state_sector(STATE_SECTORS[1])
        body = "\0".join(f"{key}={value}" for key, value in sorted({**state, **(changes or {})}.items()))
        body = body.encode().ljust(SECTOR - 4, b"\0")
        sector = zlib.crc32(body).to_bytes(4, "little") + body
        if changes is None:
            sector = sector[:SECTOR // 2] + b"\xa5" * (SECTOR // 2)
        with open(self.path, "r+b") as file:
            file.seek(number * SECTOR)
            file.write(sector)


# --- the board ---


class PiBoard(Board):
    """QEMU's Raspberry Pi 3 with its SD card, its console and QEMU's own monitor.

    QEMU's watchdog of this processor fires when it is started. So it is taken out of the device tree; and as it
    is what resets the processor, too, the test does that when the kernel has tried to."""

    LINES = ("console", "monitor")
    START_S = START_S
    resets = 0

    @staticmethod
    def machine(disk, work):
        names = disk.boot_files()
        kernel, tree = firmware_choice(read(disk.boot_file("config.txt", work)), "3", names.__contains__)
        tree = disk.boot_file(tree, work)
        run("fdtput", "-r", tree, "/soc/watchdog@7e100000")
        return ["-M", "raspi3b", "-drive", f"if=sd,format=raw,file={disk.path}",
                "-kernel", disk.boot_file(kernel, work), "-dtb", tree,
                # The console is the second line: the first is Bluetooth's.
                "-serial", "null", "-serial", "chardev:console", "-monitor", "chardev:monitor"]

    def read(self, limit_s):
        got = super().read(limit_s)
        resets = self.text["console"].count("reboot: Restarting system")
        if resets > self.resets:
            self.resets = resets
            self.sockets["monitor"].sendall(b"system_reset\n")
        return got

    def line_level(self, number):
        """Of a GPIO line, as QEMU's processor has it."""
        self.sockets["monitor"].sendall(f"xp /1wx {GPLEV0:#x}\n".encode())
        match = self.wait(r"[0-9a-f]{8,16}: 0x([0-9a-f]{8})", ANSWER_S, "monitor")
        return int(match[1], 16) >> number & 1

    def wait_level(self, number, level, limit_s):
        end = time.monotonic() + limit_s
        while self.line_level(number) != level:
            expect(time.monotonic() < end, f"line {number} is not {level} within {limit_s} s{self.ends()}")
            self.read(0.2)


def read(path):
    with open(path, encoding="ascii") as file:
        return file.read()


# --- cases: each returns what was seen ---


def card(shared, name):
    work = os.path.join(shared.work, name)
    shutil.rmtree(work, ignore_errors=True)
    os.makedirs(work)
    return PiDisk(os.path.join(shared.image, "isohead.img"), os.path.join(work, "disk")), work


def case_choice(shared):
    """each model's firmware finds what config.txt names"""
    disk, work = card(shared, "choice")
    names = disk.boot_files()
    config = read(disk.boot_file("config.txt", work))
    chosen = {}
    for model in MODELS:
        for name in FIRMWARE.get(model, FIRMWARE_BEFORE_4):
            expect(name in names, f"Raspberry Pi {model}: no {name} on the boot partition")
        chosen[model] = firmware_choice(config, model, names.__contains__)
        expect(chosen[model][0] == "u-boot.bin", f"Raspberry Pi {model}: {chosen[model]}")
    expect(len({tree for _, tree in chosen.values()}) == len(MODELS), f"device trees: {chosen}")

    # The reading itself: filters, prefixes, what is missing.
    def choice(text, model="3", files=("k", "u", "upstream/k", "upstream/bcm2837-rpi-3-b.dtb", "bcm2837-rpi-3-b.dtb",
                                       "bcm2710-rpi-3-b.dtb", "bcm2711-rpi-4-b.dtb")):
        try:
            return firmware_choice("arm_64bit=1\n" + text, model, set(files).__contains__)
        except Wrong:
            return None
    for found, wanted in (
            (choice("kernel=k"), ("k", "bcm2710-rpi-3-b.dtb")),
            (choice("kernel=k\nupstream_kernel=1"), ("upstream/k", "upstream/bcm2837-rpi-3-b.dtb")),
            (choice("kernel=u\nupstream_kernel=1"), ("u", "bcm2837-rpi-3-b.dtb")),
            (choice("kernel=k\n[pi4]\nkernel=u\n[all]\n#kernel=x"), ("k", "bcm2710-rpi-3-b.dtb")),
            (choice("kernel=k\n[pi4]\nkernel=u", "4"), ("u", "bcm2711-rpi-4-b.dtb")),
            (choice("kernel=k\n[none]\nkernel=u\n[pi3]\ndevice_tree=u"), ("k", "u")),
            (choice("kernel=x"), None), (choice("kernel=k", "zero 2 w"), None), (choice("arm_64bit=0\nkernel=k"), None)):
        expect(found == wanted, f"chosen {found}, expected {wanted}")
    return ", ".join(f"{model}: {tree}" for model, (_, tree) in chosen.items())


def case_loader(shared):
    """U-Boot starts the slot that the state says, and counts; with half a state, too"""
    rows = [  # what is changed in the first and in the second sector; what is started; what is left of both
        ({}, {}, "a", "2 3"),
        ({"a_left": "good"}, {"a_left": "good"}, "a", "good 3"),
        ({"first": "b", "a_left": "good", "b_left": "1"}, {"first": "b", "a_left": "good", "b_left": "1"}, "b", "good 0"),
        ({"first": "b", "a_left": "good", "b_left": "0"}, {"first": "b", "a_left": "good", "b_left": "0"}, "a", "good 0"),
        ({"a_left": "0", "b_left": "0"}, {"a_left": "0", "b_left": "0"}, "b", "0 0"),
        (None, {"first": "b", "a_left": "good", "b_left": "2"}, "b", "good 1"),  # the power failed in the first one
        ({"first": "b", "a_left": "good", "b_left": "3"}, {"a_left": "good", "b_left": "0"}, "b", "good 2"),  # or behind it
    ]
    begin = time.monotonic()
    for first, second, slot, left in rows:
        disk, work = card(shared, "loader")
        for number, changes in zip(STATE_SECTORS[::-1], (second, first)):
            disk.set_state(number, changes)
        before = [disk.state_sector(number) for number in STATE_SECTORS]
        with PiBoard(disk, work) as board:
            match = board.wait(r"isohead: starting slot (.)", START_S)
        found = disk.state_sector(1) or {}
        expect((match[1], f"{found.get('a_left')} {found.get('b_left')}") == (slot, left),
               f"state {before}: started {match[1]} and left {found}, expected {slot} and {left}")
        if "good" not in left or slot == "b":
            disk.state()
    # A slot whose kernel cannot be read is passed over at once.
    disk, work = card(shared, "loader")
    run("mdel", "-i", disk.fat("isohead-esp"), "::/a/initrd")
    with PiBoard(disk, work) as board:
        board.wait("isohead: starting slot a", START_S)
        board.wait("isohead: slot a does not start", START_S)
        board.wait("isohead: starting slot b", START_S)
    expect(disk.state() == {"first": "a", "a_left": "2", "b_left": "2"}, f"state {disk.state()}")
    return f"{len(rows) + 1} states, {(time.monotonic() - begin) / (len(rows) + 1):.1f} s each"


def vivid(image, folder):
    """The kernel's virtual camera with what it needs, into a folder; the commands that load them."""
    modules = os.path.join(image, "packages", "lib", "modules")
    modules = os.path.join(modules, os.listdir(modules)[0])
    with open(os.path.join(modules, "modules.dep"), encoding="ascii") as file:
        depends = dict(line.rstrip("\n").split(":") for line in file)
    wanted = next(name for name in depends if re.search(r"/vivid\.ko", name))
    commands = ""
    for name in depends[wanted].split()[::-1] + [wanted]:
        shutil.copy(os.path.join(modules, name), folder)
        options = " n_devs=1 num_inputs=1 input_types=0 node_types=1 vid_cap_nr=0" if name == wanted else ""
        commands += f"insmod /data/test/{os.path.basename(name)}{options} 2>/dev/null\n"
    return commands


def fill(shared, disk, work):
    """The data partition: frames, a rig for them and one for vivid, settings for both, an update."""
    frames = Frames(shared.frames, os.path.join(work, "frames"), shared.host_sim)
    folder = os.path.join(work, "test")
    os.makedirs(folder)
    rig = read(frames.rig)
    small = re.sub(r'("image_height":)\d+', r"\g<1>360", re.sub(r'("image_width":)\d+', r"\g<1>640", rig))
    for name, text in (("isohead.conf", DIRECTORY), ("start.sh", vivid(shared.image, folder)), ("rig.json", rig),
                       ("test/camera.conf", CAMERA), ("test/camera.json", small)):
        with open(os.path.join(work, name), "w", encoding="ascii") as file:
            file.write(text)
    disk.put([os.path.join(work, name) for name in ("isohead.conf", "start.sh", "rig.json")], "/")
    disk.put([os.path.join(shared.image, "slot.squashfs"), folder, os.path.join(work, "frames")], "/")
    return frames


def case_start(shared):
    """a zeroed slot is left by itself; records and laser; the power fails in an update"""
    disk, work = card(shared, "start")
    frames = fill(shared, disk, work)
    disk.zero("isohead-a")
    with PiBoard(disk, work) as board:
        expect(not board.wait_slot("a"), "a zeroed slot counts as whole")
        expect(board.wait_slot("b"), "slot B is damaged")
        back_s = board.now_s()
        # Not all: the slot is judged after some, and what is said of it then stands between a record's pieces.
        records = frames.records[:RECORDS]
        for index, wanted in enumerate(records):
            match = board.wait(r'(?m)^(\{"file":"%06d\.pgm".*\})\n' % index, START_S)
            if index == 0:
                record_s = board.now_s()
            expect(as_of_host(match[1]) == wanted, f"frame {index}:\nboard    {match[1]}\nhost_sim {wanted}")
        board.wait("slot b is good", START_S)
        expect(disk.state() == {"first": "a", "a_left": "0", "b_left": "good"}, f"state {disk.state()}")
        board.command("grep -q ' /data vfat ro,' /proc/mounts")
        board.command("! touch /usr/x")
        board.command("isohead-put /data/test/camera.json rig.json", START_S)
        board.command("isohead-put /data/test/camera.conf isohead.conf", START_S)
        expect(board.line_level(LASER) == 0, "the laser's line is high before anything may use it")
        board.command("killall isohead_board")
        board.wait_level(LASER, 1, START_S)
        board.wait(r'(?m)^\{"file":"\d+\.pgm".*"dots":\d+.*\}\n', START_S)
        board.command("killall -9 isohead_board")
        board.wait("the firmware ended with status 137", ANSWER_S)
        board.wait_level(LASER, 0, ANSWER_S)
        board.wait_level(LASER, 1, START_S)
        board.sockets["console"].sendall(b"\nisohead-update /data/slot.squashfs\n")
        board.wait("writing slot a on /dev/", START_S)
        board.read(1)
    cut = disk.state()
    expect(cut == {"first": "b", "a_left": "0", "b_left": "good"}, f"state after the power failed in an update: {cut}")
    with PiBoard(disk, work) as board:
        expect(board.wait_slot("b"), "slot B is damaged after the power failed in an update of A")
        board.wait_level(LASER, 1, START_S)
    return (f"power-on to slot B, after A was found damaged, {back_s:.0f} s, to the first record {record_s:.0f} s; "
            f"{len(records)} records identical to host_sim's")


CASES = [case_choice, case_loader, case_start]


def main():
    parser = argparse.ArgumentParser()
    for name in ["image", "frames", "host-sim", "work"]:
        parser.add_argument("--" + name, required=True, type=os.path.abspath)
    parser.add_argument("case", nargs="*")
    shared = parser.parse_args()
    os.makedirs(shared.work, exist_ok=True)
    failures = 0
    for case in CASES:
        if shared.case and case.__name__[len("case_"):] not in shared.case:
            continue
        begin, good = time.monotonic(), True
        try:
            text = case(shared)
        except (Wrong, subprocess.CalledProcessError) as error:
            good, text = False, f"{error} {getattr(error, 'output', '')}"
        failures += not good
        print(f"{'ok  ' if good else 'FAIL'} {time.monotonic() - begin:6.1f} s  {case.__doc__}\n{'':15}{text}", flush=True)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
