# 64-bit RISC-V under Linux, with Debian's cross compiler; for make bits alone.
set(CMAKE_SYSTEM_PROCESSOR riscv64)
set(ISOHEAD_TRIPLET riscv64-linux-gnu)
set(ISOHEAD_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../build/sysroot/riscv64")
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
