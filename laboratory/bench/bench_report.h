// Results of `slabstream bench`, as a table for people and JSON for programs. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "client/cli/frame_loop.h"
#include "common/stats/report.h"
#include "laboratory/bench/bench.h"
#include "laboratory/bench/bench_cases.h"
#include "laboratory/bench/bench_machine.h"

namespace slabstream {

// Times in ms. Quantiles by nearest rank, the median as in statistics.h.
struct Spread {
  int count = 0;
  double median = 0, p05 = 0, p95 = 0, min = 0, max = 0;
};
Spread SpreadOf(const std::vector<double>& values);

struct BenchResult {
  BenchCase bench_case;
  std::string skipped;            // why nothing was measured; then the rest is empty
  VolumeDescription description;  // the volume's description
  double first_frame_ms = 0;      // an embedded service is empty then, so this includes reading a file
  // Request to last byte of each frame after the warm-up, in order of rendering; of projections that the renderer draws.
  std::vector<double> orthographic_ms, perspective_ms;
  std::array<double, kStageCount> stage_median_ms{};  // worker time, summed over workers
  std::int64_t peak_rss_bytes = 0;                    // the most memory that this process held: all of the service if it is embedded
};

// Sets the times and stages of a result that has none: `records[i]` belongs to `jobs[i]`.
void SetFrames(BenchResult& result, std::span<const FrameJob> jobs, std::span<const FrameRecord> records);

struct BenchRun {
  MachineInfo machine;
  BenchOptions options;
};

// The table, line by line. `name_width`: of the longest case.
std::string BenchHeader(const BenchRun& run, std::size_t name_width);
std::string BenchRow(const BenchResult& result, std::size_t name_width);

std::string BenchJson(const BenchRun& run, const std::vector<BenchResult>& results);

}  // namespace slabstream
