#!/usr/bin/env python3
"""The report page in a real browser: does it load, show what the records say, and obey?

report.py --host-sim PROGRAM --frames DIR [--keep FOLDER]

DIR holds sequence1 and sequence2 as make sim renders them; some frames of both are taken. What the page shows is
compared with the records and traces of the same run, read here anew. FOLDER: pictures of the page are left there.
"""

import argparse
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile

from browser import Browser

# Frames of each sequence: an empty seat at either end, hands, lost heads. The last one of sequence2 is broken here.
TAKEN = [0, 1, 3, 4, 5, 6, 7, 8, 20, 21, 45, 49]
# In this one the truth is moved, so that there are frames that are not right, however good the program is.
ELSEWHERE = 20
PAGE_BYTES_MAX = 30e6  # of 200 frames
DESK = (1000, 700)  # px; two pictures beside each other, and no more to draw than that takes
SHOWN = "document.documentElement.dataset.shown"


class Test:
    def __init__(self):
        self.count = self.failed = 0

    def ok(self, good, name, why=""):
        self.count += 1
        self.failed += not good
        print("%sok %d - %s%s" % ("" if good else "not ", self.count, name, "" if good else "\n# %s" % (why,)), flush=True)

    def same(self, found, expected, name):
        self.ok(found == expected, name, "found %.400r, expected %.400r" % (found, expected))


def make_input(source, folder):
    """Two directories; the truth of a frame in each has the head elsewhere; a broken frame at the end of the second."""
    for sequence in ("sequence1", "sequence2"):
        to = os.path.join(folder, sequence)
        os.makedirs(to)
        names = ["%06d.pgm" % i for i in TAKEN]
        for name in names + ["rig.json"]:
            shutil.copy(os.path.join(source, sequence, name), to)
        for lines in ("truth.jsonl", "frames.jsonl"):
            with open(os.path.join(source, sequence, lines), encoding="utf-8") as file:
                kept = [entry for entry in map(json.loads, file) if entry["file"] in names]
            for entry in kept:
                if entry["file"] == "%06d.pgm" % ELSEWHERE and entry.get("head"):
                    entry["head"]["centre_mm"][0] += 300
            with open(os.path.join(to, lines), "w", encoding="utf-8") as file:
                file.writelines(json.dumps(entry) + "\n" for entry in kept)
    broken = os.path.join(folder, "sequence2", "000049.pgm")
    with open(broken, "r+b") as file:
        file.truncate(1000)


def run(program, *arguments, **options):
    return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=600, check=False, **options)


def go(browser, index):
    browser.value("(() => { const s = document.getElementById('slider'); s.value = %d;"
                  " s.dispatchEvent(new Event('input')); })()" % index)
    browser.until("%s === '%d'" % (SHOWN, index))


# --- what the page shows ---------------------------------------------------------------------------

def cells(browser, selector):
    """A table's rows of texts; a small text below another one after a |. What only a screen reader gets is left out."""
    return browser.value("""[...document.querySelectorAll(%s)].map((row) => [...row.children].map((cell) => {
        const copy = cell.cloneNode(true);
        copy.querySelectorAll('.hidden').forEach((e) => e.remove());
        copy.querySelectorAll('small').forEach((e) => e.prepend('|'));
        return copy.textContent; }))""" % json.dumps(selector))


def expected_row(record, index):
    h = record["hypotheses"][index]
    text = "rejected: " + h["rejected"] if h["rejected"] else "the head" if record["head"] == index else "accepted"
    row = ["%d" % index, text + ("|predicted: not seen here" if h.get("predicted") else "")]
    if "score" in h:
        row.append("%.3f%s" % (h["score"], " ✗" if h["rejected"] else ""))
    row.append(", ".join("%.1f" % v for v in h["centre_mm"]) +
               ("|± %.1f, track %d" % (h["sigma_mm"], h["track"]) if "track" in h else "") +
               ("|looks %.1f°, %.1f°" % tuple(v + 0.0 for v in h["pose_deg"]) if h.get("pose_deg") else ""))
    row.append("%.1f" % h["distance_mm"])
    row.append(", ".join("%.2f" % v for v in h["pixel"]) + "|%.2f × %.2f, %.1f°" % (*h["axes_px"], h["angle_deg"]))
    return row


def test_hypotheses(browser, record):
    """'' or what differs in the table of hypotheses."""
    if "error" in record:
        return "" if record["error"] in browser.value("document.getElementById('hypotheses-text').textContent") else "no error"
    rows = cells(browser, "#hypotheses tbody tr")
    for row in rows:
        if "score" in record["hypotheses"][0]:
            row[2] = row[2].split("|")[0]  # the limit is the same everywhere: looked at in test_limits
    wanted = [expected_row(record, i) for i in range(len(record["hypotheses"]))]
    return "" if rows == wanted else "%r, expected %r" % (rows, wanted)


# Which of the columns of nests a reason stands for; they are in the order of the tests.
REASON = {"area": [2], "curvature": [3, 4], "shape": [5], "outline": [6, 7, 8, 9]}


