// WorkerMetrics: what a worker measures, as text for Prometheus (docs/on-servers.md). The thread of the machine calls Count,
// CountSent and now.Set; any thread calls Text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

#include "common/metrics/exposition.h"
#include "common/metrics/snapshot.h"
#include "common/stats/report.h"
#include "common/wire/any_message.h"
#include "worker/machine/worker_machine.h"

namespace slabstream {

class WorkerMetrics {
 public:
  explicit WorkerMetrics(std::uint64_t memory_limit) : memory_limit_(memory_limit) {}

  void Count(const WorkerEvent& event);                           // counts what the executor has done
  void CountSent(Plane plane, std::size_t bytes, bool has_left);  // a payload: kImages, to a worker; kPictures, to a client

  Snapshot<WorkerCounts> now;

  std::string Text(const std::function<void()>& wake);  // the metrics' text; `wake` is that of Snapshot

 private:
  const std::uint64_t memory_limit_;  // 0: none
  mutable std::mutex mutex_;
  TimeHistogram render_times_, combine_times_;
  StageTimes stage_ns_{};
  std::uint64_t rendered_ = 0, failed_ = 0, cancelled_ = 0;
  std::uint64_t stored_bytes_ = 0, image_bytes_ = 0, picture_bytes_ = 0, unsent_ = 0;
};

}  // namespace slabstream
