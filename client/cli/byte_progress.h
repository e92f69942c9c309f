// ByteProgress: a bar for work on many bytes: "reading scan.nrrd: 45 % of 2048 MiB (310 MiB/s)". What was done before the first call of
// Show does not count for the rate. Ctrl-C stops the work.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "client/cli/interrupt.h"
#include "client/cli/progress_bar.h"
#include "common/transport/socket.h"

namespace slabstream {

class ByteProgress {
 public:
  // `what`: "reading scan.nrrd".
  ByteProgress(ProgressBar& bar, std::string what) : bar_(bar), what_(std::move(what)) {}

  void Show(std::uint64_t done, std::uint64_t all);           // all > 0
  int percent() const { return percent_; }                    // the percentage that was shown last; -1: nothing was
  std::stop_token stop() const { return stop_.get_token(); }  // Ctrl-C came before the last call of Show

 private:
  ProgressBar& bar_;
  const std::string what_;
  Wakeup wakeup_;
  const InterruptGuard guard_{wakeup_};
  std::stop_source stop_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::optional<std::uint64_t> done_before_;
  int percent_ = -1;
};

}  // namespace slabstream
