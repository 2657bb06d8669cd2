#!/bin/sh
# Bring Unity (the test framework) and cJSON's one source file (for cross builds) into a folder.
#
#   tools/fetch_third_party.sh DIR      ->  DIR/unity/src/unity.{c,h}..., DIR/cjson/cJSON.{c,h}
#
# Unity is no Debian binary package, but Debian's source package of cJSON carries it whole. It is
# fetched through apt, which checks its signature, with a package list of our own below DIR: neither
# root nor a change of the system's sources is needed. Where there is no apt, name copies instead:
# make test UNITY_DIR=... CJSON_DIR=...
set -eu
[ $# = 1 ] || { echo "usage: $0 DIR" >&2; exit 2; }
mkdir -p "$1"
dir=$(cd "$1" && pwd)
[ -e "$dir/unity/src/unity.c" ] && [ -e "$dir/cjson/cJSON.c" ] && exit 0

if ! command -v apt-get >/dev/null 2>&1; then
    echo "no apt-get here: give make UNITY_DIR=<folder with unity.c> and CJSON_DIR=<folder with cJSON.c>" >&2
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
[ -n "$(ls "$apt_dir/parts")" ] || {
    echo "no package archive of $id in /etc/apt: give make UNITY_DIR=... and CJSON_DIR=..." >&2
    exit 1
}
options="-o Dir::Etc::SourceList=/dev/null -o Dir::Etc::SourceParts=$apt_dir/parts
         -o Dir::State::Lists=$apt_dir/lists -o Dir::Cache=$apt_dir -o APT::Sandbox::User="
# shellcheck disable=SC2086 # a list of options
(cd "$apt_dir" && apt-get $options update -qq && apt-get $options source --download-only -qq cjson) \
    >"$apt_dir/log" 2>&1 || { cat "$apt_dir/log" >&2; exit 1; }
tar -x -C "$apt_dir" -f "$apt_dir"/cjson_*.orig.tar.*
mkdir -p "$dir/cjson"
rm -rf "$dir/unity"
cp -r "$apt_dir"/cJSON-*/tests/unity "$dir/unity"
cp "$apt_dir"/cJSON-*/cJSON.[ch] "$dir/cjson/"
rm -rf "$apt_dir"
