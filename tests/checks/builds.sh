# shellcheck shell=sh
# Builds that a check compares, below build/bits. To be sourced by a script that has set root, the top
# folder, and cjson, a folder with cJSON.c, which builds for other processors need.
#
# A build's NAME is a compiler of this machine (gcc, clang), another processor under Linux (arm64, armhf,
# riscv64, s390x, ppc64) or an emulated Cortex-M board (mps2-an386, mps2-an500, mps3-an547), each of
# these with a file in cmake/; then -O0, -O2 or -O3.

# shellcheck disable=SC2154 # root and cjson: see above
builds=$root/build/bits

# builds_configure NAME
builds_configure() {
    set -- "$1" -S "$root" -B "$builds/$1" -DCMAKE_BUILD_TYPE=Bits "-DCMAKE_C_FLAGS_BITS=-${1##*-}"
    target=${1%-*}
    case $target in
    gcc | clang) set -- "$@" "-DCMAKE_C_COMPILER=$target" ;;
    mps*) ;;
    *) set -- "$@" -DCMAKE_EXE_LINKER_FLAGS=-static ;;
    esac
    if [ -e "$root/cmake/$target.cmake" ]; then
        set -- "$@" "-DCMAKE_TOOLCHAIN_FILE=$root/cmake/$target.cmake" "-DISOHEAD_CJSON_DIR=$cjson"
    fi
    shift
    cmake "$@"
}

# builds_make NAME TARGET...
builds_make() {
    name=$1
    shift
    mkdir -p "$builds/$name"
    { builds_configure "$name" && cmake --build "$builds/$name" --parallel 2 --target "$@"; } \
        >"$builds/$name/log" 2>&1 || {
        tail -n 30 "$builds/$name/log" >&2
        echo "$builds/$name does not build" >&2
        exit 1
    }
}

# builds_run NAME PROGRAM ARGUMENT...: PROGRAM as below build/bits/NAME.
builds_run() {
    name=$1
    program=$builds/$1/$2
    shift 2
    case $name in
    gcc-* | clang-*) "$program" "$@" ;;
    arm64-*) qemu-aarch64 "$program" "$@" ;;
    armhf-*) qemu-arm "$program" "$@" ;;
    ppc64-*) qemu-ppc64 "$program" "$@" ;;
    riscv64-*) qemu-riscv64 "$program" "$@" ;;
    s390x-*) qemu-s390x "$program" "$@" ;;
    mps*)
        # a program that hangs is ended; on a busy machine the golden set takes many minutes
        timeout 3600 qemu-system-arm -M "${name%-*}" -nographic -monitor none -serial none \
            -semihosting-config "enable=on,target=native,arg=$(echo golden "$@" | sed 's/ /,arg=/g')" \
            -kernel "$program"
        ;;
    *)
        echo "builds_run: nothing runs '$name'" >&2
        return 2
        ;;
    esac
}
