#include "common/stats/report.h"

#include "common/base/check.h"

namespace slabstream {

std::string_view ToString(Stage stage) {
  switch (stage) {
    case Stage::kFetch: return "fetch";
    case Stage::kPrepare: return "prepare";
    case Stage::kTransform: return "transform";
    case Stage::kShade: return "shade";
    case Stage::kSplat: return "splat";
    case Stage::kComposite: return "composite";
    case Stage::kZBuffer: return "z_buffer";
    case Stage::kCombine: return "combine";
    case Stage::kEncode: return "encode";
    case Stage::kResolve: return "resolve";
    case Stage::kRender: return "render";
    case Stage::kSample: return "sample";
  }
  CHECK(false) << "no such stage: " << int(stage);
  return "";
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
