#!/bin/sh
# Bring Unity (the test framework) and cJSON's one source file (for cross builds) into a folder.
#
#   tools/fetch_third_party.sh DIR      ->  DIR/unity/src/unity.{c,h}..., DIR/cjson/cJSON.{c,h}
#
# Unity is no Debian binary package, but Debian's source package of cJSON carries it whole. Where there is
# no apt, name copies instead: make test UNITY_DIR=... CJSON_DIR=...
set -eu
[ $# = 1 ] || { echo "usage: $0 DIR" >&2; exit 2; }
mkdir -p "$1"
dir=$(cd "$1" && pwd)
[ -e "$dir/unity/src/unity.c" ] && [ -e "$dir/cjson/cJSON.c" ] && exit 0

"$(dirname "$0")/apt_source.sh" cjson "$dir/sources" || {
    echo "give make UNITY_DIR=<folder with unity.c> and CJSON_DIR=<folder with cJSON.c>" >&2
    exit 1
}
mkdir -p "$dir/cjson"
rm -rf "$dir/unity"
cp -r "$dir"/sources/cJSON-*/tests/unity "$dir/unity"
cp "$dir"/sources/cJSON-*/cJSON.[ch] "$dir/cjson/"
rm -rf "$dir/sources"