def test_nests(browser, trace):
    """'' or what is wrong: each nest's area as traced, and its first failing test the one that is the reason."""
    rows = cells(browser, "#nests tbody tr")
    if len(rows) != len(trace["heads"]["hypothesis"]):
        return "%d nests, expected %d" % (len(rows), len(trace["heads"]["hypothesis"]))
    for row, nest in zip(rows, trace["heads"]["hypothesis"]):
        area = int(re.sub(r"\D", "", row[2].split("|")[0]))
        extent = float(row[4].split("|")[0].split(" ")[0])
        failing = [i for i, cell in enumerate(row) if "✗" in cell]
        reason = nest["rejected"]
        if area != nest["area_mm2"] or abs(extent - nest["extent_mm_q8"] / 256) > 0.051:
            return "area %d, extent %g: %r" % (area, extent, nest)
        if (failing[0] not in REASON[reason]) if reason else failing:
            return "fails in columns %r, rejected for %r" % (failing, reason)
        if row[1] != ("rejected: " + reason if reason else "accepted"):
            return "decision %r, expected %r" % (row[1], reason)
    return ""


def test_evidence(browser, record, trace):
    """'' or what is wrong with the parts of the chosen hypothesis."""
    chosen = record["head"] if record["head"] is not None else 0
    detection = trace["findings"][chosen]
    rows = cells(browser, "#evidence tbody tr")
    if "part_q10" not in detection:
        return "" if rows == [] else "evidence of what was not seen"
    found = [float(row[2]) for row in rows]
    if rows[0][0] == "before any evidence":
        if detection["track"] == 0 and abs(sum(found) - detection["logit_q10"] / 1024) > 0.11:
            return "%r sum to %.2f, expected %.2f" % (found, sum(found), detection["logit_q10"] / 1024)
        found = found[1:]
    found.sort()
    measures = len(trace["evidence"])
    maps = sorted(detection["part_q10"][measures:], key=abs, reverse=True)
    # The maps that say most, and all others in one row.
    wanted = sorted(round(p / 1024, 2) for p in [*detection["part_q10"][:measures], *maps[:6], sum(maps[6:])])
    length = browser.value("[...document.querySelectorAll('#evidence .bar i')].map((e) => parseFloat(e.style.width))")
    value = [abs(float(row[2])) for row in rows if row[0] != "before any evidence"]
    if len(length) != len(value) or any(abs(l - 48 * v / max(value)) > 0.3 for l, v in zip(length, value)):
        return "bars of %r for %r" % (length, value)
    close = len(found) == len(wanted) and all(abs(a - b) < 0.0101 for a, b in zip(found, wanted))
    return "" if close else "%r, expected %r" % (found, wanted)


def expected_rig(record):
    rig = record.get("rig")
    if rig is None:
        return ""
    across = "; dots lie %.2f px beside their lines" % rig["across_px"]
    if rig["state"] == "fits":
        return "Rig: fits" + across
    def degrees(key):
        return ", ".join("%.3f" % angle for angle in rig[key])
    return ("Rig: has moved, the projector by (%s) ± (%s)° about X, Y, Z, the focal length by %.2f %%, the picture by (%.2f, %.2f) px%s; depth is known" %
            (degrees("rotation_deg"), degrees("sigma_deg"), rig["focal_percent"], *rig["shift_px"], across))


def test_frames(test, browser, records, traces):
    wrong = {"record": [], "status": [], "rig": [], "hypotheses": [], "nests": [], "evidence": []}
    for index, (record, trace) in enumerate(zip(records, traces)):
        go(browser, index)
        if json.loads(browser.value("document.getElementById('record').textContent")) != record:
            wrong["record"].append(index)
        status = browser.value("document.getElementById('now').textContent").replace("\xa0", " ")
        parts = ["Frame %d of %d" % (index + 1, len(records)), record["file"]]
        if record.get("head") is not None:
            parts.append("x %.1f, y %.1f, z %.1f mm" % tuple(record["hypotheses"][record["head"]]["centre_mm"]))
        if any(part not in status for part in parts):
            wrong["status"].append((index, status))
        rig = browser.value("document.getElementById('rig').textContent")
        if rig != expected_rig(record):
            wrong["rig"].append((index, rig))
        for name, why in (("hypotheses", test_hypotheses(browser, record)),
                          ("nests", test_nests(browser, trace) if trace else ""),
                          ("evidence", test_evidence(browser, record, trace) if trace else "")):
            if why:
                wrong[name].append((index, why))
    for name, found in wrong.items():
        test.ok(not found, "every frame: %s as in the run's own output" % name, found[:2])


def test_limits(test, browser):
    """The score's limits, as ih_tracks' log-odds of 1 and 0.5 say."""
    rows = cells(browser, "#hypotheses tbody tr")
    test.same({row[2].split("|")[1] for row in rows}, {"over 0.731 at once, 0.622 from frame 3 on"}, "the score's limits beside it")


