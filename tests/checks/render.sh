#!/bin/sh
# tools/render on itself: the same options give the same bytes, another seed gives others, every
# size and depth works, the truth fits the frames, wrong options and unwritable output are reported.
#
#     render.sh RENDER
#
# Prints TAP; exit status 1 when a case fails.
set -eu
LC_ALL=C
export LC_ALL

if [ $# -ne 1 ] || [ ! -x "$1" ]; then
    echo "usage: $0 RENDER" >&2
    exit 2
fi
render=$(cd "$(dirname "$1")" && pwd)/$(basename "$1")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# A report of a sanitizer must not pass for the program's own status 1.
ASAN_OPTIONS="${ASAN_OPTIONS:+$ASAN_OPTIONS:}exitcode=99"
UBSAN_OPTIONS="${UBSAN_OPTIONS:+$UBSAN_OPTIONS:}halt_on_error=1:exitcode=99"
export ASAN_OPTIONS UBSAN_OPTIONS

number=0
failed=0

# result NAME REASON: an empty reason is a pass.
result() {
    number=$((number + 1))
    if [ -z "$2" ]; then
        echo "ok $number - $1"
    else
        failed=$((failed + 1))
        echo "not ok $number - $1"
        echo "# $2"
    fi
}

# draw NAME DIR OPTION...: must succeed and say nothing.
draw() {
    name=$1
    dir=$2
    shift 2
    if "$render" "$@" "$dir" >out 2>err && [ ! -s out ] && [ ! -s err ]; then
        result "$name" ""
    else
        result "$name" "exit status or output: $(head -n 3 err out)"
    fi
}

# fingerprint DIR: of the names and bytes of all files.
fingerprint() { (cd "$1" && sha256sum -- *) | sha256sum; }

# refuse NAME STATUS PATTERN ARGUMENT...: must end with the status and a message.
refuse() {
    name=$1
    wanted=$2
    pattern=$3
    shift 3
    status=0
    "$render" "$@" >out 2>err || status=$?
    reason=
    [ "$status" = "$wanted" ] || reason="exit status $status, expected $wanted"
    grep -q -e "$pattern" err || reason="$reason no '$pattern' on standard error: $(head -n 1 err)"
    result "$name" "$reason"
}

small="--frames 2 --size 320x240"

# --- the same, and not the same ------------------------------------------------------------------
# shellcheck disable=SC2086 # a list of options
{
    draw "two frames" one $small --seed 5
    draw "the same again" again $small --seed 5
    draw "another seed" other $small --seed 6
    draw "a careless rig" careless $small --assembly 1 --seed 5
    draw "other people, a rig of its own seed" before $small --assembly 1 --rig-seed 5 --seed 6
}
[ "$(fingerprint one)" = "$(fingerprint again)" ] && reason= || reason="bytes differ"
result "the same options give the same bytes" "$reason"
[ "$(fingerprint one)" != "$(fingerprint other)" ] && reason= || reason="the same bytes"
result "another seed gives other bytes" "$reason"
cmp -s careless/rig.json before/rig.json && ! cmp -s careless/000000.pgm before/000000.pgm && reason= || reason="another rig, or the same picture"
result "others before the same rig" "$reason"

# --- every kind ----------------------------------------------------------------------------------
draw "1280x800, 16 bits, wide rig, hands" large --frames 1 --size 1280x800 --bits 16 --rig wide --sequence 2
draw "10 bits, strong lens, nothing behind" ten --frames 1 --size 640x480 --bits 10 --distortion strong \
    --background none
draw "12 bits, turning, no lens" twelve --frames 1 --size 320x240 --bits 12 --scene turning --distortion none
for scene in empty table room clutter; do
    draw "scene $scene, ambient bright" "$scene" --frames 1 --size 320x240 --scene "$scene" --ambient bright
done

cat >check.py <<'PYTHON'
import json, sys

directory, width, height, maximum, head_wanted = sys.argv[1], *map(int, sys.argv[2:5]), sys.argv[5]
rig = json.load(open(directory + "/rig.json"))
assert (rig["image_width"], rig["image_height"]) == (width, height), "rig's size"
assert len(rig["dot_rays"]["data"]) == 361 * 3, "rays"
frames = [json.loads(line) for line in open(directory + "/frames.jsonl")]
truths = [json.loads(line) for line in open(directory + "/truth.jsonl")]
assert [f["file"] for f in frames] == [t["file"] for t in truths], "files of frames and truth"
assert all(a["time_us"] < b["time_us"] for a, b in zip(frames, frames[1:])), "times"
for truth in truths:
    data = open(directory + "/" + truth["file"], "rb").read()
    fields = data.split(None, 4)[:4]
    assert fields == [b"P5", b"%d" % width, b"%d" % height, b"%d" % maximum], "header %s" % fields
    start = data.index(fields[3], data.index(fields[2], 2 + 1 + len(fields[1]))) + len(fields[3]) + 1
    assert len(data) - start == width * height * (1 if maximum < 256 else 2), "length of the samples"
    assert truth["dots"] or head_wanted != "yes", "no dots"
    both = truth["dots"] + truth["dim_dots"]
    assert len({d[0] for d in both}) == len(both), "a dot twice"
    for index, u, v, z_mm in both:
        assert 0 <= index < 361, "index %d" % index
        assert -0.5 <= u <= width - 0.5 and -0.5 <= v <= height - 0.5, "dot outside: %g %g" % (u, v)
        assert 0 < z_mm < 16000, "depth %g" % z_mm
    if head_wanted == "no":
        assert truth["head"] is None, "a head in an empty scene"
if head_wanted == "yes":
    assert any(t["head"] for t in truths), "no head"
PYTHON

# fits DIR WIDTH HEIGHT MAXVAL HEAD: parseable, and truth and frames fit each other.
fits() {
    if /usr/bin/python3 check.py "$@" >out 2>&1; then
        result "truth and rig of $1 fit its frames" ""
    else
        result "truth and rig of $1 fit its frames" "$(tail -n 1 out)"
    fi
}
fits one 320 240 255 any
fits large 1280 800 65535 any
fits ten 640 480 1023 any
fits twelve 320 240 4095 any
fits empty 320 240 255 no
fits table 320 240 255 no
fits room 320 240 255 no
fits clutter 320 240 255 no

# --- depth images --------------------------------------------------------------------------------
# Two directories: a ball 900 mm away before a wall, with a hole in it; a slanted wall.
cat >depths.py <<'PYTHON'
import json, math, os, struct

W, H, F = 160, 120, 140.0

def ball(u, v):
    x, y = (u - 79.5) / F, (v - 59.5) / F
    a, b, c = x * x + y * y + 1, -900.0, 900.0 ** 2 - 100.0 ** 2
    root = b * b - a * c
    if 20 <= u < 40:
        return 0
    return (-b - math.sqrt(root)) / a if root > 0 else 1500

def slope(u, v):
    return 1000 / (1 + 0.5 * (u - 79.5) / F)

def matrix(rows, cols, data):
    return {"type_id": "opencv-matrix", "rows": rows, "cols": cols, "dt": "d", "data": data}

def write(folder, depth, heads):
    os.makedirs(folder)
    with open(folder + "/000000.pgm", "wb") as file:
        file.write(b"P5\n%d %d\n65535\n" % (W, H))
        for v in range(H):
            file.write(b"".join(struct.pack(">H", round(depth(u, v))) for u in range(W)))
    rig = {"kind": "range", "image_width": W, "image_height": H,
           "camera_matrix": matrix(3, 3, [F, 0, 79.5, 0, F, 59.5, 0, 0, 1]),
           "distortion_coefficients": matrix(1, 5, [0, 0, 0, 0, 0]), "near_mm": 400, "far_mm": 4000}
    json.dump(rig, open(folder + "/rig.json", "w"))
    truth = {"file": "000000.pgm", "head": heads[0] if heads else None}
    if len(heads) > 1:
        truth["heads"] = heads
    print(json.dumps(truth), file=open(folder + "/truth.jsonl", "w"))

if __name__ == "__main__":
    head = {"centre_mm": [0, 0, 900], "semi_axes_mm": [100, 100, 100]}
    other = {"centre_mm": [350, 0, 900], "semi_axes_mm": [100, 100, 100]}
    write("range/ball", ball, [other, head])
    write("range/slope", slope, [])
PYTHON
cat >cast.py <<'PYTHON'
import json
from depths import ball, slope, F

# --seed 0: the camera is the depth camera, so a dot's pixel says which depth it must have.
rig = json.load(open("cast/rig.json"))
m = rig["camera_matrix"]["data"]
frames = [json.loads(line) for line in open("cast/frames.jsonl")]
truths = [json.loads(line) for line in open("cast/truth.jsonl")]
assert [f["source"] for f in frames] == ["ball/000000.pgm", "slope/000000.pgm"], "sources"
assert frames[1]["time_us"] - frames[0]["time_us"] >= 10000000, "unrelated frames without a gap"
for truth, depth in zip(truths, (ball, slope)):
    hit_count = 0
    for index, u, v, z in truth["dots"]:
        u, v = (u - m[2]) / m[0] * F + 79.5, (v - m[5]) / m[4] * F + 59.5
        near = [depth(round(u) + i, round(v) + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
        assert min(near) - 3 <= z <= max(near) + 3, "dot %d at %g, depth image %s" % (index, z, near)
        hit_count += z < 1000
    assert hit_count > 15, "few dots: %d" % hit_count
assert not [d for d in truths[0]["dots"] if 21 < (d[1] - m[2]) / m[0] * F + 79.5 < 38], "a dot in the hole"
assert truths[0]["head"]["centre_mm"] == [0, 0, 900], "head: the nearest one"
assert len(truths[0]["heads"]) == 2 and truths[1]["head"] is None, "heads"
moved = [json.loads(line) for line in open("moved/truth.jsonl")]
assert len(moved) == 6, "three poses for each depth image"
for truth in moved[:3]:
    x, y, z = truth["head"]["centre_mm"]
    assert 590 < (x * x + y * y + z * z) ** 0.5 < 1410 and abs(x) < 0.27 * z, "head's place %g %g %g" % (x, y, z)
    on_head = [d for d in truth["dots"] if z - 120 < d[3] < z]
    assert len(on_head) >= 8, "dots on the head: %d" % len(on_head)
assert len({json.dumps(t["head"]) for t in moved[:3]}) == 3, "the same pose twice"
assert all(len(t["dots"]) >= 100 for t in moved), "too few dots"
PYTHON
/usr/bin/python3 depths.py
draw "depth images as they were taken" cast --range range --seed 0 --ambient dim --distortion none \
    --size 320x240
draw "depth images from other positions" moved --range range --seed 4 --frames 3 --size 320x240 --ambient dim
/usr/bin/python3 cast.py >out 2>&1 && reason= || reason=$(tail -n 1 out)
result "dots lie on the measured surface, heads go with it" "$reason"
refuse "depth images and a scene" 2 "--range" --range range --scene room a
refuse "no range directory" 1 "nowhere" --range nowhere a
refuse "a directory of dots as range" 1 "one/rig.json.*kind" --range one a
mkdir short && cp range/slope/* short && head -c 20000 range/slope/000000.pgm >short/000000.pgm
refuse "depth image cut off" 1 "short/000000.pgm: too short" --range short a
cp range/slope/000000.pgm short && : >short/truth.jsonl
refuse "depth image without a truth" 1 "short/truth.jsonl" --range short a
rm -rf a

# --- a depth camera ------------------------------------------------------------------------------
cat >camera.py <<'PYTHON'
"""What is measured is where the truth says that a head is; farther away by what was asked for; beside the head, where
the sensor's projector does not get, nothing is known."""
import json
import struct

def read(folder):
    rig = json.load(open(folder + "/rig.json"))
    assert rig["kind"] == "range" and "dot_rays" not in rig and "projector_origin" not in rig, "rig"
    assert (rig["image_width"], rig["image_height"]) == (640, 480), "size"
    frames = []
    for line in open(folder + "/truth.jsonl"):
        truth = json.loads(line)
        data = open(folder + "/" + truth["file"], "rb").read()
        assert data.startswith(b"P5\n640 480\n65535\n") and len(data) == 17 + 2 * 640 * 480, "image"
        assert "dots" not in truth, "dots"
        frames.append((truth["head"], struct.unpack(">%dH" % (640 * 480), data[17:])))
    return rig, frames

def behind_front(folder):
    """Of the surface at the head's centre, behind the centre less the depth's semi-axis."""
    rig, frames = read(folder)
    m, offsets = rig["camera_matrix"]["data"], []
    for head, depth in frames:
        if head:
            (x, y, z), axes = head["centre_mm"], head["semi_axes_mm"]
            offsets.append(depth[640 * round(m[4] * y / z + m[5]) + round(m[0] * x / z + m[2])] - z + axes[2])
    return offsets, [head["centre_mm"][2] for head, _ in frames if head], frames

near, near_z, frames = behind_front("camera")
far, far_z, _ = behind_front("camera_far")
assert near and max(map(abs, near + far)) < 45, "surface off the head by %s %s" % (near, far)
assert all(abs(b - a - 700) < 0.02 for a, b in zip(near_z, far_z)), "not 700 mm farther: %s %s" % (near_z, far_z)
m = read("camera")[0]["camera_matrix"]["data"]
lost = [0, 0]
for head, depth in [frame for frame in frames if frame[0]]:
    (x, y, z), axes = head["centre_mm"], head["semi_axes_mm"]
    u, v, half = round(m[0] * x / z + m[2]), round(m[4] * y / z + m[5]), m[0] * axes[0] / z
    for side, towards in enumerate((-1, 1)):
        strip = [u + towards * round(half + away) for away in range(3, 11)]
        lost[side] += sum(depth[640 * row + column] == 0 for row in range(v - 10, v + 10) for column in strip)
# A wall 0.3 m behind a head at 1 m and a projector 55 mm aside leave 7 px of shadow on one side, ragged edges of 4 px on both.
assert max(lost) > 2 * min(lost) and max(lost) > 0.4 * 160 * sum(bool(head) for head, _ in frames), "shadow: %s" % lost
PYTHON
draw "a depth camera" camera --rig range --frames 4 --seed 3 --background near --act none
draw "a depth camera farther away" camera_far --rig range --frames 4 --seed 3 --background near --act none --away 700
draw "the same depth images" camera_again --rig range --frames 4 --seed 3 --background near --act none
/usr/bin/python3 camera.py >out 2>&1 && reason= || reason=$(tail -n 1 out)
result "a depth camera measures the head where the truth has it" "$reason"
[ "$(fingerprint camera)" = "$(fingerprint camera_again)" ] && reason= || reason="bytes differ"
result "the same options give the same depth images" "$reason"
for option in "--laser alternate" "--knock 0.1" "--bits 8" "--range range" "--missing 0.5" "--ambient dim"; do
    # shellcheck disable=SC2086 # an option and its value
    refuse "a depth camera with $option" 2 "${option%% *}: a depth camera" --rig range $option a
done
refuse "too far away" 2 "--away" --away 2001 a
refuse "real depth images farther away" 2 "--away" --range range --away 100 a

# --- somebody comes and goes -------------------------------------------------------------------------
cat >pattern.py <<'PYTHON'
import json

def place(rig, point):
    """Row and column of the pattern in which a point lies, from the middle dot, and whether it is ahead."""
    data, origin = rig["dot_rays"]["data"], rig["projector_origin"]["data"]
    ray = [data[3 * i:3 * i + 3] for i in range(361)]
    way = [p - o for p, o in zip(point, origin)]
    length = sum(w * w for w in way) ** 0.5
    steps = []
    for stride in (19, 1):
        step = [(b - a) / 2 for a, b in zip(ray[180 - stride], ray[180 + stride])]
        steps.append(sum(s * w for s, w in zip(step, way)) / length / sum(s * s for s in step))
    return steps

def read(folder):
    rig = json.load(open(folder + "/rig.json"))
    return rig, [json.loads(line) for line in open(folder + "/truth.jsonl")]
PYTHON
cat >visit.py <<'PYTHON'
from pattern import place, read

rig, truths = read("visit")
there = [truth["head"] is not None for truth in truths]
assert not any(there[:6] + there[-6:]), "a head at the start or the end"
first, last = there.index(True), len(there) - 1 - there[::-1].index(True)
assert all(there[first:last + 1]) and last - first >= 8, "no stay: %s" % there
for truth in truths[first:last + 1]:
    assert max(map(abs, place(rig, truth["head"]["centre_mm"]))) <= 8.01, "a head beside the pattern"
ends = [place(rig, truths[i]["head"]["centre_mm"]) for i in (first, (first + last) // 2, last)]
assert min(max(map(abs, ends[0])), max(map(abs, ends[2]))) > max(map(abs, ends[1])), "not from a side: %s" % ends
PYTHON
draw "a visit" visit --scene visit --frames 40 --size 320x240
/usr/bin/python3 visit.py >out 2>&1 && reason= || reason=$(tail -n 1 out)
result "a visitor comes, is in the truth while in the pattern, and goes" "$reason"

# --- who, and what they do ---------------------------------------------------------------------------
cat >people.py <<'PYTHON'
from pattern import place, read

def heads(folder):
    return [t["head"] for t in read(folder)[1] if t["head"]]

def before_face(folder):
    """Dots well before the face: on hands."""
    rig, truths = read(folder)
    m, count = rig["camera_matrix"]["data"], 0
    for truth in filter(lambda t: t["head"], truths):
        c, a = truth["head"]["centre_mm"], truth["head"]["semi_axes_mm"]
        for index, u, v, z in truth["dots"]:
            x, y = (u - m[2]) / m[0] * z - c[0], (v - m[5]) / m[4] * z - c[1]
            count += x * x + y * y < a[0] * a[0] and z < c[2] - a[2] - 32
    return count

anybody, child = heads("anybody"), heads("child")
shrunk = [a / b for a, b in zip(child[0]["semi_axes_mm"], anybody[0]["semi_axes_mm"])]
assert 0.895 < min(shrunk) <= max(shrunk) < 0.945, "a child's head: %s" % shrunk
assert child[0]["centre_mm"][1] > anybody[0]["centre_mm"][1] + 30, "a child sits no lower"
turns = [abs(head["angles_deg"][0]) for head in heads("back")]
assert max(turns) > 60 and min(turns) < 45, "turns to the back: %s" % turns
both = read("two")[1]
for truth in filter(lambda t: t["head"], both):
    first, second = (head["centre_mm"] for head in truth["heads"])
    apart = sum((a - b) ** 2 for a, b in zip(first, second)) ** 0.5
    assert 300 < apart < 850, "apart: %g" % apart
    nearest = min(truth["heads"], key=lambda head: sum(p * p for p in place(read("two")[0], head["centre_mm"])))
    assert truth["head"] == nearest, "not the one in the middle"
assert sum(t["head"] is not None for t in both) == 9, "frames with nobody"
assert before_face("anybody") == 0 and before_face("face") > 20, "hands: %d" % before_face("face")
PYTHON
few="--frames 4 --size 320x240 --ambient dim --distortion none --seed 5"
# shellcheck disable=SC2086 # a list of options
{
    draw "anybody" anybody $few
    for person in child hat mask beard long-hair bald glasses headphones; do
        draw "person $person" "$person" $few --person "$person"
        [ "$(fingerprint "$person")" != "$(fingerprint anybody)" ] && reason= || reason="the same bytes"
        result "a person with $person is not just anybody" "$reason"
    done
    draw "act none" none $few --act none --sequence 2
    draw "act phone" phone $few --act phone
    draw "act face" face $few --act face
    draw "act back" back --frames 30 --size 320x240 --seed 5 --act back
    draw "two people" two --frames 10 --size 320x240 --seed 5 --scene two
    refuse "unknown person" 2 "--person" --person dog a
    refuse "unknown act" 2 "--act" --act sleep a
}
[ "$(fingerprint none)" = "$(fingerprint anybody)" ] && reason= || reason="bytes differ"
result "who does nothing keeps the hands down" "$reason"
[ "$(fingerprint phone)" != "$(fingerprint anybody)" ] && reason= || reason="the same bytes"
result "who telephones lifts a hand" "$reason"
/usr/bin/python3 people.py >out 2>&1 && reason= || reason=$(tail -n 1 out)
result "children are small, faces touched, heads turned, two in the truth" "$reason"

# --- a rig that is not as it says, and sunlight ------------------------------------------------------
cat >wrong.py <<'PYTHON'
import math
from pattern import read

def rays(rig):
    data = rig["dot_rays"]["data"]
    return [data[3 * i:3 * i + 3] for i in range(361)]

def turns(folder):
    """Angles between where the dots went and where rig.json sends them, degrees."""
    rig, truths = read(folder)
    m, origin, ray = rig["camera_matrix"]["data"], rig["projector_origin"]["data"], rays(rig)
    angles = []
    for index, u, v, z in truths[0]["dots"]:
        way = [(u - m[2]) / m[0] * z - origin[0], (v - m[5]) / m[4] * z - origin[1], z - origin[2]]
        cross = [way[i - 2] * ray[index][i - 1] - way[i - 1] * ray[index][i - 2] for i in range(3)]
        angles.append(math.degrees(math.asin(math.hypot(*cross) / math.hypot(*way))))
    return angles

def bright(folder):
    data = open(folder + "/000002.pgm", "rb").read()[-320 * 240:]
    return sum(sample >= 250 for sample in data) / len(data)

def rotated(ray, rotation_deg):
    """By Rodrigues' formula."""
    angle = math.radians(math.hypot(*rotation_deg))
    n = [math.radians(r) / angle for r in rotation_deg] if angle else [0, 0, 0]
    along, cross = sum(a * b for a, b in zip(n, ray)), [n[i - 2] * ray[i - 1] - n[i - 1] * ray[i - 2] for i in range(3)]
    return [r * math.cos(angle) + c * math.sin(angle) + a * along * (1 - math.cos(angle)) for r, c, a in zip(ray, cross, n)]

def off_px(folder, frame=0, rotations_deg=(), shift_mm=(0, 0, 0), camera=(0, 0, 0)):
    """Largest distance of a frame's dots from where rig.json sends them after this knock, rotations in order."""
    rig, truths = read(folder)
    m, ray = rig["camera_matrix"]["data"], rays(rig)
    origin = [o + s for o, s in zip(rig["projector_origin"]["data"], shift_mm)]
    focal, worst = 1 + camera[0] / 100, 0
    for index, u, v, z in truths[frame]["dots"]:
        way = ray[index]
        for rotation_deg in rotations_deg:
            way = rotated(way, rotation_deg)
        x, y = (origin[i] + way[i] * (z - origin[2]) / way[2] for i in range(2))
        worst = max(worst, math.hypot(m[0] * focal * x / z + m[2] + camera[1] - u, m[4] * focal * y / z + m[5] + camera[2] - v))
    return worst

assert off_px("anybody") < 0.005, "a straight rig is off by %g px" % off_px("anybody")
for axis, what in (((0.5, 0, 0), "x"), ((-0.2, 0.4, -1), "xyz")):
    assert off_px("knocked_" + what) > 1 and off_px("knocked_" + what, 2, [axis]) < 0.005, "knocked about %s" % what
assert off_px("shifted") > 0.2 and off_px("shifted", 2, shift_mm=(0.5, -1, 2)) < 0.005, "shifted"
assert off_px("refocused") > 1 and off_px("refocused", 2, camera=(-1, 2.5, -4)) < 0.005, "camera"
together = dict(shift_mm=(0.5, 0, 0), camera=(0.5, 0, 3))
for frame in range(4):
    drift = (frame / 3 * 0.3, 0, frame / 3 * -0.6)
    assert off_px("drifted", frame, [(0.2, 0, 0), drift], **together) < 0.005, "drift of frame %d" % frame
assert max(turns("anybody")) < 0.02, "a straight rig is not straight: %g" % max(turns("anybody"))
assert 0.1 < max(turns("knocked")) < 0.32, "knocked by %g" % max(turns("knocked"))
noisy, true = read("noisy")[0], read("anybody")[0]
m, n = noisy["camera_matrix"]["data"], true["camera_matrix"]["data"]
assert 0 < abs(m[0] / n[0] - 1) < 0.01 and 0 < abs(m[2] - n[2]) < 10, "camera_matrix"
errors = [math.degrees(math.dist(a, b)) for a, b in zip(rays(noisy), rays(true))]
assert 0.015 < sum(errors) / 361 < 0.05, "rays: %g" % (sum(errors) / 361)
assert bright("anybody") < 0.01 < 0.03 < bright("sunlight") < 0.7, "bright: %g" % bright("sunlight")
PYTHON
# shellcheck disable=SC2086 # a list of options
{
    draw "a knocked projector" knocked $few --knock 0.3
    draw "knocked about X" knocked_x $few --knock 0.5,0,0
    draw "knocked about an axis" knocked_xyz $few --knock -0.2,0.4,-1
    draw "knocked by nothing" unknocked $few --knock 0,0,0 --knock-shift 0,0,0 --knock-camera 0,-0,0 --drift 0,0,0
    draw "a shifted projector" shifted $few --knock-shift 0.5,-1,2
    draw "another camera" refocused $few --knock-camera -1,2.5,-4
    draw "drift after a knock" drifted $few --knock 0.2,0,0 --drift 0.3,0,-0.6 --knock-shift 0.5,0,0 --knock-camera 0.5,0,3
    draw "the end of a drift" drift_end $few --knock 0.2,0,0 --drift 0.3,0,-0.6 --knock-shift 0.5,0,0 \
        --knock-camera 0.5,0,3 --first-frame 2
    draw "drift of a single frame" drift_one --frames 1 --size 320x240 --ambient dim --distortion none --seed 5 --drift 1,0,0
    draw "errors of calibration" noisy $few --calibration-noise 2
    draw "sunlight" sunlight --frames 4 --size 320x240 --seed 8 --ambient sunlight
    refuse "too hard a knock" 2 "--knock" --knock 0.51 a
    for three in 1,2 1,2,3,4 1,,3 ,1,2 1,2, 1,2,x 1,+2,3 "1, 2,3" 1,2,5.1 -5.1,2,1 1e0,0,0 0x1,0,0 nan,0,0 1.2.3,0,0 .,0,0; do
        refuse "knock of $three" 2 "--knock $three: must be X,Y,Z of -5 to 5 each" --knock "$three" a
        refuse "drift of $three" 2 "--drift $three: must be X,Y,Z of -5 to 5 each" --drift "$three" a
    done
    refuse "drift about no axis" 2 "--drift 0.3: must be X,Y,Z" --drift 0.3 a
    refuse "knock by nothing at all" 2 "--knock : must be a number" --knock "" a
    refuse "shift too far" 2 "--knock-shift 0,50.1,0: must be X,Y,Z of -50 to 50 each" --knock-shift 0,50.1,0 a
    refuse "shift of one number" 2 "--knock-shift 5" --knock-shift 5 a
    refuse "another camera altogether" 2 "--knock-camera 20.1,0,0: must be F,CX,CY of -20 to 20" --knock-camera 20.1,0,0 a
    refuse "principal point too far" 2 "--knock-camera 0,0,-101" --knock-camera 0,0,-101 a
    refuse "knock backwards" 2 "--knock" --knock -0.1 a
    refuse "noise that is no number" 2 "--calibration-noise" --calibration-noise 1e a
}
reason=
for knock in knocked knocked_x knocked_xyz shifted refocused drifted; do
    cmp -s $knock/rig.json anybody/rig.json || reason="rig.json of $knock differs"
done
result "rig.json does not have the knock" "$reason"
[ "$(fingerprint unknocked)" = "$(fingerprint anybody)" ] && reason= || reason="bytes differ"
result "a knock by nothing changes nothing" "$reason"
cmp -s drift_end/000003.pgm drifted/000003.pgm && [ "$(cat drift_end/truth.jsonl)" = "$(sed -n 3,4p drifted/truth.jsonl)" ] &&
    reason= || reason="frame or truth differs"
result "the end of a drift is the same as in the whole" "$reason"
cmp -s drift_one/000000.pgm anybody/000000.pgm && reason= || reason="frame differs"
result "a single frame has not drifted" "$reason"
cmp -s noisy/000002.pgm anybody/000002.pgm && reason= || reason="frame differs"
result "errors of calibration change no frame" "$reason"
/usr/bin/python3 wrong.py >out 2>&1 && reason= || reason=$(tail -n 1 out)
result "rotation, errors of calibration and sunlight are as large as given" "$reason"

# --- laser off, exposure, a part of a sequence ---------------------------------------------------------
cat >exposed.py <<'PYTHON'
import json
from pattern import read

def peaks(folder, name, dots, fx):
    """How much the dots' pixels stand out of what is around, grey levels."""
    data = open("%s/%s" % (folder, name), "rb").read()[-320 * 240:]
    def at(u, v):
        return data[320 * min(max(v, 0), 239) + min(max(u, 0), 319)]
    rise = [max(at(round(u) + i, round(v) + j) for i in (-1, 0, 1) for j in (-1, 0, 1)) -
            (at(round(u) - 6, round(v)) + at(round(u) + 6, round(v))) / 2 for _, u, v, _ in dots]
    return sum(rise) / len(rise)

rig, on = read("anybody")
_, alternate = read("alternate")
frames = [json.loads(line) for line in open("alternate/frames.jsonl")]
assert [f["laser"] for f in frames] == [True, False, True, False], "laser: %s" % frames
assert [t["file"] for t in alternate] == ["000000.pgm", "000002.pgm"], "truth of frames without laser"
assert alternate == on[::2], "another truth"
fx = rig["camera_matrix"]["data"][0]
assert peaks("alternate", "000002.pgm", on[2]["dots"], fx) > 10, "dots do not stand out"
assert peaks("alternate", "000001.pgm", on[1]["dots"], fx) < 5, "dots without a laser"
half, once = (peaks(f, "000002.pgm", on[2]["dots"], fx) for f in ("half", "anybody"))
assert 0.4 < half / once < 0.65, "half the exposure: %g of %g" % (half, once)
for less, more in zip(read("half")[1], on):
    assert less["dots"] == [d for d in more["dots"] if d in less["dots"]], "other dots with less light"
    assert len(less["dim_dots"]) > len(more["dim_dots"]), "no dot is dimmer with less light"
    assert sorted(less["dots"] + less["dim_dots"]) == sorted(more["dots"] + more["dim_dots"]), "a dot gone with less light"
PYTHON
# shellcheck disable=SC2086 # a list of options
{
    draw "laser alternate" alternate $few --laser alternate
    draw "half the exposure" half $few --exposure 0.5
    cp -r anybody part
    draw "two frames of four" part $few --first-frame 1+2
    refuse "no such first frame" 2 "--first-frame 4.*only 4" $few --first-frame 4 a
    refuse "first frame and nothing" 2 "--first-frame" --first-frame 1+ a
    refuse "exposure 0" 2 "--exposure" --exposure 0 a
    refuse "laser off" 2 "--laser" --laser off a
}
/usr/bin/python3 exposed.py >out 2>&1 && reason= || reason=$(tail -n 1 out)
result "the laser is off where frames.jsonl says so, exposure scales the light" "$reason"
reason=
[ "$(ls part)" = "$(printf '%s\n' 000001.pgm 000002.pgm frames.jsonl rig.json truth.jsonl)" ] || reason=$(ls part)
for frame in 000001 000002; do
    cmp -s part/$frame.pgm anybody/$frame.pgm || reason="$frame differs"
done
[ "$(cat part/truth.jsonl)" = "$(sed -n 2,3p anybody/truth.jsonl)" ] || reason="truth differs"
result "a part of a sequence is the same as in the whole" "$reason"

# --- boards of a calibration ---------------------------------------------------------------------------
cat >board.py <<'PYTHON'
import json
import math
from pattern import read

def grey(folder, frame):
    return open("%s/%06d.pgm" % (folder, frame), "rb").read()[-320 * 240:]

rig, truths = read("board")
m, plan = rig["camera_matrix"]["data"], read("anybody")[0]
assert [t["file"] for t in truths] == ["000000.pgm", "000002.pgm", "000004.pgm"], "truth of frames without laser"
for truth in truths:
    middle, across, down = (truth["board"][name] for name in ("middle_mm", "across", "down"))
    normal = [across[i - 2] * down[i - 1] - across[i - 1] * down[i - 2] for i in range(3)]
    assert truth["head"] is None and 390 < middle[2] < 1510 and normal[2] > 0.7, "pose: %s" % truth["board"]
    on = [d for d in truth["dots"] if d[3] < 1600]
    for _, u, v, z in on:
        place = [(u - m[2]) / m[0] * z - middle[0], (v - m[5]) / m[4] * z - middle[1], z - middle[2]]
        assert abs(sum(n * p for n, p in zip(normal, place))) < 0.1, "a dot off the board"
    u, v = (m[0] * middle[0] / middle[2] + m[2], m[4] * middle[1] / middle[2] + m[5])
    # The bitmap's left half is white, its right half dark.
    for side, frame in ((-1, 1), (1, 1)):
        x = [c + side * 60 * a for c, a in zip(middle, across)]
        at = (round(m[0] * x[0] / x[2] + m[2]), round(m[4] * x[1] / x[2] + m[5]))
        if truth is truths[0] and 0 <= at[0] < 320 and 0 <= at[1] < 240:
            level = grey("board", frame)[320 * at[1] + at[0]]
            assert (level > 60) == (side < 0), "bitmap: %d on side %d" % (level, side)
assert abs(m[0] / (0.8 * plan["camera_matrix"]["data"][0]) - 1) < 0.05 and m[2] != 159.5, "focal length, assembly"

missing = read("missing")[1]
share = sum(len(t["dots"]) for t in missing) / sum(len(t["dots"]) for t in truths)
assert 0.4 < share < 0.6, "missing dots: %g are there" % share
assert sum(g >= 250 for g in grey("glare", 1)) > 20 + sum(g >= 250 for g in grey("board", 1)), "no glare"
assert sum(sorted(abs(a - b) for a, b in zip(grey("blurred", 1), grey("board", 1)))[-500:]) > 500 * 15, "no blur"
PYTHON
{
    printf 'P5\n200 100\n255\n'
    for _ in $(seq 100); do
        head -c 100 /dev/zero | tr '\0' '\346'
        head -c 100 /dev/zero | tr '\0' '\024'
    done
} >half.pgm
sheet="--scene board --board half.pgm --board-mm 280 --laser alternate --frames 6 --size 320x240 --distortion none
    --seed 5 --focal 0.8 --assembly 1"
# shellcheck disable=SC2086 # a list of options
{
    draw "a board" board $sheet
    draw "a board with half the dots" missing $sheet --missing 0.5
    draw "a board that mirrors a lamp" glare $sheet --glare
    draw "a board out of focus" blurred $sheet --blur 3
    refuse "a board without a sheet" 2 "go together" --scene board a
    refuse "a sheet without a board" 2 "go together" --board half.pgm --board-mm 280 a
    refuse "a sheet that is none" 1 "rig.json: no binary PGM" --scene board --board one/rig.json --board-mm 280 a
    refuse "a sheet that is not there" 1 "nowhere" --scene board --board nowhere --board-mm 280 a
    refuse "too long a focal length" 2 "--focal" --focal 2.1 a
    refuse "more missing than most" 2 "--missing" --missing 0.95 a
    rm -rf a
}
/usr/bin/python3 board.py >out 2>&1 && reason= || reason=$(tail -n 1 out)
result "a board is flat, printed, and posed anew for each pair of frames" "$reason"

# --- a camera that looks up or down ---------------------------------------------------------------
cat >tilted.py <<'END'
"""The head at rest stays where it is (within its sway), and turns; what is below it comes nearer when the camera
looks up. Shoulders are the visible dots 180 to 300 mm below the head's centre."""
import json
import statistics


def read(directory):
    lines = [json.loads(line) for line in open(directory + "/truth.jsonl", encoding="utf-8")]
    lines = [line for line in lines if line["head"]]
    matrix = json.load(open(directory + "/rig.json", encoding="utf-8"))["camera_matrix"]["data"]
    below = []
    for line in lines:
        centre = line["head"]["centre_mm"]
        for _, _, v, z in line["dots"]:
            under = (v - matrix[5]) / matrix[4] * z - centre[1]
            if 180 < under < 300 and z < centre[2] + 300:
                below.append(z - centre[2])
    middle = [statistics.mean(line["head"]["centre_mm"][axis] for line in lines) for axis in range(3)]
    return middle, statistics.median(below)


level, level_below = read("level")
up, up_below = read("up")
down, down_below = read("down")
assert max(abs(a - b) for a, b in zip(up, level)) < 30, (up, level)
assert up_below < level_below - 60 < level_below + 60 < down_below, (up_below, level_below, down_below)
END
for tilt in "level 0" "up 25" "down -25"; do
    # shellcheck disable=SC2086 # a name and an angle
    set -- $tilt
    "$render" --seed 4 --frames 6 --background none --tilt "$2" "$1"
done
/usr/bin/python3 tilted.py >out 2>&1 && reason= || reason=$(tail -n 1 out)
result "a tilted camera turns the scene about the head" "$reason"

# --- refusals ------------------------------------------------------------------------------------
refuse "no directory" 2 "OUT_DIR"
refuse "two directories" 2 "OUT_DIR" a b
refuse "unknown option" 2 "unrecognized" --colour red a
refuse "option without a value" 2 "requires an argument" a --seed
refuse "seed that is no number" 2 "--seed" --seed five a
refuse "negative seed" 2 "--seed" --seed -1 a
refuse "rig's seed that is no number" 2 "--rig-seed" --rig-seed five a
refuse "no frames" 2 "--frames" --frames 0 a
refuse "too many frames" 2 "--frames" --frames 5001 a
refuse "too small" 2 "--size" --size 319x240 a
refuse "too large" 2 "--size" --size 1280x801 a
refuse "size with something after it" 2 "--size" --size 320x240x8 a
refuse "too steep" 2 "--tilt" --tilt 41 a
refuse "tilt that is no number" 2 "--tilt" --tilt -up a
refuse "9 bits" 2 "--bits" --bits 9 a
refuse "unknown scene" 2 "--scene" --scene cat a
refuse "unknown rig" 2 "--rig narrow: must be paper, wide or range" --rig narrow a
refuse "sequence 3" 2 "--sequence" --sequence 3 a
[ ! -e a ] && reason= || reason="a directory was made"
result "wrong options leave nothing behind" "$reason"

: >file
# shellcheck disable=SC2086 # a list of options
{
    refuse "output below a file" 1 "file/frames" $small file/frames
    refuse "output is a file" 1 "file" $small file
    mkdir -p taken/000000.pgm
    refuse "frame's name taken by a folder" 1 "taken/000000.pgm" $small taken
    mkdir -p named/rig.json
    refuse "rig's name taken by a folder" 1 "named/rig.json" $small named
}

"$render" --help >help 2>err && reason= || reason="status $?"
[ -s help ] && [ ! -s err ] || reason="no help, or more than that"
awk 'length > 80 { exit 1 }' help || reason=$(awk 'length > 80' help | head -n 1)
result "--help fits a terminal of 80 columns" "$reason"

echo "1..$number"
if [ "$failed" != 0 ]; then
    echo "# $failed of $number failed"
    exit 1
fi
