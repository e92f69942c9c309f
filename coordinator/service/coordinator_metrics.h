// CoordinatorMetrics: what a coordinator measures, as text for Prometheus (docs/on-servers.md). The thread of the machines calls
// CountFrame and now.Set; any thread calls Text.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

#include "common/metrics/exposition.h"
#include "common/metrics/snapshot.h"
#include "common/stats/report.h"
#include "common/wire/client_messages.h"
#include "coordinator/datasets/dataset_machine.h"
#include "coordinator/frames/frame_machine.h"

namespace slabstream {

class CoordinatorMetrics {
 public:
  explicit CoordinatorMetrics(std::uint64_t memory_limit) : memory_limit_(memory_limit) {}

  // A frame was made.
  void CountFrame(const FrameStatistics& statistics);

  struct Machines {
    FrameCounts frames;
    DatasetCounts datasets;
  };
  Snapshot<Machines> now;

  std::string Text(const std::function<void()>& wake);  // the metrics' text; `wake` is that of Snapshot

 private:
  const std::uint64_t memory_limit_;  // 0: none
  mutable std::mutex mutex_;
  TimeHistogram frame_times_, queue_times_;
  StageTimes stage_ns_{};
  std::uint64_t voxel_bytes_ = 0, stored_bytes_ = 0, image_bytes_ = 0;
};

}  // namespace slabstream
