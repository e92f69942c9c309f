// ReadProgress: how much of a volume's samples has been read, and how fast. Readers count, and whoever waits is told each whole percent
// once.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <utility>

#include "common/base/read_share.h"
#include "common/base/time.h"

namespace slabstream {

using TellRead = std::function<void(const ReadShare&)>;

class ReadProgress {
 public:
  // `tell`, if any, is called by the thread that reads, with percents that rise.
  explicit ReadProgress(TellRead tell) : tell_(std::move(tell)) {}

  // Before the first sample is read: so many bytes of samples are to come. Again for something else that is read after it: only what is
  // beyond the percents that were told is told then.
  void Begin(std::int64_t bytes) {
    expected_ = bytes;
    read_ = 0;
    begun_ = MonotonicNow();
  }
  void Add(std::int64_t bytes) {
    read_ += bytes;
    const int percent = expected_ > 0 ? int(100.0 * double(std::min(read_, expected_)) / double(expected_)) : 0;
    if (percent <= told_) return;
    told_ = percent;
    const double seconds = std::chrono::duration<double>(MonotonicNow() - begun_).count();
    if (tell_) tell_({percent, std::uint64_t(double(read_) / std::max(seconds, 1e-6))});
  }

 private:
  TellRead tell_;
  std::int64_t expected_ = 0, read_ = 0;
  int told_ = 0;
  Time begun_{};
};

}  // namespace slabstream
