#include "client/cli/stats_json.h"

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

}  // namespace slabstream
