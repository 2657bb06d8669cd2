#!/bin/sh
# The image to flash: a GPT with the ESP, slots A and B, and the data partition.
#
#   tools/image/image.sh [BOARD [OUT]]
#
# BOARD is isohead_board for arm64 (default: that of `make board ARCH=arm64`). Writes below OUT
# (default build/image): isohead.img; slot.squashfs, what isohead-update takes; isohead.cdx.json, the
# bill of materials; SHA256SUMS. With XZ=1 isohead.img.xz too. Needs no root and mounts nothing.
# The same commit and packages give the same bytes: identifiers and times are fixed.
set -eu
cd "$(dirname "$0")/../.."
board=${1:-build/board-arm64/firmware/app/isohead_board}
out=${2:-build/image}
[ -f "$board" ] || { echo "no $board: type  make board ARCH=arm64" >&2; exit 1; }

ESP_MIB=128
SLOT_MIB=64 # twice of what is needed: room for years of updates
DATA_MIB=48
export SOURCE_DATE_EPOCH="${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}"
export LC_ALL=C TZ=UTC
PATH=$PATH:/sbin:/usr/sbin

mkdir -p "$out"
out=$(cd "$out" && pwd)
tools/image/slot.sh "$out" "$board"
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

# entry SLOT VERSION: its boot loader entry; 3 tries
entry() {
    cat <<ENTRY
title isohead, slot $1
sort-key isohead
version $2
linux /$1/linux
initrd /$1/initrd
options isohead.slot=$1 isohead.bytes=$bytes isohead.sha256=$sha256 panic=5 loglevel=4
ENTRY
}

esp=$out/esp.fat
fat "$esp" $ESP_MIB ISOHEAD-ESP 15048ead
mmd -i "$esp" ::/EFI ::/EFI/BOOT ::/loader ::/loader/entries ::/a ::/b
mcopy -i "$esp" "$out/boot/systemd-bootaa64.efi" ::/EFI/BOOT/BOOTAA64.EFI
mcopy -i "$esp" "$out/boot/linux" "$out/boot/initrd" ::/a/
mcopy -i "$esp" "$out/boot/linux" "$out/boot/initrd" ::/b/
# The menu takes no key: the command line of an entry says what is checked.
printf 'timeout 0\neditor no\nauto-entries no\nauto-firmware no\n' | mcopy -i "$esp" - ::/loader/loader.conf
entry a 2 | mcopy -i "$esp" - ::/loader/entries/slot-a+3.conf
entry b 1 | mcopy -i "$esp" - ::/loader/entries/slot-b+3.conf

data=$out/data.fat
fat "$data" $DATA_MIB ISOHEAD 15048eda
mcopy -i "$data" tools/image/data/readme.txt docs/safety.md ::/
sed 's|^rig = .*|rig = /data/rig.json|' firmware/app/isohead.conf | mcopy -i "$data" - ::/isohead.conf

image=$out/isohead.img
rm -f "$image"
truncate -s $((ESP_MIB + 2 * SLOT_MIB + DATA_MIB + 2))M "$image"
sfdisk --quiet "$image" <<TABLE
label: gpt
label-id: $(identifier disk)
first-lba: 2048
start=2048, size=${ESP_MIB}MiB, type=uefi, name=isohead-esp, uuid=$(identifier esp)
size=${SLOT_MIB}MiB, type=linux, name=isohead-a, uuid=$(identifier a)
size=${SLOT_MIB}MiB, type=linux, name=isohead-b, uuid=$(identifier b)
size=${DATA_MIB}MiB, type=EBD0A0A2-B9E5-4433-87C0-68B6B72699C7, name=isohead-data, uuid=$(identifier data)
TABLE
# put FILE MIB: at that offset of the image
put() { dd if="$1" of="$image" bs=1M seek="$2" conv=notrunc,sparse status=none; }
put "$esp" 1
put "$slot" $((1 + ESP_MIB))
put "$slot" $((1 + ESP_MIB + SLOT_MIB))
put "$data" $((1 + ESP_MIB + 2 * SLOT_MIB))

read -r packages <"$out/packages.list"
# shellcheck disable=SC2086 # a list of packages
/usr/bin/python3 tools/board/bill.py image "$out/root" "$out/initramfs" "$out/boot" build/apt/debs $packages \
    >"$out/isohead.cdx.json"

(cd "$out" && sha256sum isohead.img slot.squashfs isohead.cdx.json >SHA256SUMS)
show() { echo "$1: $(($(stat -c %s "$1") * 10 / 1048576))" | sed 's/\(.\)$/.\1 MiB/'; }
show "$image"
show "$slot"
if [ "${XZ:-}" = 1 ]; then
    xz --keep --force --threads=1 -9 "$image"
    show "$image.xz"
fi
