# The core with every operation checked: docs/numerics.md, "Checked". Included after the core.
option(ISOHEAD_RANGE_CHECKS "Check ranges and every operation of the core; needs clang and Python" OFF)

# isohead_check_ranges(TARGET...): of the core's sources.
function(isohead_check_ranges)
  foreach(target IN LISTS ARGN)
    target_compile_definitions(${target} PRIVATE ISOHEAD_RANGE_CHECKS)
    target_compile_options(${target} PRIVATE
      -fsanitize=undefined,integer,implicit-conversion,local-bounds -fno-sanitize-recover=all -g)
    set_property(TARGET ${target} PROPERTY C_COMPILER_LAUNCHER
      /usr/bin/python3 "${CMAKE_SOURCE_DIR}/tests/checks/ranges_cc.py")
  endforeach()
endfunction()

if(ISOHEAD_RANGE_CHECKS)
  if(NOT CMAKE_C_COMPILER_ID STREQUAL "Clang")
    message(FATAL_ERROR "ISOHEAD_RANGE_CHECKS needs clang, this is ${CMAKE_C_COMPILER_ID}: "
                        "cmake --preset ranges")
  endif()
  add_library(isohead_ranges_failed STATIC tests/checks/ranges_failed.c)
  target_include_directories(isohead_ranges_failed PRIVATE firmware/core)
  target_compile_definitions(isohead_ranges_failed PRIVATE ISOHEAD_RANGE_CHECKS)
  isohead_check_ranges(isohead_core)
  target_link_libraries(isohead_core PUBLIC isohead_ranges_failed)
  target_link_options(isohead_core INTERFACE -fsanitize=undefined)

  add_executable(ranges_planted tests/checks/ranges_planted.c)
  target_link_libraries(ranges_planted PRIVATE isohead_core)
  isohead_check_ranges(ranges_planted)
endif()
