# 64-bit ARM Linux, with Debian's cross compiler.
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(ISOHEAD_TRIPLET aarch64-linux-gnu)
set(ISOHEAD_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../build/sysroot/arm64")
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
