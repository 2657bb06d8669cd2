#!/usr/bin/python3
"""tools/view: a made-up frame's pictures pixel by pixel, a rendered sequence's words against host_sim's records, films
and pages counted, and what is refused.

    view.py --view PROGRAM --host-sim PROGRAM --frames DIR --work DIR

Prints TAP; exit status 1 when a case fails.
"""

import argparse
import contextlib
import json
import os
import pty
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import time

import cv2
import numpy as np

import scene

FRAMES = 12  # of the rendered sequence
NESTED = 10  # the last frame that is taken of sequence1, whose first ones have whole contours in their nests
VERMILION, BLACK, WHITE, BLUE = (213, 94, 0), (0, 0, 0), (255, 255, 255), (0, 114, 178)
YELLOW, SKY = (240, 228, 66), (86, 180, 233)
LIMIT_S = 300  # what ends a program that hangs

number = failed = 0
options = None


def result(name, reason=None):
    global number, failed
    number += 1
    failed += bool(reason)
    print("%s %d - %s%s" % ("not ok" if reason else "ok", number, name, "\n# " + reason if reason else ""), flush=True)


def run(*words, **environment):
    done = subprocess.run([options.view] + [str(word) for word in words], capture_output=True, text=True,
                          stdin=subprocess.DEVNULL, check=False, timeout=LIMIT_S,
                          env=dict(os.environ, TMPDIR=os.path.join(options.work, "tmp"), **environment))
    return done.returncode, done.stdout, done.stderr


def must(*words, **environment):
    status, out, err = run(*words, **environment)
    if status != 0 or out:
        raise RuntimeError("view %s: status %d: %s%s" % (" ".join(map(str, words)), status, out, err))
    return err


def at(name):
    return os.path.join(options.work, name)


