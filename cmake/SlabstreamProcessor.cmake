# For which instruction sets kernels are compiled: SLABSTREAM_SIMD_DEFINITIONS, for Highway. Programs choose among them when they start.
set(SLABSTREAM_SIMD_DEFINITIONS "")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  # SSE4, AVX2 and AVX-512, and scalar code, which takes 2 to 8 times as long as SSE4. No SSSE3: processors that have it but not SSE4 were
  # made in 2006 and 2007.
  set(SLABSTREAM_SIMD_DEFINITIONS HWY_DISABLED_TARGETS=HWY_SSSE3)
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
  slabstream_processor_has(SLABSTREAM_HAS_AVX512 avx512f avx512vl avx512dq avx512bw)
  if(SLABSTREAM_HAS_AVX2 AND SLABSTREAM_HAS_AVX512)
    list(APPEND SLABSTREAM_SIMD_DEFINITIONS HWY_COMPILE_ONLY_STATIC HWY_BASELINE_TARGETS=HWY_AVX3)
  elseif(SLABSTREAM_HAS_AVX2)
    list(APPEND SLABSTREAM_SIMD_DEFINITIONS HWY_COMPILE_ONLY_STATIC HWY_BASELINE_TARGETS=HWY_AVX2)
  elseif(SLABSTREAM_HAS_SSE4)
    list(APPEND SLABSTREAM_SIMD_DEFINITIONS HWY_COMPILE_ONLY_STATIC HWY_BASELINE_TARGETS=HWY_SSE4)
  endif()
endif()
