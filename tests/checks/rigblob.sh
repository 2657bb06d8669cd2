#!/bin/sh
# rigblob: what it writes is a rig as Python reads it, damage is refused, a refused rig leaves nothing.
#
#     rigblob.sh RIGBLOB RIG_JSON
set -eu
LC_ALL=C
export LC_ALL
[ $# = 2 ] || { echo "usage: $0 RIGBLOB RIG_JSON" >&2; exit 2; }
rigblob=$1
rig=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
count=0
bad=0

# check NAME STATUS MESSAGE ARGUMENT...: exit status, and standard error or, where that is empty, output;
# MESSAGE empty: nothing is said at all.
check() {
    name=$1
    wanted=$2
    message=$3
    shift 3
    status=0
    "$rigblob" "$@" >out 2>err || status=$?
    [ -s err ] || cp out err
    count=$((count + 1))
    said=no
    if [ -n "$message" ]; then
        grep -Eq -e "$message" err && said=yes
    elif [ ! -s err ]; then
        said=yes
    fi
    if [ "$status" != "$wanted" ] || [ $said = no ]; then
        bad=$((bad + 1))
        echo "not ok - $name: status $status, expected $wanted; expected a line like '$message':"
        sed 's/^/    /' err
    fi
}

# there FILE...: nothing else is left behind.
there() {
    count=$((count + 1))
    found=$(find . -mindepth 1 | sort | paste -s -d ' ')
    if [ "$found" != "$(printf './%s\n' err out "$@" | sort | paste -s -d ' ')" ]; then
        bad=$((bad + 1))
        echo "not ok - expected err out $*, found $found"
    fi
}

check 'write' 0 '' "$rig" rig.bin
there rig.bin
count=$((count + 1))
/usr/bin/python3 - "$rig" rig.bin <<'PYTHON' || bad=$((bad + 1))
"""The blob against rig.json, read by Python's json, struct and zlib."""
import json
import math
import struct
import sys
import zlib

rig = json.load(open(sys.argv[1], encoding="utf-8"))
blob = open(sys.argv[2], "rb").read()
def fixed(value, bits):
    return math.floor(abs(value) * 2**bits + 0.5) * (1 if value >= 0 else -1)
fx, _, cx, _, fy, cy = rig["camera_matrix"]["data"][:6]
words = [2, 4428, 0, rig["image_width"], rig["image_height"]]
words += [fixed(value, 16) for value in (fx, fy, cx, cy)]
words += [fixed(value, 24) for value in rig["distortion_coefficients"]["data"]]
words += [math.floor(rig["near_mm"]), math.ceil(rig["far_mm"])]
words += [fixed(value, 16) for value in rig["projector_origin"]["data"]]
words += [fixed(value, 30) for value in rig["dot_rays"]["data"]]
words += [fixed(value, 30) for value in rig.get("up", [0, -1, 0])]
wanted = b"IHRB" + struct.pack("<%di" % len(words), *words)
wanted += struct.pack("<I", zlib.crc32(wanted))
if blob != wanted:
    at = next((i for i, pair in enumerate(zip(blob, wanted)) if pair[0] != pair[1]), min(len(blob), len(wanted)))
    sys.exit("not ok - the blob has %d bytes, expected %d; the first difference is at offset %d"
             % (len(blob), len(wanted), at))
PYTHON

sed 's/"near_mm"/"up":[0.36,0.48,-0.8],"near_mm"/' "$rig" >tilted.json
check 'tilted' 0 '' tilted.json tilted.bin
check 'show up' 0 '^up 0\.36 0\.4[78][0-9]* -0\.8' --show tilted.bin
sed 's/"near_mm"/"up":[0.6,0.8,0.8],"near_mm"/' "$rig" >tilted.json
check 'no unit vector' 1 'tilted\.json: up: .0\.6, 0\.8, 0\.8., length 1\.28062, expected a unit vector' tilted.json a.bin
rm tilted.json tilted.bin
check 'show' 0 '^kind dots$' --show rig.bin
check 'show a ray' 0 '^dot_rays\[360\] ' --show rig.bin
check 'no argument' 2 'expected RIG OUT'
check 'one argument' 2 'expected RIG OUT' "$rig"
check 'three arguments' 2 'expected RIG OUT' "$rig" a b
check 'show two' 2 'expected RIG OUT' --show a b
check 'unknown option' 2 'unrecognized option' --wide "$rig" a
check 'help' 0 '^rigblob RIG OUT' --help

check 'no such rig' 1 'nothing: No such file' nothing a.bin
sed 's/"image_width"/"image_breadth"/' "$rig" >rig.json
check 'a field is missing' 1 'rig\.json: image_width: missing' rig.json a.bin
sed 's/"near_mm": *[0-9.e+]*/"near_mm":9000/' "$rig" >rig.json
check 'the core refuses it' 1 'rig\.json: near_mm, far_mm: 9000 and ' rig.json a.bin
check 'no JSON' 1 'rig\.bin: ' rig.bin a.bin
cp "$rig" rig.json
cp "$rig" rig.part
ln rig.json linked.json
ln -s rig.json link.json
for out in rig.json ./rig.json linked.json link.json; do
    check "over its own rig: $out" 2 "$out: OUT would replace RIG, expected another file" rig.json "$out"
done
check 'over its own rig while it is written' 2 'rig: OUT would replace RIG' rig.part rig
for file in rig.json rig.part; do
    count=$((count + 1))
    cmp -s "$rig" "$file" || { bad=$((bad + 1)); echo "not ok - $file is no longer as it was"; }
done
rm rig.json rig.part linked.json link.json
there rig.bin

mkdir d
check 'no such folder' 1 'e/a\.bin: No such file' "$rig" e/a.bin
check 'a folder' 1 'd: a directory, device or pipe, expected a file' "$rig" d
check 'a device' 1 '/dev/null: a directory, device' "$rig" /dev/null
check 'another device' 1 '/dev/full: a directory, device' "$rig" /dev/full
there d rig.bin
cp rig.bin before.bin
printf 'old' >rig.bin
check 'an old one is replaced' 0 '' "$rig" rig.bin
cmp rig.bin before.bin || bad=$((bad + 1))
there before.bin d rig.bin

head -c 4427 before.bin >rig.bin
check 'one byte short' 1 'rig\.bin: rig blob that is too short' --show rig.bin
{ cat before.bin && printf x; } >rig.bin
check 'one byte more' 1 'rig\.bin: rig blob with bytes after its end' --show rig.bin
cat before.bin before.bin before.bin >rig.bin
check 'far too long' 1 'rig\.bin: 13284 bytes, expected at most' --show rig.bin
printf 'P5 4 4 255 0123456789' >frame.pgm
check 'something else' 1 'no rig blob: it does not begin with IHRB' --show frame.pgm
cp before.bin rig.bin
printf '\003' | dd of=rig.bin bs=1 seek=4 conv=notrunc status=none
check 'another version' 1 'another version' --show rig.bin
cp before.bin rig.bin
printf 'changed' | dd of=rig.bin bs=1 seek=2000 conv=notrunc status=none
check 'changed bytes' 1 'its CRC-32 does not fit' --show rig.bin

echo "rigblob: $count checks, $bad failed"
[ $bad = 0 ]
