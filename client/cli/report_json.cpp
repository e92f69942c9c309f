#include "client/cli/report_json.h"

#include <algorithm>
#include <set>
#include <utility>

#include "client/report/frame_spans.h"
#include "client/report/frame_summary.h"
#include "common/json/json.h"
#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

Json FrameJson(const FrameRecord& frame, const FrameSummary& summary) {
  Json json = {{"output", frame.output},
               {"latency_ms", Milliseconds(frame.latency.count())},
               {"queued_ms", Milliseconds(frame.statistics.queued_ns)},
               {"direct", frame.direct},
               {"attempts", frame.statistics.attempts},
               {"workers", frame.statistics.workers},
               {"levels", LevelsJson(frame.statistics)},
               {"bytes", BytesJson(summary)},
               {"stages_ms", StagesJson(summary)},
               {"imbalance", summary.imbalance},
               {"idle_share", summary.idle_share}};
  if (!frame.statistics.lowered.empty()) json["lowered"] = frame.statistics.lowered;
  if (!frame.statistics.missing.empty()) json["missing"] = frame.statistics.missing;
  return json;
}

// Tracks of a worker: its two threads, and its waiting for voxels, which overlaps both.
enum Track { kRenderTrack = 1, kCombineTrack = 2, kFetchTrack = 3 };
constexpr std::pair<Track, const char*> kTracks[] = {{kRenderTrack, "render"}, {kCombineTrack, "combine"}, {kFetchTrack, "fetch"}};

Track TrackOf(Stage stage) {
  switch (stage) {
    case Stage::kFetch: return kFetchTrack;
    case Stage::kCombine:
    case Stage::kEncode:
    case Stage::kResolve: return kCombineTrack;
    default: return kRenderTrack;
  }
}

Json Name(const char* what, std::uint32_t process, std::uint32_t thread, const std::string& name) {
  return {{"name", what}, {"ph", "M"}, {"pid", process}, {"tid", thread}, {"args", {{"name", name}}}};
}

Json Complete(const std::string& name, std::uint32_t process, std::uint32_t thread, std::int64_t begin_ns, std::int64_t end_ns, Json args) {
  return {{"name", name},
          {"ph", "X"},
          {"pid", process},
          {"tid", thread},
          {"ts", double(begin_ns) / 1e3},
          {"dur", double(end_ns - begin_ns) / 1e3},
          {"args", std::move(args)}};
}

}  // namespace

std::string StatsJson(const FrameOptions& options, const std::vector<FrameRecord>& frames) {
  Json json = {{"source", ShownSource(options.source)},
               {"renderer", frames.empty() ? options.request.renderer : frames.back().statistics.renderer},
               {"size", {options.request.size.width, options.request.size.height}}};
  FrameSummary all;
  Json list = Json::array();
  for (const FrameRecord& frame : frames) {
    const FrameSummary summary = Summarize(frame.statistics);
    all.voxel_bytes += summary.voxel_bytes;
    all.stored_bytes += summary.stored_bytes;
    all.sent_bytes += summary.sent_bytes;
    all.image_bytes += summary.image_bytes;
    list.push_back(FrameJson(frame, summary));
  }
  const FrameStatistics last = frames.empty() ? FrameStatistics() : frames.back().statistics;
  json["plan"] = {{"workers", last.workers},       {"groups", last.groups},  {"decomposition", last.decomposition},
                  {"balance_by", last.balance_by}, {"axis", last.axis},      {"assignment", last.assignment},
                  {"balance", last.balance},       {"combine", last.combine}};
  json["bytes"] = BytesJson(all);
  json["frames"] = std::move(list);
  return json.dump(2) + "\n";
}

std::string TraceJson(const std::vector<FrameRecord>& frames) {
  std::int64_t origin = 0;
  for (const FrameRecord& frame : frames) {
    origin = origin == 0 ? frame.statistics.begin_ns : std::min(origin, frame.statistics.begin_ns);
  }

  Json events = Json::array();
  std::set<std::uint32_t> workers;
  std::vector<std::int64_t> lanes;  // by track of process 0: the end of its last frame; frames in flight overlap
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FrameStatistics& frame = frames[i].statistics;
    std::size_t lane = 0;
    while (lane < lanes.size() && lanes[lane] > frame.begin_ns) ++lane;
    if (lane == lanes.size()) lanes.push_back(0);
    lanes[lane] = frame.end_ns;
    events.push_back(Complete("frame " + std::to_string(i), 0, std::uint32_t(lane + 1), frame.begin_ns - origin, frame.end_ns - origin,
                              {{"output", frames[i].output}, {"groups", frame.groups}, {"workers", frame.workers}}));
    for (const RankReport& report : frame.reports) workers.insert(report.worker);
    for (const StageSpan& span : StageSpans(frame)) {
      events.push_back(Complete(std::string(ToString(span.stage)), span.worker, TrackOf(span.stage), span.begin_ns - origin,
                                span.end_ns - origin, {{"frame", i}, {"group", span.group}, {"rank", span.rank}, {"box", span.box}}));
    }
  }

  events.push_back(Name("process_name", 0, 0, "frames"));
  for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
    events.push_back(Name("thread_name", 0, std::uint32_t(lane + 1), "in flight " + std::to_string(lane + 1)));
  }
  for (const std::uint32_t worker : workers) {
    events.push_back(Name("process_name", worker, 0, "worker " + std::to_string(worker)));
    for (const auto& [track, name] : kTracks) events.push_back(Name("thread_name", worker, track, name));
  }
  const Json json = {{"displayTimeUnit", "ms"}, {"traceEvents", std::move(events)}};
  return json.dump() + "\n";
}

}  // namespace slabstream
