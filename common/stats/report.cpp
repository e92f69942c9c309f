#include "common/stats/report.h"

namespace slabstream {

std::string_view ToString(Stage stage) {
  static constexpr auto kNames = std::to_array<std::string_view>(
      {"fetch", "prepare", "transform", "shade", "splat", "composite", "z_buffer", "combine", "encode", "resolve", "render", "sample"});
  static_assert(kNames.size() == kStageCount);
  return kNames.at(std::size_t(stage));
}

void AddTimes(StageTimes& sum, const StageTimes& times) {
  for (std::size_t stage = 0; stage < sum.size(); ++stage) sum[stage] += times[stage];
}

void AddStage(RankReport& report, Stage stage, std::int64_t begin_ns, std::int64_t end_ns) {
  report.stage_ns[std::size_t(stage)] += end_ns - begin_ns;
  if (report.spans.size() < kMaxSpans) report.spans.push_back({stage, begin_ns, end_ns});
}

std::int64_t PictureNs(const RankReport& report) {
  std::int64_t ns = 0;
  for (std::size_t i = 0; i < report.spans.size(); ++i) {
    const Span& span = report.spans[i];
    const bool packed = span.stage == Stage::kEncode && i > 0 && report.spans[i - 1].stage == Stage::kResolve;
    if (span.stage == Stage::kResolve || packed) ns += span.end_ns - span.begin_ns;
  }
  return ns;
}

}  // namespace slabstream
