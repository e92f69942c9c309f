#include "worker/service/worker_metrics.h"

#include "common/metrics/process_metrics.h"
#include "common/metrics/service_metrics.h"
#include "data/stores/http_transfers.h"

namespace slabstream {

void WorkerMetrics::Count(const WorkerEvent& event) {
  const std::lock_guard lock(mutex_);
  if (const auto* render = std::get_if<RenderDone>(&event)) {
    if (render->status.code() == StatusCode::kCancelled) {
      ++cancelled_;
    } else if (!render->status.ok()) {
      ++failed_;
    } else {
      ++rendered_;
      render_times_.Add(Duration(render->report.stage_ns[std::size_t(Stage::kRender)]));
      AddTimes(stage_ns_, render->report.stage_ns);
    }
  } else if (const auto* combine = std::get_if<CombineDone>(&event)) {
    const Duration time(combine->span.end_ns - combine->span.begin_ns);
    combine_times_.Add(time);
    stage_ns_[std::size_t(Stage::kCombine)] += time.count();
  } else if (const auto* stored = std::get_if<ChunkStored>(&event)) {
    stored_bytes_ += stored->stored_bytes;
  }
}

void WorkerMetrics::CountSent(Plane plane, std::size_t bytes, bool has_left) {
  const std::lock_guard lock(mutex_);
  if (!has_left) {
    ++unsent_;
    return;
  }
  (plane == Plane::kImages ? image_bytes_ : picture_bytes_) += bytes;
}

std::string WorkerMetrics::Text(const std::function<void()>& wake) {
  const WorkerCounts counts = now.Get(wake);
  const std::lock_guard lock(mutex_);
  Exposition out;
  out.Single("worker_registered", MetricType::kGauge, "1 while a coordinator has this worker.", std::uint64_t{counts.registered});
  out.Single("worker_leaving", MetricType::kGauge, "1 once it takes no new frames.", std::uint64_t{counts.leaving});
  out.Single("worker_frames", MetricType::kGauge, "Frames that it has a part in.", std::uint64_t{counts.sizes.frames});
  out.Single("worker_queued_boxes", MetricType::kGauge, "Boxes that wait for a thread or are rendered.",
             std::uint64_t{counts.sizes.renders});
  out.Single("worker_chunk_requests", MetricType::kGauge, "Parts of boxes that it waits for.", std::uint64_t{counts.sizes.chunk_requests});
  out.Family("worker_boxes_total", MetricType::kCounter, "Boxes of frames that have ended, by their result.");
  out.Value(rendered_, {{"result", "done"}});
  out.Value(failed_, {{"result", "failed"}});
  out.Value(cancelled_, {{"result", "cancelled"}});
  out.Family("worker_render_seconds", MetricType::kHistogram, "Time to render a box.");
  out.Histogram(render_times_);
  out.Family("worker_combine_seconds", MetricType::kHistogram, "Time to combine two images.");
  out.Histogram(combine_times_);
  AddStageSeconds(out, "worker_stage_seconds_total", "Time by stage; render contains others.", stage_ns_);
  out.Single("worker_cached_bytes", MetricType::kGauge, "Voxels that it keeps, and what was made from them.", counts.cached_bytes);
  out.Single("worker_fetched_bytes_total", MetricType::kCounter, "Voxels that it has received or read.", counts.fetched_bytes);
  out.Single("worker_store_bytes_total", MetricType::kCounter, "Bytes that it has read from stores itself, as they are stored.",
             stored_bytes_);
  out.Family(
      "worker_sent_bytes_total", MetricType::kCounter,
      "Bytes over sockets by plane: images to workers (also tiles of shapes; not images in shared memory), pictures to the coordinator.");
  out.Value(image_bytes_, {{"plane", "images"}});
  out.Value(picture_bytes_, {{"plane", "pictures"}});
  out.Single("worker_unsent_total", MetricType::kCounter, "Images and pictures that could not be sent.", unsent_);
  AddWebTraffic(out, {"worker_web_requests_total", "worker_web_bytes_total", "worker_web_seconds_total"},
                HttpTransfers::TrafficOfProcess());
  AddProcess(out, memory_limit_);
  return out.Take();
}

}  // namespace slabstream