def read_json(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def write_json(path, value, **how):
    with open(path, "w", encoding="utf-8") as file:
        json.dump(value, file, **how)


class Picture:
    """A PNG whose plot begins at `corner` and shows the frame `scale` times as large."""

    def __init__(self, path, corner, scale):
        self.pixels = cv2.imread(path)[..., ::-1].astype(int)
        self.corner, self.scale = corner, scale

    def page(self, position):
        return tuple(corner + (value + 0.5) * self.scale for corner, value in zip(self.corner, position))

    def near(self, page, colour, radius=2, off=60):
        """Is a pixel within so many of this place of that colour?"""
        x, y = (int(round(value - 0.5)) for value in page)
        around = self.pixels[max(y - radius, 0):y + radius + 1, max(x - radius, 0):x + radius + 1]
        return bool((np.abs(around - colour).max(axis=2) <= off).any())

    def shows(self, position, colour, **how):
        return self.near(self.page(position), colour, **how)

    def brightness(self, position):
        x, y = (int(value) for value in self.page(position))
        return self.pixels[y, x].mean()


def around(of, times=1.0, count=120):
    """Places on an ellipse."""
    tilt = np.radians(of["angle"])
    for angle in np.linspace(0, 2 * np.pi, count, endpoint=False):
        x, y = of["a"] * times * np.cos(angle), of["b"] * times * np.sin(angle)
        yield (of["centre"][0] + x * np.cos(tilt) - y * np.sin(tilt),
               of["centre"][1] + x * np.sin(tilt) + y * np.cos(tilt))


def fraction(picture, positions, colour, **how):
    return np.mean([picture.shows(position, colour, **how) for position in positions])


def check_fraction(name, value, low, high=1.0):
    result(name, None if low <= value <= high else "%.2f; %.2f to %.2f was expected" % (value, low, high))


def case_contours():
    must("contours", "--trace", at("trace"), at("made"), at("contours.png"))
    picture = Picture(at("contours.png"), (20, 60), 820 / scene.WIDTH)
    solid = fraction(picture, around(scene.ACCEPTED), BLACK, radius=1)
    check_fraction("contours: the accepted hypothesis is a black line", solid, 0.9)
    dashed = fraction(picture, around(scene.REJECTED), BLUE, radius=0)
    check_fraction("contours: the rejected one is blue and has gaps", dashed, 0.4, 0.85)
    hollow = fraction(picture, around(scene.HEAD), WHITE, radius=1)
    check_fraction("contours: the head's line is hollow ..", hollow, 0.85)
    edge = fraction(picture, around(scene.HEAD, 1 + 2.7 / 820 * scene.WIDTH / scene.HEAD["a"]), VERMILION, radius=1)
    check_fraction("contours: .. with vermilion beside the hollow", edge, 0.9)
    result("contours: a cross marks the head's centre",
           None if picture.shows(scene.HEAD["centre"], VERMILION, radius=0) else "no vermilion there")
    line = [scene.node_px(x, 40) for x in [*np.arange(8, 12, 0.1), *np.arange(24, 40, 0.1)]]
    dark = np.mean([picture.shows(position, BLACK, radius=0) for position in line])
    check_fraction("contours: the open polygon is dashed", dark, 0.45, 0.75)
    part = [scene.node_px(x, y) for x in np.arange(30.5, 40, 0.25) for y in (5, 12)]
    check_fraction("contours: its elliptical part is a light line ..", fraction(picture, part, WHITE, radius=1), 0.95)
    chord = [scene.node_px(30, y) for y in np.arange(5.5, 12, 0.25)]
    check_fraction("contours: .. closed by its chord ..", fraction(picture, chord, WHITE, radius=1), 0.95)
    earlier = [scene.node_px(x, y) for x in np.arange(4.5, 10, 0.25) for y in (5, 12)]
    check_fraction("contours: no part of a slice before", fraction(picture, earlier, WHITE, radius=1), 0, 0.1)
    beside = [(u, v - 2.2 * scene.WIDTH / 820) for u, v in part[::2]]
    check_fraction("contours: .. between dark ones", fraction(picture, beside, BLACK, radius=1), 0.9)
    return picture


def case_bands(picture):
    """Two columns of the grid are a band of 20 mm; row 38 has nothing else on it."""
    v = scene.node_px(0, 38.2)[1]
    greys = [picture.brightness((scene.node_px(2 * band + 1.5, 0)[0], v)) for band in range(23)]
    result("bands: the deeper the lighter",
           None if all(a < b for a, b in zip(greys, greys[1:])) else "greys are %s" % greys)
    middle = [picture.brightness((scene.node_px(9.5 + shift, 0)[0], v)) for shift in (-1.8, -1.2, 0.1, 0.35)]
    result("bands: a band is 20 mm, and ends where the depth says",
           None if max(middle[1:]) - min(middle[1:]) < 3 and middle[0] < min(middle[1:]) - 3 else str(middle))
    outside = picture.brightness((scene.node_px(-1, 0)[0], v))
    result("bands: white where there is no surface", None if outside > 252 else "%.0f" % outside)


def case_level():
    """Cameras on their side, looking down, and both: the surface is in the level frame, the picture the camera's."""
    trace, rig = read_json(at("trace/000003.json")), read_json(at("made/rig.json"))
    trace["points"]["state"][7], trace["points"]["x_q28"][7], trace["points"]["y_q28"][7] = 1, round(0.1 * 2**28), round(-0.15 * 2**28)
    for folder in ("hung", "hung_trace"):
        os.makedirs(at(folder))
    shutil.copy(at("made/" + scene.FRAME), at("hung"))
    write_json(at("hung/rig.json"), {**rig, "kind": "range"})
    for name, roll_deg, tilt_deg, corner in (("on its side", 90, 0, (29, 0)), ("looking down", 0, 25, (0, -29)), ("both", -90, 25, (-29, 0))):
        roll, tilt = np.radians(roll_deg), np.radians(tilt_deg)
        level = (np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
                 @ np.array([[np.cos(roll), np.sin(roll), 0], [-np.sin(roll), np.cos(roll), 0], [0, 0, 1]]))
        write_json(at("hung_trace/000003.json"), {**trace, "level_q30": [round(value * 2**30) for value in level.ravel()]})

        def seen(x, y, of=level):
            """A direction of the level frame, by its slopes, in the camera's picture."""
            direction = of.T @ [x, y, 1]
            return tuple(scene.CENTRE + scene.FOCAL * direction[:2] / direction[2])

        def node(x, y, at_px=seen):
            return at_px((x - 23) * scene.STEP_PX / scene.FOCAL, (y - 23) * scene.STEP_PX / scene.FOCAL)
        must("contours", "--trace", at("hung_trace"), at("hung"), at("hung.png"))
        picture = Picture(at("hung.png"), (20, 60), 820 / scene.WIDTH)
        part = [node(x, y) for x in np.arange(30.5, 39, 0.25) for y in (5, 12)]
        part = [px for px in part if 4 < px[0] < scene.WIDTH - 4 and 4 < px[1] < scene.HEIGHT - 4]
        result("level: enough of the part is in the picture, " + name, None if len(part) > 30 else len(part))
        check_fraction("level: a contour's part is where the camera sees it, " + name, fraction(picture, part, WHITE, radius=1), 0.95)
        greys = [picture.brightness(node(x, 16)) for x in np.arange(19.5, 31, 2)]
        result("level: so are the bands, " + name, None if all(a < b for a, b in zip(greys, greys[1:])) else str(greys))
        solid = fraction(picture, around(scene.ACCEPTED), BLACK, radius=1)
        check_fraction("level: an ellipse is the picture's own, " + name, solid, 0.9)
        tip = 20 + 48 + corner[0] * 24 / 29, 60 + 820 * scene.HEIGHT / scene.WIDTH - 48 + corner[1] * 24 / 29
        result("level: an arrow says which way is up, " + name, None if picture.near(tip, SKY, radius=3) else "nothing at %s" % (tip,))
        must("control", "--trace", at("hung_trace"), at("hung"), at("hung.png"))
        picture = Picture(at("hung.png"), (20, 64), 1880 / scene.WIDTH)
        u, v = picture.page(seen(0.1, -0.15))
        ring = [picture.near((u + 6.5 * np.cos(t), v + 6.5 * np.sin(t)), YELLOW, radius=3) for t in np.linspace(0, 6.28, 8, endpoint=False)]
        result("level: a point of a depth image, " + name, None if all(ring) else str(ring))


def case_control():
    must("control", "--trace", at("trace/000003.json"), at("made"), at("control.png"))
    picture = Picture(at("control.png"), (20, 64), 1880 / scene.WIDTH)
    problems = []
    for slot, position, residual_px in scene.DOTS:
        u, v = picture.page(position)
        if slot is None:
            seen = picture.near((u + 3, v + 3), SKY), not picture.near((u, v + 8), YELLOW)
        else:
            # the line is level and runs to the right as the dot comes nearer: beside it is below
            end = v + residual_px * 40 * picture.scale
            bar = [picture.near((u, v + (end - v) * part), VERMILION) for part in (0.3, 0.6, 0.95)]
            seen = (picture.near((u + 5, v), YELLOW), all(bar),
                    not picture.near((u, end + np.sign(residual_px) * 8), VERMILION),
                    not picture.near((u, v - np.sign(residual_px) * 20), VERMILION))
        if not all(seen):
            problems.append("dot of slot %s: %s" % (slot, seen))
    result("control: rings, crosses, and bars across the epipolar lines, 40 times as long", "; ".join(problems))
    number_there = picture.pixels[int(picture.page((200, 150))[1]) - 6:int(picture.page((200, 150))[1]) + 6,
                                  int(picture.page((200, 150))[0]) + 8:int(picture.page((200, 150))[0]) + 26]
    result("control: a number beside a labelled dot",
           None if number_there.min(axis=2).max() > 220 else "nothing white beside it")


def case_real_residuals():
    """Where the bars of a rendered frame end, by OpenCV's model of the lens and the rig's own numbers."""
    directory = os.path.join(options.frames, "sequence1")
    must("control", "--trace", at("traces"), "--from", "000010.pgm", directory, at("real.png"))
    trace = read_json(at("traces/sequence1/000010.json"))
    rig = read_json(os.path.join(directory, "rig.json"))
    camera, lens, origin, rays = (np.array(rig[key]["data"], float) for key in (
        "camera_matrix", "distortion_coefficients", "projector_origin", "dot_rays"))
    camera, rays = camera.reshape(3, 3), rays.reshape(361, 3)
    picture = Picture(at("real.png"), (20, 64), 1880 / rig["image_width"])
    there = checked = 0
    for slot, label in enumerate(trace["labels"]["slot"]):
        if label is None or abs(label["perp_px_q12"]) < 0.25 * 4096:
            continue
        dot = np.array([trace["dots"][key][label["dot"]] / 4096 for key in ("u_px_q12", "v_px_q12")])
        position = cv2.undistortPoints(dot.reshape(1, 1, 2), camera, lens)[0, 0]
        infinity = rays[slot, :2] / rays[slot, 2]
        direction = origin[:2] - origin[2] * infinity
        nearest = infinity + direction * ((position - infinity) @ direction) / (direction @ direction)
        on_line = cv2.projectPoints(np.array([[*nearest, 1.0]]), np.zeros(3), np.zeros(3), camera, lens)[0][0, 0]
        checked += 1
        there += picture.shows(dot + (dot - on_line) * 0.9 * 40, VERMILION, radius=3, off=80)
    result("control: a rendered frame's bars end where the rig says",
           None if checked >= 20 and there >= 0.9 * checked else "%d of %d" % (there, checked))


def case_trace(records):
    """What the trace holds for pictures: parts that have their slice's moments, detections that the record has too."""
    whole = parts = 0
    problems = []
    for folder, record in records:
        index = record["file"]
        trace = read_json(at("traces/%s/%s.json" % (folder, index[:-len(".pgm")])))
        found = [(part["nest"], part["slice"], cut["level_mm_q8"], part["x_y_q9"])
                 for cut in trace["cuts"] for contour in cut["contour"] for part in contour["part"]]
        nests = trace["hypotheses"]["nest"]
        wanted = [(n, s) for n, nest in enumerate(nests) for s, slice_ in enumerate(nest["slice"])
                  if not slice_["whole"]]
        whole += sum(slice_["whole"] for nest in nests for slice_ in nest["slice"])
        parts += len(wanted)
        if sorted(wanted) != sorted(item[:2] for item in found):
            problems.append("frame %s: parts of %s, not of %s" % (index, sorted(found), wanted))
        for nest, slice_, level, positions in found:
            of = nests[nest]["slice"][slice_]
            here = np.array(positions) / 512
            after = np.roll(here, -1, axis=0)
            cross = here[:, 0] * after[:, 1] - after[:, 0] * here[:, 1]
            area = cross.sum() / 2
            middle = ((here + after) * cross[:, None]).sum(axis=0) / (6 * area)
            off = [area - of["area_q16"] / 65536, *(middle - [of["x_q16"] / 65536, of["y_q16"] / 65536])]
            if np.abs(off).max() > 1e-3 or level != nests[nest]["front_mm_q8"] + of["behind_mm_q8"]:
                problems.append("frame %s, nest %d, slice %d: off by %s" % (index, nest, slice_, off))
        shown = [[f["u_px_q12"], f["v_px_q12"], f["a_px_q12"], f["b_px_q12"]] for f in trace["findings"]]
        said = [[value * 4096 for value in h["pixel"] + h["axes_px"]] for h in record["hypotheses"]]
        if len(shown) != len(said) or (shown and np.abs(np.subtract(shown, said)).max() > 0.006 * 4096):
            problems.append("frame %s: detections are not the record's hypotheses" % index)
        if (trace["result"]["head"], trace["result"]["selected"]) != (record["heads"], record["head"]):
            problems.append("frame %s: the result is not the record's" % index)
    result("trace: a part per slice that is not whole, with its moments; the record's detections and result",
           "; ".join(problems) or (None if whole > 5 and parts > 20 else "hardly any slices: %d, %d" % (whole, parts)))


def pdf_words(path, *how):
    return subprocess.run(["pdftotext", *how, path, "-"], capture_output=True, text=True, check=True).stdout


def pdf_pages(path):
    text = subprocess.run(["pdfinfo", path], capture_output=True, text=True, check=True).stdout
    size = re.search(r"Page size: +([\d.]+) x ([\d.]+)", text)
    return int(re.search(r"Pages: +(\d+)", text)[1]), sorted(float(value) for value in size.groups())


def distance_mm(record):
    """Of the head, from the trace: a record's one decimal may be a tie."""
    path = os.path.join(at("traces"), "short", os.path.splitext(record["file"])[0] + ".json")
    with open(path, encoding="utf-8") as file:
        return json.load(file)["findings"][record["head"]]["distance_mm_q8"] / 256


def case_words(records):
    """What stands in the PDFs, against the records and the trace."""
    must("sheet", "--trace", at("traces"), "--from", "000003", "--count", "9", at("short"), at("sheet.pdf"))
    text = pdf_words(at("sheet.pdf")).replace("other candidate, no head", "")  # the key
    words = re.findall(r"head (?:at|near) (\d+) mm|(no head)", text)
    chosen = records[3:12]
    expected = ["%.0f" % distance_mm(r) if r["head"] is not None else "" for r in chosen]
    result("sheet: the nine distances are the records'",
           None if sorted(w[0] for w in words) == sorted(expected) else "%s, not %s" % (words, expected))
    result("sheet: a page of A4", None if pdf_pages(at("sheet.pdf")) == (1, [595.28, 841.89]) else "not one of A4")
    must("contours", "--trace", at("traces"), "--count", "3", at("short"), at("contours.pdf"))
    result("contours: a page per frame", None if pdf_pages(at("contours.pdf"))[0] == 3 else "not three pages")
    problems = []
    for page in range(3):
        text = pdf_words(at("contours.pdf"), "-layout", "-f", str(page + 1), "-l", str(page + 1))
        for hypothesis in read_json(at("traces/short/%06d.json" % page))["heads"]["hypothesis"]:
            reason = hypothesis["rejected"]
            wanted = "rejected: %s, at %.0f mm" % (reason, hypothesis["distance_mm_q8"] / 256) if reason else "accepted"
            area = "area %.0f cm² (120 to 560)" % (hypothesis["area_mm2"] / 100)
            if wanted not in text or (reason in (None, "area") and area not in text):
                problems.append("page %d has no '%s' with '%s'" % (page + 1, wanted, area))
    result("contours: every hypothesis, its reason and its value", "; ".join(problems))
    picture = subprocess.run(["pdftoppm", "-r", "60", "-png", "-f", "1", "-l", "1", at("contours.pdf")],
                             capture_output=True, check=True).stdout
    pixels = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    result("PDF: it is drawn by another program", None if pixels is not None and pixels.std() > 20 else "blank")


def case_reasons():
    """Each test's failure shows the value that failed, of the made-up trace."""
    cases = [("area", {}, "area 117 cm² (120 to 560)"),
             ("curvature", {"curvature_mm_q8": 59 * 256}, "curvature 59 mm (60 to 800)"),
             ("curvature", {"extent_mm_q8": 64 * 256}, "extent in depth 64 mm (65 or more)"),
             ("shape", {"upright_q16": 59000}, "height / width 0.95 (0.97 or more)"),
             ("outline", {}, "not behind it below: 7 of 20 (45 % or more)"), ("of tomorrow", {}, None)]
    problems = []
    for reason, changes, words in cases:
        trace = scene.trace()
        trace["heads"]["hypothesis"][1].update(changes, rejected=reason)
        write_json(at("reason.json"), trace)
        must("contours", "--trace", at("reason.json"), at("made"), at("reason.pdf"))
        after = pdf_words(at("reason.pdf"), "-layout").split("rejected: " + reason)
        lines = [line.strip() for line in after[1].splitlines()[1:] if line.strip()] if len(after) == 2 else None
        if lines is None or [line for line in lines if "(" in line] != ([words] if words else []):
            problems.append("%s: %s" % (reason, lines))
    result("contours: each reason with the value that failed, and no other", "; ".join(problems))


def case_sheet():
    must("sheet", "--trace", at("traces"), "--count", "9", at("short"), at("sheet.png"))
    rig = read_json(at("short/rig.json"))
    height = 264 * rig["image_height"] / rig["image_width"]
    expected = (round(32 - 14 + 2 * (2 * height + 4 + 34 + 14)), 32 - 14 + 5 * (264 + 14))
    pixels = cv2.imread(at("sheet.png"))
    result("sheet: nine frames and the key in five columns and two rows",
           None if pixels.shape[:2] == expected else "%s, not %s" % (pixels.shape[:2], expected))
    result("sheet: below 400 kB", None if os.path.getsize(at("sheet.png")) < 400000 else "larger")


def film(path):
    capture = cv2.VideoCapture(path)
    frames = []
    while True:
        good, frame = capture.read()
        if not good:
            return frames, capture.get(cv2.CAP_PROP_FPS)
        frames.append(frame)


def case_film():
    must("pair", "--trace", at("traces"), at("short"), at("film.mp4"))
    frames, rate = film(at("film.mp4"))
    result("film: a frame per frame, at the sequence's rate",
           None if len(frames) == FRAMES and abs(rate - 10) < 0.01 else "%d at %g per s" % (len(frames), rate))
    must("pair", "--trace", at("traces"), "--from", "000007", at("short"), at("pair.png"))
    still = cv2.imread(at("pair.png")).astype(int)
    off = [np.abs(still - frame.astype(int)).mean() for frame in frames]
    result("film: its frames are the pictures, in order",
           None if np.argmin(off) == 7 and off[7] < 6 else "nearest to %d, off by %.1f" % (np.argmin(off), min(off)))
    status, _, err = run("pair", "--trace", at("traces"), at("short"), at("none.mp4"),
                         OPENCV_VIDEOIO_PRIORITY_FFMPEG="0")
    result("film: without an encoder it says so, and leaves nothing",
           None if status == 1 and "no encoder for MP4" in err and not os.path.exists(at("none.mp4")) else err)


def limit_files():
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))