def test_table1(test, browser, text):
    """The rows of Table 1 against those on standard output."""
    wanted = []
    for line in text.split("Table 1", 1)[1].split("\nDots", 1)[0].splitlines()[3:]:
        if line.strip():
            wanted.append(line[20:].replace("-", "–").split())
    found = [row[1:] for row in cells(browser, "#table1 tbody tr")]
    wanted = [row + ["–"] * (10 - len(row)) for row in wanted]
    test.same(found, wanted, "Table 1 as on standard output")


# --- what a user does ------------------------------------------------------------------------------

def test_keys(test, browser, records, right):
    last = len(records) - 1

    def press(key, wanted, name):
        browser.key(key)
        try:
            browser.until("%s === '%d'" % (SHOWN, wanted))
            test.ok(True, name)
        except TimeoutError:
            test.same(browser.value(SHOWN), "%d" % wanted, name)

    browser.value("document.activeElement.blur()")
    go(browser, 3)
    press("ArrowRight", 4, "key: right")
    press("ArrowLeft", 3, "key: left")
    browser.key("PageDown")
    browser.key("End")
    test.same(browser.value("document.getElementById('slider').value"), "3", "keys that scroll a page do so, off the slider")
    browser.value("document.getElementById('slider').focus()")
    press("PageDown", 13, "key: page down")
    press("PageUp", 3, "key: page up")
    press("End", last, "key: end")
    press("ArrowRight", last, "key: right stops at the end")
    press("Home", 0, "key: home")
    browser.value("document.activeElement.blur()")
    press("n", right.index(False), "key: n, to the first that is not right")
    go(browser, last)
    press("p", max(i for i in range(last) if not right[i]), "key: p, back to the last before")
    browser.value("document.getElementById('dir').focus()")
    browser.key("n")
    test.same(browser.value("document.getElementById('slider').value"), "%d" % max(i for i in range(last) if not right[i]),
              "letters in the list of directories are the list's")
    browser.value("document.activeElement.blur()")
    go(browser, 5)
    browser.value("document.getElementById('slider').focus()")
    press("ArrowRight", 6, "slider: right, one frame and not two")
    press("ArrowRight", 7, "slider: right again")
    test.same(browser.value("document.getElementById('slider').value"), "7", "slider: stands at the frame")
    browser.click("#next")
    browser.until("%s === '8'" % SHOWN)
    # Its clock is this test: a frame's time is over when that is said, and not sooner.
    browser.value("wait = setTimeout, setTimeout = (done, ms) => ms === 120 ? (step = done, 0) : wait(done, ms), 0")
    browser.click("#play")
    browser.until("%s === '9'" % SHOWN)
    browser.value("step(), 0")
    browser.until("%s === '10'" % SHOWN)
    browser.click("#play")
    browser.value("setTimeout = wait, step(), 0")
    test.same([browser.value("document.getElementById('play').getAttribute('aria-pressed')"), browser.value(SHOWN)], ["false", "10"],
              "play runs, and stops")
    go(browser, max(range(len(records)), key=lambda i: len(records[i].get("hypotheses", ()))))
    browser.value("document.activeElement.blur()")
    before = browser.value("document.querySelector('#evidence summary').textContent")
    browser.key("h")
    after = browser.value("document.querySelector('#evidence summary').textContent")
    test.ok(before != after, "key: h, the next hypothesis", (before, after))
    test.same(browser.value("document.querySelectorAll('#hypotheses [aria-pressed=true]').length"), 1, "one hypothesis is chosen")
    go(browser, 5)
    x, y = browser.position("#chart-0")
    browser.mouse("mousePressed", x, y, 1)
    browser.mouse("mouseReleased", x, y)
    browser.until("%s !== '5'" % SHOWN)
    test.ok(0 < int(browser.value(SHOWN)) < len(TAKEN), "a click in a chart chooses the frame there", browser.value(SHOWN))


PIXELS = "document.getElementById('%s').toDataURL()"


def test_space(test, browser):
    go(browser, 6)
    # Scroll first: the position is the same for both pictures.
    browser.position("#space")
    first = browser.value(PIXELS % "space")
    test.ok(len(set(first)) > 20 and len(first) > 20000, "3-D: there is a picture", len(first))
    test.ok(browser.value(PIXELS % "space") == first, "3-D: it rests")
    browser.drag("#space", 90, 30)
    rotated = browser.value(PIXELS % "space")
    test.ok(rotated != first, "3-D: a drag rotates it")
    browser.value("document.getElementById('space').focus()")
    browser.key("0")
    test.ok(browser.value(PIXELS % "space") == first, "3-D: 0 brings the first view back")
    browser.key("ArrowLeft")
    left = browser.value(PIXELS % "space")
    browser.key("ArrowRight")
    test.ok(left != first, "3-D: an arrow key rotates it")
    test.same(browser.value(SHOWN), "6", "3-D: its arrow keys do not change the frame")
    browser.key("+")
    test.ok(browser.value(PIXELS % "space") not in (first, left), "3-D: + zooms")
    browser.key("0")
    for part in ("points", "surface", "head", "truth", "axes"):
        browser.value("document.querySelector('[data-part=%s]').click()" % part)
        test.ok(browser.value(PIXELS % "space") != first, "3-D: %s can be taken away" % part)
        browser.value("document.querySelector('[data-part=%s]').click()" % part)


