#!/bin/sh
# The image to flash: a boot partition, slots A and B, and the data partition.
#
#   tools/image/image.sh uefi|rpi PROGRAM OUT
#
# PROGRAM is isohead_board for arm64, as `make board ARCH=arm64` gives it. What a kind of board has of its
# own is in a folder beside this script. Writes below OUT: isohead.img; slot.squashfs, what isohead-update takes; isohead.cdx.json, the
# bill of materials; SHA256SUMS. With XZ=1 isohead.img.xz too. Needs no root and mounts nothing.
# The same commit and packages give the same bytes: identifiers and times are fixed.
set -eu
cd "$(dirname "$0")/../.."
if [ $# != 3 ] || [ ! -f "tools/image/$1/board.sh" ]; then
    sed -n '4s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
board=$1
program=$2
out=$3
[ -f "$program" ] || { echo "no $program: type  make board ARCH=arm64" >&2; exit 1; }

ESP_MIB=128
SLOT_MIB=64 # twice of what is needed: room for years of updates
DATA_MIB=48
export SOURCE_DATE_EPOCH="${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}"
export LC_ALL=C TZ=UTC
PATH=$PATH:/sbin:/usr/sbin

mkdir -p "$out"
out=$(cd "$out" && pwd)
# shellcheck source=tools/image/rpi/board.sh
. "tools/image/$board/board.sh"
tools/image/slot.sh "$out" "$board" "$program"
slot=$out/slot.squashfs
bytes=$(stat -c %s "$slot")
sha256=$(sha256sum "$slot" | cut -d ' ' -f 1)
[ "$bytes" -le $((SLOT_MIB * 1048576)) ] || { echo "$bytes bytes do not fit into a slot" >&2; exit 1; }

# identifier NAME: always the same UUID for the same name
identifier() {
    echo "isohead $1" | sha256sum | sed 's/^\(.\{8\}\)\(....\)\(...\)\(...\)\(.\{12\}\).*/\1-\2-4\3-8\4-\5/'
}

# fat FILE MIB LABEL SERIAL: an empty FAT file system
fat() {
    rm -f "$1"
    truncate -s "$2M" "$1"
    mkfs.vfat --invariant -F 32 -n "$3" -i "$4" "$1" >/dev/null
}

esp=$out/esp.fat
fat "$esp" $ESP_MIB ISOHEAD-ESP 15048ead
board_esp "$esp"
for name in a b; do
    mmd -i "$esp" "::/$name"
    mcopy -i "$esp" "$out/boot/linux" "$out/boot/initrd" "::/$name/"
done

data=$out/data.fat
fat "$data" $DATA_MIB ISOHEAD 15048eda
mcopy -i "$data" tools/image/data/readme.txt docs/safety.md ::/
sed 's|^rig = .*|rig = /data/rig.json|' firmware/app/isohead.conf | mcopy -i "$data" - ::/isohead.conf

image=$out/isohead.img
rm -f "$image"
truncate -s $((ESP_MIB + 2 * SLOT_MIB + DATA_MIB + 2))M "$image"
board_table | sfdisk --quiet "$image"
board_state "$image"
# put FILE MIB: at that offset of the image
put() { dd if="$1" of="$image" bs=1M seek="$2" conv=notrunc,sparse status=none; }
put "$esp" 1
put "$slot" $((1 + ESP_MIB))
put "$slot" $((1 + ESP_MIB + SLOT_MIB))
put "$data" $((1 + ESP_MIB + 2 * SLOT_MIB))

read -r packages <"$out/packages.list"
# shellcheck disable=SC2046,SC2086 # lists of packages
/usr/bin/python3 tools/board/bill.py image "$out/root" "$out/initramfs" "$out/boot" build/apt/debs $packages $(board_linked) \
    >"$out/isohead.cdx.json"

(cd "$out" && sha256sum isohead.img slot.squashfs isohead.cdx.json >SHA256SUMS)
show() { echo "$1: $(($(stat -c %s "$1") * 10 / 1048576))" | sed 's/\(.\)$/.\1 MiB/'; }
show "$image"
show "$slot"
if [ "${XZ:-}" = 1 ]; then
    xz --keep --force --threads=1 -9 "$image"
    show "$image.xz"
fi
