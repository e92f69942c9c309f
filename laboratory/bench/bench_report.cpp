#include "laboratory/bench/bench_report.h"

#include <fmt/format.h>

#include "client/cli/cores.h"
#include "client/report/frame_summary.h"
#include "common/base/check.h"
#include "common/base/version.h"
#include "common/json/json.h"
#include "laboratory/measure/statistics.h"

namespace slabstream {
namespace {

std::vector<double> BothProjections(const BenchResult& result) {
  std::vector<double> both = result.orthographic_ms;
  both.insert(both.end(), result.perspective_ms.begin(), result.perspective_ms.end());
  return both;
}

Json SpreadJson(const std::vector<double>& times) {
  const Spread spread = SpreadOf(times);
  return {{"frames", spread.count}, {"median", spread.median}, {"p05", spread.p05}, {"p95", spread.p95},
          {"min", spread.min},      {"max", spread.max},       {"all", times}};
}

Json CaseJson(const BenchRun& run, const BenchResult& result) {
  const BenchCase& c = result.bench_case;
  if (!result.skipped.empty()) return {{"case", c.name}, {"skipped", result.skipped}};
  Json volume = {{"name", c.dataset}};
  if (const auto* path = std::get_if<std::string>(&c.volume); path != nullptr && run.options.connection.local_workers > 0)
    volume["file"] = *path;
  const Index3& size = result.description.geometry.size;
  volume["size"] = {size.x, size.y, size.z};
  volume["raw_bytes"] = result.description.voxel_bytes();
  const auto* preset = std::get_if<std::string>(&c.transfer.choice);
  Json stages = Json::object();
  for (int stage = 0; stage < kStageCount; ++stage) {
    stages[std::string(ToString(Stage(stage)))] = result.stage_median_ms[std::size_t(stage)];
  }
  return {{"case", c.name},
          {"volume", volume},
          {"renderer", c.renderer->name()},
          {"parameters", Json(c.parameters)},
          {"transfer", preset != nullptr ? Json(*preset) : Json("curve")},
          {"opacity", c.opacity ? Json(*c.opacity) : Json()},
          {"opacity_distance", c.transfer.opacity_distance},
          {"first_frame_ms", result.first_frame_ms},
          {"latency_ms",
           {{"orthographic", SpreadJson(result.orthographic_ms)},
            {"perspective", SpreadJson(result.perspective_ms)},
            {"both", SpreadJson(BothProjections(result))}}},
          {"stage_median_ms", stages},
          {"peak_rss_bytes", result.peak_rss_bytes}};
}

}  // namespace

Spread SpreadOf(const std::vector<double>& values) {
  if (values.empty()) return {};
  return {int(values.size()),     MedianOf(values).median, Quantile(values, 0.05),
          Quantile(values, 0.95), Quantile(values, 0),     Quantile(values, 1)};
}

void SetFrames(BenchResult& result, std::span<const FrameJob> jobs, std::span<const FrameRecord> records) {
  CHECK_EQ(jobs.size(), records.size());
  std::array<std::vector<double>, kStageCount> stages;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const bool perspective = jobs[i].request.view.projection == Projection::kPerspective;
    auto& times = perspective ? result.perspective_ms : result.orthographic_ms;
    times.push_back(double(records[i].latency.count()) / 1e6);
    const StageTimes stage_ns = Summarize(records[i].statistics).stage_ns;
    for (std::size_t stage = 0; stage < stages.size(); ++stage) stages[stage].push_back(double(stage_ns[stage]) / 1e6);
  }
  for (std::size_t stage = 0; stage < stages.size(); ++stage) result.stage_median_ms[stage] = MedianOf(std::move(stages[stage])).median;
}

std::string BenchHeader(const BenchRun& run, std::size_t name_width) {
  const BenchOptions& o = run.options;
  const std::string where = o.connection.local_workers > 0 ? fmt::format("workers in this process: {}, threads of each: {}",
                                                                         o.connection.local_workers, LocalThreads(o.connection))
                                                           : o.connection.service.text();
  return fmt::format("machine: {} cores, {}, {}\n", run.machine.cores, run.machine.cpu, run.machine.simd) +
         fmt::format("run:     {0}x{0} pixels, {1} turns of {2} views of each projection, {3}; times in ms, memory in MiB\n", o.size,
                     o.turns, o.frames, where) +
         fmt::format("{:<{}} {:>15} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>7} {:>7}\n", "case", name_width, "voxels",
                     "renderer", "ortho", "persp", "both", "p05", "p95", "min", "max", "first", "raw", "peak");
}

std::string BenchRow(const BenchResult& result, std::size_t name_width) {
  const BenchCase& c = result.bench_case;
  if (!result.skipped.empty()) return fmt::format("{:<{}} skipped: {}\n", c.name, name_width, result.skipped);
  const Index3& size = result.description.geometry.size;
  const Spread both = SpreadOf(BothProjections(result));
  const auto mebibytes = [](std::int64_t bytes) { return double(bytes) / (1 << 20); };
  const auto median = [](const std::vector<double>& times) { return times.empty() ? "-" : fmt::format("{:.2f}", MedianOf(times).median); };
  return fmt::format("{:<{}} {:>15} {:>8} {:>8} {:>8} {:>8.2f} {:>8.2f} {:>8.2f} {:>8.2f} {:>8.2f} {:>8.1f} {:>7.1f} {:>7.1f}\n", c.name,
                     name_width, fmt::format("{}x{}x{}", size.x, size.y, size.z), c.renderer->name(), median(result.orthographic_ms),
                     median(result.perspective_ms), both.median, both.p05, both.p95, both.min, both.max, result.first_frame_ms,
                     mebibytes(result.description.voxel_bytes()), mebibytes(result.peak_rss_bytes));
}

std::string BenchJson(const BenchRun& run, const std::vector<BenchResult>& results) {
  const BenchOptions& o = run.options;
  Json json = {{"version", Version()},
               {"command", o.command},
               {"machine", {{"cpu", run.machine.cpu}, {"cores", run.machine.cores}, {"simd", run.machine.simd}}},
               {"size", o.size},
               {"frames", o.frames},
               {"turns", o.turns},
               {"termination", o.termination},
               {"endpoint", o.connection.service.text()},  // empty: in this process, with the numbers of workers and threads below
               {"workers", o.connection.local_workers},
               {"threads", o.connection.local_workers > 0 ? LocalThreads(o.connection) : 0},
               {"cases", Json::array()}};
  for (const BenchResult& result : results) json["cases"].push_back(CaseJson(run, result));
  return json.dump(2) + "\n";
}

}  // namespace slabstream
