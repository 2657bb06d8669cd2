#!/bin/sh
# The manual pages of isohead_board are well formed and name the very settings that it has.
#
#     manual.sh COMMAND...       COMMAND --help is asked, so that an emulator may stand in front
#
# Every option of --help has an entry in packaging/isohead_board.1 and no other; the same for
# packaging/isohead.conf.5, but for those that only the command line has. Exit status 1 otherwise.
set -eu
LC_ALL=C
export LC_ALL
[ $# -ge 1 ] || { echo "usage: $0 COMMAND..." >&2; exit 2; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$@" --help >"$work/help"
cd "$(dirname "$0")/../../packaging"

# What an entry of --help begins with; in its text other options may be spoken of.
sed -n 's/^ *--\([a-z][a-z-]*\).*/\1/p' "$work/help" | sort >"$work/options"
[ -s "$work/options" ] || { echo "manual: --help lists no options" >&2; exit 1; }
sed -n 's/^\.It Fl -\([a-z-]*\).*/\1/p' isohead_board.1 | sort >"$work/page1"
grep -vxE 'config|laser-off|check|help|version' "$work/options" >"$work/keys"
sed -n 's/^\.It Ic \([a-z-]*\) = .*/\1/p' isohead.conf.5 | sort >"$work/page5"
failed=0
if ! diff "$work/options" "$work/page1"; then
    echo "manual: isohead_board.1 (>) and --help (<) differ" >&2
    failed=1
fi
if ! diff "$work/keys" "$work/page5"; then
    echo "manual: isohead.conf.5 (>) and --help (<) differ" >&2
    failed=1
fi

# Lines of the two that check pages, of which none is expected.
for page in isohead_board.1 isohead.conf.5; do
    mandoc -Tlint "$page" >"$work/lint" 2>&1 || true
    LC_ALL=C.UTF-8 man --warnings -E UTF-8 -l -Tutf8 -Z "./$page" 2>>"$work/lint" >/dev/null || true
    if [ -s "$work/lint" ]; then
        cat "$work/lint" >&2
        failed=1
    fi
done
[ $failed = 0 ] || exit 1
echo "manual: $(wc -l <"$work/options") options, $(wc -l <"$work/keys") keys, as --help has them"
