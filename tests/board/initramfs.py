"""The board's root file system: an archive that the kernel unpacks into memory."""

import os
import re
import subprocess

READELF = "aarch64-linux-gnu-readelf"
# Where the cross compiler's own libc lies; the sysroot comes first.
CROSS_LIBC = "/usr/aarch64-linux-gnu/lib"
LIBRARY_DIRS = ["usr/lib/aarch64-linux-gnu", "lib/aarch64-linux-gnu", "usr/lib", "lib"]


def needed_libraries(program, sysroot):
    """All shared libraries that an arm64 program loads: {name: path on this machine}."""
    places = [os.path.join(sysroot, place) for place in LIBRARY_DIRS] + [CROSS_LIBC]
    found, waiting = {}, [program]
    while waiting:
        path = waiting.pop()
        text = subprocess.run([READELF, "--dynamic", "--program-headers", "--wide", path],
                              check=True, stdout=subprocess.PIPE, text=True).stdout
        names = re.findall(r"\(NEEDED\).*\[(.*)\]", text)
        names += [os.path.basename(name) for name in
                  re.findall(r"Requesting program interpreter: (.*)\]", text)]
        for name in names:
            if name in found:
                continue
            candidates = [os.path.join(place, name) for place in places]
            here = [candidate for candidate in candidates if os.path.exists(candidate)]
            if not here:
                raise FileNotFoundError(f"{path} needs {name}, which is not in {', '.join(places)}")
            found[name] = here[0]
            waiting.append(here[0])
    return found


class Archive:
    """A cpio archive in the kernel's "newc" format; folders are added as needed."""

    def __init__(self):
        self.entries = {}

    def add(self, name, content, mode):
        folder = os.path.dirname(name)
        if folder and folder not in self.entries:
            self.add(folder, b"", 0o040755)
        self.entries[name] = (content, mode)

    def add_file(self, name, path):
        with open(path, "rb") as file:
            mode = 0o100755 if os.access(path, os.X_OK) else 0o100644
            self.add(name, file.read(), mode)

    def add_tree(self, root):
        for folder, _, names in os.walk(root):
            for name in names:
                path = os.path.join(folder, name)
                self.add_file(os.path.relpath(path, root), path)

    def write(self, path):
        with open(path, "wb") as file:
            number = 0
            for name, (content, mode) in [*self.entries.items(), ("TRAILER!!!", (b"", 0))]:
                number += 1
                fields = [number, mode, 0, 0, 1, 0, len(content), 0, 0, 0, 0, len(name) + 1, 0]
                head = b"070701" + b"".join(b"%08X" % field for field in fields)
                head += name.encode() + b"\0"
                file.write(head + bytes(-len(head) % 4) + content + bytes(-len(content) % 4))


def build(out, root, programs, sysroot, tools, files):
    """root: what get.sh has made; tools: our own helpers, linked statically; programs, files: {name
    on the board: path}."""
    here = os.path.dirname(os.path.abspath(__file__))
    archive = Archive()
    archive.add_tree(root)
    archive.add_file("init", os.path.join(here, "init"))
    for path in tools:
        archive.add_file("bin/" + os.path.basename(path), path)
    for program in programs.values():
        for name, path in needed_libraries(program, sysroot).items():
            folder = "lib" if name.startswith("ld-linux") else "lib/aarch64-linux-gnu"
            archive.add_file(f"{folder}/{name}", path)
    for name, path in {**programs, **files}.items():
        archive.add_file(name, path)
    archive.write(out)
