#!/bin/sh
# tools/render on itself: the same options give the same bytes, another seed gives others, every
# size and depth works, the truth fits the frames, wrong options and unwritable output are told.
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
}
[ "$(fingerprint one)" = "$(fingerprint again)" ] && reason= || reason="bytes differ"
result "the same options give the same bytes" "$reason"
[ "$(fingerprint one)" != "$(fingerprint other)" ] && reason= || reason="the same bytes"
result "another seed gives other bytes" "$reason"

# --- every kind ----------------------------------------------------------------------------------
draw "1280x800, 16 bits, wide rig, hands" large --frames 1 --size 1280x800 --bits 16 --rig wide --sequence 2
draw "10 bits, strong lens, nothing behind" ten --frames 1 --size 640x480 --bits 10 --distortion strong \
    --background none
draw "12 bits, turning, no lens" twelve --frames 1 --size 320x240 --bits 12 --scene turning --distortion none
for scene in empty table room; do
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
    assert len({d[0] for d in truth["dots"]}) == len(truth["dots"]), "a dot twice"
    for index, u, v, z_mm in truth["dots"]:
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

# --- refusals ------------------------------------------------------------------------------------
refuse "no directory" 2 "OUT_DIR"
refuse "two directories" 2 "OUT_DIR" a b
refuse "unknown option" 2 "unrecognized" --colour red a
refuse "option without a value" 2 "requires an argument" a --seed
refuse "seed that is no number" 2 "--seed" --seed five a
refuse "negative seed" 2 "--seed" --seed -1 a
refuse "no frames" 2 "--frames" --frames 0 a
refuse "too many frames" 2 "--frames" --frames 5001 a
refuse "too small" 2 "--size" --size 319x240 a
refuse "too large" 2 "--size" --size 1280x801 a
refuse "size with something after it" 2 "--size" --size 320x240x8 a
refuse "9 bits" 2 "--bits" --bits 9 a
refuse "unknown scene" 2 "--scene" --scene cat a
refuse "unknown rig" 2 "--rig" --rig narrow a
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

echo "1..$number"
if [ "$failed" != 0 ]; then
    echo "# $failed of $number failed"
    exit 1
fi
