// Which instruction set the vector kernels use: the best one that the CPU has, unless it is limited.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

// Instruction sets that this program has code for and this processor runs, best first: "avx512", "avx2", "sse4", "neon".
std::vector<std::string> SimdTargets();

// Limits kernels to the one of SimdTargets() that the environment variable SLABSTREAM_SIMD names, or worse ones, if it is set: for
// measuring, and for running the tests under each instruction set. Call it before the first kernel runs. InvalidArgument: no such name,
// or this processor has none of those that the program was compiled for.
Status LimitSimdTargetByEnvironment();

}  // namespace slabstream
