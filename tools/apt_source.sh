#!/bin/sh
# Fetch one of the distribution's source packages through apt, which checks its signature, and unpack
# its upstream sources.
#
#   tools/apt_source.sh PACKAGE DIR [MEMBER]     ->  DIR/PACKAGE-VERSION/...
#
# MEMBER: a file of the sources, as in include/name.h; then only that one is unpacked. A package list of
# our own below DIR/apt is used: neither root nor a change of the system's sources is needed.
set -eu
[ $# = 2 ] || [ $# = 3 ] || { echo "usage: $0 PACKAGE DIR [MEMBER]" >&2; exit 2; }
package=$1
mkdir -p "$2"
dir=$(cd "$2" && pwd)
if ! command -v apt-get >/dev/null 2>&1; then
    echo "no apt-get here to fetch the sources of $package with" >&2
    exit 1
fi

apt_dir=$dir/apt
rm -rf "$apt_dir"
mkdir -p "$apt_dir/lists/partial" "$apt_dir/archives/partial" "$apt_dir/parts"
# The distribution's own archives as this machine names them, asked for their sources.
id=$(. /etc/os-release && echo "$ID")
for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources; do
    if [ -e "$file" ] && grep -qi "$id" "$file"; then
        sed -e 's/^deb /deb-src /' -e 's/^Types:.*/Types: deb-src/' "$file" \
            >"$apt_dir/parts/$(basename "$file")"
    fi
done
[ -n "$(ls "$apt_dir/parts")" ] || { echo "no package archive of $id in /etc/apt" >&2; exit 1; }
options="-o Dir::Etc::SourceList=/dev/null -o Dir::Etc::SourceParts=$apt_dir/parts
         -o Dir::State::Lists=$apt_dir/lists -o Dir::Cache=$apt_dir -o APT::Sandbox::User="
# shellcheck disable=SC2086 # a list of options
(cd "$apt_dir" && apt-get $options update -qq &&
    apt-get $options source --download-only -qq "$package") \
    >"$apt_dir/log" 2>&1 || { cat "$apt_dir/log" >&2; exit 1; }
if [ $# = 3 ]; then
    tar -x -C "$dir" --wildcards -f "$apt_dir/$package"_*.orig.tar.* "$package-*/$3"
else
    tar -x -C "$dir" -f "$apt_dir/$package"_*.orig.tar.*
fi
rm -rf "$apt_dir"
