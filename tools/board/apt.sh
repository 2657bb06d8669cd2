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
# build/apt; signatures are checked as always. Downloads are kept there. With SUITE=NAME in the
# environment it is that suite of the same archive instead, its firmware and its backports.
set -eu
cd "$(dirname "$0")/../.."
debs=$PWD/build/apt/debs
apt_dir=$PWD/build/apt${SUITE:+-$SUITE}
usage() { sed -n '2,12s/^# \{0,1\}//p' "$0" >&2; exit 2; }
[ $# -ge 2 ] || usage
command -v apt-get >/dev/null 2>&1 || { echo "no apt-get here: this needs Debian or its kin" >&2; exit 1; }
mkdir -p "$apt_dir/lists/partial" "$apt_dir/archives/partial" "$apt_dir/parts"

# One at a time: the lists are shared.
exec 9>"$apt_dir/lock"
flock 9

id=$(. /etc/os-release && echo "$ID")
# suite: the sources of $SUITE, from where this machine gets its own
suite() {
    codename=$(. /etc/os-release && echo "$VERSION_CODENAME")
    # shellcheck disable=SC2016 # apt-get's own variables
    uri=$(apt-get indextargets --format '$(REPO_URI) $(RELEASE)' 'Created-By: Packages' |
        awk -v release="$codename" '$2 == release { print $1; exit }')
    [ -n "$uri" ] || { echo "no package archive of $codename in /etc/apt" >&2; exit 1; }
    cat <<END
Types: deb
URIs: $uri
Suites: $SUITE $SUITE-backports
Components: main non-free-firmware
Architectures: arm64
Targets: Packages
Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg
END
}

[ -z "${SUITE:-}" ] || suite >"$apt_dir/parts/suite.sources"
for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources; do
    if [ -z "${SUITE:-}" ] && [ -e "$file" ] && grep -qi "$id" "$file"; then
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
    mkdir -p "$debs" "$where"
    for package in "$@"; do
        if [ ! -e "$debs/$package.deb" ]; then
            rm -rf "$apt_dir/new"
            mkdir "$apt_dir/new"
            (cd "$apt_dir/new" && apt-get download -qq "$package") >"$apt_dir/log" 2>&1 ||
                { cat "$apt_dir/log" >&2; echo "cannot download $package" >&2; exit 1; }
            mv "$apt_dir"/new/*.deb "$debs/$package.deb"
        fi
        [ "$where" = "$debs" ] || cp -f "$debs/$package.deb" "$where/"
    done
}

verb=$1
shift
update
case "$verb" in
unpack)
    root=$1
    shift
    download "$debs" "$@"
    mkdir -p "$root"
    for package in "$@"; do
        dpkg-deb --extract "$debs/$package.deb" "$root"
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
