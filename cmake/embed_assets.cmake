# Writes OUTPUT, which defines Assets() (gateway/assets.h) with the files of FOLDER: by their paths in it.
# Run at build time: cmake -DFOLDER=... -DOUTPUT=... -P
cmake_minimum_required(VERSION 3.25)
set(types
  html "text/html" js "text/javascript" css "text/css" svg "image/svg+xml" json "application/json"
  png "image/png" ico "image/x-icon" woff2 "font/woff2" map "application/json" txt "text/plain")
file(GLOB_RECURSE files RELATIVE ${FOLDER} ${FOLDER}/*)
list(SORT files)
set(arrays "")
set(table "")
set(number 0)
foreach(name IN LISTS files)
  cmake_path(GET name EXTENSION LAST_ONLY ending)
  string(REPLACE "." "" ending "${ending}")
  list(FIND types "${ending}" place)
  if(place EQUAL -1)
    message(FATAL_ERROR "${FOLDER}/${name}: no media type is known for .${ending}")
  endif()
  math(EXPR place "${place} + 1")
  list(GET types ${place} type)
  file(READ ${FOLDER}/${name} hex HEX)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${hex}")
  file(SIZE ${FOLDER}/${name} size)
  string(APPEND arrays "constexpr unsigned char kFile${number}[] = {${bytes}0};\n")
  string(APPEND table "    {\"/${name}\", \"${type}\", {reinterpret_cast<const char*>(kFile${number}), ${size}}},\n")
  math(EXPR number "${number} + 1")
endforeach()
file(WRITE ${OUTPUT}.new "#include \"gateway/assets.h\"\n\n#include <array>\n\nnamespace slabstream {\nnamespace {\n\n${arrays}\n}  // namespace\n
std::span<const Asset> Assets() {
  static const std::array<Asset, ${number}> assets = {{\n${table}  }};
  return assets;
}\n\n}  // namespace slabstream\n")
file(COPY_FILE ${OUTPUT}.new ${OUTPUT} ONLY_IF_DIFFERENT)
