#!/bin/sh
# Bring what a make target needs and this machine lacks.
#
#   tools/setup.sh sim|test|fuzz|coverage|ranges|mutation|accept|eval|bench|bits|cortexm|size|vectors|format|lint
#   tools/setup.sh board arm64|armhf|host
#   tools/setup.sh deb arm64|armhf|tools
#   tools/setup.sh test-deb
#   tools/setup.sh test-board
#   tools/setup.sh image|test-image [uefi|rpi]
#   tools/setup.sh flash
#   tools/setup.sh calibrate|view|test-view|test-report|site|export|people|python
#
# On Debian and its kin missing packages are installed when that is allowed (root, or sudo without a
# password); otherwise the exact command is printed and the exit status is 1. Nothing is installed
# when everything is there.
set -eu
cd "$(dirname "$0")/.."
mkdir -p build

packages=
lacks() { packages="$packages $1"; }
need_program() { command -v "$1" >/dev/null 2>&1 || lacks "$2"; }
need_header() {
    echo "#include <$1>" | ${CC:-cc} -E -x c - >/dev/null 2>&1 || lacks "$2"
}
need_python() {
    /usr/bin/python3 -c "import $1" >/dev/null 2>&1 || lacks "$2"
}

need_sim() {
    need_program cc gcc
    need_program cmake cmake
    need_header stdlib.h libc6-dev
    need_header cjson/cJSON.h libcjson-dev
    # PNG frames; and what is folded into the report page, and writes it. Elsewhere these lie in other places: host_sim is
    # built without the page, and CMake says how to name them.
    if command -v apt-get >/dev/null 2>&1; then
        need_header png.h libpng-dev
        need_header zlib.h zlib1g-dev
        need_header turbojpeg.h libturbojpeg0-dev
        [ -e /usr/share/javascript/three/three.min.js ] || lacks libjs-three
        [ -e /usr/share/javascript/chart.js/chart.min.js ] || lacks libjs-chart.js
    fi
}

# A browser for the report page and the site.
need_report() {
    need_program chromium chromium
    need_site
}

need_site() {
    need_python markdown_it python3-markdown-it
    need_program git git
}

# Compilers and the emulator for tests/checks/same_bits.sh and tests/golden/golden.sh in make test.
need_bits() {
    need_program gcc gcc
    need_program clang clang
    need_cross aarch64-linux-gnu arm64 aarch64
}

# need_cross TRIPLET DEBIAN_NAME QEMU: what builds and runs a static program of another processor.
need_cross() {
    need_program "qemu-$3" qemu-user
    need_program "$1-gcc" "gcc-$1"
    [ -e "/usr/$1/lib/libc.a" ] || lacks "libc6-dev-$2-cross"
}

# The processors that make bits has beyond make test.
need_bits_all() {
    need_cross arm-linux-gnueabihf armhf arm
    need_cross riscv64-linux-gnu riscv64 riscv64
    need_cross s390x-linux-gnu s390x s390x
    need_cross powerpc64-linux-gnu ppc64 ppc64
}

# need_board arm64|armhf|host
need_board() {
    need_program cmake cmake
    need_program make make
    case "${1:-}" in
    host)
        need_sim
        need_header libv4l2.h libv4l-dev
        need_header gpiod.h libgpiod-dev
        need_header microhttpd.h libmicrohttpd-dev
        ;;
    arm64)
        need_program aarch64-linux-gnu-gcc gcc-aarch64-linux-gnu
        [ -e /usr/aarch64-linux-gnu/lib/libc.so ] || lacks libc6-dev-arm64-cross
        ;;
    armhf)
        need_program arm-linux-gnueabihf-gcc gcc-arm-linux-gnueabihf
        [ -e /usr/arm-linux-gnueabihf/lib/libc.so ] || lacks libc6-dev-armhf-cross
        ;;
    *)
        echo "there is no board '${1:-}': name arm64, armhf or host" >&2
        exit 2
        ;;
    esac
}

