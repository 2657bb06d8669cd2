# --report of host_sim: page.html with its style, its program and two libraries, folded into one C file.
# Where something is missing, and for another processor, whose libraries nobody asked for, host_sim is
# built without it and says so when it is asked for a report.

set(report_dir "${CMAKE_CURRENT_LIST_DIR}")
set(report_js /usr/share/javascript)
set(ISOHEAD_THREE_JS "${report_js}/three" CACHE PATH "Folder with three.min.js (Debian: libjs-three)")
set(ISOHEAD_CHART_JS "${report_js}/chart.js" CACHE PATH "Folder with chart.min.js, version 3 (Debian: libjs-chart.js)")

set(report_lacks "")
if(CMAKE_CROSSCOMPILING)
  set(report_lacks "it is built for another processor")
else()
  find_path(ISOHEAD_ZLIB_INCLUDE zlib.h)
  find_library(ISOHEAD_ZLIB_LIBRARY z)
  find_path(ISOHEAD_TURBOJPEG_INCLUDE turbojpeg.h)
  find_library(ISOHEAD_TURBOJPEG_LIBRARY turbojpeg)
  foreach(needed
      "${ISOHEAD_ZLIB_INCLUDE}/zlib.h:zlib1g-dev"
      "${ISOHEAD_TURBOJPEG_INCLUDE}/turbojpeg.h:libturbojpeg0-dev"
      "${ISOHEAD_THREE_JS}/three.min.js:libjs-three"
      "${ISOHEAD_THREE_JS}/examples/js/controls/OrbitControls.js:libjs-three"
      "${ISOHEAD_CHART_JS}/chart.min.js:libjs-chart.js")
    string(REPLACE ":" ";" needed "${needed}")
    list(GET needed 0 file)
    list(GET needed 1 package)
    if(NOT EXISTS "${file}")
      list(APPEND report_lacks "${package}")
    endif()
  endforeach()
  if(report_lacks)
    list(REMOVE_DUPLICATES report_lacks)
    list(JOIN report_lacks " " report_lacks)
    set(report_lacks "it was built without ${report_lacks}. Install that, then make sim")
  endif()
endif()

if(report_lacks)
  message(STATUS "host_sim is built without --report: ${report_lacks}")
  target_sources(host_sim PRIVATE sim_page_none.c)
  set_source_files_properties(sim_page_none.c PROPERTIES COMPILE_DEFINITIONS "SIM_PAGE_REASON=\"${report_lacks}\"")
else()
  set(report_parts "${CMAKE_CURRENT_BINARY_DIR}/sim_page_parts.c")
  set(report_orbit "${ISOHEAD_THREE_JS}/examples/js/controls/OrbitControls.js")
  set(report_pieces "${report_dir}/page.html" "${report_dir}/page.css" "${report_dir}/notices.txt"
    "${ISOHEAD_THREE_JS}/three.min.js" "${ISOHEAD_CHART_JS}/chart.min.js" "${report_dir}/data.js"
    "${report_dir}/picture.js" "${report_dir}/space.js" "${report_dir}/charts.js" "${report_dir}/tables.js"
    "${report_dir}/page.js" "${report_orbit}")
  add_custom_command(OUTPUT "${report_parts}"
    COMMAND "${CMAKE_COMMAND}" "-DOUT=${report_parts}" "-DTHREE=${ISOHEAD_THREE_JS}/three.min.js"
      "-DORBIT=${report_orbit}"
      "-DCHART=${ISOHEAD_CHART_JS}/chart.min.js" -P "${report_dir}/fold.cmake"
    DEPENDS ${report_pieces} "${report_dir}/fold.cmake" VERBATIM)
  target_sources(host_sim PRIVATE sim_image.c sim_page.c "${report_parts}")
  target_include_directories(host_sim PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}")
  target_include_directories(host_sim SYSTEM PRIVATE "${ISOHEAD_ZLIB_INCLUDE}" "${ISOHEAD_TURBOJPEG_INCLUDE}")
  target_link_libraries(host_sim PRIVATE "${ISOHEAD_ZLIB_LIBRARY}" "${ISOHEAD_TURBOJPEG_LIBRARY}")
endif()
