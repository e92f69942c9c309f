// BoxReading: a read of a box under way, which ends when all its parts have ended, whatever threads they end on.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <stop_token>
#include <utility>

#include "common/base/status.h"
#include "common/volume/box.h"
#include "data/sources/volume_source.h"

namespace slabstream {

class BoxReading {
 public:
  // Has one part from the beginning: that of who looks for the others.
  BoxReading(const Box& box, const BoxRoom& out, std::stop_token stop, VolumeSource::ReadDone done)
      : box_(box), out_(out), stop_(std::move(stop)), done_(std::move(done)) {}

  const Box& box() const { return box_; }
  const BoxRoom& out() const { return out_; }
  const std::stop_token& stop() const { return stop_; }
  // Whether its parts are still wanted.
  bool goes_on() const { return !failed_ && !stop_.stop_requested(); }

  // The first failure is what the read ends with.
  void Fail(Status status) {
    const std::lock_guard lock(mutex_);
    if (failure_.ok()) failure_ = std::move(status);
    failed_ = true;
  }
  void GiveUp() { Fail(Status::Cancelled("reading was stopped")); }

  void BeginPart() { ++parts_; }
  void EndPart() {
    if (--parts_ == 0) done_(std::move(failure_));  // of the thread that is last
  }

 private:
  const Box box_;
  const BoxRoom out_;
  const std::stop_token stop_;
  const VolumeSource::ReadDone done_;
  std::atomic<std::int64_t> parts_ = 1;  // that have not ended
  std::atomic<bool> failed_ = false;
  std::mutex mutex_;
  Status failure_;
};

}  // namespace slabstream
