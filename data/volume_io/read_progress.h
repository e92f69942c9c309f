// ReadProgress: how much of a volume's samples has been read. Readers count, and whoever waits is told each whole percent once.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>

namespace slabstream {

class ReadProgress {
 public:
  // `tell` is called by the thread that reads, with numbers in [1, 100] that rise.
  explicit ReadProgress(std::function<void(int percent)> tell) : tell_(std::move(tell)) {}

  // Before the first sample is read: so many bytes of samples are to come.
  void Begin(std::int64_t bytes) {
    expected_ = bytes;
    read_ = told_ = 0;
  }
  void Add(std::int64_t bytes) {
    read_ += bytes;
    const int percent = expected_ > 0 ? int(100.0 * double(std::min(read_, expected_)) / double(expected_)) : 0;
    if (percent > told_) tell_(told_ = percent);
  }

 private:
  std::function<void(int percent)> tell_;
  std::int64_t expected_ = 0, read_ = 0;
  int told_ = 0;
};

}  // namespace slabstream
