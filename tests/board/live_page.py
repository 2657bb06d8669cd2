#!/usr/bin/env python3
"""The live view's page in a browser, on a desk and on a phone: does it show what the board sees?

live_page.py ISOHEAD_BOARD FRAMES [PICTURES]      exit status 1 if something is wrong

PICTURES: a folder for live.png, the desk, of one frame that has something of everything.
"""

import os
import subprocess
import sys
import tempfile

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
sys.path.insert(0, os.path.join(ROOT, "tests", "report"))

import browser as devtools
from browser import Browser
from watch import held_port, schedule_as_others, view_pid

# Of one call of the browser, on a machine under load.
devtools.TIMEOUT_S = 300
# Frames of sequence 2: a hand comes before the face. Slow enough for a picture to be taken of one.
SHOWN, WANTED, RATE = range(16, 25), "000022.pgm", 2
SCREENS = {"live": (1280, 800, 1, False), "live_phone": (360, 780, 1, True)}  # width, height, scale, phone
COLOURS = {"heads": 0xffb000, "dots": 0xff3d9a, "contours": 0x35c2ff, "others": 0xff8a5c}  # app_live.css
# Pixels of the canvas that are nearly of a colour.
COUNT = """(() => { const c = document.getElementById("picture"); let count = 0;
  const data = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
  for (let i = 0; i < data.length; i += 4)
    count += Math.max(Math.abs(data[i] - %d), Math.abs(data[i + 1] - %d), Math.abs(data[i + 2] - %d)) < 24;
  return count; })()"""
TEXT = 'document.getElementById("%s").textContent'

failures = []


def check(condition, text):
    if not condition:
        failures.append(text)
        print("FAIL", text, flush=True)


def frames_of(source, folder):
    for name in ["rig.json"] + ["%06d.pgm" % index for index in SHOWN]:
        os.symlink(os.path.join(os.path.abspath(source), name), os.path.join(folder, name))


def check_screen(browser, name, width, height):
    head, dots, rate, state = (browser.value(TEXT % id) for id in ("head", "dots", "rate", "state"))
    check(head.count("mm") >= 2 and "score" in head, f"{name}: head: {head}")
    check("of 361 labelled" in dots and int(dots.split(",")[0]) > 200, f"{name}: dots: {dots}")
    rig = browser.value(TEXT % "rig")
    check(rig == "fits", f"{name}: rig: {rig}")
    check("frames/s on the board" in rate and state == "live", f"{name}: rate: {rate}; state: {state}")
    needs = browser.value("document.documentElement.scrollWidth")
    check(needs <= width, f"{name}: {needs} pixels wide, the screen {width}")
    bottoms = browser.value('["head", "picture"].map((id) => document.getElementById(id).getBoundingClientRect().bottom)')
    check(max(bottoms) <= height, f"{name}: the answer ends at {bottoms[0]}, the picture at {bottoms[1]}, the screen at {height}")
    label = browser.value('document.getElementById("picture").getAttribute("aria-label")')
    check(label.startswith("camera image; head: "), f"{name}: a screen reader reads: {label}")


def stand(browser, there):
    """Where that is so, the page asks for no other frame."""
    browser.value("go = next, next = () => %s ? new Promise(() => { window.stands = true; }) : go(), 0" % there)
    browser.until("window.stands === true")


def check_boxes(browser, name):
    """Each box takes its own colour from the picture and gives it back; the page draws from the frame that it has."""
    for what, colour in COLOURS.items():
        count = COUNT % (colour >> 16, colour >> 8 & 255, colour & 255)
        with_it = browser.value(count)
        browser.click("#show-" + what)
        without = browser.value(count)
        browser.click("#show-" + what)
        check(with_it > 20 and without < with_it / 4 and browser.value(count) == with_it,
              f"{name}: {what}: {with_it} pixels, {without} without it, then {browser.value(count)}")


def watch(browser, url, pictures):
    for name, (width, height, scale, phone) in SCREENS.items():
        browser.size(width, height, scale, phone)
        browser.open(url)
        # Something of everything: before a track begins there is no head.
        there = TEXT % "state" + ' === "live" && ' + TEXT % "head" + '.includes("mm away") && ' + \
            TEXT % "rejected" + '.includes("mm away") && !' + TEXT % "rate" + '.includes("–")'
        if pictures:
            there += " && %s === '%s'" % (TEXT % "frame", WANTED)
        stand(browser, there)
        if pictures and not phone:
            browser.screenshot(os.path.join(pictures, name + ".png"), "main")
        check_screen(browser, name, width, height)
        check_boxes(browser, name)


def main():
    program, source = sys.argv[1:3]
    pictures = sys.argv[3] if len(sys.argv) > 3 else None
    port, held = held_port()
    with held, tempfile.TemporaryDirectory() as work:
        folder = os.path.join(work, "frames")
        os.makedirs(folder)
        frames_of(source, folder)
        loop = subprocess.Popen([program, "--device", folder, "--rate", str(RATE), "--view", str(port)],
                                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        try:
            url = loop.stderr.readline().split("live view: ")[1].strip()
            schedule_as_others(view_pid(loop.pid))
            with Browser(work) as browser:
                watch(browser, url, pictures)
            strange = [request for request in browser.requests if not request.startswith((url, "data:", "about:"))]
            check(not strange, f"requests elsewhere: {strange}")
            check(not browser.errors, f"errors: {browser.errors}")
            loop.terminate()
            messages = loop.communicate()[1]
            check(loop.returncode == 0, f"the loop's end: {messages}")
        finally:
            loop.kill()
    print(f"live page: {len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
