"""A linked Cortex-M program: which object each address is of, what its code calls, what a function of the
C library or the compiler takes of the stack."""

import bisect
import re
import subprocess

from call_graph import Broken

PREFIX = "arm-none-eabi-"
REGISTER_BYTES = 4
INSTRUCTION = re.compile(r"^\s*([0-9a-f]+):\t(\S+)(?:\t([^;@]*))?")


def run(*command):
    return subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE).stdout


def registers(text):
    """How many of them {r4-r7, lr} are; objdump writes each one out."""
    return len(re.search(r"\{([^}]*)\}", text)[1].split(","))


def pushed(name, operands):
    """Bytes by which an instruction lowers the stack pointer; 0 for most."""
    name = name.removesuffix(".w").removesuffix(".n")
    if name == "push" or (name == "stmdb" and operands.startswith("sp!")):
        return REGISTER_BYTES * registers(operands)
    moved = re.search(r"\[sp, #-(\d+)\]!", operands) if name.startswith("str") else \
        re.fullmatch(r"sp, (?:sp, )?#(\d+)", operands.strip()) if name in ("sub", "subw") else None
    if not moved and re.match(r"sp\b", operands) and name not in ("add", "pop", "ldmia", "cmp", "addw"):
        raise Broken("calls: the stack pointer is changed by '%s %s'" % (name, operands))
    return int(moved[1]) if moved else 0


class Program:
    def __init__(self, path):
        self.path = path
        self.symbol = {}  # name: address; of two static functions with one name either
        self.name = {}    # address: name, a static one as FILE.c:NAME
        self._read_map()
        self._read_symbols()
        self._read_code()

    def _read_map(self):
        with open(self.path + ".map", encoding="utf-8") as file:
            text = file.read().partition("Linker script and memory map")[2]
        section = re.compile(r"^ (\.text|\.rodata)\S*\s+0x([0-9a-f]+)\s+0x([0-9a-f]+)\s+(\S+)$", re.M)
        self.sections = sorted((int(at, 16), int(size, 16), kind, path)
                               for kind, at, size, path in section.findall(text) if int(size, 16))
        self.starts = [at for at, _, _, _ in self.sections]

    def object_of(self, address):
        """PATH/ARCHIVE.a(FILE.c.obj) or PATH/FILE.c.obj; None outside of all."""
        i = bisect.bisect_right(self.starts, address) - 1
        if i < 0 or address >= self.sections[i][0] + self.sections[i][1]:
            return None
        return self.sections[i][3]

    def source_of(self, address):
        """ih_fit.c for what was compiled from it, memcpy for the C library's, _udivmoddi4 for gcc's."""
        path = self.object_of(address) or "?"
        return re.sub(r"^.*[/(]|^lib_a-|\.o(bj)?\)?$", "", path).removeprefix("lib_a-")

    def _read_symbols(self):
        for line in run(PREFIX + "nm", self.path).splitlines():
            part = line.split()
            if len(part) != 3 or part[2].startswith("$"):
                continue
            address = int(part[0], 16)
            self.symbol[part[2]] = address
            if part[1] in "TtW":
                static = self.source_of(address) + ":" if part[1] == "t" else ""
                self.name.setdefault(address, static + part[2])

    def _read_code(self):
        """{function: [(mnemonic, operands)]}, and where each instruction stands."""
        self.code = {}
        self.places = []  # addresses of all instructions, rising
        self.targets = {}  # address of an instruction that may go to the start of a function: its name
        current = None
        for line in run(PREFIX + "objdump", "-d", "--no-show-raw-insn", self.path).splitlines():
            start = re.match(r"([0-9a-f]+) <[^>]*>:$", line)
            found = INSTRUCTION.match(line)
            if start:
                current = self.code.setdefault(self.name.get(int(start[1], 16)), [])
            elif found and current is not None and not found[2].startswith("."):
                current.append((found[2], found[3] or ""))
                self.places.append(int(found[1], 16))
                target = re.search(r"\b([0-9a-f]+) <[^>+]*>", found[3] or "")
                if target and found[2].startswith("b"):
                    self.targets[self.places[-1]] = self.name.get(int(target[1], 16))
        self.function_starts = sorted(self.name)

    def function_at(self, address):
        """The function that an address is in."""
        return self.name[self.function_starts[bisect.bisect_right(self.function_starts, address) - 1]]

    def called_by(self, address, count):
        """The function that the last of count instructions from an address on goes to; None: none."""
        return self.targets.get(self.places[bisect.bisect_left(self.places, address) + count - 1])

    def calls(self, function):
        """Other functions that its code goes to; Broken where it goes through a register."""
        found = set()
        for name, operands in self.code[function]:
            target = re.search(r"\b([0-9a-f]+) <[^>+]*>", operands)
            if name.startswith("b") and target and self.name.get(int(target[1], 16)) != function:
                found.add(self.name[int(target[1], 16)])
            through = name in ("blx", "bx", "tbb", "tbh") and operands.strip() != "lr"
            if (through and not operands.startswith("[pc")) or (name == "mov" and operands.startswith("pc")):
                raise Broken("calls: %s goes through a register: %s %s" % (function, name, operands))
        return found

    def stack_of(self, function, active=()):
        """Bytes that it and what it calls take, as if none of its pushes was undone before its last call. A
        bound for functions that push on their way in alone, as those of the C library and the compiler do."""
        if function in active:
            raise Broken("calls: recursion: " + " -> ".join(active + (function,)))
        own = sum(pushed(name, operands) for name, operands in self.code[function])
        return own + max((self.stack_of(callee, active + (function,)) for callee in self.calls(function)),
                         default=0)

    def first_push(self, function):
        """Bytes of its first store on the stack: a push, behind what does without one."""
        for name, operands in self.code[function]:
            if pushed(name, operands):
                return pushed(name, operands)
            if name.startswith(("st", "vst", "bl")):
                break
        raise Broken("stack: %s stores or calls before it pushes" % function)
