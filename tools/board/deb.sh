#!/bin/sh
# The Debian packages: isohead, the program of a board, and isohead-tools, what a PC needs for it.
#
#   tools/board/deb.sh arm64|armhf     ->  build/isohead_VERSION_ARCH.deb; its name is printed
#                                          build/isohead_VERSION_ARCH.cdx.json, its bill of materials
#   tools/board/deb.sh tools           ->  build/isohead-tools_VERSION_ARCH.deb, for this machine's own architecture
#
# Of what `make board ARCH=...` or `make calibrate` built. Dependencies are computed from the programs' symbols and what
# the packages that they were linked with say of theirs. The same commit gives the same bytes.
set -eu
LC_ALL=C
export LC_ALL
umask 022
cd "$(dirname "$0")/../.."
root=$PWD
name=isohead
case "${1:-}" in
arm64) arch=$1 strip=aarch64-linux-gnu-strip ;;
armhf) arch=$1 strip=arm-linux-gnueabihf-strip ;;
tools) arch=$(dpkg --print-architecture) strip=strip name=isohead-tools ;;
*)
    sed -n '2,6s/^# \{0,1\}//p' "$0" >&2
    exit 2
    ;;
esac
version=$(sed -n 's/^project(isohead VERSION \([0-9.]*\) .*/\1/p' CMakeLists.txt)
[ -n "$version" ] || { echo "deb: no version in CMakeLists.txt" >&2; exit 1; }
# Times in the package: the last commit's, or what the caller names, as without git.
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
export SOURCE_DATE_EPOCH

stage=build/deb-$1
package=$stage/$name
rm -rf "$stage"
mkdir -p "$package/DEBIAN" "$stage/debian"

# put MODE FROM TO
put() { install -D -m "$1" "$2" "$package$3"; }
# pack FROM TO.gz: without a name and time in it
pack() {
    mkdir -p "$(dirname "$package$2")"
    gzip -9n <"$1" >"$package$2"
}
# program FROM TO MAKE_TARGET: stripped; adds to $programs
programs=
program() {
    [ -x "$1" ] || { echo "deb: no $1: run make $3" >&2; exit 1; }
    put 755 "$1" "$2"
    "$strip" --strip-unneeded --remove-section=.comment --remove-section=.note "$package$2"
    programs="$programs $name$2"
}
# pages NAME...: of docs. Who has only the package must be able to read what the settings refer to: a link to what is not
# in it becomes plain words, a picture goes.
pages() {
    here=$(echo "$*" | tr ' ' '|')
    for page in "$@"; do
        sed -E -e '/^!\[.*\]\([^)]*\)$/d' -e "s/\]\((($here)\.md[^)]*)\)/]\x01\1\x02/g" \
            -e 's/\[([^]]*)\]\([^)]*\)/\1/g' -e 's/\x01/(/g' -e 's/\x02/)/g' "docs/$page.md" >"$stage/$page.md"
        put 644 "$stage/$page.md" "/usr/share/doc/$name/$page.md"
    done
}
# manual NAME PROGRAM WHAT: a page that says what --help says
manual() {
    {
        printf '.Dd %s\n.Dt %s 1\n.Os\n.Sh NAME\n.Nm %s\n.Nd %s\n.Sh DESCRIPTION\n.Bd -literal\n' \
            "$(date -u -d "@$SOURCE_DATE_EPOCH" '+%B %-d, %Y')" "$(echo "$1" | tr '[:lower:]' '[:upper:]')" "$1" "$3"
        "$2" --help | sed -e 's/\\/\\e/g' -e 's/-/\\-/g' -e "s/^[.']/\\\\\&&/"
        printf '.Ed\n'
    } >"$stage/$1.1"
    pack "$stage/$1.1" "/usr/share/man/man1/$1.1.gz"
}

board_package() {
    program "build/board-$arch/firmware/app/isohead_board" /usr/bin/isohead_board "board ARCH=$arch"
    program "build/board-$arch/firmware/lib/isohead/isohead_live" /usr/lib/isohead/isohead_live "board ARCH=$arch"
    put 644 packaging/isohead.service /lib/systemd/system/isohead.service
    put 644 packaging/60-isohead.rules /lib/udev/rules.d/60-isohead.rules
    put 644 firmware/app/isohead.conf /etc/isohead/isohead.conf
    pack packaging/isohead_board.1 /usr/share/man/man1/isohead_board.1.gz
    pack packaging/isohead.conf.5 /usr/share/man/man5/isohead.conf.5.gz
    pages safety hardware contract live health
    for script in postinst prerm postrm; do
        install -m 755 "packaging/$script" "$package/DEBIAN/$script"
    done
    echo /etc/isohead/isohead.conf >"$package/DEBIAN/conffiles"
    chmod 644 "$package/DEBIAN/conffiles"
}

