#!/bin/sh
# The libraries and headers that isohead_board is linked with, for another architecture.
#
#   tools/board/sysroot.sh arm64|armhf      ->  build/sysroot/ARCH
#
# Packages of the distribution, unpacked and never installed (tools/board/apt.sh). To compile, the C
# library's headers come with the cross compiler; libc6 is here so that programs can be run with
# "qemu-aarch64 -L build/sysroot/arm64" and for tools/board/deb.sh, which asks var/lib/dpkg here which
# package a library belongs to. A sysroot that is complete is left as it is; remove it to renew it.
set -eu
cd "$(dirname "$0")/../.."
case "${1:-}" in
arm64 | armhf) arch=$1 ;;
*)
    sed -n '2,4s/^# \{0,1\}//p' "$0" >&2
    exit 2
    ;;
esac
packages="libv4l-dev libv4l-0 libv4lconvert0 libjpeg62-turbo libgpiod-dev libgpiod2 libcjson-dev
    libcjson1 libc6 libmicrohttpd-dev libmicrohttpd12 libgnutls30 libnettle8 libhogweed6 libgmp10
    libidn2-0 libunistring2 libtasn1-6 libp11-kit0 libffi8"

sysroot=build/sysroot/$arch
[ "$(cat "$sysroot/packages" 2>/dev/null)" != "$packages" ] || exit 0

mkdir -p build/sysroot
exec 9>build/sysroot/lock
flock 9
[ "$(cat "$sysroot/packages" 2>/dev/null)" != "$packages" ] || exit 0
echo "sysroot: unpacking libraries for $arch into $sysroot"
rm -rf "$sysroot"
# shellcheck disable=SC2046,SC2086 # lists of words
tools/board/apt.sh unpack "$sysroot" $(printf "%s:$arch " $packages)

# What dpkg would know, were they installed: whose each file is, and which symbols since when.
info=$sysroot/var/lib/dpkg/info
mkdir -p "$info"
echo 1 >"$info/format"
for package in $packages; do
    deb=build/apt/debs/$package:$arch.deb
    dpkg-deb --control "$deb" "$sysroot/control"
    {
        sed '/^Package:/aStatus: install ok installed' "$sysroot/control/control"
        echo
    } >>"$sysroot/var/lib/dpkg/status"
    name=$package
    grep -q '^Multi-Arch: same' "$sysroot/control/control" && name=$package:$arch
    dpkg-deb --fsys-tarfile "$deb" | tar -t | sed -e 's,/$,,' -e "s,^\.,$PWD/$sysroot," >"$info/$name.list"
    for kind in shlibs symbols; do
        [ ! -e "$sysroot/control/$kind" ] || cp "$sysroot/control/$kind" "$info/$name.$kind"
    done
    rm -r "$sysroot/control"
done
printf '%s\n' "$packages" >"$sysroot/packages"