# libgpiod, and pip for tools/board/gpiod2.sh, which fetches another version of it.
need_gpio() {
    need_header gpiod.h libgpiod-dev
    need_python pip python3-pip
}

need_calibrate() {
    need_sim
    need_program g++ g++
    need_header opencv4/opencv2/core/version.hpp libopencv-dev
    [ -e /usr/include/opencv4/opencv2/aruco/charuco.hpp ] || lacks libopencv-contrib-dev
    need_header cairo/cairo-pdf.h libcairo2-dev
    [ -e /usr/include/nlohmann/json.hpp ] || lacks nlohmann-json3-dev
}

need_view() {
    need_sim
    need_program g++ g++
    need_header opencv4/opencv2/core/version.hpp libopencv-dev
    need_header cairo/cairo-pdf.h libcairo2-dev
    need_header png.h libpng-dev
    [ -e /usr/include/nlohmann/json.hpp ] || lacks nlohmann-json3-dev
}

# mcap's own needs, and pip for tools/python_packages.sh, which fetches mcap.
need_export() {
    need_python lz4 python3-lz4
    need_python zstandard python3-zstandard
    need_python pip python3-pip
}

# need_deb arm64|armhf|tools
need_deb() {
    case "${1:-}" in
    arm64) need_program aarch64-linux-gnu-strip binutils-aarch64-linux-gnu ;;
    armhf) need_program arm-linux-gnueabihf-strip binutils-arm-linux-gnueabihf ;;
    tools) need_program strip binutils ;;
    *)
        echo "there is no package for '${1:-}': name arm64, armhf or tools" >&2
        exit 2
        ;;
    esac
    need_program dpkg-shlibdeps dpkg-dev
    need_python json python3
}

# clang's run-time libraries are a package of their own, with its version in the name.
# clang with its sanitizers' and libFuzzer's libraries.
need_clang_rt() {
    need_program clang clang
    if ! [ -e "$(clang -print-file-name="libclang_rt.fuzzer-$(uname -m).a" 2>/dev/null)" ]; then
        version=$(apt-cache depends clang 2>/dev/null | sed -n 's/.*Depends: clang-\([0-9]*\)$/\1/p')
        lacks "libclang-rt-${version:-14}-dev"
    fi
}

need_fuzz() {
    need_program cmake cmake
    need_program make make
    need_clang_rt
    need_program afl-fuzz afl++
    need_python json python3
}

need_test_board() {
    need_board arm64
    need_program qemu-system-aarch64 qemu-system-arm
    PATH=$PATH:/sbin:/usr/sbin need_program depmod kmod
    need_program bzip2 bzip2
    need_python json python3
    need_python pip python3-pip
}

need_test_deb() {
    need_test_board
    need_board armhf
    need_program cpio cpio
    need_deb arm64
    need_deb armhf
    need_program readelf binutils
    need_program lintian lintian
    need_program mandoc mandoc
    need_program man man-db
    need_program systemd-analyze systemd
    need_program mmdebstrap mmdebstrap
    need_program arch-test arch-test
    [ "$(uname -m)" = aarch64 ] || [ -e /usr/lib/binfmt.d/qemu-aarch64.conf ] ||
        lacks qemu-user-static
}

# need_image uefi|rpi
need_image() {
    case "${1:-}" in
    uefi) ;;
    rpi)
        need_program mkenvimage u-boot-tools
        need_python pip python3-pip # for tools/board/gpiod2.sh
        ;;
    *)
        echo "there is no image for '${1:-}': name uefi or rpi" >&2
        exit 2
        ;;
    esac
    need_board arm64
    need_program qemu-aarch64 qemu-user
    need_program mksquashfs squashfs-tools
    need_program mcopy mtools
    need_program cpio cpio
    need_program zstd zstd
    need_program xz xz-utils
    need_program git git
    need_program readelf binutils
    need_python json python3
    PATH=$PATH:/sbin:/usr/sbin need_program mkfs.vfat dosfstools
    PATH=$PATH:/sbin:/usr/sbin need_program sfdisk fdisk
    PATH=$PATH:/sbin:/usr/sbin need_program depmod kmod
}

