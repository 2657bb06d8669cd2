# What the cross builds share. Included by arm64.cmake and armhf.cmake, which set ISOHEAD_TRIPLET and
# ISOHEAD_SYSROOT: libraries and headers beside the C library's, from tools/board/sysroot.sh. Without
# them everything can be built that needs no library but a C file's own (ISOHEAD_CJSON_DIR).
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_C_COMPILER ${ISOHEAD_TRIPLET}-gcc)
set(CMAKE_LIBRARY_ARCHITECTURE ${ISOHEAD_TRIPLET})

# Never this machine's own libraries.
set(CMAKE_FIND_ROOT_PATH ${ISOHEAD_SYSROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)

# Where the libraries that a library needs are; in the program no trace of it stays.
set(CMAKE_EXE_LINKER_FLAGS_INIT "-Wl,-rpath-link,${ISOHEAD_SYSROOT}/usr/lib/${ISOHEAD_TRIPLET}")
set(CMAKE_SKIP_RPATH ON)
