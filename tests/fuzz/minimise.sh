#!/bin/sh
# Put the fewest inputs that reach all that is reached into tests/fuzz/corpus: of those that are there,
# and of what make fuzz found (build/fuzz/TARGET/corpus).
#
#   tests/fuzz/minimise.sh TARGET...    after make fuzz
set -eu
cd "$(dirname "$0")/../.."
least=build/fuzz/least
mkdir -p build/fuzz/tmp
export TMPDIR="$PWD/build/fuzz/tmp"
for target in "$@"; do
    packed=build/fuzz/$target/packed
    rm -rf "$least" "$packed"
    mkdir -p "$least" "build/fuzz/$target/corpus"
    tests/fuzz/corpus.py unpack "tests/fuzz/corpus/$target.pack" "$packed"
    nice "build/fuzz-libfuzzer/tests/fuzz/fuzz_$target" -set_cover_merge=1 -max_len=4096 "$least" \
        "$packed" "build/fuzz/$target/corpus" >"build/fuzz/$target/minimise.log" 2>&1 ||
        { tail -n 20 "build/fuzz/$target/minimise.log"; exit 1; }
    tests/fuzz/corpus.py pack "$least" "tests/fuzz/corpus/$target.pack"
done
