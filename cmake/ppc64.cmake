# 64-bit POWER, big-endian, under Linux, with Debian's cross compiler; for make bits alone.
set(CMAKE_SYSTEM_PROCESSOR ppc64)
set(ISOHEAD_TRIPLET powerpc64-linux-gnu)
set(ISOHEAD_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../build/sysroot/ppc64")
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
