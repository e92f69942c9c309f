# Third-party libraries, all of them Debian 12 packages (deploy/packages lists them).
find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)
find_package(cppzmq REQUIRED)
find_package(Protobuf 3.21 REQUIRED)
find_package(CLI11 CONFIG REQUIRED)
find_package(spdlog CONFIG REQUIRED)
find_package(fmt CONFIG REQUIRED)
find_package(nlohmann_json CONFIG REQUIRED)
find_package(zstd CONFIG REQUIRED)
find_package(Eigen3 3.4 CONFIG REQUIRED)
find_package(hwy CONFIG REQUIRED)
find_package(TBB CONFIG REQUIRED)
find_package(TIFF REQUIRED)
find_package(ZLIB REQUIRED)
pkg_check_modules(XXHASH REQUIRED IMPORTED_TARGET libxxhash)
# OpenImageIO's own CMake configuration wants its command-line tools and an OpenCV include directory; its pkg-config file does not.
pkg_check_modules(OIIO REQUIRED IMPORTED_TARGET OpenImageIO)

# ITK defines targets and include directories globally through its "use file"; take just the modules that read and write volumes.
find_package(ITK 5 REQUIRED COMPONENTS ITKCommon ITKIOImageBase ITKIONIFTI ITKIONRRD ITKIOMeta)

if(SLABSTREAM_TESTS)
  find_package(GTest CONFIG REQUIRED)
  include(GoogleTest)
endif()
if(SLABSTREAM_BENCH)
  find_package(benchmark CONFIG REQUIRED)
endif()