def test_picture(test, browser):
    for layer in ("image", "dots", "contours", "nests", "hypotheses", "truth", "bright"):
        before = browser.value(PIXELS % "picture")
        browser.value("document.querySelector('[data-layer=%s]').click()" % layer)
        test.ok(browser.value(PIXELS % "picture") != before, "picture: %s can be switched" % layer)
        browser.value("document.querySelector('[data-layer=%s]').click()" % layer)


def test_names(test, browser):
    tree = browser.tree()
    wanted = {"button", "checkbox", "combobox", "slider", "image", "img", "table", "region", "heading"}
    bare = [role for role, name in tree if role in wanted and not name.strip()]
    test.same(bare, [], "every control, picture and table has a name for a screen reader")
    roles = [role for role, _ in tree]
    test.ok("status" in roles, "the frame is announced in a live region")
    images = [name for role, name in tree if role in ("image", "img")]
    test.ok(len(images) >= 5 and all(len(name) > 40 for name in images), "charts and pictures have their text", images)
    found = browser.value("Data.frames.slice(0, %d).filter((f) => f.selected).length" % len(TAKEN))
    go(browser, 0)
    label = browser.value("document.getElementById('chart-0').getAttribute('aria-label')")
    test.ok("a head in %d of %d frames" % (found, len(TAKEN)) in label, "a chart's text says what it shows", label)
    levels = browser.value("[...document.querySelectorAll('h1,h2,h3')].map((h) => Number(h.tagName[1]))")
    test.ok(levels[0] == 1 and all(b - a <= 1 for a, b in zip(levels, levels[1:])), "headings in order", levels)
    test.same(browser.value("document.documentElement.lang"), "en", "the language is declared")


def luminance(colour):
    parts = [c / 255 for c in colour]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_looks(test, browser, keep):
    colour = ("(() => { const e = document.createElement('i'); e.style.color = `var(--%s)`; document.body.append(e);"
              " const c = getComputedStyle(e).color; e.remove(); return c.match(/[0-9.]+/g).slice(0, 3).map(Number); })()")
    grounds = []
    for scheme in ("light", "dark"):
        browser.media(prefers_color_scheme=scheme)
        grounds.append(luminance(browser.value(colour % "ground")))
        for front, back in (("ink", "ground"), ("quiet", "ground"), ("quiet", "panel"), ("good", "good-ground"),
                            ("bad", "bad-ground"), ("bad", "ground"), ("accent", "panel")):
            low, high = sorted((luminance(browser.value(colour % front)), luminance(browser.value(colour % back))))
            ratio = (high + 0.05) / (low + 0.05)
            test.ok(ratio >= 4.5, "%s: %s on %s can be read" % (scheme, front, back), "contrast %.2f" % ratio)
        if keep:
            browser.screenshot(os.path.join(keep, scheme + ".png"), whole=True)
    test.ok(grounds[0] > 0.8 and grounds[1] < 0.05, "light and dark as the system wants", grounds)
    browser.media(prefers_color_scheme="light")
    for width in (320, 390, 768):
        browser.size(width, 800, 2, True)
        for index in (5, len(TAKEN) + 3, 2 * len(TAKEN) - 1):
            go(browser, index)
            wide = browser.value("document.documentElement.scrollWidth - %d" % width)
            test.ok(wide <= 0, "%d px wide: frame %d does not run over" % (width, index), "by %d px" % wide)
        if keep:
            go(browser, 5)
            browser.screenshot(os.path.join(keep, "phone%d.png" % width), whole=True)
    for name, width, height, phone in (("1280x800", 1280, 800, False), ("a phone", 390, 844, True)):
        browser.size(width, height, 1, phone)
        browser.value("scrollTo(0, 0)")
        go(browser, 5)
        bottom = browser.value("['now', 'picture', 'space'].map((id) => document.getElementById(id).getBoundingClientRect().bottom)")
        test.ok(bottom[0] < min(bottom[1:]) and max(bottom[1:]) <= height, "%s: verdict, picture and 3-D are in the first screen" % name, bottom)
    bar = "getComputedStyle(document.getElementById('bar')).position"
    browser.size(844, 390, 2, True)
    test.same(browser.value(bar), "static", "a phone on its side: the slider scrolls away with the page")
    browser.size(*DESK)
    test.same(browser.value(bar), "sticky", "elsewhere it stays in sight")
    browser.media("print")
    hidden = browser.value("['.buttons', '.slide', '.layers'].map((s) => getComputedStyle(document.querySelector(s)).display)")
    test.same(hidden, ["none"] * 3, "on paper there is nothing to press")
    browser.media(prefers_color_scheme="light")


