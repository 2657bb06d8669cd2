#!/usr/bin/env python3
"""The image for a Raspberry Pi, on QEMU's Raspberry Pi 3: U-Boot from the image starts a slot and counts, the kernel and
the slot are the image's own, frames come from a directory and from the kernel's virtual camera, the laser's line is the processor's.

image_rpi.py --image DIR --frames DIR --host-sim FILE --work DIR [CASE...]

--image: what tools/image/image.sh has made; --frames: a rendered frames directory. QEMU has none of
Raspberry Pi's own firmware: firmware_choice() reads config.txt as that firmware is documented to do, and QEMU gets the
files that it names. Exit status 1 if a case fails.
"""

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import time
import zlib

from frames import as_of_host
from image import Board, Disk, FRAME_COUNT, Frames, Wrong, broken_slot, expect, run

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
START_S = 900
LASER = 17
GPLEV0 = 0x3F200034
TIMER_US = 0x3F003004  # two words: microseconds since power-on
# The frames of a directory, or a camera of vivid, for which alone the laser may be on.
DIRECTORY = """device = /data/frames
rate = 1
loop = on
output = serial:/dev/ttyAMA0
status = 0
"""
CAMERA = f"""device = /dev/video0
rate = 5
exposure = keep
gain = keep
laser-cap = 1000
gpio-chip = pinctrl-bcm2835
laser-line = {LASER}
laser-active-low = off
interlock-line = none
output = serial:/dev/ttyAMA0
status = 0
laser = on
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
        self.write_at(number * SECTOR, sector)


# --- the board ---


class PiBoard(Board):
    """QEMU's Raspberry Pi 3 with its SD card, its console, a line for records and QEMU's own monitor.

    Its time is a nanosecond per instruction, and none passes while it waits: no limit of the board's programs, such as
    the laser's, depends on how busy this machine is.
    Bluetooth is taken out of the device tree, as dtoverlay=disable-bt does: its serial line is the one for records. So is the
    watchdog, which fires in QEMU when it is started; it is what resets the processor, too, so the test does that when the kernel has tried to."""

    LINES = ("console", "records", "monitor")
    START_S = START_S
    resets = 0

    @staticmethod
    def machine(disk, work):
        names = disk.boot_files()
        kernel, tree = firmware_choice(read(disk.boot_file("config.txt", work)), "3", names.__contains__)
        tree = disk.boot_file(tree, work)
        run("fdtput", "-r", tree, "/soc/watchdog@7e100000", "/soc/serial@7e201000/bluetooth")
        return ["-M", "raspi3b", "-icount", "shift=0,sleep=off", "-drive", f"if=sd,format=raw,file={disk.path}",
                "-kernel", disk.boot_file(kernel, work), "-dtb", tree,
                # The console is the second line: the first is Bluetooth's.
                "-serial", "chardev:records", "-serial", "chardev:console", "-monitor", "chardev:monitor"]

    def read(self, limit_s):
        got = super().read(limit_s)
        resets = self.text["console"].count("reboot: Restarting system")
        if resets > self.resets:
            self.resets = resets
            self.sockets["monitor"].sendall(b"system_reset\n")
        return got

    def words(self, address, count):
        """Of the processor's memory, or of what is there instead of it."""
        self.sockets["monitor"].sendall(f"xp /{count}wx {address:#x}\n".encode())
        match = self.wait(r"(?m)^0*%x:((?: 0x[0-9a-f]{8}){%d})\n" % (address, count), START_S, "monitor")
        return [int(word, 16) for word in match[1].split()]

    def board_s(self):
        """Of the board's own time, since power-on."""
        low, high = self.words(TIMER_US, 2)
        return (high << 32 | low) / 1e6

    def wait_level(self, level):
        """Until the laser's GPIO line is at that level, as QEMU's processor has it."""
        end = time.monotonic() + START_S
        while self.words(GPLEV0, 1)[0] >> LASER & 1 != level:
            expect(time.monotonic() < end, f"the laser's line is not {level} within {START_S} s{self.ends()}")
            self.read(0.2)

    def record(self):
        """The next whole one."""
        return self.wait(r"(?m)^(\{.*\})\n", START_S, "records")[1]

    def records_of_host(self, frames):
        """All of a directory's frames, from the first; returns when the first came."""
        for index, wanted in enumerate(frames.records):
            found = as_of_host(self.record())
            if index == 0:
                first_s = self.board_s()
            expect(found == wanted, f"frame {index}:\nboard    {found}\nhost_sim {wanted}")
        return first_s


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


class Case:
    """A disk whose data partition has frames, a rig for them, settings, and what makes a camera of vivid."""

    def __init__(self, shared, name, camera=False):
        self.disk, self.work = card(shared, name)
        self.frames = Frames(shared.frames, os.path.join(self.work, "frames"), shared.host_sim)
        self.slot = os.path.join(shared.image, "slot.squashfs")
        folder = os.path.join(self.work, "test")
        os.makedirs(folder)
        rig = read(self.frames.rig)
        small = re.sub(r'("image_height":)\d+', r"\g<1>360", re.sub(r'("image_width":)\d+', r"\g<1>640", rig))
        for name, text in (("isohead.conf", CAMERA if camera else DIRECTORY), ("rig.json", small if camera else rig),
                           ("start.sh", "dmesg -n 1\n" + (vivid(shared.image, folder) if camera else "")), ("test/directory.conf", DIRECTORY)):
            with open(os.path.join(self.work, name), "w", encoding="ascii") as file:
                file.write(text)
        self.disk.put([os.path.join(self.work, name) for name in ("isohead.conf", "start.sh", "rig.json")], "/")
        self.disk.put([folder, os.path.join(self.work, "frames")], "/")

    def state_is(self, first, a_left, b_left):
        state = self.disk.state()
        expect(state == {"first": first, "a_left": a_left, "b_left": b_left}, f"state {state}")


