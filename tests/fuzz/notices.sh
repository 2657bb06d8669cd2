#!/bin/sh
# Is a build of the fuzz targets stopped by what is wrong?
#
#   tests/fuzz/notices.sh PROGRAM LETTER...    fuzz_notices; each letter of it must stop the program
# shellcheck disable=SC2094 # nobody writes the input
set -eu
program=$1
shift
input=$(mktemp)
trap 'rm -f "$input"' EXIT
printf n >"$input"
"$program" "$input" <"$input" >/dev/null 2>&1 || {
    echo "$program: fails although nothing is wrong" >&2
    exit 1
}
for letter in "$@"; do
    printf '%s' "$letter" >"$input"
    if "$program" "$input" <"$input" >/dev/null 2>&1; then
        echo "$program: does not notice '$letter' of tests/fuzz/fuzz_notices.c" >&2
        exit 1
    fi
done
