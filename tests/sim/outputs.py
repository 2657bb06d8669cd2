#!/usr/bin/env python3
"""What host_sim says beside its records: progress, lines of 80 columns, how the rig has moved.

outputs.py HOST_SIM FRAMES_DIR
"""

import json
import os
import pty
import shutil
import subprocess
import sys
import tempfile

failed = 0


def ok(good, name, why=""):
    global failed
    failed += not good
    print("%sok - %s%s" % ("" if good else "not ", name, "" if good else "\n# %s" % (why,)))


def run(program, *arguments, **options):
    return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=600, check=False, **options)


def test_lines(program, folder):
    text = run(program, folder).stdout
    long = [line for line in text.splitlines()[1:] if len(line) > 80 and "error:" not in line]
    ok(text and not long, "lines of at most 80 columns, with long names too", long)
    help_lines = run(program, "--help").stdout.splitlines()
    ok(max(map(len, help_lines)) <= 80, "help fits a terminal", max(help_lines, key=len))


def rig_lines(program, *arguments):
    return [line for line in run(program, *arguments).stdout.splitlines() if line.startswith("  rig ")]


def test_rig(program, folder, work):
    """A line where the state of the rig changes, and how it has moved at the end."""
    wrong = os.path.join(work, "wrong.json")
    with open(os.path.join(folder, "rig.json"), encoding="utf-8") as file:
        rig = json.load(file)
    rig["camera_matrix"]["data"][5] += 2  # cy in px
    with open(wrong, "w", encoding="utf-8") as file:
        json.dump(rig, file)
    lines = rig_lines(program, folder)
    ok(lines == ["  rig fits"], "a rig that fits: said once", lines)
    lines = rig_lines(program, "--rig", wrong, folder)
    record = json.loads(run(program, "--json", "--rig", wrong, folder).stdout.splitlines()[2])
    moved = "  rig moved: %.3f %.3f %.3f degrees, focal %.2f %%, shift %.2f %.2f px" % (
        *record["rig"]["rotation_deg"], record["rig"]["focal_percent"], *record["rig"]["shift_px"])
    good = len(lines) == 4 and lines[2] == moved and lines[0].startswith("  rig moved: ")
    good = good and all(line.startswith("  rig depth ") for line in lines[1::2]) and max(map(len, lines)) <= 80
    ok(good, "a rig that moved: how, after the first frame and the last", (lines, moved))
    lines = rig_lines(program, "--paper", folder)
    ok(lines == [], "with --paper nothing is said of the rig", lines)


def test_progress(program, folder):
    ok(run(program, "--json", folder).stderr.count("\r") == 0, "no progress in a pipe")
    try:
        ours, theirs = pty.openpty()
    except OSError as reason:
        ok(True, "progress on a terminal # SKIP no terminal can be opened here, /dev/pts: %s" % reason.strerror)
        return
    with open(os.devnull, "w", encoding="utf-8") as null:
        process = subprocess.Popen([program, "--json", folder], stdout=null, stderr=theirs)
    os.close(theirs)
    shown = b""
    while True:
        try:
            data = os.read(ours, 4096)
        except OSError:  # all is read, and the other end closed
            break
        if not data:
            break
        shown += data
    process.wait(60)
    os.close(ours)
    name = os.path.basename(folder)
    ok(("%s 1/" % name).encode() in shown, "progress on a terminal", shown[:200])
    ok(shown.endswith(b"\r\x1b[K"), "and nothing is left of it", shown[-80:])


def main():
    program, source = os.path.abspath(sys.argv[1]), sys.argv[2]
    with tempfile.TemporaryDirectory() as work:
        folder = os.path.join(work, 'frames, "all"')
        os.makedirs(folder)
        shutil.copy(os.path.join(source, "rig.json"), folder)
        for i in (0, 10, 20):
            shutil.copy(os.path.join(source, "%06d.pgm" % i), folder)
        os.rename(os.path.join(folder, "000020.pgm"), os.path.join(folder, "a_camera_s_own_long_name,000020.pgm"))
        with open(os.path.join(folder, "b\nbroken.pgm"), "w", encoding="utf-8") as file:
            file.write("P5 no frame")
        test_rig(program, folder, work)
        test_lines(program, folder)
        test_progress(program, folder)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
