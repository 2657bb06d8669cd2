# What the builds for Cortex-M share, with arm-none-eabi-gcc. Included by the boards' files, which set
# ISOHEAD_CPU and ISOHEAD_LINKER_SCRIPT (in hal/cortexm).
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
# There is no operating system to link a test program for.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)

# The core has no floating point, and no program may need a unit for it.
# make size reads the call graph with its stacks, beside the objects, and the linker's map.
set(CMAKE_C_FLAGS_INIT
    "-mcpu=${ISOHEAD_CPU} -mthumb -mfloat-abi=soft -ffreestanding -ffunction-sections -fdata-sections -fcallgraph-info=su")
set(CMAKE_ASM_FLAGS_INIT "-mcpu=${ISOHEAD_CPU} -mthumb -mfloat-abi=soft")
set(CMAKE_EXE_LINKER_FLAGS_INIT
    "-nostdlib -Wl,--gc-sections,--fatal-warnings -L${CMAKE_CURRENT_LIST_DIR}/../hal/cortexm -T${ISOHEAD_LINKER_SCRIPT}")
