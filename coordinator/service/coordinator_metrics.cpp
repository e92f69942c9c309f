#include "coordinator/service/coordinator_metrics.h"

#include <cstddef>

#include "common/metrics/process_metrics.h"
#include "common/metrics/service_metrics.h"
#include "data/stores/http_transfers.h"

namespace slabstream {

void CoordinatorMetrics::CountFrame(const FrameStatistics& statistics) {
  const std::lock_guard lock(mutex_);
  frame_times_.Add(Duration(statistics.queued_ns + statistics.end_ns - statistics.begin_ns));
  queue_times_.Add(Duration(statistics.queued_ns));
  for (const RankReport& report : statistics.reports) {
    AddTimes(stage_ns_, report.stage_ns);
    voxel_bytes_ += report.voxel_bytes;
    stored_bytes_ += report.stored_bytes;
    image_bytes_ += report.image_bytes;
  }
}

std::string CoordinatorMetrics::Text(const std::function<void()>& wake) {
  const auto [frames, datasets] = now.Get(wake);
  RefusedRequests refused = frames.refused;
  refused += datasets.refused;
  const auto gauge = [](std::size_t value) { return std::uint64_t{value}; };

  const std::lock_guard lock(mutex_);
  Exposition out;
  out.Family("coordinator_frames_total", MetricType::kCounter, "Frames that have ended, by their result.");
  out.Value(frames.frames_done, {{"result", "done"}});
  out.Value(frames.frames_failed, {{"result", "failed"}});
  out.Value(frames.frames_cancelled, {{"result", "cancelled"}});
  AddRefused(out, "coordinator_refused_total", "Requests that were refused, by the reason.", refused);
  out.Single("coordinator_queued_frames", MetricType::kGauge, "Frames that wait.", gauge(frames.queued));
  out.Single("coordinator_running_frames", MetricType::kGauge, "Frames that workers have parts of.", gauge(frames.running));
  out.Single("coordinator_clients", MetricType::kGauge, "Clients that are known.", gauge(frames.clients));
  out.Family("coordinator_workers", MetricType::kGauge, "Workers by state: ready for frames, or leaving.");
  out.Value(gauge(frames.workers_staying), {{"state", "ready"}});
  out.Value(gauge(frames.workers_leaving), {{"state", "leaving"}});
  out.Single("coordinator_vacant_slots", MetricType::kGauge, "Slots of workers that have gone, kept for others for a while.",
             gauge(frames.slots_vacant));
  out.Single("coordinator_workers_lost_total", MetricType::kCounter, "Workers that have gone without notice.", frames.workers_lost);
  out.Family("coordinator_frame_seconds", MetricType::kHistogram, "From a frame's request to the last byte of its picture.");
  out.Histogram(frame_times_);
  out.Family("coordinator_queue_seconds", MetricType::kHistogram, "From a frame's request to its start.");
  out.Histogram(queue_times_);
  AddStageSeconds(out, "coordinator_stage_seconds_total", "Time of workers for frames, by stage; render contains others.", stage_ns_);
  out.Family("coordinator_bytes_total", MetricType::kCounter,
             "Bytes for frames by plane: voxels to workers, what was read from stores for them, images between workers.");
  out.Value(voxel_bytes_, {{"plane", "voxels"}});
  out.Value(stored_bytes_, {{"plane", "stores"}});
  out.Value(image_bytes_, {{"plane", "images"}});
  out.Family("coordinator_datasets", MetricType::kGauge, "Datasets of the catalogue by state.");
  out.Value(gauge(datasets.unloaded), {{"state", "unloaded"}});
  out.Value(gauge(datasets.loading), {{"state", "loading"}});
  out.Value(gauge(datasets.ready), {{"state", "ready"}});
  out.Value(gauge(datasets.failed), {{"state", "failed"}});
  out.Single("coordinator_voxel_bytes", MetricType::kGauge, "Voxels in the memory of the coordinator.", datasets.voxel_bytes);
  AddWebTraffic(out, {"coordinator_web_requests_total", "coordinator_web_bytes_total", "coordinator_web_seconds_total"},
                HttpTransfers::TrafficOfProcess());
  AddProcess(out, memory_limit_);
  return out.Take();
}

}  // namespace slabstream
