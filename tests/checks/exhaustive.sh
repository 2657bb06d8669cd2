#!/bin/sh
# The unit tests of arithmetic over the whole range of its input, not in strides; minutes.
#
#     exhaustive.sh UNITY_DIR
set -eu
[ $# = 1 ] || { echo "usage: $0 UNITY_DIR" >&2; exit 2; }
unity=$(cd "$1" && pwd)
cd "$(dirname "$0")/../.."
mkdir -p build/exhaustive
for name in fix basis; do
    "${CC:-cc}" -std=c11 -O2 -ffp-contract=off -Ifirmware/core -Itests/unit -isystem "$unity" \
        "tests/unit/test_$name.c" "$unity/unity.c" firmware/core/ih_fix.c firmware/core/ih_cholesky.c \
        firmware/core/ih_normal.c firmware/core/ih_basis.c -lm -o "build/exhaustive/test_$name"
    "build/exhaustive/test_$name" --all
done
