#include "gateway/metrics.h"

#include <fmt/format.h>

#include "client/report/frame_summary.h"

namespace slabstream {
namespace {

// Families of the text, each with its lines.
class Exposition {
 public:
  void Family(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    text_ += fmt::format("# HELP slabstream_{0} {1}\n# TYPE slabstream_{0} {2}\n", name, help, type);
  }
  template <class Value>
  void Line(const Value& value, std::string_view labels = {}, std::string_view suffix = {}) {
    text_ += fmt::format("slabstream_{}{}{}{}{} {}\n", name_, suffix, labels.empty() ? "" : "{", labels, labels.empty() ? "" : "}", value);
  }
  template <class Value>
  void Single(std::string_view name, std::string_view type, std::string_view help, const Value& value) {
    Family(name, type, help);
    Line(value);
  }
  std::string Take() { return std::move(text_); }

 private:
  std::string name_, text_;
};

}  // namespace

void Metrics::Histogram::Add(double seconds) {
  for (std::size_t i = 0; i < kBounds.size(); ++i) counts[i] += seconds <= kBounds[i] ? 1 : 0;
  ++count;
  sum += seconds;
}

void Metrics::Observe(std::string_view stage, std::int64_t ns) {
  auto found = stages_.find(stage);
  if (found == stages_.end()) found = stages_.emplace(stage, Histogram()).first;
  found->second.Add(double(ns) / 1e9);
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

std::string Metrics::Text(const ServiceNews& news) const {
  const std::lock_guard lock(mutex_);
  Exposition out;
  out.Single("gateway_frames_total", "counter", "Frames that the service made for this gateway.", frames_);
  out.Family("gateway_pictures_total", "counter", "Pictures sent, by their type.");
  for (const auto& [type, count] : pictures_) out.Line(count, fmt::format("type=\"{}\"", type));
  out.Family("gateway_answers_total", "counter", "Questions about volumes that the service answered.");
  for (const auto& [question, count] : answers_) out.Line(count, fmt::format("question=\"{}\"", question));
  out.Family("gateway_bytes_total", "counter",
             "Bytes by plane: voxels to workers, what was read from stores for them, images between workers, pictures to the web.");
  for (const auto& [plane, bytes] : bytes_) out.Line(bytes, fmt::format("plane=\"{}\"", plane));
  out.Single("gateway_rendered_boxes_total", "counter", "Boxes that workers rendered for this gateway.", voxel_reports_);
  out.Single("gateway_cached_boxes_total", "counter", "Those whose voxels the worker had already.", voxel_hits_);
  out.Family("gateway_stage_seconds", "histogram", "Times of a frame by stage, and of answers.");
  for (const auto& [stage, histogram] : stages_) {
    for (std::size_t i = 0; i < Histogram::kBounds.size(); ++i) {
      out.Line(histogram.counts[i], fmt::format("stage=\"{}\",le=\"{}\"", stage, Histogram::kBounds[i]), "_bucket");
    }
    out.Line(histogram.count, fmt::format("stage=\"{}\",le=\"+Inf\"", stage), "_bucket");
    out.Line(histogram.sum, fmt::format("stage=\"{}\"", stage), "_sum");
    out.Line(histogram.count, fmt::format("stage=\"{}\"", stage), "_count");
  }
  out.Family("gateway_responses_total", "counter", "Responses by their HTTP status.");
  for (const auto& [status, count] : responses_) out.Line(count, fmt::format("status=\"{}\"", status));
  out.Family("gateway_refusals_total", "counter", "Requests and sessions that the gateway refused or dropped.");
  for (const auto& [reason, count] : refusals_) out.Line(count, fmt::format("reason=\"{}\"", reason));
  out.Single("gateway_sessions", "gauge", "Views that are open.", sessions_);

  const StatusReply& status = news.status;
  out.Single("service_up", "gauge", "1 while the service answers and has a worker.", news.health == ServiceHealth::kReady ? 1 : 0);
  out.Single("service_workers", "gauge", "Workers of the service.", status.workers.size());
  out.Single("service_workers_lost_total", "counter", "Workers that the service has lost.", status.workers_lost);
  out.Single("service_queued", "gauge", "Frames that wait at the service.", status.queued);
  out.Single("service_running", "gauge", "Frames that the service works on.", status.running);
  out.Single("service_frames_done_total", "counter", "Frames that the service has made, for all clients.", status.frames_done);
  out.Single("service_frames_failed_total", "counter", "Frames that failed.", status.frames_failed);
  out.Family("service_refused_total", "counter", "Requests that the service refused.");
  out.Line(status.refused.bad_request, "reason=\"bad request\"");
  out.Line(status.refused.unknown_dataset, "reason=\"unknown dataset\"");
  out.Line(status.refused.too_large, "reason=\"too large\"");
  out.Line(status.refused.over_quota, "reason=\"over quota\"");
  std::uint64_t cached = 0, fetched = 0;
  for (const WorkerStatus& worker : status.workers) {
    cached += worker.cached_bytes;
    fetched += worker.fetched_bytes;
  }
  out.Single("service_cached_bytes", "gauge", "Voxels that workers keep.", cached);
  out.Single("service_fetched_bytes_total", "counter", "Voxels that the present workers have fetched.", fetched);
  return out.Take();
}

}  // namespace slabstream
