#!/bin/sh
# The laser's policy on a 64-bit ARM, run by qemu-aarch64, with each of its instructions left out in turn
# (tests/unit/app/laser_skips.h). Status 77, skipped: compiler or emulator is missing.
#
#     laser_skips.sh UNITY_DIR    objects in build/laser_skips
set -eu
[ $# -eq 1 ] || { echo "usage: $0 UNITY_DIR" >&2; exit 2; }
for program in aarch64-linux-gnu-gcc aarch64-linux-gnu-objcopy qemu-aarch64; do
    command -v "$program" >/dev/null || { echo "skipped: no $program (tools/setup.sh)"; exit 77; }
done
unity=$(cd "$1" && pwd)
cd "$(dirname "$0")/../.."
out=build/laser_skips
rm -rf "$out"
mkdir -p "$out"

# compile FILE OPTION...: as the board's program is, which has -O2
compile() {
    aarch64-linux-gnu-gcc -std=c11 -O2 -Wall -Wextra -Werror -Ihal -Ifirmware/app -isystem "$unity" -c "$@" \
        -o "$out/$(basename "$1" .c).o"
}
for source in firmware/app/app_laser.c hal/hal.c hal/hal_limits.c hal/hal_text.c "$unity/unity.c"; do
    compile "$source"
done
# its other tests are not run here
compile tests/unit/app/test_laser.c -Wno-unused-function -D_GNU_SOURCE -DLASER_SKIPS
# on pages of its own: nothing else is translated anew with each skip
aarch64-linux-gnu-objcopy --rename-section .text=policy --set-section-alignment .text=4096 "$out/app_laser.o"
aarch64-linux-gnu-gcc -static "$out"/*.o -o "$out/test_laser"
qemu-aarch64 "$out/test_laser" >"$out/log" 2>&1 || { cat "$out/log"; exit 1; }
grep ' instructions of the policy' "$out/log"
