#!/bin/sh
# The installed library, as a stranger's project has it: in an empty folder, by find_package and by pkg-config, from C and from
# C++, shared and static; with the program of docs/porting.md, whose heads are those of host_sim.
#
#     install.sh WORK_DIR RIGBLOB FRAMES_DIR
set -eu
[ $# = 3 ] || { echo "usage: $0 WORK_DIR RIGBLOB FRAMES_DIR" >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
rigblob=$(realpath "$2")
frames=$(realpath "$3")
mkdir -p "$1"
cd "$1"
work=$PWD
fail() {
    echo "install: $*" >&2
    exit 1
}
# quietly COMMAND...: its words only when it fails
quietly() {
    "$@" >"$work/log" 2>&1 || { cat "$work/log" >&2; fail "$*"; }
}

# Installed, then moved elsewhere: nothing may remember where.
rm -rf prefix moved use
libdir=lib/$(cc -print-multiarch)
quietly cmake -S "$root" -B build -DISOHEAD_INSTALL=ON -DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_FLAGS_DEBUG=-O1 \
    -DCMAKE_INSTALL_PREFIX="$work/prefix" -DCMAKE_INSTALL_LIBDIR="$libdir"
quietly cmake --build build --parallel 2 --target isohead_core isohead_shared host_sim
quietly cmake --install build
mv prefix moved
lib=$work/moved/$libdir
export LD_LIBRARY_PATH="$lib" PKG_CONFIG_PATH="$lib/pkgconfig"
version=$(sed -n 's/^project(isohead VERSION \([0-9.]*\) .*/\1/p' "$root/CMakeLists.txt")

# What can be linked with: no more than this.
nm -D --defined-only "$lib/libisohead.so" | awk '{ print $3 }' | sort | tr '\n' ' ' >exported
expected="ih_align_depth_sigma_mm_q8 ih_cloud_draw ih_err_text ih_exposure_look ih_exposure_next ih_exposure_params_default"
expected="$expected ih_exposure_start ih_params_default ih_params_paper ih_reject_text ih_rig_blob_decode ih_rig_blob_encode"
expected="$expected isohead_find isohead_frame isohead_init isohead_label "
[ "$(cat exported)" = "$expected" ] || fail "exports $(cat exported), expected $expected"
readelf -d "$lib/libisohead.so.$version" | grep -q "SONAME.*libisohead.so.${version%.*}\]" || fail "another name in the library"
! grep -rqF "$root" "$work/moved/include" "$lib/cmake" "$lib/pkgconfig" || fail "a path of the sources was installed"

# The program of the page, and its table.
mkdir use
cd use
awk '/^```c$/ { on = 1; next } /^```$/ { if (on) exit } on' "$root/docs/porting.md" >program.c
[ "$(wc -l <program.c)" -gt 20 ] || fail "no program in docs/porting.md"
"$rigblob" "$frames/rig.json" rig.blob
{
    echo 'unsigned char rig_blob[] = {'
    od -An -v -tu1 rig.blob | sed -e 's/\([0-9][0-9]*\)/\1,/g'
    printf '};\nunsigned int rig_blob_len = %d;\n' "$(wc -c <rig.blob)"
} >rig_blob.h
cp program.c program.cpp
for frame in "$frames"/*.pgm; do tail -c 437664 "$frame"; done >samples
# Without frames.jsonl frames are 40 ms apart, as those of the program.
mkdir plain
cp "$frames"/*.pgm "$frames/rig.json" plain
"$work/moved/bin/host_sim" --json plain >records.jsonl
/usr/bin/python3 - >heads <<'END'
import json
for line in open("records.jsonl", encoding="utf-8"):
    record = json.loads(line)
    head = None if record["head"] is None else record["hypotheses"][record["head"]]["centre_mm"]
    print("nobody" if head is None else "x %.1f y %.1f z %.1f mm" % tuple(head))
END
# finds PROGRAM: the heads of host_sim; a decimal that is a tie may be rounded the other way
finds() {
    "$1" <samples >found || fail "$1: status $?"
    /usr/bin/python3 - "$1" <<'END' || exit 1
import re
import sys
found, heads = open("found", encoding="utf-8").readlines(), open("heads", encoding="utf-8").readlines()
numbers = lambda line: [float(n) for n in re.findall(r"-?\d+\.\d", line)]
good = len(found) == len(heads) > 0 and all(
    re.sub(r"[-0-9.]+", "", a) == re.sub(r"[-0-9.]+", "", b) and
    all(abs(x - y) < 0.11 for x, y in zip(numbers(a), numbers(b))) for a, b in zip(found, heads))
sys.exit(0 if good else "install: %s finds other heads than host_sim" % sys.argv[1])
END
}

warnings="-Wall -Wextra -Wpedantic -Werror"
# shellcheck disable=SC2046,SC2086
cc -std=c11 $warnings program.c $(pkg-config --cflags --libs isohead) -o by_pkg_config_c
# shellcheck disable=SC2046,SC2086
c++ -std=c++17 $warnings program.cpp $(pkg-config --cflags --libs isohead) -o by_pkg_config_cxx
[ "$(pkg-config --modversion isohead)" = "$version" ] || fail "pkg-config names another version"

cat >CMakeLists.txt <<END
cmake_minimum_required(VERSION 3.22)
project(use LANGUAGES C CXX)
set(CMAKE_CXX_STANDARD 17)
foreach(other 0.0 9.0)
  find_package(isohead \${other} QUIET)
  if(isohead_FOUND)
    message(FATAL_ERROR "isohead $version is good enough for \${other}")
  endif()
endforeach()
find_package(isohead $version REQUIRED)
foreach(kind isohead static)
  add_executable(by_cmake_c_\${kind} program.c)
  add_executable(by_cmake_cxx_\${kind} program.cpp)
  # Another C++ program, which compares with C.
  add_executable(in_cxx_\${kind} $here/in_cxx.cpp $here/in_c.c)
  foreach(program by_cmake_c by_cmake_cxx in_cxx)
    target_link_libraries(\${program}_\${kind} PRIVATE isohead::\${kind})
  endforeach()
endforeach()
END
quietly cmake -S . -B build -DCMAKE_PREFIX_PATH="$work/moved"
quietly cmake --build build
# Either way of naming the header.
echo '#include <isohead/isohead.h>' >either.c
# shellcheck disable=SC2046,SC2086
cc $warnings -fsyntax-only $(pkg-config --cflags isohead) either.c

for program in ./by_pkg_config_c ./by_pkg_config_cxx build/by_cmake_c_isohead build/by_cmake_c_static build/by_cmake_cxx_isohead \
    build/by_cmake_cxx_static; do
    finds $program
done
readelf -d build/by_cmake_c_isohead | grep -q 'NEEDED.*libisohead' || fail "isohead::isohead is not the shared library"
! readelf -d build/by_cmake_c_static | grep -q 'NEEDED.*libisohead' || fail "isohead::static is not the static library"
# Of a rig whose bytes have changed the program says so.
sed -i '0,/ 73,/s// 74,/' rig_blob.h
# shellcheck disable=SC2046
cc program.c $(pkg-config --cflags --libs isohead) -o wrong
! ./wrong <samples 2>words || fail "a wrong blob is taken"
grep -q . words || fail "a wrong blob is refused without a word"
for kind in isohead static; do quietly "build/in_cxx_$kind"; done
echo "install: libisohead.so $(stat -c %s "$(realpath "$lib/libisohead.so")") bytes, $(wc -l <found) frames as host_sim in six programs"