def case_full_disk():
    """An old film stays, nothing is left beside it, and the message says so; a film's writer prints nothing of its own."""
    for name in ("full.mp4", "full.pdf", "full.png"):
        os.makedirs(at("full"), exist_ok=True)
        path = os.path.join(at("full"), name)
        with open(path, "w", encoding="ascii") as file:
            file.write("old")
        verb = "contours" if name.endswith("png") else "pair"
        ended = subprocess.run([options.view, verb, "--trace", at("traces"), at("short"), path], preexec_fn=limit_files,
                               capture_output=True, text=True, check=False)
        with open(path, "rb") as file:
            content = file.read()
        good = ended.returncode == 1 and "could not be written" in ended.stderr and content == b"old"
        left = [other for other in os.listdir(at("full")) if other != name]
        result("no room for %s: told, and the old one stays" % name,
               None if good and not left else "status %d, said %s, %d bytes, beside it %s"
               % (ended.returncode, ended.stderr, len(content), left))
        os.remove(path)


def case_straight():
    must("contours", "--from", "000004", at("short"), at("straight.png"))
    must("contours", "--from", "000004", "--trace", at("traces"), at("short"), at("traced.png"))
    with open(at("straight.png"), "rb") as one, open(at("traced.png"), "rb") as other:
        result("straight from frames: the same bytes", None if one.read() == other.read() else "they differ")
    # host_sim keeps the suffix in a trace's name where frames differ in it alone.
    shutil.copytree(at("traces"), at("suffixed"))
    os.rename(at("suffixed/short/000004.json"), at("suffixed/short/000004.pgm.json"))
    must("contours", "--from", "000004.pgm", "--trace", at("suffixed"), at("short"), at("suffixed.png"))
    with open(at("straight.png"), "rb") as one, open(at("suffixed.png"), "rb") as other:
        result("a trace that has its frame's suffix", None if one.read() == other.read() else "another picture")
    done = subprocess.run([options.view, "control", "--from", "000004", ".", at("here.png")], cwd=at("short"),
                          capture_output=True, text=True, check=False)
    result("straight from frames: of the working directory", None if done.returncode == 0 else done.stderr)
    os.makedirs(at("norig"), exist_ok=True)
    shutil.copy(at("short/000000.pgm"), at("norig"))
    must("control", "--rig", at("short/rig.json"), at("norig"), at("norig.png"))
    result("straight from frames: with --rig", None if os.path.getsize(at("norig.png")) > 0 else "nothing")
    shutil.copytree(at("short"), at("holed"), dirs_exist_ok=True)
    with open(at("holed/000001.pgm"), "wb") as file:
        file.write(b"P5\n7 7\n255\n")
    status, _, err = run("control", "--from", "000002", at("holed"), at("holed.png"))
    result("straight from frames: a bad one among them is reported, status 1, and the picture is there",
           None if status == 1 and "000001.pgm" in err and os.path.exists(at("holed.png")) else err)