def test_link(test, browser, page, records):
    """An address names a frame, and each frame shows its own."""
    browser.open(page + "?anew#sequence2/000006")  # another document, which loads
    browser.until(SHOWN + " !== undefined")
    index = len(TAKEN) + TAKEN.index(6)
    test.same(browser.value(SHOWN), "%d" % index, "an address with a frame opens it")
    link = "document.querySelector('#now a')"
    test.same(browser.value(link + ".hash"), "#sequence2/000006", "a frame shows its link")
    go(browser, 3)
    test.same(browser.value("location.hash"), "#sequence1/%06d" % TAKEN[3], "the address follows the frame")
    browser.value("location.hash = '#sequence2/%06d'" % TAKEN[1])
    browser.until("%s === '%d'" % (SHOWN, len(TAKEN) + 1))
    browser.value("location.hash = '#no/such%'")
    test.same(browser.value(SHOWN), "%d" % (len(TAKEN) + 1), "an address without a frame changes nothing")
    before = browser.value("history.length")
    go(browser, 5)
    go(browser, 6)
    test.same(browser.value("history.length"), before, "frames do not fill the history")
    header = browser.value("document.getElementById('run').textContent")
    camera = [json.loads(line)["camera"] for line in browser.value("[...document.querySelectorAll('script.dir')].map((e) => e.textContent)")]
    test.ok("host_sim --json --report " in header and "isohead " in header and "%d × %d px" % (camera[0]["width"], camera[0]["height"]) in header
            and "rig.json" in header and header.count("%d frames" % len(TAKEN)) == 2, "the header: command, version, rig, camera", header)
    test.same(len(records), 2 * len(TAKEN), "records of all frames")


def shaded(browser, index, axis=0):
    """Is the ground of a curve at a frame that of frames that are not right? Some frames are 4.8 px apart."""
    return browser.value("""(() => { const chart = Chart.getChart('chart-%d'), f = Data.frames[%d];
        const x = chart.scales.x.getPixelForValue(f.time_s), y = chart.chartArea.top + 3, r = chart.currentDevicePixelRatio;
        return [-1, 1].some((dx) => { const p = chart.ctx.getImageData(Math.round((x + dx) * r), Math.round(y * r), 1, 1).data;
          return p[3] > 0 && p[0] - p[2] > 15; }); })()""" % (axis, index))


def test_shades(test, browser, right):
    for first in (0, len(TAKEN)):
        for start in (first + 1, first + 4):
            go(browser, start)  # the line at the frame that is shown is elsewhere
            others = [i for i in range(first, first + len(TAKEN) - 1) if abs(i - start) > 1]
            wrong = [i for i in others if shaded(browser, i) == right[i]]
            test.same(wrong, [], "curves: frames that are not right are shaded, no others")


def test_against(test, browser, program, frames, work):
    """Two runs of the same frames; the other one knows less."""
    page, other = os.path.join(work, "against.html"), os.path.join(work, "other.json")
    result = run(program, "--json", "--without", "fit,scan,tracks", frames)
    theirs = [json.loads(line) for line in result.stdout.splitlines()]
    with open(other, "w", encoding="utf-8") as file:
        file.write(result.stdout)
    result = run(program, "--json", "--report", page, "--against", other, frames)
    ours = [json.loads(line) for line in result.stdout.splitlines()]
    truth = []
    for sequence in ("sequence1", "sequence2"):
        with open(os.path.join(frames, sequence, "truth.jsonl"), encoding="utf-8") as file:
            truth += [json.loads(line)["head"] for line in file]

    def centre(record):
        return record["hypotheses"][record["head"]]["centre_mm"] if record.get("head") is not None else None

    def near(a, b):
        return a is not None and b is not None and sum((p - q) ** 2 for p, q in zip(a, b)) <= 100 ** 2

    def right(record, head):
        return "error" not in record and (near(centre(record), head["centre_mm"]) if head else centre(record) is None)

    scored = [i for i, record in enumerate(ours) if "error" not in record]
    better = [i for i in scored if right(ours[i], truth[i]) and not right(theirs[i], truth[i])]
    worse = [i for i in scored if right(theirs[i], truth[i]) and not right(ours[i], truth[i])]
    different = [i for i in range(len(ours)) if centre(ours[i]) != centre(theirs[i]) and not near(centre(ours[i]), centre(theirs[i]))]
    open_anew(browser, page)
    shown = browser.value("document.getElementById('summary').textContent")
    test.ok("%d better, %d worse, %d heads differ." % (len(better), len(worse), len(different)) in shown and len(different) > 2,
            "--against: how many are better and worse", (shown, better, worse, different))
    go(browser, 0)
    browser.value("document.activeElement.blur()")
    seen = []
    for _ in different:
        browser.key("d")
        browser.until(SHOWN + " !== '%d'" % (seen[-1] if seen else 0))
        seen.append(int(browser.value(SHOWN)))
    test.same(seen, [i for i in different if i > 0][:len(seen)], "--against: key d, the frames that differ")
    lone = next(i for i in different if centre(theirs[i]) is None)
    go(browser, lone)
    test.ok("The other run: no head: not right." in browser.value("document.getElementById('now').textContent"), "--against: what the other run said")
    both = next(i for i in scored if centre(theirs[i]) is not None and centre(ours[i]) is not None)
    go(browser, both)
    before = browser.value(PIXELS % "picture")
    browser.value("document.querySelector('[data-layer=other]').click()")
    test.ok(browser.value(PIXELS % "picture") != before, "--against: the other run's head in the picture")
    test.same(browser.value("Chart.getChart('chart-0').data.datasets.length"), 3, "--against: a third curve")
    test.same(browser.errors, [], "--against: no error on the console")
    with open(other, "w", encoding="utf-8") as file:
        file.write('{"file":"x.pgm"}\nno\n{"file":"</script><b>.pgm","error":"</script>"}\n')
    result = run(program, "--json", "--report", page, "--against", other, os.path.join(frames, "sequence1"))
    test.ok(result.returncode == 1 and "other.json: line 1: no record, expected a line of host_sim --json" in result.stderr
            and "other.json: line 2: not a JSON object" in result.stderr and result.stdout.count("\n") == len(TAKEN),
            "--against: what is no record is reported, and the run goes on", result.stderr)
    open_anew(browser, page)
    test.same(browser.errors, [], "--against: frames that this run does not have do no harm")
    result = run(program, "--against", other, frames)
    test.ok(result.returncode == 2 and "--report FILE" in result.stderr, "--against without --report: usage", result.stderr)
    result = run(program, "--report", other, "--against", other, frames)
    test.ok(result.returncode == 1 and "a file that this run reads" in result.stderr and result.stdout == "", "--against: its file is not overwritten", result.stderr)


