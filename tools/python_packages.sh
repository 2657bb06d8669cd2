#!/bin/sh
# Bring the Python packages of a list into a folder of their own, without touching the system's.
#
#   tools/python_packages.sh tools/export/requirements.txt DIR      ->  DIR/mcap, DIR/google and so on
#
# pip fetches them from the package index this machine is set up for. Versions and SHA-256 are fixed in
# the list; pip refuses anything else. A folder that was made from the same list stays as it is.
set -eu
[ $# = 2 ] || { echo "usage: $0 LIST DIR" >&2; exit 2; }
wanted=$1
dir=$2
cmp -s "$wanted" "$dir/requirements.txt" && exit 0
if [ -e "$dir" ] && [ ! -e "$dir/requirements.txt" ]; then
    echo "$dir is there and not of this script: name another folder" >&2
    exit 1
fi

/usr/bin/python3 -m pip --version >/dev/null 2>&1 || {
    echo "no pip here: install python3-pip" >&2
    exit 1
}
new=$dir.new
rm -rf "$new"
mkdir -p "$new"
/usr/bin/python3 -m pip install --quiet --disable-pip-version-check --no-input --no-deps --require-hashes \
    --only-binary :all: --no-compile --target "$new" --requirement "$wanted" \
    >"$new.log" 2>&1 || { cat "$new.log" >&2; exit 1; }
rm -f "$new.log"
# copied last: it stands for the whole folder
cp "$wanted" "$new/requirements.txt"
rm -rf "$dir"
mv "$new" "$dir"