def case_paper():
    """With the paper's method alone the heads are hypotheses."""
    subprocess.run([options.host_sim, "--json", "--paper", "--trace", at("papers"), at("short")], check=True,
                   stdout=subprocess.DEVNULL)
    for name in sorted(os.listdir(at("papers/short"))):
        trace = read_json(at("papers/short/" + name))
        if trace["result"]["selected"] is not None:
            break
    must("contours", "--trace", at("papers"), "--from", name[:-5], "--count", "1", at("short"), at("paper.pdf"))
    words = pdf_words(at("paper.pdf"))
    selected = trace["result"]["selected"]
    distance = "%.0f" % (trace["heads"]["hypothesis"][selected]["distance_mm_q8"] / 256)
    result("the paper's method alone: its head, and no probability",
           None if "head at %s mm" % distance in words and "% sure" not in words and "whole" not in words else words)


def case_empty():
    trace = scene.trace()
    trace.update({"surface": {"valid": False}, "cuts": [], "findings": []})
    trace["hypotheses"]["nest"] = trace["heads"]["hypothesis"] = []
    trace["heads"]["head"] = trace["result"]["head"] = []
    trace["result"]["selected"] = None
    trace["dots"] = {"u_px_q12": [], "v_px_q12": []}
    trace["labels"]["slot"] = [None] * 361
    write_json(at("empty.json"), trace)
    must("contours", "--trace", at("empty.json"), at("made"), at("empty.pdf"))
    words = pdf_words(at("empty.pdf"))
    result("a frame without anything in it", None if all(w in words for w in (
        "no head", "no surface: too few points", "no hypotheses")) else words)
    must("control", "--trace", at("empty.json"), at("made"), at("empty.png"))


