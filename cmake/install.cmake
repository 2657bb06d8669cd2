# What `cmake --install` puts where: the core as a static and as a shared library with its headers, a CMake package and a
# pkg-config file, and host_sim.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(core_dir "${CMAKE_SOURCE_DIR}/firmware/core")
set(include_dir "${CMAKE_INSTALL_INCLUDEDIR}/isohead")

# The headers a program includes itself, and all that these include.
set(headers isohead.h points/ih_cloud.h rig/ih_rig_blob.h upkeep/ih_exposure.h)
set(waiting ${headers})
while(waiting)
  list(POP_FRONT waiting header)
  file(STRINGS "${core_dir}/${header}" lines REGEX "^#include \"")
  foreach(line IN LISTS lines)
    string(REGEX REPLACE "^#include \"(.*)\".*" "\\1" included "${line}")
    if(NOT included IN_LIST headers)
      list(APPEND headers "${included}")
      list(APPEND waiting "${included}")
    endif()
  endforeach()
endwhile()
foreach(header IN LISTS headers)
  get_filename_component(folder "${header}" DIRECTORY)
  install(FILES "${core_dir}/${header}" DESTINATION "${include_dir}/${folder}")
endforeach()

set_target_properties(isohead_core PROPERTIES OUTPUT_NAME isohead EXPORT_NAME static)
set_target_properties(isohead_shared PROPERTIES EXPORT_NAME isohead)
foreach(target isohead_core isohead_shared)
  target_include_directories(${target} INTERFACE
    "$<INSTALL_INTERFACE:${include_dir};${CMAKE_INSTALL_INCLUDEDIR}>")
endforeach()
install(TARGETS isohead_shared isohead_core EXPORT isohead)
install(TARGETS host_sim)

# find_package(isohead): the targets isohead::isohead (shared) and isohead::static; nothing else is needed.
set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/isohead")
install(EXPORT isohead FILE isoheadConfig.cmake NAMESPACE isohead:: DESTINATION "${package_dir}")
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/isoheadConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/isoheadConfigVersion.cmake" DESTINATION "${package_dir}")

# Relative to where the file lies, as an installation may be moved.
file(RELATIVE_PATH up "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
file(CONFIGURE OUTPUT isohead.pc @ONLY CONTENT [[
prefix=${pcfiledir}/@up@
libdir=${prefix}/@CMAKE_INSTALL_LIBDIR@
includedir=${prefix}/@CMAKE_INSTALL_INCLUDEDIR@

Name: isohead
Description: a person's head in 3-D from 361 laser dots or a depth image
Version: @PROJECT_VERSION@
Cflags: -I${includedir}/isohead -I${includedir}
Libs: -L${libdir} -lisohead
]])
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/isohead.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