tools_package() {
    built=build/calibrate
    program $built/tools/calibrate/calibrate /usr/bin/isohead-calibrate calibrate
    program $built/tools/render/render /usr/bin/isohead-render calibrate
    program $built/tools/rigblob/rigblob /usr/bin/rigblob calibrate
    program $built/sim/host_sim /usr/bin/host_sim calibrate
    manual isohead-calibrate $built/tools/calibrate/calibrate "calibrate a camera and its laser by pictures of a printed board"
    manual isohead-render $built/tools/render/render "render frames of laser dots, and boards to try the calibration with"
    manual rigblob $built/tools/rigblob/rigblob "a calibrated rig as bytes for boards without JSON"
    manual host_sim $built/sim/host_sim "find heads in 3-D in directories of frames"
    pages calibration contract depth_camera safety health report
    # The page's commands as they are where the package is installed.
    sed -i -E -e '/^## What it needs$/,/^calibrate=/c\## What it needs\nThis package. The rendered pictures take 50 MB and all steps with them some minutes. For short:\n```\ncalibrate=isohead-calibrate' \
        -e 's,^render=.*,render=isohead-render,' -e 's,build/[a-z/]*/rigblob,rigblob,' -e 's,\./host_sim,host_sim,' \
        "$package/usr/share/doc/$name/calibration.md"
}

if [ "$name" = isohead ]; then
    board_package
else
    tools_package
fi

# The licence's text as an indented paragraph, empty lines as dots.
sed '1,/^$/d' LICENSE | sed '1,/^$/d' | sed -e 's/^$/./' -e 's/^/ /' | cat packaging/copyright - \
    >"$stage/copyright"
if [ "$name" = isohead-tools ]; then
    # What is folded into the page that host_sim writes; the licence is the same.
    {
        printf '\nFiles: usr/bin/host_sim\nCopyright:'
        sed -n 's/^ .*Copyright (c)//p' sim/report/notices.txt
        printf 'License: Expat\n'
    } >>"$stage/copyright"
fi
put 644 "$stage/copyright" "/usr/share/doc/$name/copyright"
maintainer=$(sed -n '/^Maintainer: /{s///p;q}' packaging/control.in)
{
    printf '%s (%s) stable; urgency=medium\n\n' "$name" "$version"
    printf '  * What is new stands in CHANGELOG.md of the sources.\n\n'
    printf ' -- %s  %s\n' "$maintainer" "$(date -u -R -d "@$SOURCE_DATE_EPOCH")"
} >"$stage/changelog"
pack "$stage/changelog" "/usr/share/doc/$name/changelog.gz"

# dpkg-shlibdeps wants a source package's control file; it is run beside it.
printf 'Source: isohead\n\nPackage: %s\nArchitecture: any\n' "$name" >"$stage/debian/control"
set --
if [ "$name" = isohead ]; then
    sysroot=$root/build/sysroot/$arch
    set -- "--admindir=$sysroot/var/lib/dpkg"
    for dir in "$sysroot"/usr/lib/*-linux-* "$sysroot"/lib/*-linux-*; do
        set -- "$@" "-l$dir"
    done
fi
# shellcheck disable=SC2086 # a list of words
depends=$(cd "$stage" && DEB_HOST_ARCH=$arch dpkg-shlibdeps "$@" -O "-S$name" $programs 2>shlibdeps.log |
    sed -n 's/^shlibs:Depends=//p')
[ -n "$depends" ] || { cat "$stage/shlibdeps.log" >&2; exit 1; }

# As Debian counts: KiB of each file, rounded up, and one per folder.
size=$(find "$package" -path "$package/DEBIAN" -prune -o -type f -printf '%s\n' -o -printf '1\n' |
    awk '{ sum += int(($1 + 1023) / 1024) } END { print sum }')
# A paragraph of control.in for each package.
awk -v RS= -v ORS='\n' -v "package=Package: $name" 'index($0 "\n", package "\n") == 1' packaging/control.in |
    sed -e "s/@VERSION@/$version/" -e "s/@ARCH@/$arch/" -e "s/@SIZE@/$size/" -e "s/@DEPENDS@/$depends/" \
    >"$package/DEBIAN/control"
(cd "$package" && find . -path ./DEBIAN -prune -o -type f -printf '%P\n' | sort | xargs md5sum) \
    >"$package/DEBIAN/md5sums"

# dpkg-deb takes times later than SOURCE_DATE_EPOCH down to it and sorts by name.
find "$package" -exec touch -h -d "@$SOURCE_DATE_EPOCH" {} +
deb=build/${name}_${version}_$arch.deb
dpkg-deb --root-owner-group -Zxz --build "$package" "$deb" >"$stage/build.log"
if [ "$name" = isohead ]; then
    /usr/bin/python3 tools/board/bill.py deb "$deb" build/apt/debs >"${deb%.deb}.cdx.json"
fi
echo "$deb"