# --- other runs -------------------------------------------------------------------------------------

def open_anew(browser, page):
    browser.errors.clear()
    browser.open(page)
    browser.until(SHOWN + " !== undefined")


def test_paper(test, browser, program, frames, work):
    """The paper's method alone: no scores, several heads at once, none selected then."""
    page, trace = os.path.join(work, "paper.html"), os.path.join(work, "paper")
    result = run(program, "--json", "--paper", "--report", page, "--trace", trace, os.path.join(frames, "sequence1"))
    records = [json.loads(line) for line in result.stdout.splitlines()]
    open_anew(browser, page)
    wrong = []
    for index, record in enumerate(records):
        go(browser, index)
        with open(os.path.join(trace, "sequence1", record["file"][:-len(".pgm")] + ".json"), encoding="utf-8") as file:
            why = test_hypotheses(browser, record) or test_nests(browser, json.load(file))
        if why:
            wrong.append((index, why))
    test.ok(len(records) == len(TAKEN) and not wrong, "--paper: every frame's hypotheses and nests", wrong[:2])
    test.same(browser.value("document.getElementById('evidence').textContent"), "", "--paper: no evidence that was not used")
    test.same(browser.value("document.getElementById('rig').textContent"), "", "--paper: no rig that was not checked")
    test.same(browser.errors, [], "--paper: no error on the console")


def test_moved(test, browser, program, frames, work):
    """A rig whose principal point is 2 px off."""
    page, wrong = os.path.join(work, "moved.html"), os.path.join(work, "moved.json")
    with open(os.path.join(frames, "sequence1", "rig.json"), encoding="utf-8") as file:
        rig = json.load(file)
    rig["camera_matrix"]["data"][5] += 2
    with open(wrong, "w", encoding="utf-8") as file:
        json.dump(rig, file)
    result = run(program, "--json", "--rig", wrong, "--report", page, os.path.join(frames, "sequence1"))
    records = [json.loads(line) for line in result.stdout.splitlines()]
    open_anew(browser, page)
    go(browser, 6)
    shown = browser.value("document.getElementById('rig').textContent")
    test.ok(shown == expected_rig(records[6]) and "has moved" in shown, "a rig that moved: by how much", shown)
    test.same(browser.value("document.getElementById('rig').className"), "quiet moved", "a rig that moved: in another colour")


def test_range(test, browser, program, work):
    """A list of points of another sensor, without truth: a ball before a wall."""
    folder = os.path.join(work, "range")
    os.makedirs(folder)
    matrix = {"type_id": "opencv-matrix", "dt": "d"}
    rig = {"kind": "range", "image_width": 320, "image_height": 240, "near_mm": 400, "far_mm": 2500,
           "camera_matrix": {**matrix, "rows": 3, "cols": 3, "data": [300, 0, 160, 0, 300, 120, 0, 0, 1]},
           "distortion_coefficients": {**matrix, "rows": 1, "cols": 5, "data": [0] * 5}}
    with open(os.path.join(folder, "rig.json"), "w", encoding="utf-8") as file:
        json.dump(rig, file)
    with open(os.path.join(folder, "a.xyz"), "w", encoding="utf-8") as file:
        for v in range(0, 240, 4):
            for u in range(0, 320, 4):
                x, y = (u - 160) / 300, (v - 120) / 300
                on_ball = x * x + y * y < 0.012
                z = 800 - 5000 * (0.012 - x * x - y * y) if on_ball else 1500
                file.write("%.1f %.1f %.1f\n" % (x * z, y * z, z))
    page = os.path.join(work, "range.html")
    result = run(program, "--json", "--report", page, folder)
    record = json.loads(result.stdout)
    open_anew(browser, page)
    test.same(json.loads(browser.value("document.getElementById('record').textContent")), record, "a list of points: the record")
    test.same(test_hypotheses(browser, record), "", "a list of points: the hypotheses")
    test.ok(not browser.value("document.getElementById('no-truth').hidden"), "without truth the page says so")
    test.ok("without a head" in browser.value("document.getElementById('next-wrong').textContent"),
            "without truth the next frame is one without a head")
    before = browser.value(PIXELS % "picture")
    browser.value("document.querySelector('[data-layer=image]').click()")
    test.ok(browser.value(PIXELS % "picture") != before, "a list of points: drawn as an image")
    test.same(browser.errors, [], "a list of points: no error on the console")


