#!/bin/sh
# The unit tests of arithmetic over the whole range of its input, not in strides; minutes.
#
#     exhaustive.sh UNITY_DIR
set -eu
[ $# = 1 ] || { echo "usage: $0 UNITY_DIR" >&2; exit 2; }
unity=$(cd "$1" && pwd)
cd "$(dirname "$0")/../.."
mkdir -p build/exhaustive
for name in base/test_fix surface/test_multiquadric; do
    # shellcheck disable=SC2046 # the core's files have no blanks in their names
    "${CC:-cc}" -std=c11 -O2 -ffp-contract=off -Ifirmware/core -Itests/unit -isystem "$unity" \
        "tests/unit/$name.c" "$unity/unity.c" $(find firmware/core -name '*.c') -lm \
        -o "build/exhaustive/${name#*/}"
    "build/exhaustive/${name#*/}" --all
done
