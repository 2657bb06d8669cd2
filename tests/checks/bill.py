#!/usr/bin/env python3
"""Does tools/board/bill.py list each file that is packed, with its hash, and each package that brought one? With small
packages made here.

bill.py      exit status 1 if not
"""

import gzip
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

BILL = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools", "board", "bill.py")
SERIAL = r"urn:uuid:[0-9a-f]{8}-[0-9a-f]{4}-[1-5][0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}"

failures = []


def check(condition, text):
    if not condition:
        failures.append(text)
        print("FAIL", text)


def digest(content):
    return hashlib.sha256(content).hexdigest()


def write(path, content):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as file:
        file.write(content)


def make_deb(work, name, version, files, depends=""):
    """NAME:arm64.deb below debs."""
    tree = os.path.join(work, "tree-" + name)
    for path, content in files.items():
        write(tree + path, content)
    control = (f"Package: {name}\nVersion: {version}\nArchitecture: arm64\nMaintainer: nobody <x@y.invalid>\n"
               f"{'Depends: ' + depends + chr(10) if depends else ''}Description: a test\n")
    write(os.path.join(tree, "DEBIAN", "control"), control.encode())
    os.makedirs(os.path.join(work, "debs"), exist_ok=True)
    deb = os.path.join(work, "debs", name + ":arm64.deb")
    subprocess.run(["dpkg-deb", "--root-owner-group", "--build", tree, deb], check=True, stdout=subprocess.DEVNULL)
    return deb


def bill(*arguments):
    environment = {**os.environ, "SOURCE_DATE_EPOCH": "86400"}
    runs = [subprocess.run(["/usr/bin/python3", "-B", BILL, *arguments], check=True, env=environment, stdout=subprocess.PIPE).stdout
            for _ in range(2)]
    check(runs[0] == runs[1], "two runs, two bills")
    document = json.loads(runs[0])
    check(document["bomFormat"] == "CycloneDX" and document["specVersion"] == "1.5", "no CycloneDX 1.5")
    check(re.fullmatch(SERIAL, document["serialNumber"]), f"serial number {document['serialNumber']}")
    check(document["metadata"]["timestamp"] == "1970-01-02T00:00:00Z", "another time")
    return {component["name"]: component for component in document["components"]}


def hash_of(component):
    return component["hashes"][0]["content"]


def main():
    if shutil.which("dpkg-deb") is None:
        print("bill: no dpkg-deb here, so that no packages are packed either")
        return 0
    with tempfile.TemporaryDirectory() as work:
        debs = os.path.join(work, "debs")
        library = make_deb(work, "libone1", "1:2.3+b4-5", {"/usr/lib/libone.so.1": b"one"})
        make_deb(work, "libtwo2", "2", {"/usr/lib/libtwo.so.2": b"two"})
        ours = make_deb(work, "isohead", "0.1", {"/usr/bin/x": b"x", "/etc/x.conf": b"c"}, "libone1 (>= 2), adduser")

        found = bill("deb", ours, debs)
        check(set(found) == {"/usr/bin/x", "/etc/x.conf", "libone1", "adduser"}, f"of a package: {sorted(found)}")
        check(hash_of(found["/usr/bin/x"]) == digest(b"x"), "hash of a packed file")
        with open(library, "rb") as file:
            check(hash_of(found["libone1"]) == digest(file.read()), "hash of what it depends on")
        check(found["libone1"]["version"] == "1:2.3+b4-5", "version of what it depends on")

        root, initramfs, boot = [os.path.join(work, name) for name in ("root", "initramfs", "boot")]
        write(os.path.join(root, "usr/lib/elsewhere/libone.so.1"), b"one")
        write(os.path.join(root, "etc/passwd"), b"p")
        write(os.path.join(initramfs, "init"), b"i")
        write(os.path.join(boot, "initrd"), b"r")
        write(os.path.join(boot, "linux"), gzip.compress(b"kernel"))
        make_deb(work, "linux3", "3", {"/boot/vmlinuz": b"kernel"})
        os.symlink("init", os.path.join(initramfs, "link"))
        found = bill("image", root, initramfs, boot, debs, "libone1:arm64", "libtwo2:arm64", "linux3:arm64", "pkg:pypi/four@4.1")
        check(set(found) == {"libone1", "linux3", "four", "slot/etc/passwd", "initramfs/init", "boot/initrd"}, f"of an image: {sorted(found)}")
        check(found["four"]["version"] == "4.1" and found["four"]["purl"] == "pkg:pypi/four@4.1", "a library in the program")
        check(hash_of(found["slot/etc/passwd"]) == digest(b"p"), "hash of a file of ours")
    print(f"bill: {len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
