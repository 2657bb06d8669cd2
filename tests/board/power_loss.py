#!/usr/bin/env python3
"""Power cuts, writes that fail and full disks while the image's scripts write: one slot always starts, and a file of
the data partition is the old one or the new one.

power_loss.py [--trials COUNT] [--work DIR]      exit status 1 if something is wrong

The scripts themselves run (isohead-update, isohead-put, the rename of a slot that proved good), in a tree of files in
place of the disk; their paths are rewritten, and mount does nothing. torn.c notes each operation on the way to the disk,
and lets the one that was chosen fail.

What a disk holds after a power cut is a model, stricter than a FAT driver: of the operations since the last sync each
may have reached the disk or not, whatever the order; of a write each sector of 512 bytes by itself; a rename leaves the
old name, the new one, both or, between two folders, neither. Boot loader and initramfs are modelled as
tools/image/initramfs/init and systemd-boot do it.
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

HERE = os.path.dirname(os.path.abspath(__file__))
IMAGE = os.path.join(HERE, "..", "..", "tools", "image", "root", "usr")
# Folders of the tree that are the disk.
DISK = ("dev/", "run/esp/", "data/")
SECTOR = 512
ROOM_SECTORS = 64
SLOT_BYTES = {1: 9000, 2: 11111, 3: 10240}
FILE = {"old": b"duty = 20\n" * 90 + b"interlock-line = 5\n", "new": b"duty = 10\n" * 300 + b"interlock-line = 6\n"}

# What squashfs' driver and busybox do for the scripts. A slot's kernel says which slot it is of.
MOUNT = """#!/bin/sh
[ "$2" = squashfs ] || exit 0
shift 4
mkdir -p "$2/boot"
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


def entry(name, version, slot):
    return (f"title isohead, slot {name}\nsort-key isohead\nversion {version}\nlinux /{name}/linux\n"
            f"initrd /{name}/initrd\noptions isohead.slot={name} isohead.bytes={len(slot)} "
            f"isohead.sha256={digest_of(slot)} panic=5 loglevel=4\n").encode()


def fresh_disk(b_entry="slot-b.conf"):
    """Slot a runs and is good, version 2; slot b has version 1."""
    a, b = slot_file(2), slot_file(1)
    disk = {"dev/a-slot": a.ljust(ROOM_SECTORS * SECTOR, b"\xff"), "dev/b-slot": b.ljust(ROOM_SECTORS * SECTOR, b"\xff"),
            "run/esp/loader/entries/slot-a.conf": entry("a", 2, a), "run/esp/loader/entries/" + b_entry: entry("b", 1, b),
            "data/isohead.conf": FILE["old"]}
    for name, slot in (("a", a), ("b", b)):
        for part in ("linux", "initrd"):
            disk[f"run/esp/{name}/{part}"] = boot_file(part, slot)
    return disk


# --- running a script ---

class Tree:
    """A folder that stands for the board's file system."""

    def __init__(self, work, shim):
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
        for name in ("a", "b", "esp"):
            device = f"sys/class/block/{name}-slot/"
            self._put(device + "uevent", b"PARTNAME=isohead-%s\n" % name.encode())
            self._put(device + "size", b"%d\n" % ROOM_SECTORS)
        self._put("run/slot", b"a\n")
        for name in ("sbin/isohead-update", "sbin/isohead-put", "lib/isohead/slots"):
            with open(os.path.join(IMAGE, name), encoding="ascii") as file:
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
                              timeout=60, check=False)
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
    """The sectors that reach the disk; the file is as long as the last of them says."""
    old = disk[name]
    for start in range(0, len(content), SECTOR):
        if keeps():
            piece = content[start:start + SECTOR]
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


# --- a start ---

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
        known = [slot_file(version) for version in SLOT_BYTES]
        has_kernel = any(all(disk.get(f"run/esp/{name}/{part}") == boot_file(part, slot) for part in ("linux", "initrd"))
                         for slot in known)
        if not has_kernel:
            if left:
                continue
            return None, f"{path} has no whole kernel, and no starts are counted"
        content = disk[f"dev/{name}-slot"][:int(options.get("bytes", "0"))]
        if digest_of(content) == options.get("sha256"):
            return name, start
        for other in [other for other in disk if other.startswith(f"run/esp/loader/entries/slot-{name}")][:1]:
            disk[f"run/esp/loader/entries/slot-{name}+0-1.conf"] = disk.pop(other)
    return None, "it starts again and again"