def case_slots(shared):
    """a zeroed slot is left by itself, records; the power fails in an update; the update run again"""
    case = Case(shared, "slots")
    case.disk.put([case.slot], "/")
    case.disk.zero("isohead-a")
    with open(case.slot, "rb") as file:
        slot = file.read()
    # The processor is reset, with nothing else written, when half of the slot is on the card.
    cut = (f"isohead-update /data/slot.squashfs & "
           f"s() {{ set -- $(cat /sys/class/block/$(cat /run/disk)/stat); echo $7; }}; "
           f"n=$(($(s) + {len(slot) // SECTOR // 2})); until [ $(s) -ge $n ]; do :; done; echo b >/proc/sysrq-trigger")
    with PiBoard(case.disk, case.work) as board:
        expect(not board.wait_slot("a"), "a zeroed slot counts as whole")
        damaged_s = board.board_s()
        expect(board.wait_slot("b"), "slot B is damaged")
        back_s = board.board_s()
        first_s = board.records_of_host(case.frames)
        board.wait("slot b is good", START_S)
        case.state_is("a", "0", "good")
        board.command("grep -q ' /data vfat ro,' /proc/mounts", START_S)
        board.command("! touch /usr/x", START_S)
        board.sockets["console"].sendall(f"\n{cut}\n".encode())
        board.wait("writing slot a on /dev/", START_S)
        board.wait("sysrq: Resetting", START_S)
    case.state_is("b", "0", "good")
    written = case.disk.content("isohead-a", len(slot))
    expect(written != slot and written.strip(b"\0"), "the power failed when slot A was whole or empty")
    with PiBoard(case.disk, case.work) as board:
        expect(board.wait_slot("b"), "slot B is damaged after the power failed in an update of A")
        board.records_of_host(case.frames)
        board.command(f"isohead-update /data/slot.squashfs {hashlib.sha256(slot).hexdigest()}", START_S)
        board.command("reboot", START_S)
        expect(board.wait_slot("a"), "slot A is damaged after the update")
        board.wait("slot a is good", START_S)
        case.state_is("a", "good", "good")
    expect(case.disk.content("isohead-a", len(slot)) == slot, "slot A is not what the update held")
    return (f"of the board's time: A found damaged {damaged_s:.1f} s after power-on, B whole {back_s:.1f} s, first record {first_s:.1f} s; "
            f"{FRAME_COUNT} records identical to host_sim's")


def case_broken(shared):
    """the last start of a slot on trial whose firmware fails: the slot before is back"""
    case = Case(shared, "broken")
    path = broken_slot(shared.image, case.work)
    with open(path, "rb") as file:
        broken = file.read()
    case.disk.write("isohead-b", broken)
    state = {"first": "b", "a_left": "good", "b_left": "1", "b_bytes": len(broken), "b_sha256": hashlib.sha256(broken).hexdigest()}
    for number in STATE_SECTORS:
        case.disk.set_state(number, state)
    with PiBoard(case.disk, case.work) as board:
        expect(board.wait_slot("b"), "slot B is damaged")
        board.wait("slot b on trial: the firmware ended 3 times; starting again", START_S)
        case.state_is("b", "good", "0")
        bad_s = board.board_s()
        expect(board.wait_slot("a"), "slot A is damaged")
        first_s = board.records_of_host(case.frames) - bad_s
        case.state_is("b", "good", "0")
    return f"of the board's time: B given up {bad_s:.1f} s after power-on, first record of A {first_s:.1f} s later"


def case_laser(shared):
    """records of the kernel's camera with the laser on; the program is killed, and all that hold the line"""
    case = Case(shared, "laser", camera=True)
    with PiBoard(case.disk, case.work) as board:
        board.wait("isohead: starting slot a", START_S)
        expect(board.words(GPLEV0, 1)[0] >> LASER & 1 == 0, "the laser's line is high before anything may use it")
        expect(board.wait_slot("a"), "slot A is damaged")
        for index in range(FRAME_COUNT):
            record = board.record()
            expect('"dots":' in record, record)
            if index == 0:
                first_s = board.board_s()
        board.wait_level(1)
        board.wait("slot a is good", START_S)
        # The program alone: its guards make the line low. What would do it after them, and starts it again, stands still.
        board.command("for p in /proc/[0-9]*; do case $(cat $p/comm) in isohead_board) program=${p#/proc/} ;; esac; done; "
                      "keeper=$(awk '/^PPid/ {print $2}' /proc/$program/status); kill -STOP $keeper; kill -9 $program", START_S)
        board.wait_level(0)
        board.command("kill -CONT $keeper", START_S)
        board.wait("the firmware ended with status 137", START_S)
        board.wait_level(1)
        # The guards, too. The settings that it is started with next know of no laser.
        board.command("isohead-put /data/test/directory.conf isohead.conf", START_S)
        board.command("kill -STOP $keeper; killall -9 isohead_board", START_S)
        left = board.words(GPLEV0, 1)[0] >> LASER & 1
        board.command("kill -CONT $keeper", START_S)
        board.wait("the firmware ended with status 137", START_S)
        board.wait_level(0)
    return (f"of the board's time: first record {first_s:.1f} s after power-on; {FRAME_COUNT} records; "
            f"line {LASER} high, low by the guards, high again; without guards, {left} and then low by --laser-off")


CASES = [case_choice, case_loader, case_slots, case_broken, case_laser]


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
