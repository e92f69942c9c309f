# What `cmake --install` puts where, by components that a packager can pick (docs/cpp.md):
#   server              coordinator and workers
#   cli                 the command line; needs client-runtime
#   gateway             HTTP and the viewer's page; needs client-runtime
#   client-runtime      libslabstream.so.N, and the module that writes EXR, TIFF, PDF and SVG
#   client-development  headers, Fortran module as source, CMake package, pkg-config file, examples; needs client-runtime
#   python              the Python client
#   lab                 slabstream-laboratory, which `slabstream bench` and `slabstream experiment` start, and slabstream-lab, the pages of experiments
include(CMakePackageConfigHelpers)

# Programs look for each other beside themselves.
foreach(program slabstream-coordinator:server slabstream-worker:server slabstream-dicom-decoder:server slabstream:cli slabstream-gateway:gateway
    slabstream-laboratory:lab)
  string(REPLACE ":" ";" program ${program})
  list(GET program 0 name)
  list(GET program 1 component)
  install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${component})
endforeach()

# The client library in C++.
install(TARGETS slabstream_api EXPORT SlabstreamTargets
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT client-runtime NAMELINK_COMPONENT client-development)
if(SLABSTREAM_PICTURES)
  install(TARGETS slabstream_pictures_module LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/slabstream COMPONENT client-runtime)
endif()
install(FILES ${CMAKE_SOURCE_DIR}/client/api/slabstream/client.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/slabstream COMPONENT client-development)
install(FILES ${CMAKE_SOURCE_DIR}/client/insitu/slabstream_insitu.h ${CMAKE_SOURCE_DIR}/client/insitu/slabstream_insitu.f90
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT client-development)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT client-development USE_SOURCE_PERMISSIONS)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/Slabstream)
install(EXPORT SlabstreamTargets NAMESPACE Slabstream:: DESTINATION ${package} COMPONENT client-development)
configure_package_config_file(${CMAKE_SOURCE_DIR}/cmake/SlabstreamConfig.cmake.in ${CMAKE_BINARY_DIR}/SlabstreamConfig.cmake INSTALL_DESTINATION ${package})
# Versions 0.N may differ in everything.
write_basic_package_version_file(${CMAKE_BINARY_DIR}/SlabstreamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/SlabstreamConfig.cmake ${CMAKE_BINARY_DIR}/SlabstreamConfigVersion.cmake DESTINATION ${package} COMPONENT client-development)

file(RELATIVE_PATH SLABSTREAM_PREFIX ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
string(REGEX REPLACE "/$" "" SLABSTREAM_PREFIX ${SLABSTREAM_PREFIX})
configure_file(${CMAKE_SOURCE_DIR}/cmake/slabstream.pc.in ${CMAKE_BINARY_DIR}/slabstream.pc @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/slabstream.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT client-development)

# Python (docs/python.md).
install(DIRECTORY ${CMAKE_SOURCE_DIR}/python/slabstream DESTINATION ${CMAKE_INSTALL_DATADIR}/slabstream/python COMPONENT python
  PATTERN __pycache__ EXCLUDE)
install(PROGRAMS ${CMAKE_SOURCE_DIR}/python/slabstream-lab DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT lab)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/python/slabstream_lab DESTINATION ${CMAKE_INSTALL_DATADIR}/slabstream/python COMPONENT lab
  PATTERN __pycache__ EXCLUDE)
