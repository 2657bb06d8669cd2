#!/usr/bin/env python3
"""Power cuts, writes that fail and full disks while the image's scripts write: one slot always starts, and a file of
the data partition is the old one or the new one.

power_loss.py [--trials COUNT] [--work DIR]      exit status 1 if something is wrong

The scripts themselves run (isohead-update, isohead-put, the note that a slot proved good), those of each kind of board,
in a tree of files in place of the disk; their paths are rewritten, and mount does nothing. torn.c notes each operation on the way to the disk,
and lets the one that was chosen fail.

What a disk holds after a power cut is a model, stricter than a FAT driver: of the operations since the last sync each
may have reached the disk or not, whatever the order; of a write each sector of 512 bytes by itself; a rename leaves the
old name, the new one, both or, between two folders, neither. Boot loader and initramfs are modelled as
tools/image/initramfs/init, systemd-boot and tools/image/rpi/uboot.env do it.
"""

import argparse
import functools
import hashlib
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import zlib

HERE = os.path.dirname(os.path.abspath(__file__))
IMAGE = os.path.join(HERE, "..", "..", "tools", "image")
SCRIPTS = {"sbin/isohead-update": "root/usr/sbin/isohead-update", "sbin/isohead-put": "root/usr/sbin/isohead-put",
           "lib/isohead/slots": "root/usr/lib/isohead/slots"}
# Folders of the tree that are the disk.
DISK = ("dev/", "run/esp/", "data/")
SECTOR = 512
PIECE = 64
ROOM_SECTORS = 64
SLOT_DEVICES = {"a": "dev/sd2", "b": "dev/sd3"}
PARTITIONS = {"sd1": "esp", "sd2": "a", "sd3": "b"}
SLOT_BYTES = {1: 9000, 2: 11111, 3: 10240}
FILE = {"old": b"duty = 20\n" * 90 + b"interlock-line = 5\n", "new": b"duty = 10\n" * 300 + b"interlock-line = 6\n"}

# What squashfs' driver and busybox do for the scripts. A slot's kernel says which slot it is of.
MOUNT = """#!/bin/sh
[ "$2" = squashfs ] || exit 0
shift 4
mkdir -p "$2/boot" "$2/usr/lib/isohead"
cp "$2/../../usr/lib/isohead/boot" "$2/usr/lib/isohead/"
bytes=$(sed -n 's/^hsqs \\([0-9]*\\) .*/\\1/p' "$1" | head -n 1)
digest=$(head -c "$bytes" "$1" | sha256sum | cut -d ' ' -f 1)
for part in linux initrd; do
    for i in 1 2 3 4 5 6 7 8 9 10 11 12; do echo "$part $i of $digest"; done >"$2/boot/$part"
done
"""


@functools.lru_cache(maxsize=None)
def slot_file(version):
    """A slot that starts as a squashfs does, and says how long it is."""
    generator = random.Random(version)
    head = b"hsqs %d \n" % SLOT_BYTES[version]
    return head + bytes(generator.choices(b"0123456789abcdef", k=SLOT_BYTES[version] - len(head)))


def digest_of(content):
    return hashlib.sha256(content).hexdigest()


@functools.lru_cache(maxsize=None)
def boot_file(part, slot):
    return "".join(f"{part} {i} of {digest_of(slot)}\n" for i in range(1, 13)).encode()


def common_disk():
    """What both kinds of board have: slot a runs, slot b has another version."""
    disk = {"data/isohead.conf": FILE["old"]}
    for name, version in (("a", 2), ("b", 1)):
        slot = slot_file(version)
        disk[SLOT_DEVICES[name]] = slot.ljust(ROOM_SECTORS * SECTOR, b"\xff")
        for part in ("linux", "initrd"):
            disk[f"run/esp/{name}/{part}"] = boot_file(part, slot)
    return disk


def has_kernel(disk, name):
    return any(all(disk.get(f"run/esp/{name}/{part}") == boot_file(part, slot_file(version)) for part in ("linux", "initrd"))
               for version in SLOT_BYTES)


