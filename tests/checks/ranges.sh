#!/bin/sh
# The core with every operation and the ranges of docs/numerics.md checked, over the golden set and
# frames; a planted mistake of each kind is noticed.
#
#     ranges.sh [--all UNITY_DIR] GOLDEN_DIR FRAMES_DIR...
#
# GOLDEN_DIR: where another build has golden and golden_pack; its hashes must be the same. FRAMES_DIR:
# directories of frames, of the first also the golden set's rigs (sequence1, sequence2). --all: with the
# tests of the core and the fuzzers' corpus; without it only sequence1 of the first. Built in
# build/ranges. Exit status 1 when something was found.
set -eu

usage() {
    echo "usage: $0 [--all UNITY_DIR] GOLDEN_DIR FRAMES_DIR..." >&2
    exit 2
}
unity=
if [ "${1:-}" = --all ]; then
    [ $# -ge 2 ] || usage
    unity=$(cd "$2" && pwd)
    shift 2
fi
[ $# -ge 2 ] || usage
golden=$(cd "$1" && pwd)
shift
for dir in "$@"; do
    [ -d "$dir" ] || { echo "ranges: $dir is no directory" >&2; exit 2; }
done
frames=$(cd "$1" && pwd)
root=$(cd "$(dirname "$0")/../.." && pwd)
build=$root/build/ranges
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# --- the build -----------------------------------------------------------------------------------

# quietly WHAT COMMAND...: its output only when it fails
quietly() {
    what=$1
    shift
    "$@" >"$work/log" 2>&1 || {
        tail -n 30 "$work/log" >&2
        echo "ranges: $what" >&2
        exit 1
    }
}
if [ -n "$unity" ]; then
    set -- "-DISOHEAD_TESTS=ON" "-DISOHEAD_UNITY_DIR=$unity" -- "$@"
else
    set -- "-DISOHEAD_TESTS=OFF" -- "$@"
fi
options=
while [ "$1" != -- ]; do
    options="$options $1"
    shift
done
shift
cd "$root"
# shellcheck disable=SC2086 # a list of words
quietly "the preset ranges cannot be configured" cmake --preset ranges $options
targets="golden host_sim ranges_planted"
[ -z "$unity" ] || targets="$targets core_tests fuzzers"
# shellcheck disable=SC2086
quietly "it does not build" cmake --build --preset ranges --parallel 2 --target $targets

# --- planted mistakes ----------------------------------------------------------------------------

# planted KIND TEXT: must end the program, with a line that has the text.
planted() {
    if sh -c '"$0" "$1"; exit $?' "$build/ranges_planted" "$1" >"$work/out" 2>&1; then
        echo "ranges: a planted mistake was not noticed: $1" >&2
        exit 1
    fi
    grep -q "$2" "$work/out" || {
        cat "$work/out" >&2
        echo "ranges: a planted mistake was reported wrongly: $1, expected '$2'" >&2
        exit 1
    }
    kinds=$((kinds + 1))
}
kinds=0
planted range 'ranges_planted.c:[0-9]*: range: 70000, expected 0 .. 69999'
planted cast 'ranges_planted.c:[0-9]*: range: converted to int16_t is 70000'
planted sign 'ranges_planted.c:[0-9]*: range: converted to uint32_t is -70000'
planted implicit 'ranges_planted.c:.*implicit conversion'
planted wrap 'ranges_planted.c:.*unsigned integer overflow'
planted overflow 'ranges_planted.c:.*signed integer overflow'
planted shift 'ranges_planted.c:.*shift exponent'
planted index 'ranges_planted.c:.*out of bounds'
planted divide 'ranges_planted.c:.*division by zero'
planted argument 'ih_fix.h:[0-9]*: range: 31, expected 32 .. 62'
planted stage 'ih_ellipsoid.c:[0-9]*: range: 256, expected 10240 .. 51200'
"$build/ranges_planted" nothing
echo "ranges: $kinds kinds of planted mistakes noticed"

# --- the golden set ------------------------------------------------------------------------------

sequence() {
    for frame in rig.json 000024.pgm 000025.pgm 000026.pgm; do
        echo "$frames/sequence$1/$frame"
    done
}
# shellcheck disable=SC2046
"$golden/golden_pack" "$work/golden.bin" $(sequence 1) $(sequence 2)
(cd "$work" && "$golden/golden" golden.bin >expected && "$build/tests/golden/golden" golden.bin >out) || {
    tail -n 1 "$work/out" >&2
    echo "ranges: the golden set did not pass" >&2
    exit 1
}
cmp "$work/expected" "$work/out" || { echo "ranges: the checks change the golden set" >&2; exit 1; }
echo "ranges: golden set, $(grep -c ' result ' "$work/out") frames, $(wc -l <"$work/out") hashes"

# --- frames --------------------------------------------------------------------------------------

[ -n "$unity" ] || set -- "$frames/sequence1"
for dir in "$@"; do
    "$build/sim/host_sim" --json "$dir" >"$work/out" || { echo "ranges: $dir did not pass" >&2; exit 1; }
    "$build/sim/host_sim" --json --paper "$dir" >"$work/paper" || {
        echo "ranges: $dir did not pass with --paper" >&2
        exit 1
    }
    echo "ranges: $dir, $(wc -l <"$work/out") frames, and with --paper"
done
[ -n "$unity" ] || exit 0

# --- the core's tests, the fuzzers' corpus -------------------------------------------------------

quietly "a test of the core or a replay of the corpus did not pass" \
    ctest --test-dir "$build" --label-regex '^(core|fuzz)$' --exclude-regex notices --parallel 2 --output-on-failure
sed -n 's/^100% tests passed.*out of \(.*\)/ranges: \1 tests of the core and replays of the corpus/p' "$work/log"
