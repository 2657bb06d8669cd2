#!/bin/sh
# Many frames in one process: the same memory and the same records for the same frames at the end as
# at the start.
#
#     longrun.sh LONGRUN RENDER WORK_DIR FRAMES
#
# LONGRUN, RENDER: the built programs. The sequences are rendered below WORK_DIR if they are not there.
set -eu

if [ $# != 4 ] || [ ! -x "$1" ] || [ ! -x "$2" ]; then
    echo "usage: $0 LONGRUN RENDER WORK_DIR FRAMES" >&2
    exit 2
fi
longrun=$1
render=$2
work=$3
frames=$4

# sequence NAME OPTION...: rig.json is written last, it stands for the whole directory.
sequence() {
    name=$1
    shift
    [ -e "$work/$name/rig.json" ] || "$render" "$@" "$work/$name"
}
mkdir -p "$work"
sequence visit --scene visit --rig wide --size 376x290 --frames 40 --seed 11
sequence hands --sequence 2 --frames 24 --seed 12
sequence two --scene two --laser alternate --size 480x372 --frames 30 --seed 13
sequence turning --scene turning --size 320x240 --frames 24 --seed 14

"$longrun" "$frames" "$work/visit" "$work/hands" "$work/two" "$work/turning"