def refuse(name, expected, *words, wanted=1, out="refused.png"):
    status, _, err = run(*words, at(out))
    good = status == wanted and re.search(expected, err) and len(err.splitlines()) == 1 and not os.path.exists(at(out))
    result("refused: " + name, None if good else "status %d, said: %s" % (status, err))


def case_bad_traces():
    text = json.dumps(scene.trace())

    def broken(name, expected, content):
        with open(at("broken.json"), "w", encoding="utf-8") as file:
            file.write(content)
        refuse(name, expected, "contours", "--trace", at("broken.json"), at("made"))

    broken("a trace that is cut short, with its line", r"broken\.json:1:2001: no JSON: it ends too soon", text[:2000])
    pretty = json.dumps(scene.trace(), indent=1).splitlines()
    pretty[6] = pretty[6] + " oops"
    broken("a trace with something else in line 7", r"broken\.json:7:\d+: no JSON", "\n".join(pretty))
    broken("an empty trace", r"broken\.json:1:1: no JSON: it ends too soon", "")
    broken("a trace with a number beyond all", r"broken\.json: number overflow parsing '1e999'", "[1e999]")
    broken("a trace that is a list", r'must be an object with "file", is \[\]', "[]")
    for name, expected, change in [
            ("no result", r'broken\.json: has no "result"', lambda t: t.pop("result")),
            ("46 rows", r"surface\.depth_mm_q8: must have 47 entries, has 46",
             lambda t: t["surface"]["depth_mm_q8"].pop()),
            ("a short row", r"surface\.depth_mm_q8\[9\]: must have 47 entries, has 46",
             lambda t: t["surface"]["depth_mm_q8"][9].pop()),
            ("a depth that is a word", r'surface\.depth_mm_q8\[3\]\[4\]: must be an integer.*is "deep"',
             lambda t: t["surface"]["depth_mm_q8"][3].__setitem__(4, "deep")),
            ("a dot that is not there", r"labels\.slot\[5\]\.dot: must be an integer from 0 to 2, is 3",
             lambda t: t["labels"]["slot"][5].update(dot=3)),
            ("a nest that is not there", r"heads\.hypothesis\[1\]\.nest: must be an integer from 0 to 1, is 2",
             lambda t: t["heads"]["hypothesis"][1].update(nest=2)),
            ("a selected head that is not there", r"result\.selected: must be an integer from 0 to 0, is 7",
             lambda t: t["result"].update(selected=7)),
            ("360 slots", r"labels\.slot: must have 361 entries, has 360", lambda t: t["labels"]["slot"].pop()),
            ("a number that is too large", r"heads\.hypothesis\[0\]\.area_mm2: must be an integer",
             lambda t: t["heads"]["hypothesis"][0].update(area_mm2=2**63)),
            ("a frame's name that leads elsewhere", r"file: must be the name of a frame",
             lambda t: t.update(file="../made/000003.pgm")),
            ("a frame that is not there", r"made/000009\.pgm: No such file", lambda t: t.update(file="000009.pgm"))]:
        trace = scene.trace()
        change(trace)
        broken(name, expected, json.dumps(trace))
    chance = random.Random(8)
    problems = []
    for _ in range(25):
        bad = bytearray(text.encode())
        position = chance.randrange(len(bad))
        bad[position:position + chance.choice((1, 1, 40))] = bytes([chance.randrange(256)])
        with open(at("fuzzed.json"), "wb") as file:
            file.write(bad)
        status, _, err = run("pair", "--trace", at("fuzzed.json"), at("made"), at("fuzzed.png"))
        if status not in (0, 1) or (status == 1 and "fuzzed.json:" not in err and "/made/" not in err):
            problems.append("byte %d: status %d: %s" % (position, status, err))
    result("25 traces with a wrong byte: drawn or refused by name", "; ".join(problems))


