# 32-bit ARM Linux with hardware floating point (ARMv7), with Debian's cross compiler.
set(CMAKE_SYSTEM_PROCESSOR armv7l)
set(ISOHEAD_TRIPLET arm-linux-gnueabihf)
set(ISOHEAD_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../build/sysroot/armhf")
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
