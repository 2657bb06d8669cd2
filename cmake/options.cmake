# Compiler options shared by all targets.

# Everything of ours: warnings are errors, but where users build with compilers that we have not seen.
add_library(isohead_warnings INTERFACE)
target_compile_options(isohead_warnings INTERFACE
  -Wall -Wextra -Wconversion -Wshadow -Wdouble-promotion -Wvla -Wstrict-prototypes -Wmissing-prototypes)
if(NOT ISOHEAD_PYTHON AND NOT ISOHEAD_INSTALL)
  target_compile_options(isohead_warnings INTERFACE -Werror)
endif()

# The host's floating point must not depend on the compiler's taste for fused operations.
add_compile_options(-ffp-contract=off)

# No floating-point register may be touched at all, which forbids vectors too.
add_library(isohead_integer_only INTERFACE)
include(CheckCCompilerFlag)
check_c_compiler_flag(-mgeneral-regs-only ISOHEAD_HAS_GENERAL_REGS_ONLY)
if(ISOHEAD_HAS_GENERAL_REGS_ONLY)
  target_compile_options(isohead_integer_only INTERFACE -mgeneral-regs-only)
endif()

if(ISOHEAD_SANITIZE)
  add_compile_options(-fsanitize=address,undefined -fno-sanitize-recover=all
                      -fno-omit-frame-pointer -g)
  add_link_options(-fsanitize=address,undefined)
endif()

# Counts of processes that end in haste, too.
if(ISOHEAD_COVERAGE)
  add_library(coverage_ends OBJECT "${CMAKE_SOURCE_DIR}/tests/checks/coverage_ends.c")
  target_compile_options(coverage_ends PRIVATE -fno-profile-arcs -fno-test-coverage) # it runs while counts are written
  link_libraries("$<TARGET_OBJECTS:coverage_ends>")
  add_link_options(-Wl,--wrap=_exit,--wrap=raise,--wrap=execv,--wrap=syscall)
endif()

# The board's program runs for months on devices that are not ours: what the compiler can harden is
# hardened. No path of the machine that built it stays in it.
if(ISOHEAD_BOARD)
  set(CMAKE_POSITION_INDEPENDENT_CODE ON)
  include(CheckPIESupported)
  check_pie_supported(LANGUAGES C)
  add_compile_options(-fstack-protector-strong "-ffile-prefix-map=${CMAKE_SOURCE_DIR}=."
                      "$<$<CONFIG:Release>:-D_FORTIFY_SOURCE=2>")
  add_link_options(-Wl,-z,relro,-z,now)
endif()

# cJSON: the installed library, or one source file that was named.
add_library(isohead_cjson INTERFACE)
if(ISOHEAD_CJSON_DIR)
  add_library(cjson_source STATIC "${ISOHEAD_CJSON_DIR}/cJSON.c")
  # <cjson/cJSON.h> is how the installed library is included
  file(MAKE_DIRECTORY "${CMAKE_BINARY_DIR}/cjson_include/cjson")
  configure_file("${ISOHEAD_CJSON_DIR}/cJSON.h"
                 "${CMAKE_BINARY_DIR}/cjson_include/cjson/cJSON.h" COPYONLY)
  target_include_directories(isohead_cjson SYSTEM INTERFACE "${CMAKE_BINARY_DIR}/cjson_include")
  target_link_libraries(isohead_cjson INTERFACE cjson_source m)
else()
  find_library(ISOHEAD_CJSON_LIBRARY cjson REQUIRED)
  find_path(ISOHEAD_CJSON_INCLUDE cjson/cJSON.h REQUIRED)
  target_include_directories(isohead_cjson SYSTEM INTERFACE "${ISOHEAD_CJSON_INCLUDE}")
  target_link_libraries(isohead_cjson INTERFACE "${ISOHEAD_CJSON_LIBRARY}" m)
endif()