def case_bad_input():
    trace, made = ("--trace", at("trace")), at("made")
    refuse("no frames directory", "nowhere: not a directory; expected a frames directory", "contours", *trace, at("nowhere"))
    refuse("no rig", r"trace/rig\.json: No such file", "contours", *trace, at("trace"))
    refuse("a trace that is not there", "gone: is not there: host_sim --trace", "contours", "--trace", at("gone"), made)
    refuse("a folder without traces", "holds a trace", "contours", "--trace", at("tmp"), made)
    refuse("a frame that is not traced", "has no trace of a frame 000007", "contours", *trace, "--from", "000007", made)
    refuse("a frame that is not there", r"^view: [^\n]*/short: has no trace of a frame 999999", "contours", "--from", "999999", at("short"))
    refuse("another kind of file", r"must end in \.png, \.pdf or \.mp4", "contours", *trace, made, out="refused.jpg")
    refuse("five pictures in a PNG", "a PNG holds one picture, not 5", "contours", *trace, "--count", "5", made)
    refuse("a film of sheets", "a sheet is one picture", "sheet", *trace, made, out="refused.mp4")
    refuse("a folder that is not there", "could not be written: No such file", "contours", *trace, made,
           out="gone/refused.png")
    refuse("a film into a folder that is not there", "could not be written: No such file", "pair", *trace, made,
           out="gone/refused.mp4")
    status, _, err = run("contours", at("nothing"), at("refused.png"))
    result("refused: no frames at all", None if status == 1 and "could use none of its frames" in err and
           not os.path.exists(at("refused.png")) else err)
    refuse("no verb", "the first word must be", "picture", made, wanted=2)
    refuse("a wrong count", "--count 0: must be a whole number", "contours", "--count", "0", made, wanted=2)
    refuse("an empty argument", "argument is empty", "contours", "--trace", "", made, wanted=2)
    refuse("an unknown option", "^view: unrecognized option", "contours", "--colour", made, wanted=2)
    status, _, err = run("contours", made)
    result("refused: no FILE", None if status == 2 and "FILE are needed" in err else err)
    wrong = scene.rig()
    wrong["image_width"] = 320
    os.makedirs(at("other"), exist_ok=True)
    write_json(at("other/rig.json"), wrong)
    refuse("a frame of another size", "has 640x480 pixels, the rig 320x480", "contours", *trace, "--rig",
           at("other/rig.json"), made)
    wrong = scene.rig()
    wrong["dot_rays"]["data"][5] = 0
    write_json(at("other/rig.json"), wrong)
    refuse("a ray that points sideways", r"dot_rays\.data\[5\]: must be more than 0", "control", *trace, "--rig",
           at("other/rig.json"), made)
    with open(at("other/rig.json"), "w", encoding="utf-8") as file:
        file.write("{\n\"image_width\": 640,\n\"image_height\"; 480}")
    refuse("a rig that is no JSON, with its line", r"other/rig\.json:3:\d+: no JSON", "contours", *trace, "--rig",
           at("other/rig.json"), made)