class Uefi:
    """systemd-boot and its entries."""

    name = "uefi"
    b_states = ("slot-b.conf", "slot-b+0-3.conf", "slot-b+2-1.conf")
    trial = "slot-b+2-1.conf"
    # what is wrong: an entry without a count that may be there before its kernel is
    wrong_update = [("sync\n", ":\n"), ("sync && mv", "mv"), ("+$TRIES.conf", ".conf")]

    @staticmethod
    def entry(name, version, slot):
        return (f"title isohead, slot {name}\nsort-key isohead\nversion {version}\nlinux /{name}/linux\n"
                f"initrd /{name}/initrd\noptions isohead.slot={name} isohead.bytes={len(slot)} "
                f"isohead.sha256={digest_of(slot)} panic=5 loglevel=4\n").encode()

    def fresh_disk(self, b_state="slot-b.conf"):
        """Slot a is good, version 2; slot b has version 1."""
        return {**common_disk(), "run/esp/loader/entries/slot-a.conf": self.entry("a", 2, slot_file(2)),
                "run/esp/loader/entries/" + b_state: self.entry("b", 1, slot_file(1))}

    def is_updated(self, disk):
        return disk.get("run/esp/loader/entries/slot-b+3.conf") == self.entry("b", 3, slot_file(3))

    @staticmethod
    def is_good(disk):
        return "run/esp/loader/entries/slot-b.conf" in disk

    @staticmethod
    def boot(disk):
        """Which slot starts, after how many starts; (None, why) for none."""
        disk = dict(disk)
        for start in range(1, 12):
            entries = []
            for path in disk:
                match = re.fullmatch(r"run/esp/loader/entries/slot-(.)(\+(\d+)(-(\d+))?)?\.conf", path)
                if match:
                    text = disk[path].decode("ascii", "replace")
                    version = int((re.findall(r"(?m)^version (\d+)$", text) or ["0"])[0])
                    left = None if match[2] is None else int(match[3])
                    entries.append(((left != 0, version, path), path, match, left, text))
            if not entries:
                return None, "no entry"
            _, path, match, left, text = max(entries)
            options = dict(re.findall(r"isohead\.(\w+)=(\w+)", text))
            name = options.get("slot", "?")
            if left:
                tried = int(match[5] or 0) + 1
                disk[f"run/esp/loader/entries/slot-{match[1]}+{left - 1}-{tried}.conf"] = disk.pop(path)
            if not has_kernel(disk, name):
                if left:
                    continue
                return None, f"{path} has no whole kernel, and no starts are counted"
            content = disk[SLOT_DEVICES[name]][:int(options.get("bytes", "0"))]
            if digest_of(content) == options.get("sha256"):
                return name, start
            for other in [other for other in disk if other.startswith(f"run/esp/loader/entries/slot-{name}")][:1]:
                disk[f"run/esp/loader/entries/slot-{name}+0-1.conf"] = disk.pop(other)
        return None, "it starts again and again"


