#!/bin/sh
# The same frames give the same bytes, whatever compiled host_sim and wherever it runs: gcc and
# clang, -O0 and -O3, x86-64 and, under qemu-user, aarch64.
#
#     same_bits.sh [--fast] [--every N] CJSON_DIR FRAMES_DIR...
#
# --fast: without the builds of -O0. CJSON_DIR: a folder with cJSON.c for the cross build. Of each frames directory (or of those below
# FRAMES_DIR) every Nth frame is used, default 10, of the first also six in a row, and of one frame of
# the first and one of the last directory every stage's raw integers (--trace) too. Builds below
# build/bits. Exit status 1 on a difference.
set -eu
LC_ALL=C
export LC_ALL

usage() {
    echo "usage: $0 [--fast] [--every N] CJSON_DIR FRAMES_DIR..." >&2
    exit 2
}
every=10
names="gcc-O3 gcc-O0 clang-O0 clang-O3 arm64-O0 arm64-O3"
if [ "${1:-}" = --fast ]; then
    names="gcc-O3 clang-O3 arm64-O3"
    shift
fi
if [ "${1:-}" = --every ]; then
    [ $# -ge 2 ] || usage
    every=$2
    shift 2
fi
[ $# -ge 2 ] || usage
case $every in '' | 0* | *[!0-9]*) usage ;; esac
[ -e "$1/cJSON.c" ] || { echo "same_bits: $1 has no cJSON.c" >&2; exit 2; }
cjson=$(cd "$1" && pwd)
shift
for dir in "$@"; do
    [ -d "$dir" ] || { echo "same_bits: $dir is no directory" >&2; exit 2; }
done

root=$(cd "$(dirname "$0")/../.." && pwd)
# shellcheck source=tests/checks/builds.sh
. "$root/tests/checks/builds.sh"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# --- the builds ----------------------------------------------------------------------------------

for name in $names; do
    builds_make "$name" host_sim
done

# host_sim NAME ARGUMENT...: paths in it are relative, so that records are the same every time.
host_sim() {
    build=$1
    shift
    builds_run "$build" sim/host_sim "$@"
}

# --- the frames ----------------------------------------------------------------------------------

# thin FROM TO STEP: every STEPth frame, without frames.jsonl, which would miss the others.
thin() {
    mkdir -p "$2"
    cp "$1/rig.json" "$2/"
    number=0
    for frame in "$1"/*.pgm; do
        if [ $((number % $3)) = 0 ]; then
            cp "$frame" "$2/"
        fi
        number=$((number + 1))
    done
}

# middle FROM TO: the frame in the middle alone.
middle() {
    mkdir -p "$2"
    cp "$1/rig.json" "$2/"
    set -- "$1" "$2" "$1"/*.pgm
    from=$2
    shift $((1 + $# / 2))
    cp "$1" "$from/"
}

# series FROM TO: six frames in a row from the middle on, for the tracks.
series() {
    mkdir -p "$2"
    cp "$1/rig.json" "$2/"
    to=$2
    set -- "$1"/*.pgm
    shift $(($# / 2))
    for frame in "$@"; do
        cp "$frame" "$to/"
        [ "$(find "$to" -type f | wc -l)" -le 6 ] || break
    done
}

count=0
for dir in "$@"; do
    for rig in "$dir"/rig.json "$dir"/*/rig.json; do
        [ -e "$rig" ] || continue
        from=$(dirname "$rig")
        count=$((count + 1))
        # The number keeps directories of the same name apart.
        name=$count-$(basename "$from")
        thin "$from" "$work/frames/$name" "$every"
        if [ $count = 1 ]; then
            middle "$from" "$work/traced/first"
            series "$from" "$work/frames/0-series"
        fi
    done
done
[ $count -le 1 ] || middle "$from" "$work/traced/last"
[ $count -gt 0 ] || { echo "same_bits: no frames directory (with rig.json) in: $*" >&2; exit 2; }

# --- the comparison ------------------------------------------------------------------------------

printf '%-10s %-18s %-18s %s\n' build "--json" "--json --paper" "--trace of 2 frames"
lines=$work/lines
cd "$work"
mkdir out
for name in $names; do
    if ! host_sim "$name" --json frames >out/json ||
        ! host_sim "$name" --json --paper frames >out/paper ||
        ! host_sim "$name" --json --trace trace traced >out/traced; then
        echo "same_bits: host_sim of $name failed" >&2
        exit 1
    fi
    json=$(sha256sum <out/json | cut -c 1-16)
    paper=$(sha256sum <out/paper | cut -c 1-16)
    trace=$(cd trace && find . -type f | sort | xargs cat | sha256sum | cut -c 1-16)
    printf '%-10s %-18s %-18s %s\n' "$name" "$json" "$paper" "$trace"
    echo "$json $paper $trace" >>"$lines"
    records=$(wc -l <out/json)
    cp out/json "$name.json"
    rm -rf trace
done

kinds=$(sort -u "$lines" | wc -l)
if [ "$kinds" != 1 ]; then
    for name in $names; do
        cmp gcc-O3.json "$name.json" || true
    done
    echo "same_bits: NOT the same bytes" >&2
    exit 1
fi
echo "the same bytes from all: $records frames of $count directories"
