#!/bin/sh
# The Debian package of isohead_board.
#
#   tools/board/deb.sh arm64|armhf     ->  build/isohead_VERSION_ARCH.deb; its name is printed
#                                          build/isohead_VERSION_ARCH.cdx.json, its bill of materials
#
# Of what `make board ARCH=...` built. Dependencies are computed from the program's symbols and what
# the sysroot's packages say of theirs. The same commit gives the same bytes.
set -eu
LC_ALL=C
export LC_ALL
umask 022
cd "$(dirname "$0")/../.."
root=$PWD
case "${1:-}" in
arm64) arch=$1 strip=aarch64-linux-gnu-strip ;;
armhf) arch=$1 strip=arm-linux-gnueabihf-strip ;;
*)
    sed -n '2,5s/^# \{0,1\}//p' "$0" >&2
    exit 2
    ;;
esac
program=build/board-$arch/firmware/app/isohead_board
live=build/board-$arch/firmware/lib/isohead/isohead_live
sysroot=$root/build/sysroot/$arch
[ -x "$program" ] || { echo "deb: no $program: run make board ARCH=$arch" >&2; exit 1; }
version=$(sed -n 's/^project(isohead VERSION \([0-9.]*\) .*/\1/p' CMakeLists.txt)
[ -n "$version" ] || { echo "deb: no version in CMakeLists.txt" >&2; exit 1; }
# Times in the package: the last commit's, or what the caller names, as without git.
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
export SOURCE_DATE_EPOCH

stage=build/deb-$arch
package=$stage/isohead
rm -rf "$stage"
mkdir -p "$package/DEBIAN" "$stage/debian"

# put MODE FROM TO
put() { install -D -m "$1" "$2" "$package$3"; }
# pack FROM TO.gz: without a name and time in it
pack() {
    mkdir -p "$(dirname "$package$2")"
    gzip -9n <"$1" >"$package$2"
}
put 755 "$program" /usr/bin/isohead_board
put 755 "$live" /usr/lib/isohead/isohead_live
"$strip" --strip-unneeded --remove-section=.comment --remove-section=.note \
    "$package/usr/bin/isohead_board" "$package/usr/lib/isohead/isohead_live"
put 644 packaging/isohead.service /lib/systemd/system/isohead.service
put 644 packaging/60-isohead.rules /lib/udev/rules.d/60-isohead.rules
put 644 firmware/app/isohead.conf /etc/isohead/isohead.conf
pack packaging/isohead_board.1 /usr/share/man/man1/isohead_board.1.gz
pack packaging/isohead.conf.5 /usr/share/man/man5/isohead.conf.5.gz
# Who has only the package must be able to read what the settings refer to.
for text in safety hardware contract live; do
    put 644 "docs/$text.md" "/usr/share/doc/isohead/$text.md"
done

# The licence's text as an indented paragraph, empty lines as dots.
sed '1,/^$/d' LICENSE | sed '1,/^$/d' | sed -e 's/^$/./' -e 's/^/ /' | cat packaging/copyright - \
    >"$stage/copyright"
put 644 "$stage/copyright" /usr/share/doc/isohead/copyright
maintainer=$(sed -n 's/^Maintainer: //p' packaging/control.in)
{
    printf 'isohead (%s) stable; urgency=medium\n\n' "$version"
    printf '  * What is new stands in CHANGELOG.md of the sources.\n\n'
    printf ' -- %s  %s\n' "$maintainer" "$(date -u -R -d "@$SOURCE_DATE_EPOCH")"
} >"$stage/changelog"
pack "$stage/changelog" /usr/share/doc/isohead/changelog.gz

for script in postinst prerm postrm; do
    install -m 755 "packaging/$script" "$package/DEBIAN/$script"
done
install -m 644 packaging/conffiles "$package/DEBIAN/conffiles"

# dpkg-shlibdeps wants a source package's control file; it is run beside it.
printf 'Source: isohead\n\nPackage: isohead\nArchitecture: any\n' >"$stage/debian/control"
set --
for dir in "$sysroot"/usr/lib/*-linux-* "$sysroot"/lib/*-linux-*; do
    set -- "$@" "-l$dir"
done
depends=$(cd "$stage" && DEB_HOST_ARCH=$arch dpkg-shlibdeps --admindir="$sysroot/var/lib/dpkg" "$@" \
    -O -Sisohead isohead/usr/bin/isohead_board isohead/usr/lib/isohead/isohead_live 2>shlibdeps.log | sed -n 's/^shlibs:Depends=//p')
[ -n "$depends" ] || { cat "$stage/shlibdeps.log" >&2; exit 1; }

# As Debian counts: KiB of each file, rounded up, and one per folder.
size=$(find "$package" -path "$package/DEBIAN" -prune -o -type f -printf '%s\n' -o -printf '1\n' |
    awk '{ sum += int(($1 + 1023) / 1024) } END { print sum }')
sed -e "s/@VERSION@/$version/" -e "s/@ARCH@/$arch/" -e "s/@SIZE@/$size/" -e "s/@DEPENDS@/$depends/" \
    packaging/control.in >"$package/DEBIAN/control"
(cd "$package" && find . -path ./DEBIAN -prune -o -type f -printf '%P\n' | sort | xargs md5sum) \
    >"$package/DEBIAN/md5sums"

# dpkg-deb takes times later than SOURCE_DATE_EPOCH down to it and sorts by name.
find "$package" -exec touch -h -d "@$SOURCE_DATE_EPOCH" {} +
deb=build/isohead_${version}_$arch.deb
dpkg-deb --root-owner-group -Zxz --build "$package" "$deb" >"$stage/build.log"
/usr/bin/python3 tools/board/bill.py deb "$deb" build/apt/debs >"${deb%.deb}.cdx.json"
echo "$deb"
