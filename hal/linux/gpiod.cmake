# libgpiod, of version 1 or 2: the target isohead_gpiod; and for what includes it ISOHEAD_GPIOD_VERSION
# and ISOHEAD_GPIOD_HEADERS, which come before any folder where the other version may be installed.
#
# Which one it is the header says that was found; ISOHEAD_GPIOD asks for one and refuses the other.
# Version 2 may also be built from sources (tools/board/gpiod2.sh): ISOHEAD_GPIOD2_DIR.
set(ISOHEAD_GPIOD "" CACHE STRING "Major version of libgpiod, 1 or 2; empty: the one that is there")
set(ISOHEAD_GPIOD2_DIR "" CACHE PATH
    "Folder with the sources of libgpiod 2; empty: the installed library (cross builds name one)")

if(ISOHEAD_GPIOD2_DIR)
  file(GLOB gpiod2_sources "${ISOHEAD_GPIOD2_DIR}/lib/*.c")
  if(NOT gpiod2_sources)
    message(FATAL_ERROR "ISOHEAD_GPIOD2_DIR (now '${ISOHEAD_GPIOD2_DIR}') must name a folder with "
                        "lib/*.c and include/gpiod.h; tools/board/gpiod2.sh brings one")
  endif()
  file(STRINGS "${ISOHEAD_GPIOD2_DIR}/libgpiod-version.txt" gpiod2_version)
  add_library(gpiod2_source STATIC EXCLUDE_FROM_ALL ${gpiod2_sources})
  target_compile_definitions(gpiod2_source PRIVATE _GNU_SOURCE "GPIOD_VERSION_STR=\"${gpiod2_version}\"")
  target_compile_options(gpiod2_source PRIVATE -w)
  target_include_directories(gpiod2_source SYSTEM PUBLIC "${ISOHEAD_GPIOD2_DIR}/include")
endif()

# The installed one, and what version it is: what 2 does not have any more tells.
find_path(ISOHEAD_GPIOD_INCLUDE gpiod.h)
find_library(ISOHEAD_GPIOD_LIBRARY gpiod)
set(ISOHEAD_GPIOD_INSTALLED "" CACHE INTERNAL "Major version of the installed libgpiod")
if(ISOHEAD_GPIOD_INCLUDE AND ISOHEAD_GPIOD_LIBRARY)
  file(STRINGS "${ISOHEAD_GPIOD_INCLUDE}/gpiod.h" gpiod_one REGEX "gpiod_line_request_output")
  if(gpiod_one)
    set(ISOHEAD_GPIOD_INSTALLED 1 CACHE INTERNAL "")
  else()
    set(ISOHEAD_GPIOD_INSTALLED 2 CACHE INTERNAL "")
  endif()
endif()

add_library(isohead_gpiod INTERFACE)
if(ISOHEAD_GPIOD2_DIR AND NOT ISOHEAD_GPIOD STREQUAL "1")
  set(ISOHEAD_GPIOD_VERSION 2)
  set(ISOHEAD_GPIOD_HEADERS "${ISOHEAD_GPIOD2_DIR}/include")
  target_link_libraries(isohead_gpiod INTERFACE gpiod2_source)
elseif(ISOHEAD_GPIOD_INSTALLED)
  set(ISOHEAD_GPIOD_VERSION ${ISOHEAD_GPIOD_INSTALLED})
  set(ISOHEAD_GPIOD_HEADERS "${ISOHEAD_GPIOD_INCLUDE}")
  target_link_libraries(isohead_gpiod INTERFACE "${ISOHEAD_GPIOD_LIBRARY}")
else()
  message(FATAL_ERROR "libgpiod is not there: install libgpiod-dev, or give ISOHEAD_GPIOD2_DIR "
                      "(tools/board/gpiod2.sh)")
endif()
if(ISOHEAD_GPIOD AND NOT ISOHEAD_GPIOD STREQUAL ISOHEAD_GPIOD_VERSION)
  message(FATAL_ERROR "ISOHEAD_GPIOD is ${ISOHEAD_GPIOD}, but version ${ISOHEAD_GPIOD_VERSION} of libgpiod is "
                      "there (${ISOHEAD_GPIOD_INCLUDE}${ISOHEAD_GPIOD2_DIR})")
endif()
