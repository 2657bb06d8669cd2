#!/bin/sh
# make flash: what it refuses, and that it writes the whole image. On loop devices: as root.
#
#   tests/board/flash.sh WORK
set -eu
[ $# = 1 ] || { sed -n '2,4s/^# \{0,1\}//p' "$0" >&2; exit 2; }
PATH=$PATH:/sbin:/usr/sbin
mkdir -p "$1"
work=$(cd "$1" && pwd)
flash=$(cd "$(dirname "$0")/../../tools/image" && pwd)/flash.sh
image=$work/image
holder=
loops=

# shellcheck disable=SC2317 # called by trap
leave() {
    [ -z "$holder" ] || kill "$holder" 2>/dev/null || true
    umount "$work/mounted" 2>/dev/null || true
    for loop in $loops; do
        swapoff "$loop" 2>/dev/null || true
        losetup -d "$loop" 2>/dev/null || true
    done
}
trap leave EXIT
fail() { echo "FAIL $*" >&2; exit 1; }

# attach FILE MIB [OPTION]: a loop device in $loop over a new file
attach() {
    rm -f "$work/$1"
    truncate -s "$2M" "$work/$1"
    # shellcheck disable=SC2086 # no or one option
    loop=$(losetup --find --show ${3:-} "$work/$1") ||
        fail "no loop device can be made here: this test needs root, and /dev/loop*"
    loops="$loops $loop"
}

# refuses WHAT EXPECTED DEVICE [ANSWER]: with these words, and without a change of the device
refuses() {
    if message=$(echo "${4:-}" | "$flash" "$3" "$image" 2>&1); then
        fail "$1: was flashed"
    fi
    case "$message" in
    *"$2"*) echo "ok   refuses $1" ;;
    *) fail "$1: expected '$2', got: $message" ;;
    esac
}

# A small image, as image.sh makes one: a partition table, and bytes that are not zero.
truncate -s 12M "$image"
printf 'label: gpt\nsize=4MiB, name=one\nname=two\n' | sfdisk --quiet "$image"
head -c 4194304 /dev/urandom | dd of="$image" bs=1M seek=2 conv=notrunc status=none

refuses "what does not exist" "not a block device" "$work/none"
refuses "a file" "not a block device" "$image"
refuses "a character device" "not a block device" /dev/null

# The disk below the root file system, if this machine shows one. No answer is given, so that
# nothing could happen even if the check did not work.
root=$(findmnt --noheadings --output SOURCE --target / | sed 's/\[.*//')
if [ -b "$root" ]; then
    disk=$(lsblk --inverse --noheadings --list --paths --output NAME "$root" | tail -n 1)
    refuses "the system's disk" "holds / of the running system" "$disk"
else
    echo "not seen: the system's disk ($root is no block device)"
fi

attach small 11
refuses "a disk that is too small" "has 11534336 bytes, the image 12582912" "$loop" "$loop"
attach readonly 16 --read-only
refuses "a disk that is read-only" "read-only" "$loop" "$loop"

attach mounted_disk 16
mkfs.ext4 -q "$loop"
mkdir -p "$work/mounted"
mount "$loop" "$work/mounted"
refuses "a mounted disk" "mounted" "$loop" "$loop"
umount "$work/mounted"

attach swap_disk 16
mkswap "$loop" >/dev/null
swapon "$loop"
refuses "swap" "swap" "$loop" "$loop"
swapoff "$loop"

attach held 16
/usr/bin/python3 -c 'import os, sys, time
os.open(sys.argv[1], os.O_RDWR | os.O_EXCL)
open(sys.argv[2], "w").close()
time.sleep(600)' "$loop" "$work/holds" &
holder=$!
while [ ! -e "$work/holds" ]; do kill -0 $holder || fail "the holder ended"; sleep 0.1; done
refuses "a disk that a program holds" "in use by the kernel or another program" "$loop" "$loop"
kill $holder
wait $holder 2>/dev/null || true
holder=
rm "$work/holds"

attach disk 16
refuses "another answer than the name" "'yes' is not its name" "$loop" yes
refuses "no answer" "'' is not its name" "$loop"
cmp -s -n 12582912 "$loop" /dev/zero || fail "a refused disk was changed"
echo "$loop" | "$flash" "$loop" "$image" >"$work/log" 2>&1 || fail "a free disk: $(cat "$work/log")"
grep -q "read back and compared" "$work/log" || fail "says nothing of reading back: $(cat "$work/log")"
# The table's first copy names the place of the second, which has moved to the end.
offset=1048576
cmp -s -i $offset -n $((8 * 1048576)) "$image" "$work/disk" || fail "the disk does not hold the image"
sfdisk --verify "$loop" 2>&1 | grep -q "No errors detected" || fail "the disk's partition table"
sfdisk --verify "$loop" 2>&1 | grep -qi "backup.*not on the end" && fail "the second table was not moved"
echo "ok   writes, reads back, moves the second partition table to the end"

partx --add "$loop" 2>/dev/null || true
[ -b "${loop}p1" ] || fail "no ${loop}p1 appeared: partitions are not tested"
refuses "a partition" "is a part, not a whole disk" "${loop}p1" "${loop}p1"
mkfs.ext4 -q "${loop}p1"
mount "${loop}p1" "$work/mounted"
refuses "a disk with a mounted partition" "mounted" "$loop" "$loop"
umount "$work/mounted"
partx --delete "$loop"
YES=1 "$flash" "$loop" "$image" >"$work/log" 2>&1 </dev/null || fail "YES=1: $(cat "$work/log")"
echo "ok   YES=1 asks nothing"

# A dd that leaves off the end stands for a disk that does not keep what it is given.
mkdir -p "$work/bin"
printf '#!/bin/sh\ncase " $* " in *" of="*) set -- "$@" count=2 ;; esac\nexec %s "$@"\n' \
    "$(command -v dd)" >"$work/bin/dd"
chmod +x "$work/bin/dd"
attach forgetful 16
if YES=1 PATH=$work/bin:$PATH "$flash" "$loop" "$image" >"$work/log" 2>&1; then
    fail "a disk that does not hold what was written passed"
fi
grep -q "does not hold what was written" "$work/log" || fail "a forgetful disk: $(cat "$work/log")"
echo "ok   sees that a disk does not hold what was written"

# The older kind of partition table has no second copy: nothing is added to the image.
truncate -s 12M "$image"
printf 'label: dos\nsize=4MiB, type=c\ntype=83\n' | sfdisk --quiet --wipe always "$image"
attach older 16
YES=1 "$flash" "$loop" "$image" >"$work/log" 2>&1 || fail "a table of the older kind: $(cat "$work/log")"
cmp -s -n 12582912 "$image" "$work/older" || fail "the disk does not hold the image with a table of the older kind"
cmp -s -i 12582912:0 -n 4194304 "$work/older" /dev/zero || fail "something was written behind the image"
echo "ok   a table of the older kind"
