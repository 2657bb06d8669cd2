# IBM Z, which is big-endian, under Linux, with Debian's cross compiler; for make bits alone.
set(CMAKE_SYSTEM_PROCESSOR s390x)
set(ISOHEAD_TRIPLET s390x-linux-gnu)
set(ISOHEAD_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../build/sysroot/s390x")
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
