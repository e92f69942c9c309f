cmake_minimum_required(VERSION 3.25)
# Writes OUTPUT, a header that names the commit which is built, whenever that has changed. Run at each build: cmake -DSOURCE=... -DOUTPUT=... -P
execute_process(COMMAND git -C "${SOURCE}" describe --always --dirty --abbrev=12 --exclude=* OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE
  ERROR_QUIET RESULT_VARIABLE failure)
if(failure)
  set(commit "unknown")
endif()
file(CONFIGURE OUTPUT "${OUTPUT}" CONTENT "#pragma once\n#define SLABSTREAM_COMMIT \"@commit@\"\n" @ONLY)
