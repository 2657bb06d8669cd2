#!/bin/sh
# The emulated board's kernel: Debian's own for arm64, and the modules that its camera needs.
#
#   tests/board/get.sh    ->  build/board/Image              the kernel
#                             build/board/root/lib/modules   modules, with what they depend on
#                             build/board/root/bin/busybox
#                             build/board/release            the kernel's `uname -r`
#
# The camera is v4l2loopback, built here against the kernel's headers. Nothing happens when all is
# there and this script is unchanged; remove build/board for a newer kernel.
set -eu
cd "$(dirname "$0")/../.."
out=$PWD/build/board
apt=tools/board/apt.sh
stamp=$(cksum <tests/board/get.sh)
[ "$(cat "$out/stamp" 2>/dev/null)" = "$stamp" ] && exit 0

rm -rf "$out"
mkdir -p "$out/root/bin"
# The number in the names moves with every security update.
image=$($apt newest 'linux-image-6\.1\.0-[0-9]+-arm64')
release=${image#linux-image-}
common=linux-headers-${release%-arm64}-common
unpacked=$out/unpacked
$apt unpack "$unpacked" "$image:arm64" "linux-headers-$release:arm64" "$common" linux-kbuild-6.1 \
    busybox-static:arm64 v4l2loopback-source

# The headers name each other by where they would be installed.
headers=$unpacked/usr/src/linux-headers-$release
sed -i "s|^include /usr/src/|include $unpacked/usr/src/|" "$headers/Makefile"

# Three lines of v4l2loopback are not as a camera's driver would have them. Frames that are queued with
# a time stamp get no number: it shall be the feeder's, and the stamp of the monotonic clock. And the
# frame rate can be set, but it does not say so. And whoever is more than two frames behind gets the last
# one only: a camera's driver keeps as many as it has buffers.
tar -x -C "$unpacked" -f "$unpacked/usr/src/v4l2loopback.tar.bz2"
source=$unpacked/modules/v4l2loopback
change() {
    grep -qF "$1" "$source/v4l2loopback.c" ||
        { echo "$0: v4l2loopback.c has changed: no line '$1' in it" >&2; exit 1; }
    sed -i "s/$1/$2/" "$source/v4l2loopback.c"
}
change 'b->buffer.bytesused = buf->bytesused;' "& b->buffer.sequence = buf->sequence;\
    b->buffer.flags |= V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;"
change 'capture_param->capability = 0;' 'capture_param->capability = V4L2_CAP_TIMEPERFRAME;'
change 'if (dev->write_position > opener->read_position + 2)' \
    'if (dev->write_position > opener->read_position + dev->used_buffers)'
make -C "$headers" ARCH=arm64 CROSS_COMPILE=aarch64-linux-gnu- M="$source" modules \
    >"$out/log" 2>&1 || { tail -n 20 "$out/log" >&2; exit 1; }

# All modules, to find out what depends on what; then only those that are wanted.
mkdir -p "$unpacked/lib/modules/$release/extra"
aarch64-linux-gnu-strip --strip-debug -o "$unpacked/lib/modules/$release/extra/v4l2loopback.ko" \
    "$source/v4l2loopback.ko"
PATH=$PATH:/sbin:/usr/sbin
depmod -b "$unpacked" "$release"
modules=$out/root/lib/modules/$release
mkdir -p "$modules"
for module in virtio_mmio virtio_console virtio_net v4l2loopback vivid; do
    modprobe -d "$unpacked" -S "$release" --ignore-install --show-depends "$module" |
        while read -r verb file rest; do
            [ "$verb" != insmod ] || cp "$file" "$modules/"
        done
done
cp "$unpacked/lib/modules/$release"/modules.builtin* "$unpacked/lib/modules/$release/modules.order" \
    "$modules/"
depmod -b "$out/root" "$release"

cp "$unpacked/boot/vmlinuz-$release" "$out/Image"
cp "$unpacked/bin/busybox" "$out/root/bin/"
echo "$release" >"$out/release"
rm -rf "$unpacked"
echo "$stamp" >"$out/stamp"
