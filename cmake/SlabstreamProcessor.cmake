# For which instruction sets kernels are compiled: SLABSTREAM_SIMD_DEFINITIONS, for Highway. Programs choose among them when they start.
set(SLABSTREAM_SIMD_DEFINITIONS "")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  # SSE4, AVX2 and AVX-512. Processors of before 2010 have none of them.
  set(slabstream_least_target HWY_SSE4)
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  # Kernels keep vectors in arrays and structs, which those of SVE, whose size no compiler knows, cannot be kept in: NEON on all of Arm.
  set(SLABSTREAM_SIMD_DEFINITIONS "HWY_DISABLED_TARGETS=(HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128)")
endif()

# Sets `variable` to whether this machine has all of these instruction sets, in the compiler's names.
function(slabstream_processor_has variable)
  list(TRANSFORM ARGN REPLACE "(.+)" "__builtin_cpu_supports(\"\\1\")")
  list(JOIN ARGN " && " condition)
  check_cxx_source_runs("int main() { return ${condition} ? 0 : 1; }" ${variable})
endfunction()

if(SLABSTREAM_NATIVE AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64" AND NOT CMAKE_CROSSCOMPILING)
  include(CheckCXXSourceRuns)
  # The features that Highway compiles for: its HWY_TARGET_STR_SSE4, _AVX2 and _AVX3.
  slabstream_processor_has(SLABSTREAM_HAS_SSE4 sse4.1 sse4.2 aes pclmul)
  slabstream_processor_has(SLABSTREAM_HAS_AVX2 avx2 fma bmi bmi2 f16c aes pclmul)
  slabstream_processor_has(SLABSTREAM_HAS_AVX512 avx2 fma bmi bmi2 f16c aes pclmul avx512f avx512vl avx512dq avx512bw)
  foreach(target AVX512:HWY_AVX3 AVX2:HWY_AVX2 SSE4:HWY_SSE4)
    string(REPLACE ":" ";" target ${target})
    list(GET target 0 name)
    if(SLABSTREAM_HAS_${name})
      list(GET target 1 slabstream_least_target)
      list(APPEND SLABSTREAM_SIMD_DEFINITIONS HWY_COMPILE_ONLY_STATIC)
      break()
    endif()
  endforeach()
endif()
if(slabstream_least_target)
  list(APPEND SLABSTREAM_SIMD_DEFINITIONS HWY_BASELINE_TARGETS=${slabstream_least_target})
endif()
