#!/bin/sh
# Write an image to a whole disk, and read it back.
#
#   tools/image/flash.sh DEVICE IMAGE
#
# Refused: what is no whole disk, read-only, too small, the disk of the running system, or in use:
# mounted, swap, part of a volume group or array, open for itself by anyone. The device's name has
# to be typed once more; YES=1 in the environment stands for that.
set -eu
PATH=$PATH:/sbin:/usr/sbin
if [ -z "${1:-}" ] || [ $# != 2 ]; then
    sed -n '2,4s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
device=$1
image=$2
refuse() { echo "flash: $device: $*; nothing was written" >&2; exit 1; }

[ -f "$image" ] || { echo "flash: no image $image: type  make image" >&2; exit 1; }
[ -b "$device" ] || refuse "not a block device"
device=$(readlink -f "$device")
if [ ! -w "$device" ] || [ ! -r "$device" ]; then
    refuse "may not be read and written by $(id -un): root may"
fi
read -r type model <<END_OF_ROW
$(lsblk --nodeps --noheadings --output TYPE,MODEL "$device")
END_OF_ROW
case "$type" in
disk | loop) ;;
*) refuse "is a $type, not a whole disk" ;;
esac

# Below: what is made of the disk, through partitions, volumes, arrays and encryption.
for folder in / /boot /boot/efi /usr /var /home; do
    source=$(findmnt --noheadings --nofsroot --output SOURCE --target "$folder" 2>/dev/null | tail -n 1)
    [ -b "$source" ] || continue # a network or memory file system
    if lsblk --inverse --noheadings --list --paths --output NAME "$source" | grep -qx "$device"; then
        refuse "holds $folder of the running system"
    fi
done
in_use=$(lsblk --noheadings --list --paths --output NAME,MOUNTPOINTS "$device" | awk 'NF > 1')
[ -z "$in_use" ] || refuse "mounted, or swap:" "$(echo "$in_use" | tr -s ' \n' ' ')"
# A kernel swaps to what lsblk does not show where there is no udev.
while read -r swap rest; do
    if [ -b "$swap" ] &&
        lsblk --inverse --noheadings --list --paths --output NAME "$swap" | grep -qx "$device"; then
        refuse "$swap is swap"
    fi
done </proc/swaps
above=$(lsblk --noheadings --list --output NAME,TYPE "$device" | awk '$2 != "part" && NR > 1 { print $1 }')
[ -z "$above" ] || refuse "part of $(echo "$above" | tr '\n' ' ')"
[ "$(blockdev --getro "$device")" = 0 ] || refuse "read-only"
# The kernel's own word: nobody else has it, or a partition of it, for himself.
/usr/bin/python3 -c 'import os, sys; os.open(sys.argv[1], os.O_RDWR | os.O_EXCL)' "$device" \
    2>/dev/null || refuse "in use by the kernel or another program"

bytes=$(stat -L -c %s "$image")
room=$(blockdev --getsize64 "$device")
[ "$room" -ge "$bytes" ] || refuse "has $room bytes, the image $bytes"

echo "$device: ${model:-no model name}, $((room / 1000000)) MB. All that is on it will be lost."
if [ "${YES:-}" != 1 ]; then
    printf 'Type its name to write %s (%s MB) to it: ' "$(basename "$image")" $((bytes / 1000000))
    read -r answer || answer=
    [ "$answer" = "$device" ] || refuse "'$answer' is not its name"
fi

dd if="$image" of="$device" bs=4M oflag=direct conv=fsync,nocreat status=progress
# Past the cache: what comes back is what the medium holds.
blockdev --flushbufs "$device"
echo "reading back"
dd if="$device" bs=4M iflag=direct,count_bytes count="$bytes" status=none | cmp - "$image" || {
    echo "flash: $device does not hold what was written: do not use it" >&2
    exit 1
}
# A GPT's second copy belongs to the end of the medium, which the image does not know.
if sfdisk --dump "$image" | grep -q '^label: gpt'; then
    message=$(sfdisk --quiet --relocate gpt-bak-std "$device" 2>&1) || {
        echo "flash: the second partition table of $device: $message" >&2
        exit 1
    }
fi
sync "$device"
echo "$device holds $(basename "$image"), read back and compared"
