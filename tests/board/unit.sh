#!/bin/sh
# The package's unit under a real systemd, on the emulated board.
#
#     tests/board/unit.sh ROOT RIG_JSON
#
# ROOT: a Debian arm64 root with systemd, udev and the package in it, which is left as it is. What
# tests/board/get.sh has made is the kernel; the root and its drivers are packed into an archive that
# the kernel unpacks into memory, build/board/unit.cpio. Then test_unit.py looks. Needs root, for the
# files' owners.
set -eu
LC_ALL=C
export LC_ALL
[ $# = 2 ] || { echo "usage: $0 ROOT RIG_JSON" >&2; exit 2; }
from=$(realpath "$1")
rig=$(realpath "$2")
cd "$(dirname "$0")/../.."
here=tests/board
board=$PWD/build/board
[ -e "$board/Image" ] || { echo "unit: no kernel in $board: run $here/get.sh" >&2; exit 1; }

root=$(mktemp -d)
trap 'rm -rf --one-file-system "$root"' EXIT
trap 'exit 1' HUP INT TERM

# Without what a start does not need.
tar -c -C "$from" --one-file-system --exclude=./usr/share --exclude='./usr/lib/*/gconv' \
    --exclude='./usr/lib/*/perl-base' --exclude='./var/lib/apt/*' --exclude='./var/cache/*' \
    --exclude='./root/*' --exclude='./dev/*' . | tar -x -C "$root"

cp -r "$board/root/lib/modules" "$root/usr/lib/"
printf '%s\n' virtio_mmio virtio_console vivid >"$root/etc/modules-load.d/board.conf"
# One camera, and nothing but that.
mkdir -p "$root/etc/modprobe.d"
echo 'options vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0x0' >"$root/etc/modprobe.d/board.conf"
install -m 755 $here/unit/control "$root/usr/local/bin/control"
units=$root/etc/systemd/system
install -m 644 $here/unit/control.service "$units/"
mkdir -p "$units/multi-user.target.wants"
ln -s ../control.service "$units/multi-user.target.wants/"
ln -sf /lib/systemd/system/multi-user.target "$units/default.target"
# Slow to start on an emulated processor, and not what is looked at.
for unit in getty.target apt-daily.timer apt-daily-upgrade.timer dpkg-db-backup.timer \
    systemd-update-utmp.service systemd-update-utmp-runlevel.service; do
    ln -sf /dev/null "$units/$unit"
done
# The unit's own times are ten seconds each, and the board's clock is slower than this machine's.
mkdir "$units/isohead.service.d"
printf '[Service]\nWatchdogSec=4\nRestartSec=5\n' >"$units/isohead.service.d/times.conf"
# Of a size that vivid has; there are no dots in its pictures anyway.
sed -e 's/"image_width": *[0-9]*/"image_width":640/' -e 's/"image_height": *[0-9]*/"image_height":480/' \
    "$rig" >"$root/etc/isohead/rig.json"
ln -s lib/systemd/systemd "$root/init"

(cd "$root" && find . -print0 | sort -z | cpio --quiet -0 -o -H newc) >"$board/unit.cpio"
/usr/bin/python3 $here/test_unit.py --kernel "$board/Image" --initramfs "$board/unit.cpio" \
    --console "$board/unit.log"
