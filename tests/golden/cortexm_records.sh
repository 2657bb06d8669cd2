#!/bin/sh
# isohead_cortexm on three emulated Cortex-M boards prints the bytes of `host_sim --json` for the same
# frames: of 8 and 12 bits, of a depth camera, and such that are none; and refuses a rig that is damaged.
#
#     cortexm_records.sh CJSON_DIR FRAMES_DIR HOST_BUILD
#
# CJSON_DIR, FRAMES_DIR: as in golden.sh. HOST_BUILD: where host_sim, render and rigblob were built.
# Exit status 1 on a difference.
set -eu
LC_ALL=C
export LC_ALL

[ $# = 3 ] || { echo "usage: $0 CJSON_DIR FRAMES_DIR HOST_BUILD" >&2; exit 2; }
boards="mps2-an386-O2 mps2-an500-O2 mps3-an547-O2"
cjson=$(cd "$1" && pwd)
frames=$(cd "$2" && pwd)
host=$(cd "$3" && pwd)
root=$(cd "$(dirname "$0")/../.." && pwd)
# shellcheck source=tests/checks/builds.sh
. "$root/tests/checks/builds.sh"
for board in $boards; do
    builds_make "$board" isohead_cortexm
    # what the linker took out of the C library
    taken=$(sed -n 's/^[^ ]*libc[a-z_]*\.a(lib_a-\(.*\)\.o)$/\1/p' \
        "$root/build/bits/$board/firmware/app/isohead_cortexm.map" | sort -u | paste -s -d ' ')
    for name in $taken; do
        case $name in
        memcpy | memcpy-stub | memmove | memset | memcmp) ;;
        *) echo "cortexm: $board: the program takes $name out of the C library" >&2; exit 1 ;;
        esac
    done
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# A set is a folder with rig.json and frames, without frames.jsonl: all lit, 40 ms apart.
for n in 1 2; do
    mkdir s$n
    cp "$frames/sequence$n/rig.json" "$frames/sequence$n"/00000[0-3].pgm \
        "$frames/sequence$n"/00002[4-7].pgm s$n
done
"$host/tools/render/render" --bits 12 --rig wide --frames 6 --first-frame 3+2 --seed 3 deep >log 2>&1 ||
    { cat log >&2; exit 1; }
rm -f deep/frames.jsonl deep/truth.jsonl
# Frames that are none, between two that are.
mkdir spoilt
cp "$frames/sequence1/rig.json" s1/000000.pgm s1/000003.pgm spoilt
head -c 1000 s1/000001.pgm >spoilt/000001.pgm
printf 'P5\n320 240\n255\n' >spoilt/000002.pgm
head -c 76800 /dev/zero >>spoilt/000002.pgm
printf 'P6\n1 1\n255\nabc' >spoilt/000004.pgm
printf 'P5\n-4 4\n255\n' >spoilt/000005.pgm
: >spoilt/000006.pgm
mkdir range
/usr/bin/python3 - range <<'PYTHON'
"""A depth camera before a wall, with a head, neck and shoulders; and one frame of 8 bits, which is none."""
import json
import struct
import sys

WIDTH, HEIGHT, FOCAL = 160, 120, 140.0
def matrix(rows, columns, data):
    return {"type_id": "opencv-matrix", "rows": rows, "cols": columns, "dt": "d", "data": data}
def face_mm(x, y):
    """Nose, eyes and hair: a head that is smooth all over is none to the score."""
    nose = 24 * max(0, 1 - abs(x) / 18) * max(0, 1 - abs(y - 12) / 30)
    eyes = 12 if abs(abs(x) - 30) < 14 and abs(y + 15) < 12 else 0
    return nose - eyes + (14 if y < -50 else 0)
def depth_mm(u, v):
    x, y = (u - 80) / FOCAL * 800, (v - 50) / FOCAL * 800
    head = 1 - (x / 75) ** 2 - (y / 105) ** 2
    body = 1 - (x / 220) ** 2 - ((y - 260) / 150) ** 2
    if head > 0:
        return 880 - 95 * head ** 0.5 - face_mm(x, y)
    if abs(x) < 52 and 60 < y < 160:
        return 880  # the neck
    return 900 - 90 * body ** 0.5 if body > 0 else 1900
rig = {"kind": "range", "image_width": WIDTH, "image_height": HEIGHT, "near_mm": 300, "far_mm": 3000,
       "camera_matrix": matrix(3, 3, [FOCAL, 0, 79.5, 0, FOCAL, 59.5, 0, 0, 1]),
       "distortion_coefficients": matrix(1, 5, [0] * 5)}
