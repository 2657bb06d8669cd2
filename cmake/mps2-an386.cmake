# Cortex-M4 on Arm's MPS2 with AN386, which qemu-system-arm emulates.
set(ISOHEAD_CPU cortex-m4)
set(ISOHEAD_LINKER_SCRIPT mps2.ld)
include("${CMAKE_CURRENT_LIST_DIR}/cortexm.cmake")
