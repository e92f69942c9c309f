// Which instruction set the vector kernels use: the best one that the CPU has, unless it is limited.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

// Instruction sets that this program has code for and this CPU runs, best first: "avx512", "avx2", "sse4", "ssse3", "sse2", "neon", ...
std::vector<std::string> SimdTargets();

// Limits kernels to `name` (of SimdTargets()) or worse. Call it before the first kernel runs. InvalidArgument: no such name.
Status LimitSimdTarget(const std::string& name);

// The same by the environment variable SLABSTREAM_SIMD, if set: for measuring, and for running the tests under each instruction set.
Status LimitSimdTargetByEnvironment();

}  // namespace slabstream
