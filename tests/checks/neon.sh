#!/bin/sh
# The unit tests of stages with vectors, built for a 64-bit ARM with NEON and run by qemu-aarch64.
#
#     neon.sh UNITY_DIR FOLDER/NAME...    tests/unit/FOLDER/test_NAME.c each; objects in build/neon
set -eu
[ $# -ge 2 ] || { echo "usage: $0 UNITY_DIR FOLDER/NAME..." >&2; exit 2; }
unity=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/../.."
out=build/neon
rm -rf "$out"
mkdir -p "$out"

make_object() {
    printf '%s\n' "$2" "$out/$1.o"
}
{
    make_object unity "$unity/unity.c"
    find firmware/core -name '*.c' | while read -r source; do
        make_object "$(basename "$source" .c)" "$source"
    done
    for stage in "$@"; do
        make_object "test_${stage#*/}" "tests/unit/${stage%/*}/test_${stage#*/}.c"
    done
} | xargs -P 2 -n 2 sh -c 'exec aarch64-linux-gnu-gcc -std=c11 -O2 -ffp-contract=off -Wall -Wextra -Werror \
    -Ifirmware/core -Itests/unit -Itests/vectors -isystem "$0" -c "$1" -o "$2"' "$unity"
aarch64-linux-gnu-ar rcs "$out/core.a" "$out"/ih_*.o "$out/isohead.o" "$out/unity.o"

printf '%s\n' "$@" | xargs -P 2 -n 1 sh -c '
    test=$0/test_${1#*/}
    aarch64-linux-gnu-gcc -static "$test.o" "$0/core.a" -lm -o "$test"
    qemu-aarch64 "$test" >"$test.log" 2>&1 || { cat "$test.log"; exit 1; }
    echo "$1: $(tail -n 2 "$test.log" | head -n 1)"' "$out"