def case_progress():
    """host_sim's, then ours, on a terminal only; nothing is left of it."""
    words = [options.view, "control", at("short"), at("progress.pdf")]
    quiet = subprocess.run(words, capture_output=True, check=False).stderr
    result("progress: none in a pipe", quiet.decode())
    try:
        ours, theirs = pty.openpty()
    except OSError as reason:
        result("progress: on a terminal # SKIP none can be opened here, /dev/pts: %s" % reason.strerror)
        return
    with subprocess.Popen(words, stdin=subprocess.DEVNULL, stderr=theirs) as process:
        os.close(theirs)
        shown = b""
        with contextlib.suppress(OSError):  # all is read, and the other end closed
            while data := os.read(ours, 4096):
                shown += data
    os.close(ours)
    steps = [b"\r\x1b[Kshort 1/%d" % FRAMES, b"\r\x1b[Kdrawing 1/%d" % FRAMES]
    result("progress: on a terminal", None if process.returncode == 0 and all(s in shown for s in steps) else repr(shown))
    result("progress: nothing is left of it", None if shown.endswith(b"\r\x1b[K") else repr(shown[-80:]))


def children(pid):
    with open("/proc/%d/task/%d/children" % (pid, pid), encoding="ascii") as file:
        return [int(word) for word in file.read().split()]


def is_there(pid):
    return os.path.exists("/proc/%d" % pid)


def stopped(number, ready, *words, ignored=False):
    """Starts view, sends it a signal once ready(process, its children so far) is true; what it said, its status, and
    whether a child is left."""
    environment = dict(os.environ, TMPDIR=at("tmp"))

    def prepare_child():  # whoever started this test may ignore the signal, and children inherit that
        signal.signal(number, signal.SIG_IGN if ignored else signal.SIG_DFL)

    with subprocess.Popen([options.view, *words], stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                          env=environment, preexec_fn=prepare_child) as process:
        seen = set()
        end = time.monotonic() + LIMIT_S
        while process.poll() is None and time.monotonic() < end:
            with contextlib.suppress(FileNotFoundError):
                seen.update(children(process.pid))
            if ready(seen):
                break
            time.sleep(0.002)
        process.send_signal(number)
        said = process.communicate(timeout=LIMIT_S)[1]
    return said, process.returncode, [pid for pid in seen if is_there(pid)]


