#!/bin/sh
# The surface of every frame against the float64 solution of the same system, within 0.2 mm.
#
#     surface.sh HOST_SIM FRAMES_DIR...
set -eu
if [ $# -lt 2 ] || [ ! -x "$1" ]; then
    echo "usage: $0 HOST_SIM FRAMES_DIR..." >&2
    exit 2
fi
host_sim=$1
shift
tools=$(cd "$(dirname "$0")/../../tools" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$host_sim" --json --trace "$work" "$@" >"$work/records"
/usr/bin/python3 "$tools/oracle/check_surface.py" "$work"
