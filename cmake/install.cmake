# Installs header, libraries, the CMake package gltf_meshlet and gltf_meshlet.pc. All libraries, or
# those that BUILD_SHARED_LIBS names, as package managers want it.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Functions are only added (GLTF_MESHLET_ABI counts): programs run with any later library.
set_target_properties(gltf_meshlet PROPERTIES VERSION 1.${PROJECT_VERSION} SOVERSION 1)
set(libraries gltf_meshlet gltf_meshlet_static gltf_meshlet_decoder)
set(static_flags "")
if(DEFINED BUILD_SHARED_LIBS)
  set_target_properties(${libraries} PROPERTIES EXCLUDE_FROM_ALL ON)
  if(BUILD_SHARED_LIBS)
    set(libraries gltf_meshlet)
  else()
    set(libraries gltf_meshlet_static gltf_meshlet_decoder)
    set(static_flags " -DGLTF_MESHLET_STATIC")
  endif()
endif()
set_target_properties(${libraries} PROPERTIES EXCLUDE_FROM_ALL OFF)
install(TARGETS ${libraries} EXPORT gltf_meshlet)
install(FILES codec/c/gltf_meshlet.h TYPE INCLUDE)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/licenses/gltf_meshlet)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/gltf_meshlet)
set(config ${CMAKE_CURRENT_BINARY_DIR}/gltf_meshlet-config.cmake)
file(WRITE ${config} "include(CMakeFindDependencyMacro)
find_dependency(Threads)
include(\${CMAKE_CURRENT_LIST_DIR}/gltf_meshlet-targets.cmake)
")
write_basic_package_version_file(gltf_meshlet-config-version.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${config} ${CMAKE_CURRENT_BINARY_DIR}/gltf_meshlet-config-version.cmake
        DESTINATION ${package})
install(EXPORT gltf_meshlet NAMESPACE gltf_meshlet:: FILE gltf_meshlet-targets.cmake
        DESTINATION ${package})

# pkg-config finds the prefix from the place of the file: cmake --install may name another one.
file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/gltf_meshlet.pc "prefix=\${pcfiledir}/../..
Name: gltf_meshlet
Description: Compressed triangle meshlets that decode one by one
Version: ${PROJECT_VERSION}
Libs: -L\${prefix}/${CMAKE_INSTALL_LIBDIR} -lgltf_meshlet
Libs.private: -pthread -lstdc++ -lm
Cflags: -I\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}${static_flags}
")
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/gltf_meshlet.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