with open(sys.argv[1] + "/rig.json", "w", encoding="utf-8") as file:
    json.dump(rig, file)
for number in range(3):
    samples = [int(depth_mm(u - 2 * number, v)) for v in range(HEIGHT) for u in range(WIDTH)]
    with open("%s/00000%d.pgm" % (sys.argv[1], number), "wb") as file:
        file.write(b"P5\n%d %d\n65535\n" % (WIDTH, HEIGHT) + struct.pack(">%dH" % len(samples), *samples))
with open(sys.argv[1] + "/000003.pgm", "wb") as file:
    file.write(b"P5\n%d %d\n255\n" % (WIDTH, HEIGHT) + bytes(WIDTH * HEIGHT))
PYTHON

# fail TEXT
bad=0
fail() {
    echo "cortexm: $*" >&2
    bad=1
}

# on_board BOARD ARGUMENT...: records to board.out, messages to board.err; its status in $status.
on_board() {
    board=$1
    shift
    status=0
    builds_run "$board" firmware/app/isohead_cortexm "$@" >board.out 2>board.err || status=$?
}

# refused BOARD STATUS MESSAGE ARGUMENT...: no record, and why.
refused() {
    wanted=$2
    message=$3
    board=$1
    shift 3
    on_board "$board" "$@"
    if [ "$status" != "$wanted" ] || [ -s board.out ] || ! grep -q -e "$message" board.err; then
        fail "$board $*: status $status, expected $wanted and '$message'; it said: $(cat board.err)"
    fi
}

for set in s1 s2 deep spoilt range; do
    "$host/tools/rigblob/rigblob" "$set/rig.json" "$set/rig.bin"
    expected=0
    "$host/sim/host_sim" --json "$set" >"$set/expected" 2>/dev/null || expected=$?
    echo "$expected" >"$set/status"
done
[ "$(cat s1/status s2/status deep/status spoilt/status range/status | paste -s -d ' ')" = "0 0 0 1 1" ] ||
    fail "host_sim does not end as expected"
grep -q '"head":[0-9]' range/expected || fail "no head in the depth images: they show nothing"

printf '\n%-14s %-10s %8s %8s  %s\n' board cpu records errors "equal to host_sim --json"
for board in $boards; do
    : >all
    equal=yes
    for set in s1 s2 deep spoilt range; do
        # shellcheck disable=SC2046 # names without blanks
        on_board "$board" $set/rig.bin $(echo $set/*.pgm)
        if ! cmp -s board.out $set/expected || [ "$status" != "$(cat $set/status)" ]; then
            equal=NO
            fail "$board, $set: other records than host_sim's, or status $status:"
            diff $set/expected board.out | head -n 4 >&2
        fi
        cat board.out >>all
    done
    printf '%-14s %-10s %8s %8s  %s\n' "${board%-*}" \
        "$(sed -n 's/^set(ISOHEAD_CPU \(.*\))$/\1/p' "$root/cmake/${board%-*}.cmake")" \
        "$(wc -l <all)" "$(grep -c '"error":' all)" $equal
done

cp s1/rig.bin flipped.bin
printf 'changed' | dd of=flipped.bin bs=1 seek=3000 conv=notrunc status=none
head -c 4000 s1/rig.bin >short.bin
{ cat s1/rig.bin && printf x; } >long.bin
board=mps2-an500-O2
refused "$board" 1 'flipped.bin: rig blob whose bytes have changed' flipped.bin s1/000000.pgm
refused "$board" 1 'short.bin: rig blob that is too short' short.bin s1/000000.pgm
refused "$board" 1 'long.bin: 4429 bytes, expected at most 4428' long.bin s1/000000.pgm
refused "$board" 1 'rig.json: .* bytes, expected at most 4428' s1/rig.json s1/000000.pgm
refused "$board" 1 '000000.pgm: .* bytes, expected at most 4428' s1/000000.pgm s1/000000.pgm
refused "$board" 1 'none.bin: cannot be opened' none.bin s1/000000.pgm
refused "$board" 2 'expected RIG FRAME' s1/rig.bin
on_board "$board" s1/rig.bin s1/none.pgm
if [ "$status $(cat board.out)" != '1 {"file":"none.pgm","error":"cannot be opened"}' ]; then
    fail "a frame that is not there: status $status, $(cat board.out board.err)"
fi
if [ $bad = 0 ]; then
    echo "cortexm: the same records; a damaged rig, none, and a frame that is not there are refused"
fi
exit $bad
