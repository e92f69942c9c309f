#include "client/telemetry/frame_trace.h"

#include <algorithm>
#include <map>
#include <utility>

#include "client/report/frame_spans.h"
#include "client/report/frame_summary.h"

namespace slabstream {
namespace {

std::vector<TraceAttribute> AttributesOf(const std::string& dataset, const FrameStatistics& statistics) {
  const FrameSummary summary = Summarize(statistics);
  return {{"slabstream.dataset", dataset},
          {"slabstream.renderer", statistics.renderer},
          {"slabstream.decomposition", statistics.decomposition},
          {"slabstream.assignment", statistics.assignment},
          {"slabstream.combine", statistics.combine},
          {"slabstream.workers", std::int64_t{statistics.workers}},
          {"slabstream.groups", std::int64_t{statistics.groups}},
          {"slabstream.attempts", std::int64_t{statistics.attempts}},
          {"slabstream.voxel_bytes", std::int64_t(summary.voxel_bytes)},
          {"slabstream.stored_bytes", std::int64_t(summary.stored_bytes)},
          {"slabstream.image_bytes", std::int64_t(summary.image_bytes)}};
}

}  // namespace

WallClock::WallClock()
    : offset_ns_(std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()).count() -
                 MonotonicNow().time_since_epoch().count()) {}

TraceSpan ChildOf(const TraceSpan& parent, std::string name, std::int64_t begin_ns, std::int64_t end_ns) {
  TraceSpan span;
  span.trace = parent.trace;
  span.parent = parent.id;
  span.name = std::move(name);
  span.begin_ns = begin_ns;
  span.end_ns = end_ns;
  return span;
}

void AddFrame(std::vector<TraceSpan>& trace, const TraceSpan& parent, const WallClock& clock, Time begin, Time end,
              const std::string& dataset, const FrameStatistics& statistics) {
  TraceSpan frame = ChildOf(parent, "frame", clock.At(begin), clock.At(std::max(begin, end)));
  frame.kind = SpanKind::kClient;
  frame.attributes = AttributesOf(dataset, statistics);

  const auto here = [](std::int64_t ns) { return Time(Duration(ns)); };
  const bool same_clock = here(statistics.begin_ns - statistics.queued_ns) >= begin && here(statistics.end_ns) <= end;
  const Duration shift = same_clock ? Duration(0) : end - here(statistics.end_ns);
  const auto within = [&](std::int64_t ns) { return std::clamp(clock.At(here(ns) + shift), frame.begin_ns, frame.end_ns); };
  if (statistics.queued_ns > 0) {
    trace.push_back(ChildOf(frame, "queued", within(statistics.begin_ns - statistics.queued_ns), within(statistics.begin_ns)));
  }

  std::vector<StageSpan> stages = StageSpans(statistics);
  if (stages.size() > kMaxTracedStages) {
    frame.attributes.emplace_back("slabstream.stages_left_out", std::int64_t(stages.size() - kMaxTracedStages));
    stages.resize(kMaxTracedStages);
  }
  std::map<std::uint32_t, TraceSpan> workers;
  for (const StageSpan& stage : stages) {
    const std::int64_t from = within(stage.begin_ns), to = within(stage.end_ns);
    auto worker = workers.find(stage.worker);
    if (worker == workers.end()) {
      worker = workers.emplace(stage.worker, ChildOf(frame, "worker", from, to)).first;
      worker->second.attributes = {{"slabstream.worker", std::int64_t{stage.worker}}};
    }
    worker->second.begin_ns = std::min(worker->second.begin_ns, from);
    worker->second.end_ns = std::max(worker->second.end_ns, to);
    TraceSpan span = ChildOf(worker->second, std::string(ToString(stage.stage)), from, to);
    span.attributes = {{"slabstream.worker", std::int64_t{stage.worker}},
                       {"slabstream.group", std::int64_t{stage.group}},
                       {"slabstream.rank", std::int64_t{stage.rank}},
                       {"slabstream.box", std::int64_t{stage.box}}};
    trace.push_back(std::move(span));
  }
  for (auto& [id, worker] : workers) trace.push_back(std::move(worker));
  trace.push_back(std::move(frame));
}

}  // namespace slabstream
