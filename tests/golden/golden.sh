#!/bin/sh
# The golden set gives the same hashes of every stage's output, whatever compiled the core and
# wherever it runs.
#
#     golden.sh CJSON_DIR FRAMES_DIR NAME...
#
# CJSON_DIR: a folder with cJSON.c. FRAMES_DIR: of its sequence1 and sequence2, both of the paper's rig,
# three frames each from the middle are taken; three of the wide rig are rendered. NAME: builds as tests/checks/builds.sh describes them; the first is
# what the others are compared with. Everything lies below build/bits. Exit status 1 on a difference.
set -eu
LC_ALL=C
export LC_ALL

[ $# -ge 4 ] || { echo "usage: $0 CJSON_DIR FRAMES_DIR NAME NAME..." >&2; exit 2; }
[ -e "$1/cJSON.c" ] || { echo "golden: $1 has no cJSON.c" >&2; exit 2; }
cjson=$(cd "$1" && pwd)
frames=$2
shift 2
for rig in "$frames/sequence1/rig.json" "$frames/sequence2/rig.json"; do
    [ -e "$rig" ] || { echo "golden: no $rig: make frames writes it" >&2; exit 2; }
done
root=$(cd "$(dirname "$0")/../.." && pwd)
# shellcheck source=tests/checks/builds.sh
. "$root/tests/checks/builds.sh"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# sequence DIR: the arguments of golden_pack for one of them.
sequence() {
    for frame in rig.json 000024.pgm 000025.pgm 000026.pgm; do
        echo "$1/$frame"
    done
}
builds_make gcc-O3 golden_pack render
builds_run gcc-O3 tools/render/render --rig wide --sequence 2 --seed 3 --first-frame 24+3 "$work/wide"
# shellcheck disable=SC2046 # a list of files
builds_run gcc-O3 tests/golden/golden_pack "$work/golden.bin" $(sequence "$frames/sequence1") \
    $(sequence "$frames/sequence2") $(sequence "$work/wide")

# compiler NAME: what the build was compiled with.
compiler() {
    sed -n -e 's|^set(CMAKE_C_COMPILER ".*/\(.*\)")$|\1|p' \
        -e 's|^set(CMAKE_C_COMPILER_VERSION "\(.*\)")$|\1|p' \
        "$builds/$1"/CMakeFiles/*/CMakeCCompiler.cmake | paste -s -d ' '
}

# hashes NAME FILE: of the frames in a file of golden_pack; to standard output.
hashes() {
    (cd "$work" && builds_run "$1" tests/golden/golden "$2") || {
        echo "golden: $1 ended with status $?" >&2
        return 1
    }
}

# processor NAME: what it runs on.
processor() {
    case ${1%-*} in
    gcc | clang) uname -m ;;
    arm64) echo aarch64 ;;
    mps2-an386) echo Cortex-M4 ;;
    mps2-an500) echo Cortex-M7 ;;
    mps3-an547) echo Cortex-M55 ;;
    *) echo "${1%-*}" ;;
    esac
}

first=$1
bad=0
printf '%-11s %-14s %-32s %6s %6s  %-16s %s\n' processor build compiler frames hashes 'hash of them' equal
for name in "$@"; do
    builds_make "$name" golden
    hashes "$name" golden.bin >"$work/out" || { tail -n 1 "$work/out" >&2; exit 1; }
    if [ "$name" = "$first" ]; then
        cp "$work/out" "$work/expected"
    fi
    equal=yes
    cmp -s "$work/expected" "$work/out" || { equal=NO; bad=1; }
    printf '%-11s %-14s %-32s %6s %6s  %-16s %s\n' "$(processor "$name")" "$name" "$(compiler "$name")" \
        "$(grep -c ' result ' "$work/out")" "$(wc -l <"$work/out")" \
        "$(sha256sum <"$work/out" | cut -c 1-16)" $equal
    processor "$name" >>"$work/processors"
    if [ $equal = NO ]; then
        diff "$work/expected" "$work/out" | sed -n '2,/^>/p' | head -n 10
    fi
done
if [ $bad != 0 ]; then
    echo "golden: NOT the same outputs; above: the first frame and stage that differ" >&2
    exit 1
fi

# A difference is noticed: another lowest byte of the first rig's focal length, the sixth word.
printf '\001' | dd of="$work/golden.bin" bs=1 seek=20 conv=notrunc status=none
hashes "$first" golden.bin >"$work/out"
if cmp -s "$work/expected" "$work/out"; then
    echo "golden: a rig with another focal length gives the same hashes" >&2
    exit 1
fi
echo "golden: the same $(wc -l <"$work/expected") hashes of $# builds for" \
    "$(sort -u "$work/processors" | wc -l) processors"
