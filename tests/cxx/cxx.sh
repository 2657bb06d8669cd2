#!/bin/sh
# isohead.h in a C++17 program: compiled without a warning, linked with the core, run, and compared with C.
# With g++ and clang++, whichever there are.
#
#     cxx.sh WORK_DIR
set -eu
[ $# = 1 ] || { echo "usage: $0 WORK_DIR" >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
core=$(cd "$here/../../firmware/core" && pwd)
mkdir -p "$1"
cd "$1"
warnings="-Wall -Wextra -Wpedantic -Werror"

# The core, by the C compiler: everything but the C++ program.
rm -f ./*.o
find "$core" -name '*.c' -exec cc -std=c11 -O0 -I"$core" -c {} +
# shellcheck disable=SC2086
cc -std=c11 -O0 $warnings -I"$core" -I"$here" -c "$here/in_c.c"

tried=0
for compiler in g++ clang++; do
    command -v "$compiler" >/dev/null 2>&1 || { echo "cxx: without $compiler, which is not there"; continue; }
    # shellcheck disable=SC2086
    "$compiler" -std=c++17 -O1 $warnings -I"$core" -I"$here" "$here/in_cxx.cpp" ./*.o -o "in_cxx_$compiler"
    "./in_cxx_$compiler"
    tried=$((tried + 1))
done
[ "$tried" -gt 0 ] || { echo "cxx: no C++ compiler: nothing was tested" >&2; exit 1; }