# --- the site ---------------------------------------------------------------------------------------

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")


def make_site(*arguments):
    return run("/usr/bin/python3", "-B", os.path.join(ROOT, "tools", "site.py"), *arguments)


def test_site(test, browser, page, work, keep):
    """All pages of the repository; the report page is this run's."""
    site = os.path.join(work, "site")
    result = make_site(site, page)
    test.ok(result.returncode == 0 and result.stderr == "", "site: every link leads somewhere", result.stderr)
    browser.errors.clear()
    browser.requests.clear()
    for name in ("index.html", "docs/design.html", "docs/report.html", "docs/experiments/README.html", "CONTRIBUTING.html"):
        for width, phone in ((1280, False), (390, True)):
            browser.size(width, 800, 1, phone)
            browser.open(os.path.join(site, name))
            wide = browser.value("document.documentElement.scrollWidth - %d" % width)
            test.ok(wide <= 0, "site: %s fits %d px" % (name, width), "%d px too wide" % wide)
            if keep:
                browser.screenshot(os.path.join(keep, "site_%s_%d.png" % (name.replace("/", "_"), width)))
        pictures = browser.value("[...document.images].every((i) => i.complete && i.naturalWidth > 0)")
        test.ok(pictures, "site: %s: its pictures are there" % name)
    outside = [url for url in browser.requests if not url.startswith(("file://" + site, "data:"))]
    test.same((outside, browser.errors), ([], []), "site: nothing is loaded from elsewhere, no error")
    browser.open(os.path.join(site, "index.html"))
    browser.click("a.open")
    browser.until("document.documentElement !== null && %s !== undefined" % SHOWN)  # null between two pages
    test.ok(browser.value("location.hash").startswith("#sequence2/"), "site: leads to the report page", browser.value("location.href"))
    browser.size(*DESK)
    result = make_site(work, page)
    test.ok(result.returncode == 2 and "name another folder" in result.stderr and os.path.exists(page), "site: another's folder is left alone", result.stderr)
    os.remove(os.path.join(site, "docs", "design.html"))
    found = run("/usr/bin/python3", "-B", "-c", "import runpy, sys; print(*runpy.run_path(sys.argv[1])['check'](sys.argv[2]), sep='\\n')",
                os.path.join(ROOT, "tools", "site.py"), site).stdout
    test.ok("index.html: docs/design.html: there is no docs/design.html" in found, "site: a link that leads nowhere is found", found)
    result = make_site(site, page)
    test.ok(result.returncode == 0 and os.path.exists(os.path.join(site, "docs", "design.html")), "site: its own folder is made anew")


# --- the file --------------------------------------------------------------------------------------

def test_hostile(test, browser, program, frames, work):
    """Names that would end the element that they stand in, or begin another one."""
    folder = os.path.join(work, "h<", "script><b id=evil><script>evil()<")
    os.makedirs(folder)
    name = "<!--<script>&quot;'\"<b id=evil>.pgm"
    shutil.copy(os.path.join(frames, "sequence1", "000005.pgm"), os.path.join(folder, name))
    with open(os.path.join(folder, "z<b id=evil>\u2028.pgm"), "w", encoding="utf-8") as file:
        file.write("P5 this is no frame")
    shutil.copy(os.path.join(frames, "sequence1", "rig.json"), folder)
    page = os.path.join(work, "hostile.html")
    run(program, "--report", page, folder)
    open_anew(browser, page)
    test.same(browser.value("document.querySelectorAll('#evil').length"), 0, "hostile names: no element of theirs")
    test.same(browser.value("Data.frames.map((f) => f.record.file)"), [name, "z<b id=evil>\u2028.pgm"], "hostile names: shown as they are")
    test.same(browser.value("Data.dirs.map((d) => d.path)"), [folder], "hostile names: the directory's too")
    go(browser, 1)
    test.ok("could not be processed" in browser.value("document.getElementById('hypotheses-text').textContent"), "a lost frame says why")
    test.same(browser.errors, [], "hostile names: nothing is run")


def limit_files():
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1500000, 1500000))


