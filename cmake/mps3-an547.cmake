# Cortex-M55 on Arm's MPS3 with AN547, which qemu-system-arm emulates.
set(ISOHEAD_CPU cortex-m55)
set(ISOHEAD_LINKER_SCRIPT mps3-an547.ld)
include("${CMAKE_CURRENT_LIST_DIR}/cortexm.cmake")
