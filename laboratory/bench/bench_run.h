// Measures one case of `slabstream bench`: a service of its own (or the one at an endpoint), two frames to warm up, then turn after turn
// with one frame in flight. Pictures are decoded into memory while it measures and written only afterwards.
#pragma once

#include "common/base/status.h"
#include "laboratory/bench/bench.h"
#include "laboratory/bench/bench_report.h"

namespace slabstream {

// Cancelled after Ctrl-C.
Result<BenchResult> RunBenchCase(const BenchCase& bench_case, const BenchOptions& options);

}  // namespace slabstream
