#!/usr/bin/env python3
"""Every input of every pack is replayed, as it was packed; a corrupt pack is refused.

test_corpus.py FUZZ_ECHO
"""

import os
import re
import subprocess
import sys
import tempfile
import unittest

import corpus

HERE = os.path.dirname(os.path.abspath(__file__))
CORPUS = os.path.join(HERE, "corpus")
ECHO = os.path.abspath(sys.argv.pop(1))


def run(*command):
    return subprocess.run(command, capture_output=True, check=False)


def command(*arguments):
    return run(os.path.join(HERE, "corpus.py"), *arguments)


def contents(path):
    with open(path, "rb") as file:
        return file.read()


class Packs(unittest.TestCase):
    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.work = directory.name
        self.pack = os.path.join(self.work, "a.pack")

    def write(self, data):
        with open(self.pack, "wb") as file:
            file.write(data)

    def test_a_pack_for_each_target(self):
        text = contents(os.path.join(HERE, "CMakeLists.txt")).decode()
        targets = re.findall(r"^add_fuzz\((\w+)", text, re.MULTILINE)
        self.assertEqual(sorted(target + ".pack" for target in targets), sorted(os.listdir(CORPUS)))

    def test_every_input_is_replayed(self):
        for name in sorted(os.listdir(CORPUS)):
            pack = os.path.join(CORPUS, name)
            header, inputs = contents(pack).split(b"\n", 1)
            count = inputs.count(b"\n")
            replay = run(ECHO, pack)
            self.assertEqual(replay.returncode, 0, name)
            self.assertEqual(replay.stdout, inputs + b"%d inputs\n" % count, name)
            self.assertEqual(header.split()[-1], b"%d" % count, name)

    def test_unpacked_and_packed_again_it_is_the_same(self):
        for name in sorted(os.listdir(CORPUS)):
            pack = os.path.join(CORPUS, name)
            files = os.path.join(self.work, name + ".files")
            corpus.unpack(pack, files)
            corpus.pack(files, self.pack)
            self.assertEqual(contents(self.pack), contents(pack), name)

    def test_bytes_of_every_value_and_none(self):
        files = os.path.join(self.work, "files")
        os.mkdir(files)
        inputs = [b"", bytes(range(256)), b"\n", b"\r\n\x1a", bytes(1 << 20)]
        for number, data in enumerate(inputs):
            with open(os.path.join(files, str(number)), "wb") as file:
                file.write(data)
        self.assertEqual(command("pack", files, self.pack).returncode, 0)
        lines = [data.hex() for data in sorted(inputs)] + ["5 inputs", ""]
        self.assertEqual(run(ECHO, self.pack).stdout.decode(), "\n".join(lines))
        again = os.path.join(self.work, "again")
        self.assertEqual(command("unpack", self.pack, again).returncode, 0)
        self.assertEqual({contents(os.path.join(again, name)) for name in os.listdir(again)}, set(inputs))

    def test_a_corrupt_pack_is_refused(self):
        good = b"isohead fuzz inputs 2\n00ff\n0a\n"
        self.write(good)
        self.assertEqual(run(ECHO, self.pack).stdout, b"00ff\n0a\n2 inputs\n")
        for data, message in (
                (b"", "line 1 is not 'isohead fuzz inputs COUNT'"),
                (good[1:], "line 1 is not"),
                (good.replace(b" 2\n", b" \n"), "line 1 is not"),
                (good.replace(b" 2\n", b" 2 \n"), "line 1 is not"),
                (good.replace(b"\n", b"\r\n"), "line 1 is not"),
                (good.replace(b" 2\n", b" 3\n"), "2 inputs, but line 1 says 3"),
                (good.replace(b" 2\n", b" 1\n"), "2 inputs, but line 1 says 1"),
                (good.replace(b"00ff\n", b""), "1 inputs, but line 1 says 2"),
                (good[:-1], "the last line has no end"),
                (good.replace(b"0a", b"0"), "line 3 is not an input in hex digits"),
                (good.replace(b"0a", b"0A"), "line 3 is not an input in hex digits"),
                (good.replace(b"0a", b"0\0"), "line 3 is not an input in hex digits"),
                (good.replace(b"00ff", b"00 ff "), "line 2 is not an input in hex digits"),
                (b"isohead fuzz inputs 1\n%s\n" % (b"00" * ((1 << 20) + 1)), "line 2 is not an input")):
            self.write(data)
            replay = run(ECHO, self.pack)
            self.assertEqual(replay.returncode, 2, data[:40])
            self.assertIn("%s: %s" % (self.pack, message), replay.stderr.decode())
            with self.assertRaises(corpus.Wrong, msg=data[:40]) as refused:
                corpus.read_pack(self.pack)
            self.assertIn("%s: %s" % (self.pack, message), str(refused.exception))

    def test_missing_and_empty_files_are_refused(self):
        empty = os.path.join(self.work, "empty")
        os.mkdir(empty)
        self.write(b"isohead fuzz inputs 0\n")
        for result, message in (
                (command("pack", empty, self.pack), "%s: no inputs" % empty),
                (command("unpack", self.pack, self.work), "%s: not empty" % self.work),
                (command("unpack", self.pack + "s", empty), "No such file"),
                (run(ECHO, self.pack), "no input"),
                (run(ECHO, os.path.join(empty, "a.pack")), "No such file"),
                (run(ECHO), "no input")):
            self.assertNotEqual(result.returncode, 0, message)
            self.assertIn(message, result.stderr.decode())


if __name__ == "__main__":
    unittest.main()
