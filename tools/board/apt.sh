#!/bin/sh
# apt for packages of other architectures, without root and without a change of this machine.
#
#   tools/board/apt.sh unpack ROOT PACKAGE:ARCH...   download and unpack each below ROOT; no
#                                                    dependencies, no maintainer scripts
#   tools/board/apt.sh download DIR PACKAGE:ARCH...  only the .deb files
#   tools/board/apt.sh source DIR PACKAGE            its source package's files, not unpacked
#   tools/board/apt.sh newest REGEX                  the newest package name that REGEX matches wholly
#
# Uses the archives that this machine is set up for, with lists and cache of its own below
# build/apt; signatures are checked as always. Downloads are kept there.
set -eu
cd "$(dirname "$0")/../.."
apt_dir=$PWD/build/apt
usage() { sed -n '2,11s/^# \{0,1\}//p' "$0" >&2; exit 2; }
[ $# -ge 2 ] || usage
command -v apt-get >/dev/null 2>&1 || { echo "no apt-get here: this needs Debian or its kin" >&2; exit 1; }
mkdir -p "$apt_dir/lists/partial" "$apt_dir/archives/partial" "$apt_dir/parts"

# One at a time: the lists are shared.
exec 9>"$apt_dir/lock"
flock 9

id=$(. /etc/os-release && echo "$ID")
for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources; do
    if [ -e "$file" ] && grep -qi "$id" "$file"; then
        sed -e 's/^deb \(.*\)/deb \1\ndeb-src \1/' -e 's/^Types:.*/Types: deb deb-src/' "$file" \
            >"$apt_dir/parts/$(basename "$file")"
    fi
done
[ -n "$(ls "$apt_dir/parts")" ] || { echo "no package archive of $id in /etc/apt" >&2; exit 1; }
touch "$apt_dir/status"
cat >"$apt_dir/conf" <<END
Dir::Etc::SourceList "/dev/null";
Dir::Etc::SourceParts "$apt_dir/parts";
Dir::State "$apt_dir";
Dir::State::Lists "$apt_dir/lists";
Dir::State::Status "$apt_dir/status";
Dir::Cache "$apt_dir";
APT::Architectures { "amd64"; "arm64"; "armhf"; };
APT::Sandbox::User "";
Acquire::Languages "none";
Acquire::Retries "3";
Debug::NoLocking "1";
END
export APT_CONFIG="$apt_dir/conf"

# Lists older than a day are fetched anew; a mirror in the middle of a change gets a second chance.
update() {
    if [ -z "$(find "$apt_dir/updated" -mmin -1440 2>/dev/null)" ]; then
        for attempt in 1 2 3; do
            apt-get update -qq >"$apt_dir/log" 2>&1 && break
            [ "$attempt" = 3 ] || sleep 5
        done
        touch "$apt_dir/updated"
    fi
}

# download WHERE PACKAGE...: what is not in build/apt/debs yet; WHERE gets links to all of them
download() {
    where=$1
    shift
    mkdir -p "$apt_dir/debs" "$where"
    for package in "$@"; do
        if [ ! -e "$apt_dir/debs/$package.deb" ]; then
            rm -rf "$apt_dir/new"
            mkdir "$apt_dir/new"
            (cd "$apt_dir/new" && apt-get download -qq "$package") >"$apt_dir/log" 2>&1 ||
                { cat "$apt_dir/log" >&2; echo "cannot download $package" >&2; exit 1; }
            mv "$apt_dir"/new/*.deb "$apt_dir/debs/$package.deb"
        fi
        [ "$where" = "$apt_dir/debs" ] || cp -f "$apt_dir/debs/$package.deb" "$where/"
    done
}

verb=$1
shift
update
case "$verb" in
unpack)
    root=$1
    shift
    download "$apt_dir/debs" "$@"
    mkdir -p "$root"
    for package in "$@"; do
        dpkg-deb --extract "$apt_dir/debs/$package.deb" "$root"
    done
    ;;
download) download "$@" ;;
source)
    mkdir -p "$1"
    (cd "$1" && apt-get source --download-only -qq "$2") >"$apt_dir/log" 2>&1 ||
        { cat "$apt_dir/log" >&2; exit 1; }
    ;;
newest)
    name=$(apt-cache --names-only search "^$1\$" | cut -d ' ' -f 1 | sort -V | tail -n 1)
    [ -n "$name" ] || { echo "no package matches $1" >&2; exit 1; }
    echo "$name"
    ;;
*) usage ;;
esac
