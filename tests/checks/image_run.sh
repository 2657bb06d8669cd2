#!/bin/sh
# What the image's run does when the firmware has ended: its laser_off, with a program and a reboot that
# only say what they were called for.
set -eu
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
dog=$work/watchdog
sed -n -e '/^line_before() {/,/^}/p' -e '/^laser_off() {/,/^}/p' tools/image/root/usr/lib/isohead/run |
    sed "s|/run/isohead.conf|$work/conf|g" >"$work/laser_off"
grep -q laser_off "$work/laser_off" || { echo "image_run: run has no laser_off" >&2; exit 1; }
# The firmware goes by the same copy.
if ! grep -q 'set -- --config /run/isohead.conf;' tools/image/root/usr/lib/isohead/run; then
    echo "image_run: the firmware is not started with the settings that --laser-off goes by" >&2
    exit 1
fi
if ! grep -qx '    line_before' tools/image/root/usr/lib/isohead/run; then
    echo "image_run: nobody looks for the line before the firmware is started" >&2
    exit 1
fi
say() { :; }
# By another file than that of the settings that the firmware was started with it says "wrong".
isohead_board() { [ "$2" = "$work/conf" ] && echo off >>"$work/calls" || echo wrong >>"$work/calls"; return "$off_status"; }
reboot() { echo reset >>"$work/calls"; }
sleep() { :; }
# shellcheck source=/dev/null
. "$work/laser_off"

failed=0
# expect CALLS FED STATUS OFF_STATUS [BEFORE]: after the firmware's STATUS, where --laser-off ends with OFF_STATUS,
# and before its start with BEFORE, 0 if not given
expect() {
    : >"$dog"
    off_status=${5:-0}
    line_before
    : >"$work/calls"
    off_status=$4
    laser_off "$3" || true
    calls=$(tr '\n' ' ' <"$work/calls")
    fed=$(wc -c <"$dog")
    if [ "$calls" != "$1" ] || [ "$fed" != "$2" ]; then
        echo "image_run: firmware $3, --laser-off $4: calls '$calls', $fed bytes for the watchdog, expected '$1', $2" >&2
        failed=1
    fi
}

expect "" 0 1 1 # no settings, no laser
: >"$work/conf"
expect "off " 0 0 0
expect "off " 0 137 0
expect "off reset " 1 137 1 # started, and fed no more
expect "off reset " 1 0 1
expect "off reset " 1 1 2
expect "off " 0 2 2 # settings that are wrong switched nothing on
expect "off " 0 1 3 3 # the wrong line in the settings
expect "off " 0 0 3 3
expect "off reset " 1 1 3 0 # the line was there, and is no more
expect "off reset " 1 1 1 3
expect "off reset " 1 137 3 3 # killed: it may have found the line meanwhile
echo "image_run: 12 ends of the firmware, $failed wrong"
exit $failed
