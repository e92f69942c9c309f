# Compile through ccache where it is installed. If its folder cannot be written, as with an unwritable HOME, use one in the build folder.
find_program(SLABSTREAM_CCACHE ccache)
if(SLABSTREAM_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  execute_process(COMMAND ${SLABSTREAM_CCACHE} --get-config cache_dir OUTPUT_VARIABLE folder OUTPUT_STRIP_TRAILING_WHITESPACE)
  execute_process(COMMAND sh -c "mkdir -p \"$0\" && test -w \"$0\"" "${folder}" RESULT_VARIABLE failure ERROR_QUIET)
  # The sloppiness that ccache wants for precompiled headers: slabstream_test, below.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros)
  if(failure)
    list(APPEND CMAKE_CXX_COMPILER_LAUNCHER CCACHE_DIR=${CMAKE_BINARY_DIR}/ccache)
  endif()
  list(APPEND CMAKE_CXX_COMPILER_LAUNCHER ${SLABSTREAM_CCACHE})
endif()

# One target a folder. Warnings, optimisation and sanitizers come with the interface target below, never from global flags.

add_library(slabstream_options INTERFACE)
target_compile_features(slabstream_options INTERFACE cxx_std_20)
target_include_directories(slabstream_options INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(slabstream_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual)
# Programs name sources by their place in the repository, wherever that is: the same bytes from any folder.
target_compile_options(slabstream_options INTERFACE -ffile-prefix-map=${CMAKE_SOURCE_DIR}/=)
# Designated initialisers name what differs from the defaults and leave out the rest on purpose.
target_compile_options(slabstream_options INTERFACE -Wno-missing-field-initializers)
if(SLABSTREAM_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(slabstream_options INTERFACE -Wno-subobject-linkage) # every file looks included there
endif()
# g++ collects garbage again and again in the first 128 MB; from 512 MB on it compiles in seven eighths of the time.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(slabstream_options INTERFACE "SHELL:--param ggc-min-heapsize=524288")
endif()
target_compile_definitions(slabstream_options INTERFACE ${SLABSTREAM_SIMD_DEFINITIONS})
if(SLABSTREAM_WERROR)
  target_compile_options(slabstream_options INTERFACE -Werror)
  # g++ 12 reports these two inside its own std::string, where code that holds strings is inlined; they stay warnings.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(slabstream_options INTERFACE -Wno-error=restrict -Wno-error=maybe-uninitialized)
  endif()
endif()
if(SLABSTREAM_SANITIZE)
  target_compile_options(slabstream_options INTERFACE -fsanitize=${SLABSTREAM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(slabstream_options INTERFACE -fsanitize=${SLABSTREAM_SANITIZE})
endif()

# slabstream_library(NAME [SOURCES file...] [LINKS slabstream::target... | any target])
# Makes slabstream_NAME with the alias slabstream::NAME. Without sources it is a header-only (interface) library.
function(slabstream_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  set(target slabstream_${name})
  if(ARG_SOURCES)
    add_library(${target} STATIC ${ARG_SOURCES})
    target_link_libraries(${target} PUBLIC slabstream_options ${ARG_LINKS} PRIVATE ${ARG_PRIVATE_LINKS})
  else()
    add_library(${target} INTERFACE)
    target_link_libraries(${target} INTERFACE slabstream_options ${ARG_LINKS})
  endif()
  add_library(slabstream::${name} ALIAS ${target})
endfunction()

# slabstream_hot_folder(): frames wait for the loops in this folder and below. They are compiled file by file, with -O3; all others several at
# a time, with -O2.
macro(slabstream_hot_folder)
  set(CMAKE_UNITY_BUILD OFF)
  add_compile_options($<$<CONFIG:Release,RelWithDebInfo>:-O3>)
endmacro()

# slabstream_cold(target...): code of tests. Programs need -O2: -O1 keeps the loop that destroys each float of an image.
function(slabstream_cold)
  foreach(target IN LISTS ARGN)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release,RelWithDebInfo>:-O1>)
  endforeach()
endfunction()

# slabstream_program(NAME SOURCES file... LINKS target... [FOLDER name]): an executable in build/bin, or in the folder `name` of the build.
function(slabstream_program name)
  cmake_parse_arguments(ARG "" "FOLDER" "SOURCES;LINKS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE slabstream_options ${ARG_LINKS})
  if(ARG_FOLDER)
    set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/${ARG_FOLDER})
  endif()
endfunction()

# slabstream_test(NAME SOURCES file... LINKS target... [TIMEOUT seconds] [LABELS label...] [COST seconds] [WAITS]): a GoogleTest program in
# build/tests, one ctest. COST: long ones begin first. WAITS: it leaves the processors to others most of the time. A test without labels and
# cost is quick: the target quick_tests builds all of these, and ctest -L quick runs them.
function(slabstream_test name)
  cmake_parse_arguments(ARG "WAITS" "TIMEOUT;COST" "SOURCES;LINKS;LABELS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  slabstream_program(${name} SOURCES ${ARG_SOURCES} LINKS ${ARG_LINKS} slabstream_test_main FOLDER tests)
  slabstream_cold(${name})
  if(SLABSTREAM_UNITY) # as for unity builds: the files compile without it, too
    target_precompile_headers(${name} REUSE_FROM slabstream_test_main)
  endif()
  add_test(NAME ${name} COMMAND ${name})
  # Of the six jobs of the test presets: two tests that compute and two that wait run at a time on two cores.
  set(processors 2)
  if(ARG_WAITS)
    set(processors 1)
  endif()
  if(NOT ARG_COST AND NOT ARG_LABELS)
    set(ARG_LABELS quick)
    set_property(GLOBAL APPEND PROPERTY SLABSTREAM_QUICK_TESTS ${name})
  endif()
  if(NOT ARG_COST)
    set(ARG_COST 0)
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT} COST ${ARG_COST} SKIP_RETURN_CODE 77 PROCESSORS ${processors} LABELS "${ARG_LABELS}")
endfunction()

# slabstream_benchmark(NAME SOURCES file... LINKS target...): a Google Benchmark program in build/bench.
function(slabstream_benchmark name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS" ${ARGN})
  slabstream_program(${name} SOURCES ${ARG_SOURCES} LINKS ${ARG_LINKS} benchmark::benchmark benchmark::benchmark_main FOLDER bench)
endfunction()

# slabstream_missing_test(NAME PACKAGES): lists a test that cannot run here as not run, under a name that says why (tests/summarise.py).
function(slabstream_missing_test name packages)
  message(WARNING "${name} does not run: ${packages} missing")
  add_test(NAME ${name}_needs_${packages} COMMAND ${CMAKE_COMMAND} -E true)
  set_tests_properties(${name}_needs_${packages} PROPERTIES DISABLED TRUE)
endfunction()

# slabstream_find_python(VARIABLE CODE): a Python that runs this code without an error, such as one that imports modules; "" if there is none.
# Distributions put modules beside /usr/bin/python3, which need not be the first one on the path.
function(slabstream_find_python variable code)
  foreach(python /usr/bin/python3 python3)
    execute_process(COMMAND ${python} -c "${code}" RESULT_VARIABLE missing OUTPUT_QUIET ERROR_QUIET)
    if(missing STREQUAL "0")
      set(${variable} ${python} PARENT_SCOPE)
      return()
    endif()
  endforeach()
  set(${variable} "" PARENT_SCOPE)
endfunction()
