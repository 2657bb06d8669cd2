#!/bin/sh
# The root of one slot of the image: everything that an update replaces.
#
#   tools/image/slot.sh WORK uefi|rpi PROGRAM
#
# PROGRAM is isohead_board for arm64. Writes WORK/slot.squashfs, and WORK/boot/ with the kernel, the
# initramfs and the boot loader; kernel and initramfs are in the slot too, so that its one file is
# all of an update. WORK/root, what the slot was made of, is left there.
# Same input, same bytes: SOURCE_DATE_EPOCH is the time of every file, names are sorted.
set -eu
[ $# = 3 ] || { sed -n '2,4s/^# \{0,1\}//p' "$0" >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
apt=$here/../board/apt.sh
mkdir -p "$1"
work=$(cd "$1" && pwd)
board=$2
program=$3
: "${SOURCE_DATE_EPOCH:?is the time that all files get}"
export LC_ALL=C
umask 022

packages=$work/packages
root=$work/root
initramfs=$work/initramfs
rm -rf "$packages" "$root" "$initramfs" "${work:?}/boot"
mkdir -p "$root" "$initramfs" "$work/boot"

# shellcheck source=tools/image/rpi/board.sh
. "$here/$board/board.sh"
of_board=$(board_packages)
# shellcheck disable=SC2086 # a list of packages
"$apt" unpack "$packages" $of_board
set -- busybox-static:arm64 libc6:arm64 libgcc-s1:arm64 libv4l-0:arm64 libv4lconvert0:arm64 libjpeg62-turbo:arm64 \
    libgpiod2:arm64 libcjson1:arm64 libmicrohttpd12:arm64 libgnutls30:arm64 libnettle8:arm64 \
    libhogweed6:arm64 libgmp10:arm64 libidn2-0:arm64 libunistring2:arm64 libtasn1-6:arm64 \
    libp11-kit0:arm64 libffi8:arm64
SUITE='' "$apt" unpack "$packages" "$@"
# shellcheck disable=SC2086 # a list of packages
echo $of_board "$*" >"$work/packages.list" # for the bill of materials
[ ! -e "$packages/usr/lib/modules" ] || mv "$packages/usr/lib/modules" "$packages/lib/"
version=$(basename "$packages"/lib/modules/*)
kernel=$(find "$packages" -name "vmlinuz*")

# modules TREE KIND...: the kernel's modules of these kinds in modules.list, and what they need
modules() {
    tree=$1
    shift
    from=$packages/lib/modules/$version
    to=$tree/lib/modules/$version
    mkdir -p "$to"
    for kind in "$@"; do
        sed -n "s/^$kind //p" "$here/modules.list"
    done | sort >"$work/wanted"
    while read -r path; do
        ! grep -qx "kernel/$path" "$from/modules.builtin" || continue
        [ -e "$from/kernel/$path" ] || path=$path.xz
        [ -e "$from/kernel/$path" ] || { echo "modules.list: kernel $version has no $path" >&2; exit 1; }
        (cd "$from" && find "kernel/$path" -name '*.ko' -o -name '*.ko.xz')
    done <"$work/wanted" >"$work/modules"
    # modules.dep names all that a module needs, not only the next.
    awk 'NR == FNR { wanted[$1 ":"]; next } $1 in wanted { for (i = 2; i <= NF; i++) print $i }' \
        "$work/modules" "$from/modules.dep" | sort -u - "$work/modules" >"$work/all_modules"
    (cd "$from" && cpio --quiet -pdm "$to" <"$work/all_modules")
    cp "$from/modules.builtin" "$from/modules.builtin.modinfo" "$from/modules.order" "$to/"
    depmod -b "$tree" "$version"
    rm -f "$to"/modules.*.bin "$to"/modules.builtin* "$to/modules.order" # busybox reads the text files
}

# libraries PROGRAM: it and the libraries it needs, and theirs, copied to where they are looked for
libraries() {
    found=" "
    queue=$1
    while [ -n "$queue" ]; do
        first=${queue%% *}
        queue=${queue#"$first"}
        queue=${queue# }
        for name in $(readelf -d "$first" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p'); do
            case "$found" in *" $name "*) continue ;; esac
            found="$found$name "
            file=$(find "$packages/lib" "$packages/usr/lib" -name "$name" | head -n 1)
            [ -n "$file" ] || { echo "$first needs $name, which is in none of the packages" >&2; exit 1; }
            cp -L "$file" "$root/usr/lib/aarch64-linux-gnu/$name"
            queue="$queue${queue:+ }$root/usr/lib/aarch64-linux-gnu/$name"
        done
    done
}

# busybox TREE FOLDER: it and a link for each of its commands
busybox() {
    install -D "$packages/bin/busybox" "$1/$2/busybox"
    for name in $(qemu-aarch64 "$packages/bin/busybox" --list); do
        [ "$name" = busybox ] || ln -sf busybox "$1/$2/$name"
    done
}

# What may differ from one working copy to the next; cpio and mksquashfs leave out all else.
level() {
    chmod -R u=rwX,go=rX "$1"
    find "$1" -exec touch -hd "@$SOURCE_DATE_EPOCH" {} +
}

[ -e "$packages/lib/modules/$version/modules.dep" ] || depmod -b "$packages" "$version"

mkdir -p "$initramfs/dev" "$initramfs/proc" "$initramfs/sys" "$initramfs/run" "$initramfs/root" \
    "$initramfs/usr/lib/isohead"
busybox "$initramfs" bin
cp "$here/initramfs/init" "$initramfs/init"
cp "$here/root/usr/lib/isohead/slots" "$here/$board/boot" "$initramfs/usr/lib/isohead/"
modules "$initramfs" "$BOOT_KIND"
level "$initramfs"
(cd "$initramfs" && find . | sort | cpio --quiet --reproducible -R 0:0 -o -H newc) |
    zstd --quiet -19 >"$work/boot/initrd"
board_boot

cp -R "$here/root/." "$root/"
cp "$here/$board/boot" "$root/usr/lib/isohead/"
for folder in boot data dev etc proc run sys tmp usr/bin usr/lib/aarch64-linux-gnu; do
    mkdir -p "$root/$folder"
done
ln -s usr/bin "$root/bin"
ln -s usr/sbin "$root/sbin"
ln -s usr/lib "$root/lib"
ln -s ../run/resolv.conf "$root/etc/resolv.conf"
busybox "$root" bin
ln -s ../bin/busybox "$root/usr/sbin/init"
modules "$root" boot root "$board"
aarch64-linux-gnu-strip -o "$root/usr/bin/isohead_board" "$program"
live=$(dirname "$program")/../lib/isohead/isohead_live
aarch64-linux-gnu-strip -o "$root/usr/lib/isohead/isohead_live" "$live"
libraries "$program"
libraries "$live"
ln -s aarch64-linux-gnu/ld-linux-aarch64.so.1 "$root/usr/lib/ld-linux-aarch64.so.1"
cp "$work/boot/linux" "$work/boot/initrd" "$root/boot/"
level "$root"
rm -f "$work/slot.squashfs"
mksquashfs "$root" "$work/slot.squashfs" -quiet -no-progress -all-root -no-xattrs -no-exports \
    -comp zstd -Xcompression-level 19 -b 256K >"$work/mksquashfs.log"