need_flash() {
    need_program lsblk util-linux
    PATH=$PATH:/sbin:/usr/sbin need_program sfdisk fdisk
    need_program cmp diffutils
    [ -x /usr/bin/python3 ] || lacks python3-minimal
}

case "${1:-}" in
sim) need_sim ;;
board) need_board "${2:-}" ;;
deb) need_deb "${2:-}" ;;
test-deb) need_test_deb ;;
test-board) need_test_board ;;
image) need_image "${2:-}" ;;
flash) need_flash ;;
test-image)
    need_image "${2:-}"
    need_flash
    need_program qemu-system-aarch64 qemu-system-arm
    [ "${2:-}" != rpi ] || need_program fdtput device-tree-compiler
    [ -e /usr/share/AAVMF/AAVMF_CODE.fd ] || lacks qemu-efi-aarch64
    [ -e /usr/aarch64-linux-gnu/lib/libc.a ] || lacks libc6-dev-arm64-cross
    need_program bzip2 bzip2
    PATH=$PATH:/sbin:/usr/sbin need_program mkfs.ext4 e2fsprogs
    ;;
test-report)
    need_sim
    need_report
    ;;
site)
    need_sim
    need_site
    ;;
test)
    need_sim
    need_report
    need_bits
    need_clang_rt
    need_python numpy python3-numpy
    need_python scipy python3-scipy
    need_program nm binutils
    need_program c++ g++
    need_program pkg-config pkg-config
    need_program valgrind valgrind
    need_header libv4l2.h libv4l-dev
    need_header microhttpd.h libmicrohttpd-dev
    need_gpio
    need_export
    ;;
ranges)
    need_sim
    need_clang_rt
    need_header libv4l2.h libv4l-dev
    need_header microhttpd.h libmicrohttpd-dev
    need_gpio
    ;;
coverage | mutation)
    need_sim
    need_header microhttpd.h libmicrohttpd-dev
    need_program gcc gcc
    if [ "$1" = coverage ]; then
        need_python numpy python3-numpy
        need_header libv4l2.h libv4l-dev
        need_gpio
    fi
    ;;
fuzz) need_fuzz ;;
eval)
    need_sim
    need_python numpy python3-numpy
    need_python matplotlib python3-matplotlib
    need_program valgrind valgrind
    need_program gcc gcc
    need_program nm binutils
    ;;
bench)
    need_sim
    need_program gcc gcc
    need_program g++ g++
    need_program clang clang
    need_cross aarch64-linux-gnu arm64 aarch64
    need_program valgrind valgrind
    need_python numpy python3-numpy
    # the package with what CMake looks for, not only the modules that are used
    [ -e "/usr/lib/$(gcc -print-multiarch 2>/dev/null)/cmake/opencv4/OpenCVConfig.cmake" ] || lacks libopencv-dev
    [ -e /usr/include/eigen3/Eigen/Dense ] || lacks libeigen3-dev
    ;;
bits)
    need_sim
    need_bits
    need_bits_all
    ;;
cortexm | size)
    need_sim
    need_program gcc gcc
    need_program arm-none-eabi-gcc gcc-arm-none-eabi
    [ -e "$(arm-none-eabi-gcc -print-file-name=libc.a 2>/dev/null)" ] || lacks libnewlib-arm-none-eabi
    need_program qemu-system-arm qemu-system-arm
    need_python json python3
    ;;
calibrate)
    need_calibrate
    need_python numpy python3-numpy
    ;;
view) need_view ;;
test-view)
    need_view
    need_python numpy python3-numpy
    need_python cv2 python3-opencv
    need_program pdftotext poppler-utils
    ;;
