#!/bin/sh
# The Debian packages: what is in them, and one of them installed, run, started by systemd, updated,
# removed and purged in a Debian arm64 root.
#
#     tests/board/deb.sh RIG_JSON
#
# Needs the programs of `make board` for arm64 and armhf and of `make calibrate`, the kernel of get.sh, and root. The arm64 root
# is a small Debian of the archives that this machine is set up for; on a processor other than ARM its
# programs run by qemu-user through binfmt_misc, which is set up here if it is not. A root of the last
# day is used again: build/deb-root.tar. Exit status 1 when something is wrong.
set -eu
LC_ALL=C
export LC_ALL
[ $# = 1 ] || { echo "usage: $0 RIG_JSON" >&2; exit 2; }
[ -e "$1" ] || { echo "deb: no $1" >&2; exit 2; }
rig=$(realpath "$1")
cd "$(dirname "$0")/../.."
fail() {
    echo "deb: FAILED: $*" >&2
    exit 1
}
if [ "$(id -u)" != 0 ]; then
    sudo -n true 2>/dev/null || fail "this needs root, for chroot and mount: sudo $0 $rig"
    exec sudo -n "$0" "$rig"
fi
began=$(date +%s)
step() { printf 'deb: %3d s  %s\n' $(($(date +%s) - began)) "$*"; }

work=$(mktemp -d)
program=
end() {
    [ -z "$program" ] || kill -9 "$program" 2>/dev/null || true
    rm -rf --one-file-system "$work"
}
trap end EXIT
trap 'exit 1' HUP INT TERM

# --- the packages --------------------------------------------------------------------------------

# build_twice ARCH: the same bytes both times; sets deb
build_twice() {
    deb=$(tools/board/deb.sh "$1")
    cp "$deb" "$work/first.deb"
    tools/board/deb.sh "$1" >/dev/null
    cmp "$work/first.deb" "$deb" || fail "$deb is not the same when built again"
}

# check_program ARCH FILE: hardened, stripped, no path of this machine, needs what Depends names
check_program() {
    readelf --wide --file-header --program-headers --dynamic "$2" >"$work/elf"
    readelf --wide --dyn-syms "$2" >"$work/symbols"
    grep -q 'Type: *DYN' "$work/elf" || fail "$1: not position-independent"
    grep -q 'GNU_RELRO' "$work/elf" || fail "$1: no RELRO"
    grep -q 'NOW' "$work/elf" || fail "$1: symbols bound lazily"
    grep -q 'GNU_STACK.* RW ' "$work/elf" || fail "$1: executable stack"
    grep -q '__stack_chk_fail' "$work/symbols" || fail "$1: no stack protector"
    grep -q '_chk@' "$work/symbols" || fail "$1: nothing fortified"
    ! grep -qE 'RPATH|RUNPATH' "$work/elf" || fail "$1: has a run path"
    ! readelf --wide --sections "$2" | grep -qE '\.symtab|\.debug' || fail "$1: not stripped"
    ! grep -qF "$PWD" "$2" || fail "$1: knows where it was built: $PWD"
}

# check_package ARCH
check_package() {
    build_twice "$1"
    rm -rf "$work/tree"
    dpkg-deb --raw-extract "$deb" "$work/tree"
    check_program "$1" "$work/tree/usr/bin/isohead_board"
    check_program "$1" "$work/tree/usr/lib/isohead/isohead_live"
    check_pages
    # Whoever holds the laser loads nothing of the network.
    ! readelf --dynamic "$work/tree/usr/bin/isohead_board" | grep -q microhttpd || fail "$1: loads libmicrohttpd"
    for library in libc6 libv4l-0 libgpiod libcjson libmicrohttpd; do
        dpkg-deb --field "$deb" Depends | grep -q "$library" || fail "$deb does not depend on $library"
    done
    # Nothing is overridden: warnings fail too.
    lintian --allow-root --fail-on error,warning "$deb" || fail "lintian of $deb"
    if dpkg-deb --contents "$deb" | grep -v ' root/root '; then
        fail "$deb: not root's"
    fi
    step "$deb: $(stat -c %s "$deb") bytes, the program $(stat -c %s "$work/tree/usr/bin/isohead_board")"
}

# check_pages: the documents in the tree lead to each other and nowhere else
check_pages() {
    for page in "$work"/tree/usr/share/doc/*/*.md; do
        # shellcheck disable=SC2013 # links have no spaces
        for link in $(grep -oE '\]\([^)]*\)' "$page" | sed -e 's/^](//' -e 's/[)#].*//'); do
            [ -e "$(dirname "$page")/$link" ] || fail "$page: $link is not in the package"
        done
    done
}

# isohead-tools, for this machine: unpacked, not installed
check_tools() {
    build_twice tools
    rm -rf "$work/tree"
    dpkg-deb --raw-extract "$deb" "$work/tree"
    for library in libopencv-calib3d libcairo2 libcjson1; do
        dpkg-deb --field "$deb" Depends | grep -q "$library" || fail "$deb does not depend on $library"
    done
    lintian --allow-root --fail-on error,warning "$deb" || fail "lintian of $deb"
    check_pages
    ! grep -n 'build/\|\./host_sim' "$work/tree/usr/share/doc/isohead-tools/calibration.md" ||
        fail "$deb: the page of the calibration names programs of the sources"
    grep -q 'three.js authors' "$work/tree/usr/share/doc/isohead-tools/copyright" || fail "$deb: no word of three.js"
    for program in isohead-calibrate isohead-render rigblob host_sim; do
        page=$work/tree/usr/share/man/man1/$program.1
        gunzip "$page.gz"
        mandoc -Tlint -Wwarning "$page" >"$work/lint" || fail "$program.1: $(cat "$work/lint")"
        "$work/tree/usr/bin/$program" --help >"$work/help"
        ! grep -qF "$PWD" "$work/tree/usr/bin/$program" || fail "$program knows where it was built: $PWD"
        # every line of --help, as it stands there
        mandoc -Tascii "$page" | col -bx | sed 's/^     //' | grep -vxFf - "$work/help" && fail "$program.1 lacks lines of --help"
    done
    # The page's own example, as far as seconds go.
    (cd "$work" && PATH=$work/tree/usr/bin:$PATH && isohead-calibrate board board.pgm &&
        isohead-render --frames 3 person && rigblob person/rig.json rig.bin && host_sim person) >"$work/words" 2>&1 ||
        fail "the tools: $(cat "$work/words")"
    step "$deb: $(stat -c %s "$deb") bytes"
}

check_unit() {
    unit=packaging/isohead.service
    # The program is not installed on this machine.
    sed 's,/usr/bin/isohead_board,/bin/true,' $unit >"$work/isohead.service"
    systemd-analyze verify --man=no "$work/isohead.service" >"$work/verify" 2>&1 ||
        fail "systemd-analyze verify: $(cat "$work/verify")"
    [ ! -s "$work/verify" ] || fail "systemd-analyze verify: $(cat "$work/verify")"
    [ "$(grep -c '^Exec.*isohead_board --config /run/isohead/isohead.conf' $unit)" = 2 ] ||
        fail "the program and the command after its end go by different settings"
    for name in Conflicts Before; do
        grep -qx "$name=sleep.target" $unit || fail "the unit has no $name=sleep.target: the laser would stay on in a suspend"
    done
    # 0 is a locked box, 10 no sandbox at all; the threshold is in tenths.
    systemd-analyze security --offline=true --threshold=20 $unit >"$work/security" ||
        fail "the unit's sandbox has holes: $(cat "$work/security")"
    step "the unit verified, exposure $(sed -n 's/.*service: \([0-9.]*\).*/\1/p' "$work/security")"
}

# --- a Debian arm64 root -------------------------------------------------------------------------

# Programs of arm64 are to run here as if they were this machine's own.
need_binfmt() {
    arch-test arm64 >/dev/null 2>&1 && return
    binfmt=/proc/sys/fs/binfmt_misc
    [ -e $binfmt/register ] || mount -t binfmt_misc binfmt_misc $binfmt ||
        fail "no binfmt_misc; as root, outside of a container, type:
    modprobe binfmt_misc; mount -t binfmt_misc binfmt_misc $binfmt"
    [ -e $binfmt/qemu-aarch64 ] || cat /usr/lib/binfmt.d/qemu-aarch64.conf >$binfmt/register ||
        fail "qemu-aarch64 cannot be registered; as root, outside of a container, type:
    cat /usr/lib/binfmt.d/qemu-aarch64.conf >$binfmt/register"
    arch-test arm64 >/dev/null 2>&1 || fail "arm64 programs do not run, in spite of $binfmt/qemu-aarch64"
}

# build/deb-root.tar: apt, what is essential, the archives' lists, and what unit.sh wants
make_root() {
    [ -z "$(find build/deb-root.tar -mmin -1440 2>/dev/null)" ] || return 0
    # shellcheck source=/dev/null
    . /etc/os-release
    mkdir "$work/sources"
    for file in build/apt/parts/*; do
        sed -e '/^deb-src/d' -e 's/^Types:.*/Types: deb/' "$file" >"$work/sources/$(basename "$file")"
    done
    mmdebstrap --quiet --architectures=arm64 --variant=apt --skip=cleanup/apt \
        --include=systemd-sysv,udev,kmod \
        --dpkgopt=force-unsafe-io --dpkgopt='path-exclude=/usr/share/doc/*' \
        --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/locale/*' \
        --aptopt='Acquire::Languages "none"' --aptopt='APT::Install-Recommends "false"' \
        "$VERSION_CODENAME" build/deb-root.new.tar "$work"/sources/* >"$work/mmdebstrap" 2>&1 ||
        fail "no arm64 root: $(cat "$work/mmdebstrap")"
    mv build/deb-root.new.tar build/deb-root.tar
}

inside() { chroot "$work/root" "$@"; }
# quietly COMMAND...: inside; its words only when it fails
quietly() {
    DEBIAN_FRONTEND=noninteractive inside "$@" >"$work/words" 2>&1 </dev/null ||
        fail "$*: $(cat "$work/words")"
}
# as_user STATUS COMMAND...: inside, as the unit's user; what it says is in $work/words
as_user() {
    expected=$1
    shift
    status=0
    inside setpriv --reuid=isohead --regid=isohead --init-groups timeout 300 "$@" \
        >"$work/words" 2>&1 </dev/null || status=$?
    [ $status = "$expected" ] || fail "$*: status $status, expected $expected: $(cat "$work/words")"
}
says() { grep -qE "$1" "$work/words" || fail "expected '$1', but it says: $(cat "$work/words")"; }

# All files but dpkg's, apt's and the accounts' own, with owner and mode
snapshot() {
    (cd "$work/root" && find . -xdev \( -path ./var/lib/dpkg -o -path ./var/lib/apt -o \
        -path ./var/cache -o -path ./var/log -o -path ./proc -o -path ./run \) -prune -o \
        ! -name 'passwd*' ! -name 'group*' ! -name 'shadow*' ! -name 'gshadow*' ! -name '.pwd.lock' \
        ! -path ./etc ! -path ./root ! -path ./etc/ld.so.cache -printf '%p %y %u %g %m\n' | sort)
}

check_install() {
    cp "$(tools/board/deb.sh arm64)" "$work/root/root/isohead.deb"
    chmod 755 "$work/root/root"
    ! inside dpkg-query --status libv4l-0 >/dev/null 2>&1 || fail "the root has libv4l-0 already"
    snapshot >"$work/before"
    quietly apt-get install --yes /root/isohead.deb
    for package in isohead libv4l-0 libgpiod2 libcjson1 libmicrohttpd12 adduser; do
        inside dpkg-query --status $package | grep -qx 'Status: install ok installed' ||
            fail "$package is not installed"
    done
    # The root leaves manual pages and the like out.
    ! inside dpkg --verify isohead | grep -v /usr/share/ || fail "files changed by installing"
    groups=$(inside id -nG isohead | tr ' ' '\n' | sort | tr '\n' ' ')
    [ "$groups" = "dialout gpio isohead video " ] || fail "groups of the user: $groups"
    [ -z "$(find "$work/root/etc/systemd" -name 'isohead*')" ] || fail "the unit is enabled"
    ! grep -qE '^ *laser *= *on' "$work/root/etc/isohead/isohead.conf" || fail "the laser is on by default"
    step "installed, dependencies by apt"
}

check_run() {
    as_user 0 isohead_board --version
    says "^isohead_board $(inside dpkg-query --status isohead | sed -n 's/^Version: //p')\$"
    as_user 0 isohead_board --help
    says '^ *--laser-off'
    # The file's third line is wrong.
    printf '# a comment\nrig = rig.json\nstrobe = sometimes\n' >"$work/root/etc/isohead/wrong.conf"
    as_user 2 isohead_board --config /etc/isohead/wrong.conf
    says 'wrong\.conf:3'
    rm "$work/root/etc/isohead/wrong.conf"
    # As the unit calls it after every end, with the configuration as installed: there is no laser.
    as_user 0 isohead_board --config /etc/isohead/isohead.conf --laser-off
    as_user 2 isohead_board --laser-off
    cp "$rig" "$work/root/etc/isohead/rig.json"
    # A GPIO chip that is not there.
    as_user 1 isohead_board --rig /etc/isohead/rig.json --laser --gpio-chip /dev/gpiochip0 --laser-line 3
    says 'gpiochip0'
    step "run: version, help, a wrong configuration, no GPIO chip"
}

# A camera that is not there is waited for; SIGTERM ends that.
check_stop() {
    # Not by a function, whose subshell would be what the signal hits.
    chroot "$work/root" setpriv --reuid=isohead --regid=isohead --init-groups isohead_board \
        --config /etc/isohead/isohead.conf --rig /etc/isohead/rig.json >"$work/words" 2>&1 </dev/null &
    program=$!
    tries=0
    until grep -q /dev/video0 "$work/words"; do
        kill -0 $program || fail "ended without a camera: $(cat "$work/words")"
        tries=$((tries + 1))
        [ $tries -le 3000 ] || fail "says nothing of the camera in 300 s: $(cat "$work/words")"
        sleep 0.1
    done
    kill -TERM $program
    status=0
    wait $program || status=$?
    program=
    [ $status = 0 ] || fail "SIGTERM while it waits: status $status: $(cat "$work/words")"
    step "waits for a camera; SIGTERM ends it with status 0"
}

# A newer package with another default configuration: what was edited stays, what was not is replaced.
check_update() {
    conf=$work/root/etc/isohead/isohead.conf
    rm -rf "$work/tree"
    dpkg-deb --raw-extract "$work/root/root/isohead.deb" "$work/tree"
    sed -i 's/^Version: .*/&+next/' "$work/tree/DEBIAN/control"
    echo '# a new default' >>"$work/tree/etc/isohead/isohead.conf"
    dpkg-deb --root-owner-group --build "$work/tree" "$work/root/root/next.deb" >/dev/null
    quietly dpkg --install /root/next.deb
    grep -q 'a new default' "$conf" || fail "an unedited configuration was not updated"
    echo '# edited' >>"$conf"
    quietly dpkg --install --force-confold /root/isohead.deb
    grep -q '^# edited' "$conf" || fail "an edited configuration was overwritten"
    rm "$work/root/root/next.deb"
    step "updated, edited configuration kept"
}

check_remove() {
    quietly apt-get remove --yes isohead
    [ ! -e "$work/root/usr/bin/isohead_board" ] || fail "the program is there after remove"
    grep -q '^# edited' "$work/root/etc/isohead/isohead.conf" || fail "remove took the configuration"
    # As somebody who had enabled the unit leaves it.
    wants=$work/root/etc/systemd/system/multi-user.target.wants
    mkdir -p "$wants"
    ln -s /lib/systemd/system/isohead.service "$wants/"
    quietly apt-get purge --yes isohead
    ! inside dpkg-query --status isohead >/dev/null 2>&1 || fail "known to dpkg after purge"
    rmdir -p --ignore-fail-on-non-empty "$wants"
    quietly apt-get autoremove --yes --purge
    snapshot >"$work/after"
    diff "$work/before" "$work/after" || fail "purge and autoremove left or took files"
    [ -z "$(find "$work/root" -xdev -nouser -o -user "$(inside id -u isohead)")" ] ||
        fail "the user owns files after purge"
    step "removed, purged, no file left"
}

for arch in armhf arm64; do
    check_package $arch
done
check_tools
check_unit
need_binfmt
make_root
mkdir "$work/root"
tar -x -C "$work/root" -f build/deb-root.tar
step "a Debian arm64 root"
check_install
tests/checks/manual.sh chroot "$work/root" isohead_board
check_run
check_stop
tests/board/unit.sh "$work/root" "$rig"
step "the unit under systemd"
check_update
check_remove
step "all good"