# --- what is tried ---

UPDATE = "sh ROOT/usr/sbin/isohead-update ROOT/stick/3"
PUT = "sh ROOT/usr/sbin/isohead-put ROOT/stick/isohead.conf"
GOOD = ". ROOT/usr/lib/isohead/slots; rename_entry b ''"

failures = []


def check(condition, text):
    if not condition:
        failures.append(text)
        print("FAIL", text, flush=True)


def check_disk(disk, what):
    slot, why = boot(disk)
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
    check_disk(tree.content(), name)
    generator = random.Random(seed)
    for index in range(count):
        at = index % (len(operations) + 1)
        slot = check_disk(after_cut(disk, operations, at, generator), f"{name}, cut {index} behind operation {at}")
        Sums.trials += 1
        Sums.slots[slot] = Sums.slots.get(slot, 0) + 1
    for how in ("EIO", "ENOSPC", "CUT") if with_faults else ():
        for at in range(1, len(operations) + 1):
            tree.fill(disk)
            status, _, text = tree.run(script, at, how)
            after = tree.content()
            what = f"{name}, {how} at operation {at}"
            check_disk(after, what)
            check(status != 0 or done(after), f"{what}: status 0, and not done: {text}")
            Sums.faults += 1
            status, _, text = tree.run(script)
            check(status == 0 and done(tree.content()), f"{what}, and then again: status {status}: {text}")
    return len(operations)


def notices(tree):
    """Scripts that are wrong are noticed: an entry without a count that may be there before its kernel is, and a file
    that is written in place."""
    disk = fresh_disk()
    for script, changes in ((UPDATE, [("sync\n", ":\n"), ("+$TRIES.conf", ".conf")]),
                            (PUT, [("new=/data/$name.new", "new=/data/$name"), ('mv -f "$new"', 'true "$new"')])):
        tree.fill(disk, changes)
        _, operations, _ = tree.run(script)
        generator = random.Random(1)
        bad = 0
        for index in range(3000):
            after = after_cut(disk, operations, index % (len(operations) + 1), generator)
            bad += boot(after)[0] is None or after.get("data/isohead.conf") not in FILE.values()
        check(bad > 0, f"{changes}: not noticed")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--trials", type=int, default=600)
    parser.add_argument("--work")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=arguments.work) as work:
        shim = os.path.join(work, "torn.so")
        subprocess.run(["cc", "-std=c11", "-shared", "-fPIC", "-O1", "-Wall", "-Wextra", "-Werror", "-o", shim,
                        os.path.join(HERE, "torn.c")], check=True)
        tree = Tree(work, shim)
        notices(tree)
        new = slot_file(3)

        def updated(disk):
            return (disk.get("run/esp/loader/entries/slot-b+3.conf") == entry("b", 3, new) and
                    disk["dev/b-slot"].startswith(new) and boot(disk) == ("b", 1))

        for seed, name in enumerate(("slot-b.conf", "slot-b+0-3.conf", "slot-b+2-1.conf"), 1):
            count = try_script(tree, f"update beside {name}", UPDATE, fresh_disk(name), updated, arguments.trials, seed, seed == 1)
            print(f"update beside {name}: {count} operations")
        trial = fresh_disk("slot-b+2-1.conf")
        count = try_script(tree, "proved good", GOOD, trial,
                           lambda disk: "run/esp/loader/entries/slot-b.conf" in disk, arguments.trials, 4)
        print(f"proved good: {count} operations")
        count = try_script(tree, "settings", PUT, fresh_disk(), lambda disk: disk["data/isohead.conf"] == FILE["new"],
                           arguments.trials, 5)
        print(f"settings: {count} operations")
    slots = ", ".join(f"{slot}: {count}" for slot, count in sorted(Sums.slots.items(), key=str))
    print(f"power cuts: {Sums.trials}, then started {slots}; operations that failed or were the last: {Sums.faults}; "
          f"{len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