export)
    need_sim
    need_export
    ;;
python)
    need_sim
    [ -e "/usr/include/$(/usr/bin/python3 -c 'import sys; print("python%d.%d" % sys.version_info[:2])')/Python.h" ] ||
        lacks python3-dev
    need_python ensurepip python3-venv
    need_python numpy python3-numpy
    need_python cv2 python3-opencv
    ;;
people)
    need_python numpy python3-numpy
    need_python pip python3-pip
    # its rays are cast by a package that is there for x86-64 alone
    [ "$(uname -m)" = x86_64 ] || { echo "make people needs an x86-64 machine" >&2; exit 1; }
    ;;
learn)
    need_python numpy python3-numpy
    need_python scipy python3-scipy
    ;;
accept | vectors)
    need_python numpy python3-numpy
    need_python scipy python3-scipy
    ;;
format) need_program clang-format clang-format ;;
lint)
    need_program clang clang
    need_program clang-tidy clang-tidy
    need_program cppcheck cppcheck
    need_program gcc gcc
    need_header libv4l2.h libv4l-dev
    need_header microhttpd.h libmicrohttpd-dev
    need_calibrate
    need_view
    ;;
*)
    sed -n '4,12s/^# \{0,1\}//p' "$0" >&2
    exit 2
    ;;
esac

if [ -n "$packages" ]; then
    as_root=
    if [ "$(id -u)" != 0 ]; then
        if command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; then
            as_root="sudo -n"
        else
            as_root=no
        fi
    fi
    if ! command -v apt-get >/dev/null 2>&1 || [ "$as_root" = no ]; then
        echo "make $1 needs these Debian packages, or their like:$packages" >&2
        echo "type:  sudo apt-get install --yes$packages" >&2
        exit 1
    fi
    echo "setup: installing$packages"
    # A new machine often installs its own updates meanwhile: that is waited for, ten minutes at most.
    tries=120
    until $as_root apt-get update -qq 2>build/setup.log; do
        tries=$((tries - 1))
        if ! grep -q 'Could not get lock' build/setup.log || [ "$tries" = 0 ]; then
            cat build/setup.log >&2
            exit 1
        fi
        sleep 5
    done
    # shellcheck disable=SC2086 # both are lists of words
    DEBIAN_FRONTEND=noninteractive $as_root apt-get -o DPkg::Lock::Timeout=600 install -qq --yes --no-install-recommends \
        $packages >build/setup.log 2>&1 || { tail -n 20 build/setup.log >&2; exit 1; }
fi

case "$1" in
test | coverage | ranges | mutation | bits | cortexm | fuzz | size) tools/fetch_third_party.sh build/third_party ;;
board) [ "$2" = host ] || tools/board/sysroot.sh "$2" ;;
esac
case "$1" in
size)
    # of the installed QEMU's own version, as Debian has one alone
    header=include/qemu/qemu-plugin.h
    if [ ! -e build/third_party/qemu/qemu-plugin.h ]; then
        rm -rf build/third_party/qemu
        tools/apt_source.sh qemu build/third_party/qemu "$header"
        mv build/third_party/qemu/qemu-*/"$header" build/third_party/qemu/
    fi
    ;;
test | coverage | test-board) tools/board/gpiod2.sh build/third_party/gpiod2 ;;
image | test-image) [ "$2" != rpi ] || tools/board/gpiod2.sh build/third_party/gpiod2 ;;
esac
case "$1" in
test | export) tools/python_packages.sh tools/export/requirements.txt build/export/python ;;
esac
case "$1" in
people) tools/python_packages.sh tools/people/requirements.txt build/people/python ;;
test)
    # for x86-64 and some Pythons alone: elsewhere its test is skipped
    tools/python_packages.sh tools/people/requirements.txt build/people/python >build/people.log 2>&1 ||
        echo "setup: without the packages of tools/people, see build/people.log" >&2
    ;;
esac