class Rpi:
    """U-Boot and its two sectors."""

    name = "rpi"
    b_states = ("good", "0", "2")
    trial = "2"
    # what is wrong: one sector may be half written when the other one is
    wrong_update = [("        sync\n", "        :\n")]

    @staticmethod
    def sector(settings):
        body = "".join(f"{key}={value}\0" for key, value in sorted(settings.items())).encode().ljust(SECTOR - 4, b"\0")
        return zlib.crc32(body).to_bytes(4, "little") + body

    @staticmethod
    def state(disk):
        """Of the first sector that is whole; nothing when none is."""
        for number in (1, 9):
            sector = disk["dev/sd"][number * SECTOR:(number + 1) * SECTOR]
            if zlib.crc32(sector[4:]) == int.from_bytes(sector[:4], "little"):
                return dict(word.split("=", 1) for word in sector[4:].decode().split("\0") if word)
        return {}

    def settings(self, first, b_left, b_version):
        a, b = slot_file(2), slot_file(b_version)
        return {"first": first, "a_left": "good", "a_bytes": len(a), "a_sha256": digest_of(a),
                "b_left": b_left, "b_bytes": len(b), "b_sha256": digest_of(b)}

    def fresh_disk(self, b_state="good"):
        sector = self.sector(self.settings("a", b_state, 1))
        head = bytearray(10 * SECTOR)
        for number in (1, 9):
            head[number * SECTOR:(number + 1) * SECTOR] = sector
        return {**common_disk(), "dev/sd": bytes(head)}

    def is_updated(self, disk):
        wanted = self.sector(self.settings("b", "3", 3))
        return all(disk["dev/sd"][number * SECTOR:(number + 1) * SECTOR] == wanted for number in (1, 9))

    def is_good(self, disk):
        return self.state(disk).get("b_left") == "good"

    def boot(self, disk):
        """Which slot starts, after how many starts; (None, why) for none."""
        state = self.state(disk)
        if not state:
            return None, "no state is whole"
        for start in range(1, 12):
            order = [state["first"], "ba"["ab".index(state["first"])]]
            for name in [name for name in order if state[name + "_left"] != "0"] + order[::-1]:
                if state[name + "_left"] not in ("good", "0"):
                    state[name + "_left"] = str(int(state[name + "_left"]) - 1)
                if has_kernel(disk, name):
                    break
            else:
                return None, "no slot has a whole kernel"
            if digest_of(disk[SLOT_DEVICES[name]][:int(state[name + "_bytes"])]) == state[name + "_sha256"]:
                return name, start
            state[name + "_left"] = "0"
        return None, "it starts again and again"


# --- running a script ---