def test_files(test, program, frames, work):
    folder = os.path.join(work, "out")
    os.makedirs(folder)
    page = os.path.join(folder, "report.html")
    for old in (None, "an old page"):
        if old:
            with open(page, "w", encoding="utf-8") as file:
                file.write(old)
        result = run(program, "--report", page, frames, preexec_fn=limit_files)
        test.ok(result.returncode == 1 and page in result.stderr and "cannot be written" in result.stderr,
                "no room: status and message, %s" % (old or "no page before"), (result.returncode, result.stderr))
        test.same(os.listdir(folder), ["report.html"] if old else [], "no room: no half page, nothing left beside it")
    with open(page, encoding="utf-8") as file:
        test.same(file.read(), "an old page", "no room: the old page stays")
    empty = os.path.join(work, "empty")
    os.makedirs(empty)
    shutil.copy(os.path.join(frames, "sequence1", "rig.json"), empty)
    result = run(program, "--report", page, empty)
    test.ok(result.returncode == 1 and page in result.stderr and "no frame" in result.stderr and "Report" not in result.stdout,
            "no frames: status and message", (result.returncode, result.stdout, result.stderr))
    with open(page, encoding="utf-8") as file:
        test.same(file.read(), "an old page", "no frames: the old page stays")
    test.same(os.listdir(folder), ["report.html"], "no frames: nothing left beside it")
    for path, why in (("/dev/full", "regular file"), (folder, "regular file"), (os.path.join(folder, "no/report.html"), "No such file")):
        result = run(program, "--report", path, frames)
        test.ok(result.returncode == 1 and why in result.stderr and result.stdout == "", "%s: refused before any frame" % path,
                (result.returncode, result.stderr))


def test_stopped(test, program, frames, work):
    """Stopped in the midst of it, where it waits for a reader who does not read."""
    folder = os.path.join(work, "stopped")
    os.makedirs(folder)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE):
        process = subprocess.Popen([program, "--json", "--report", os.path.join(folder, "report.html"), *[frames] * 8],
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                   # nohup, or a shell in the background, may have it ignored
                                   preexec_fn=lambda number=number: signal.signal(number, signal.SIG_DFL))
        process.stdout.read(1)
        begun = len(os.listdir(folder))
        if number == signal.SIGPIPE:
            process.stdout.close()
        else:
            process.send_signal(number)
        test.same((begun, process.wait(600)), (1, -number), "%s in the midst ends it" % number.name)
        test.same(os.listdir(folder), [], "%s: no half page is left" % number.name)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--host-sim", required=True)
    parser.add_argument("--frames", required=True)
    parser.add_argument("--keep")
    options = parser.parse_args()
    if options.keep:
        os.makedirs(options.keep, exist_ok=True)
    test = Test()
    program = os.path.abspath(options.host_sim)
    with tempfile.TemporaryDirectory() as work:
        frames, page = os.path.join(work, "frames"), os.path.join(work, "report.html")
        make_input(options.frames, frames)
        result = run(program, "--json", "--report", page, "--trace", os.path.join(work, "trace"), frames)
        records = [json.loads(line) for line in result.stdout.splitlines()]
        test.same((result.returncode, len(records)), (1, 2 * len(TAKEN)), "the run: a record per frame, one of them lost")
        traces = []
        for record in records:
            path = os.path.join(work, "trace", os.path.basename(record["dir"]), record["file"][:-len(".pgm")] + ".json")
            traces.append(json.load(open(path, encoding="utf-8")) if os.path.exists(path) else None)
        text = run(program, frames).stdout
        size = os.path.getsize(page)
        with Browser(work) as browser:
            browser.size(*DESK)
            browser.media(prefers_color_scheme="light")
            browser.open(page)
            browser.until(SHOWN + " !== undefined")
            empty = browser.value("document.documentElement.outerHTML.length"
                                  " - [...document.querySelectorAll('.trace,.image')].reduce((n, e) => n + e.textContent.length, 0)")
            bytes_200 = empty + (size - empty) / (len(records) - 1) * 200
            test.ok(bytes_200 < PAGE_BYTES_MAX, "200 frames are below %.0f MB" % (PAGE_BYTES_MAX / 1e6), "%.1f MB" % (bytes_200 / 1e6))
            print("# %.2f MB for %d frames, so %.1f MB for 200" % (size / 1e6, len(records), bytes_200 / 1e6))
            right = browser.value("Data.frames.map((f) => Boolean(f.verdict && f.verdict.selected_right))")
            test_frames(test, browser, records, traces)
            test_table1(test, browser, text)
            go(browser, 5)
            test_limits(test, browser)
            test_keys(test, browser, records, right)
            test_space(test, browser)
            test_picture(test, browser)
            test_names(test, browser)
            test_shades(test, browser, right)
            test_looks(test, browser, options.keep)
            test.same(browser.errors, [], "no error on the console")
            test.same(browser.requests, ["file://" + page], "nothing is requested from the network")
            test_link(test, browser, page, records)
            test_against(test, browser, program, frames, work)
            test_paper(test, browser, program, frames, work)
            test_moved(test, browser, program, frames, work)
            test_range(test, browser, program, work)
            test_hostile(test, browser, program, frames, work)
            test_site(test, browser, page, work, options.keep)
        test_files(test, program, frames, work)
        test_stopped(test, program, frames, work)
    print("report: %d tests, %d failed" % (test.count, test.failed))
    return 1 if test.failed else 0


if __name__ == "__main__":
    sys.exit(main())
