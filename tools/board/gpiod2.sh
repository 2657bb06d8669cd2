#!/bin/sh
# Bring the sources of libgpiod 2 into a folder: for boards whose distribution has version 1 only, and
# for the tests, which are run against both.
#
#   tools/board/gpiod2.sh DIR      ->  DIR/include/gpiod.h, DIR/lib/*.c, DIR/libgpiod-version.txt
#
# The Python package gpiod carries the C library whole in its source package, one file that pip
# fetches from the package index this machine is set up for. Version and SHA-256 are fixed here; pip
# refuses anything else before it looks into it. Give CMake ISOHEAD_GPIOD2_DIR=DIR.
set -eu
[ $# = 1 ] || { echo "usage: $0 DIR" >&2; exit 2; }
package=gpiod
version=2.3.0
sha256=daa840ed5b691e7078a9cf21c79fe813b9a91c3ed0bdbafae0181c7b98b80300

mkdir -p "$1"
dir=$(cd "$1" && pwd)
[ "$(cat "$dir/package" 2>/dev/null)" = "$package-$version" ] && exit 0
if [ -e "$dir/lib" ] && [ ! -e "$dir/package" ]; then
    echo "$dir has a lib/ that is not of this script: name another folder" >&2
    exit 1
fi

/usr/bin/python3 -m pip --version >/dev/null 2>&1 || {
    echo "no pip here: install python3-pip, or give ISOHEAD_GPIOD2_DIR=<folder with the sources of libgpiod 2>" >&2
    exit 1
}
new=$dir/new
rm -rf "$new"
mkdir "$new"
echo "$package==$version --hash=sha256:$sha256" >"$new/wanted"
# Without build isolation: pip would fetch the newest of what builds the Python part, which is not
# built here, only its name is needed.
/usr/bin/python3 -m pip download --quiet --disable-pip-version-check --no-deps --require-hashes \
    --no-build-isolation --no-binary "$package" --dest "$new" --requirement "$new/wanted" \
    >"$new/log" 2>&1 || { cat "$new/log" >&2; exit 1; }
tar -x -z -C "$new" -f "$new/$package-$version.tar.gz"
rm -rf "${dir:?}/include" "${dir:?}/lib"
mv "$new/$package-$version/include" "$new/$package-$version/lib" \
    "$new/$package-$version/libgpiod-version.txt" "$dir/"
rm -rf "$new"
# written last: it stands for the whole folder
echo "$package-$version" >"$dir/package"