def case_stopped():
    """By a signal to itself alone, as a service manager sends it: while host_sim runs, and while it draws."""
    # So long that a signal comes while there is still a lot to do, however late this test is with it.
    long, traces = at("long"), at("traces/long")
    os.makedirs(long)
    os.makedirs(traces)
    for index in range(300):
        os.symlink(at("short/%06d.pgm" % (index % FRAMES)), os.path.join(long, "%06d.pgm" % index))
        os.symlink(at("traces/short/%06d.json" % (index % FRAMES)), os.path.join(traces, "%06d.json" % index))
    shutil.copy(at("short/rig.json"), long)

    def with_traces(seen):
        return seen and any(name.endswith(".json") for _, _, names in os.walk(at("tmp")) for name in names)

    def drawing(_):
        return os.path.exists(at("stopped.mp4.part.mp4")) and os.path.getsize(at("stopped.mp4.part.mp4")) > 0

    for name, number, ready, words in [
            ("host_sim runs", signal.SIGTERM, with_traces, ("control", long, at("stopped.pdf"))),
            ("host_sim runs", signal.SIGINT, with_traces, ("sheet", long, at("stopped.png"))),
            ("host_sim runs", signal.SIGHUP, with_traces, ("control", long, at("stopped.pdf"))),
            ("it draws", signal.SIGINT, drawing, ("pair", long, at("stopped.mp4"))),
            ("it draws a trace", signal.SIGTERM, drawing, ("pair", "--trace", at("traces"), long, at("stopped.mp4")))]:
        said, status, alive = stopped(number, ready, *words)
        left = os.listdir(at("tmp")) + [other for other in os.listdir(options.work) if other.startswith("stopped")]
        good = status == -number and not said and not alive and not left
        result("stopped while %s, by %s: nothing is left" % (name, signal.Signals(number).name),
               None if good else "status %d, said %s, alive %s, left %s" % (status, said, alive, left))
    said, status, _ = stopped(signal.SIGHUP, with_traces, "control", at("short"), at("went_on.png"), ignored=True)
    result("a signal that is ignored, as by nohup, stops nothing",
           None if status == 0 and os.path.exists(at("went_on.png")) else "status %d, said %s" % (status, said))


def case_help():
    status, out, err = run("--help")
    wide = [line for line in out.splitlines() if len(line) > 80]
    result("--help fits a terminal of 80 columns", None if status == 0 and out and not err and not wide else str(wide))


def prepare():
    shutil.rmtree(options.work, ignore_errors=True)
    for name in ("tmp", "nothing", "short"):
        os.makedirs(at(name))
    scene.write(options.work)
    source = os.path.join(options.frames, "sequence2")
    for name in ["%06d.pgm" % index for index in range(FRAMES)] + ["rig.json"]:
        shutil.copy(os.path.join(source, name), at("short"))
    with open(os.path.join(source, "frames.jsonl"), encoding="utf-8") as file, \
            open(at("short/frames.jsonl"), "w", encoding="utf-8") as short:
        short.writelines(line for line in file if json.loads(line)["file"] < "%06d.pgm" % FRAMES)
    shutil.copy(at("short/rig.json"), at("nothing"))
    out = subprocess.run([options.host_sim, "--json", "--trace", at("traces"), at("short")], capture_output=True,
                         text=True, check=True).stdout
    one = os.path.join(options.work, "sequence1")
    os.makedirs(one)
    for name in ["%06d.pgm" % index for index in range(NESTED + 1)] + ["rig.json"]:
        shutil.copy(os.path.join(options.frames, "sequence1", name), one)
    more = subprocess.run([options.host_sim, "--json", "--trace", at("traces"), one], capture_output=True, text=True,
                          check=True).stdout
    return [[json.loads(line) for line in lines.splitlines()] for lines in (out, more)]


def main():
    global options
    parser = argparse.ArgumentParser()
    for name in ("--view", "--host-sim", "--frames", "--work"):
        parser.add_argument(name, required=True, type=os.path.abspath)
    options = parser.parse_args()
    records, nested = prepare()
    case_bands(case_contours())
    case_level()
    case_control()
    case_real_residuals()
    case_trace([("short", record) for record in records] + [("sequence1", record) for record in nested])
    case_words(records)
    case_reasons()
    case_sheet()
    case_film()
    case_full_disk()
    case_straight()
    case_paper()
    case_empty()
    case_bad_traces()
    case_bad_input()
    case_help()
    case_progress()
    case_stopped()
    left = os.listdir(at("tmp")) + [name for name in os.listdir(options.work) if ".part" in name]
    result("nothing temporary is left", None if not left else ", ".join(left))
    print("1..%d" % number)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
