#!/bin/sh
# Build isohead_cortexm for a Cortex-M7 and print what the core takes there (size.py).
#
#     size.sh CJSON_DIR FRAMES_DIR RIGBLOB PLUGIN_H_DIR
#
# CJSON_DIR: a folder with cJSON.c. FRAMES_DIR: of its sequence1 eight frames are processed, the last five
# count. RIGBLOB: the program. PLUGIN_H_DIR: a folder with qemu-plugin.h. Everything lies below build/bits
# and build/size. Exit status 1 when a bound of tests/limits.conf is passed.
set -eu
LC_ALL=C
export LC_ALL

[ $# = 4 ] || { echo "usage: $0 CJSON_DIR FRAMES_DIR RIGBLOB PLUGIN_H_DIR" >&2; exit 2; }
cjson=$(cd "$1" && pwd)
sequence=$2/sequence1
[ -e "$sequence/rig.json" ] || { echo "size: no $sequence/rig.json: make frames writes it" >&2; exit 2; }
[ -e "$4/qemu-plugin.h" ] || { echo "size: $4 has no qemu-plugin.h" >&2; exit 2; }
root=$(cd "$(dirname "$0")/../.." && pwd)
# shellcheck source=tests/checks/builds.sh
. "$root/tests/checks/builds.sh"
builds_make mps2-an500-O2 isohead_cortexm

work=$root/build/size
mkdir -p "$work"
gcc -std=c11 -O2 -fPIC -shared -Wall -Wextra -Wconversion -Wshadow -Wmissing-prototypes -Werror \
    -isystem "$4" "$root/tools/size/count.c" -o "$work/libcount.so"
"$3" "$sequence/rig.json" "$work/rig.bin"
set --
for number in 20 21 22 23 24 25 26 27; do
    set -- "$@" "$sequence/0000$number.pgm"
done
exec /usr/bin/python3 "$root/tools/size/size.py" --build "$root/build/bits/mps2-an500-O2" \
    --plugin "$work/libcount.so" --rig "$work/rig.bin" "$@"
