#!/bin/sh
# The golden set on three emulated Cortex-M boards gives the host's hashes; and what the core takes
# there: code and constants, state (struct isohead, without the frame), and which symbols it needs from outside.
#
#     cortexm.sh CJSON_DIR FRAMES_DIR         as in golden.sh
#
# Exit status 1 on a difference, on data of the core that can be written, or when more than memcpy and
# its kin and the compiler's 64-bit arithmetic is called.
set -eu
LC_ALL=C
export LC_ALL

[ $# = 2 ] || { echo "usage: $0 CJSON_DIR FRAMES_DIR" >&2; exit 2; }
boards="mps2-an386-O2 mps2-an500-O2 mps3-an547-O2"
root=$(cd "$(dirname "$0")/../.." && pwd)
# shellcheck disable=SC2086 # a list of names
"$root/tests/golden/golden.sh" "$1" "$2" gcc-O3 $boards

# symbols LIBRARY: what it calls and does not hold itself
symbols() {
    arm-none-eabi-nm "$1" | awk '
        $1 == "U" { wanted[$2] = 1 }
        NF == 3 { held[$3] = 1 }
        END { for (name in wanted) if (!(name in held)) print name }' | sort | paste -s -d ' '
}

bad=0
printf '\n%-14s %-10s %9s %9s %10s   %s\n' board cpu flash_B static_B state_B calls
for name in $boards; do
    build=$root/build/bits/$name
    core=$build/firmware/core/libisohead_core.a
    # shellcheck disable=SC2046 # text, data, bss of the last line
    set -- $(arm-none-eabi-size -t "$core" | tail -n 1)
    flash=$1
    writable=$(($2 + $3))
    state=$(arm-none-eabi-nm -S -t d "$build/tests/golden/golden" | awk '$4 == "head" { print $2 + 0 }')
    calls=$(symbols "$core")
    printf '%-14s %-10s %9s %9s %10s   %s\n' "${name%-*}" \
        "$(sed -n 's/^set(ISOHEAD_CPU \(.*\))$/\1/p' "$root/cmake/${name%-*}.cmake")" \
        "$flash" "$writable" "$state" "$calls"
    [ $writable = 0 ] || bad=1
    for call in $calls; do
        case $call in
        memcpy | memmove | memset | memcmp | __aeabi_ldivmod | __aeabi_uldivmod | __ctzdi2) ;;
        *) echo "cortexm: the core calls $call" >&2; bad=1 ;;
        esac
    done
done
exit $bad
