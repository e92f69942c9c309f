#include "gateway/metrics.h"

#include <fmt/format.h>

#include "client/report/frame_summary.h"
#include "common/metrics/process_metrics.h"
#include "common/metrics/service_metrics.h"

namespace slabstream {

void Metrics::Observe(std::string_view stage, std::int64_t ns) {
  auto found = stages_.find(stage);
  if (found == stages_.end()) found = stages_.emplace(stage, TimeHistogram()).first;
  found->second.Add(Duration(ns));
}

void Metrics::CountFrame(const FrameStatistics& statistics, Duration latency) {
  const FrameSummary summary = Summarize(statistics);
  const std::lock_guard lock(mutex_);
  ++frames_;
  bytes_["voxels"] += summary.voxel_bytes;
  bytes_["stores"] += summary.stored_bytes;
  bytes_["images"] += summary.image_bytes;
  for (const RankReport& report : statistics.reports) {
    ++voxel_reports_;
    voxel_hits_ += report.voxel_bytes == 0 ? 1 : 0;
  }
  Observe("latency", latency.count());
  Observe("queued", statistics.queued_ns);
  Observe("render", summary.render_ns);
  Observe("combine", summary.combine_ns);
  Observe("finish", summary.finish_ns);
}

void Metrics::CountPicture(std::string_view type, std::size_t bytes, Duration encoding) {
  const std::lock_guard lock(mutex_);
  ++pictures_[std::string(type)];
  bytes_["web"] += bytes;
  Observe(fmt::format("encode-{}", type), encoding.count());
}

void Metrics::CountAnswer(std::string_view question, Duration latency) {
  const std::lock_guard lock(mutex_);
  ++answers_[std::string(question)];
  Observe("answer", latency.count());
}

void Metrics::CountRoundTrip(Duration round_trip) {
  const std::lock_guard lock(mutex_);
  Observe("round-trip", round_trip.count());
}

void Metrics::CountResponse(unsigned status) {
  const std::lock_guard lock(mutex_);
  ++responses_[status];
}

void Metrics::CountRefusal(std::string_view reason) {
  const std::lock_guard lock(mutex_);
  ++refusals_[std::string(reason)];
}

void Metrics::CountSession(int change) {
  const std::lock_guard lock(mutex_);
  sessions_ += change;
}

std::string Metrics::Text(const ServiceNews& news, const TraceSender::Counts& traces) const {
  const std::lock_guard lock(mutex_);
  Exposition out;
  out.Single("gateway_frames_total", MetricType::kCounter, "Frames that the service made for this gateway.", frames_);
  out.Family("gateway_pictures_total", MetricType::kCounter, "Pictures sent, by their type.");
  for (const auto& [type, count] : pictures_) out.Value(count, {{"type", type}});
  out.Family("gateway_answers_total", MetricType::kCounter, "Questions about volumes that the service answered.");
  for (const auto& [question, count] : answers_) out.Value(count, {{"question", question}});
  out.Family("gateway_bytes_total", MetricType::kCounter,
             "Bytes by plane: voxels to workers, what was read from stores for them, images between workers, pictures to the web.");
  for (const auto& [plane, bytes] : bytes_) out.Value(bytes, {{"plane", plane}});
  out.Single("gateway_rendered_boxes_total", MetricType::kCounter, "Boxes that workers rendered for this gateway.", voxel_reports_);
  out.Single("gateway_cached_boxes_total", MetricType::kCounter, "Those whose voxels the worker had already.", voxel_hits_);
  out.Family("gateway_stage_seconds", MetricType::kHistogram, "Times of a frame by stage, and of answers.");
  for (const auto& [stage, times] : stages_) out.Histogram(times, {{"stage", stage}});
  out.Family("gateway_responses_total", MetricType::kCounter, "Responses by their HTTP status.");
  for (const auto& [status, count] : responses_) out.Value(count, {{"status", std::to_string(status)}});
  out.Family("gateway_refusals_total", MetricType::kCounter, "Requests and sessions that the gateway refused or dropped.");
  for (const auto& [reason, count] : refusals_) out.Value(count, {{"reason", reason}});
  out.Family("gateway_traces_total", MetricType::kCounter, "Traces of requests: that a collector took, or that were dropped.");
  out.Value(traces.sent, {{"result", "sent"}});
  out.Value(traces.dropped, {{"result", "dropped"}});
  out.Single("gateway_sessions", MetricType::kGauge, "Views that are open.", std::uint64_t(sessions_));

  const StatusReply& status = news.status;
  out.Single("service_up", MetricType::kGauge, "1 while the service answers and has a worker.",
             std::uint64_t{news.health == ServiceHealth::kReady});
  out.Single("service_workers", MetricType::kGauge, "Workers of the service.", std::uint64_t{status.workers.size()});
  out.Single("service_workers_lost_total", MetricType::kCounter, "Workers that the service has lost.", status.workers_lost);
  out.Single("service_queued", MetricType::kGauge, "Frames that wait at the service.", std::uint64_t{status.queued});
  out.Single("service_running", MetricType::kGauge, "Frames that the service works on.", std::uint64_t{status.running});
  out.Single("service_frames_done_total", MetricType::kCounter, "Frames that the service has made, for all clients.", status.frames_done);
  out.Single("service_frames_failed_total", MetricType::kCounter, "Frames that failed.", status.frames_failed);
  AddRefused(out, "service_refused_total", "Requests that the service refused.", status.refused);
  std::uint64_t cached = 0, fetched = 0;
  for (const WorkerStatus& worker : status.workers) {
    cached += worker.cached_bytes;
    fetched += worker.fetched_bytes;
  }
  out.Single("service_cached_bytes", MetricType::kGauge, "Voxels that workers keep.", cached);
  out.Single("service_fetched_bytes_total", MetricType::kCounter, "Voxels that the present workers have fetched.", fetched);
  AddProcess(out, 0);
  return out.Take();
}

}  // namespace slabstream