class Tree:
    """A folder that stands for the board's file system."""

    def __init__(self, work, shim, board):
        self.board = board
        self.root = os.path.join(work, "board")
        self.work, self.shim = work, shim
        self.journal = os.path.join(work, "journal")
        self.bin = os.path.join(work, "bin")
        os.makedirs(self.bin, exist_ok=True)
        for name, text in (("mount", MOUNT), ("umount", "#!/bin/sh\nexit 0\n")):
            path = os.path.join(self.bin, name)
            with open(path, "w", encoding="ascii") as file:
                file.write(text)
            os.chmod(path, 0o755)

    def _put(self, name, content):
        path = os.path.join(self.root, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(content)

    def fill(self, disk, changes=()):
        """The disk, and the scripts with these changes."""
        shutil.rmtree(self.root, ignore_errors=True)
        for name, content in disk.items():
            self._put(name, content)
        for folder in ("run/esp/loader/entries", "run/esp/a", "run/esp/b", "data", "proc/sys/vm", "run/new"):
            os.makedirs(os.path.join(self.root, folder), exist_ok=True)
        for number, (device, name) in enumerate(PARTITIONS.items(), 1):
            device = f"sys/class/block/{device}/"
            self._put(device + "uevent", b"PARTNAME=isohead-%s\n" % name.encode())
            self._put(device + "size", b"%d\n" % ROOM_SECTORS)
            self._put(device + "partition", b"%d\n" % number)
        self._put("run/slot", b"a\n")
        if self.board.name == "rpi":
            self._put("sys/class/block/sd/size", b"10\n")
            self._put("run/disk", b"sd\n")
        for name, source in {**SCRIPTS, "lib/isohead/boot": self.board.name + "/boot"}.items():
            with open(os.path.join(IMAGE, source), encoding="ascii") as file:
                text = file.read()
            for before, after in changes:
                text = text.replace(before, after)
            text = re.sub(r"(?<![\w}\"$])/(usr/lib/isohead|run|sys|proc|data|dev(?!/null|/kmsg))\b", self.root + r"/\1", text)
            text = re.sub(r'"/(run|sys|proc|data|dev)/', f'"{self.root}/' + r"\1/", text)
            self._put("usr/" + name, text.replace("/dev/kmsg", "/dev/null").encode())
        for version in SLOT_BYTES:
            self._put(f"stick/{version}", slot_file(version))
        self._put("stick/isohead.conf", FILE["new"])

    def run(self, script, at=0, how=""):
        """Its exit status, and the operations that it did."""
        for suffix in ("", ".count"):
            with open(self.journal + suffix, "wb"):
                pass
        environment = {"PATH": self.bin + ":" + os.environ["PATH"], "LC_ALL": "C", "LD_PRELOAD": self.shim,
                       "TORN_JOURNAL": self.journal, "TORN_AT": str(at), "TORN_HOW": how, 
                       "TORN_BELOW": ":".join(os.path.join(self.root, folder) for folder in DISK)}
        done = subprocess.run(["sh", "-c", script.replace("ROOT", self.root)], env=environment, capture_output=True, text=True,
                              timeout=600, check=False)
        return done.returncode, self.operations(), done.stdout + done.stderr

    def operations(self):
        operations = []
        with open(self.journal, encoding="ascii") as file:
            for line in file:
                what, *words = line.rstrip("\n").split("\t")
                words = [os.path.relpath(word, self.root) if word.startswith("/") else word for word in words]
                operations.append((what, *words))
        return operations

    def content(self):
        """What is on the disk when nothing is left to be written."""
        disk = {}
        for folder, _, names in os.walk(self.root):
            for name in names:
                path = os.path.join(folder, name)
                short = os.path.relpath(path, self.root)
                if is_disk(short):
                    with open(path, "rb") as file:
                        disk[short] = file.read()
        return disk


def is_disk(name):
    return name.startswith(DISK)


# --- a power cut ---

def write_sectors(disk, name, offset, content, keeps):
    """The sectors that reach the disk, of those outside of all file systems pieces; the file is as long as the last of
    them says."""
    old = disk[name]
    unit = PIECE if name == "dev/sd" else SECTOR
    for start in range(0, len(content), unit):
        if keeps():
            piece = content[start:start + unit]
            place = offset + start
            old = old.ljust(place, b"\0")
            old = old[:place] + piece + old[place + len(piece):]
    disk[name] = old


def apply(disk, operation, keeps):
    what, words = operation[0], operation[1:]
    if what == "write" and words[0] in disk:
        write_sectors(disk, words[0], int(words[1]), bytes.fromhex(words[2]), keeps)
    elif what == "create" and keeps():
        disk.setdefault(words[0], b"")
    elif what == "truncate" and words[0] in disk and keeps():
        disk[words[0]] = b""
    elif what == "remove" and keeps():
        disk.pop(words[0], None)
    elif what == "rename" and words[0] in disk:
        content = disk[words[0]]
        has_new, has_old = keeps(), not keeps()
        same_folder = os.path.dirname(words[0]) == os.path.dirname(words[1])
        if has_new:
            disk[words[1]] = content
        if not has_old and (has_new or not same_folder):
            del disk[words[0]]


def after_cut(disk, operations, at, generator):
    """The disk when the power fails behind so many operations."""
    disk = dict(disk)
    synced = max((i + 1 for i in range(at) if operations[i][0] == "sync"), default=0)
    for operation in operations[:synced]:
        apply(disk, operation, lambda: True)
    chance = generator.choice([0.0, 0.2, 0.5, 0.8, 1.0])
    for operation in operations[synced:at]:
        apply(disk, operation, lambda: generator.random() < chance)
    return disk


# --- what is tried ---

UPDATE = "sh ROOT/usr/sbin/isohead-update ROOT/stick/3"
PUT = "sh ROOT/usr/sbin/isohead-put ROOT/stick/isohead.conf"
GOOD = ". ROOT/usr/lib/isohead/slots; slot_judge b good"

failures = []


def check(condition, text):
    if not condition:
        failures.append(text)
        print("FAIL", text, flush=True)


def check_disk(board, disk, what):
    slot, why = board.boot(disk)
    check(slot is not None, f"{what}: no slot starts: {why}")
    check(disk.get("data/isohead.conf") in FILE.values(), f"{what}: isohead.conf is neither the old one nor the new one")
    return slot


class Sums:
    trials = 0
    faults = 0
    slots = {}


def try_script(tree, name, script, disk, done, count, seed, with_faults=True):
    """Power cuts behind every operation of a script, and every fault; done(disk): has it done its work?"""
    tree.fill(disk)
    status, operations, text = tree.run(script)
    check(status == 0 and done(tree.content()), f"{name}: status {status}: {text}")
    check(len(operations) > 1, f"{name}: {len(operations)} operations")
    check_disk(tree.board, tree.content(), name)
    generator = random.Random(seed)
    for index in range(count):
        at = index % (len(operations) + 1)
        slot = check_disk(tree.board, after_cut(disk, operations, at, generator), f"{name}, cut {index} behind operation {at}")
        Sums.trials += 1
        Sums.slots[slot] = Sums.slots.get(slot, 0) + 1
    for how in ("EIO", "ENOSPC", "CUT") if with_faults else ():
        for at in range(1, len(operations) + 1):
            tree.fill(disk)
            status, _, text = tree.run(script, at, how)
            after = tree.content()
            what = f"{name}, {how} at operation {at}"
            check_disk(tree.board, after, what)
            check(status != 0 or done(after), f"{what}: status 0, and not done: {text}")
            Sums.faults += 1
            status, _, text = tree.run(script)
            check(status == 0 and done(tree.content()), f"{what}, and then again: status {status}: {text}")
    return len(operations)


def notices(tree):
    """Scripts that are wrong are noticed: an update as the board says, and a file that is written in place."""
    disk = tree.board.fresh_disk()
    for script, changes in ((UPDATE, tree.board.wrong_update),
                            (PUT, [("new=/data/$name.new", "new=/data/$name"), ('mv -f "$new"', 'true "$new"')])):
        tree.fill(disk, changes)
        _, operations, _ = tree.run(script)
        generator = random.Random(1)
        bad = 0
        for index in range(3000):
            after = after_cut(disk, operations, index % (len(operations) + 1), generator)
            bad += tree.board.boot(after)[0] is None or after.get("data/isohead.conf") not in FILE.values()
        check(bad > 0, f"{changes}: not noticed")


def try_board(tree, trials):
    """What each script of it does in its states."""
    board = tree.board
    notices(tree)

    def updated(disk):
        return (board.is_updated(disk) and disk[SLOT_DEVICES["b"]].startswith(slot_file(3)) and
                board.boot(disk) == ("b", 1))

    for seed, state in enumerate(board.b_states, 1):
        count = try_script(tree, f"{board.name}, update beside {state}", UPDATE, board.fresh_disk(state), updated, trials, seed,
                           seed == 1)
        print(f"{board.name}, update beside {state}: {count} operations")
    count = try_script(tree, f"{board.name}, proved good", GOOD, board.fresh_disk(board.trial), board.is_good, trials, 4)
    print(f"{board.name}, proved good: {count} operations")
    count = try_script(tree, f"{board.name}, settings", PUT, board.fresh_disk(),
                       lambda disk: disk["data/isohead.conf"] == FILE["new"], trials, 5)
    print(f"{board.name}, settings: {count} operations")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--trials", type=int, default=600)
    parser.add_argument("--work")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=arguments.work) as work:
        shim = os.path.join(work, "torn.so")
        subprocess.run(["cc", "-std=c11", "-shared", "-fPIC", "-O1", "-Wall", "-Wextra", "-Werror", "-o", shim,
                        os.path.join(HERE, "torn.c")], check=True)
        for board in (Uefi(), Rpi()):
            try_board(Tree(os.path.join(work, board.name), shim, board), arguments.trials)
    slots = ", ".join(f"{slot}: {count}" for slot, count in sorted(Sums.slots.items(), key=str))
    print(f"power cuts: {Sums.trials}, then started {slots}; operations that failed or were the last: {Sums.faults}; "
          f"{len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
