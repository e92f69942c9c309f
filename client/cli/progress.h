// Progress: of frames and of reading in words, of any work as a bar on stderr.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "client/cli/interrupt.h"
#include "common/base/read_share.h"
#include "common/transport/socket.h"
#include "common/wire/client_messages.h"

namespace slabstream {

// "queued, 2 before it", "reading scan.nii.gz: 45 % (310 MiB/s)", "3 of 7 groups, 4 workers, attempt 2".
std::string Describe(const FrameProgress& progress, const std::string& source);
// "reading scan.nii.gz: 45 % (310 MiB/s)". `source`: a path with options, or the name of a dataset.
std::string Describe(const ReadShare& read, const std::string& source);

// On a terminal, a bar that is redrawn; otherwise a line for each change.
class ProgressBar {
 public:
  ProgressBar(bool wanted, double total);  // total > 0: the value of `done` at the end
  ~ProgressBar() { Clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Show(double done, const std::string& text);
  void Clear();  // before other output on a terminal

 private:
  bool wanted_, terminal_;
  double total_;
  std::string last_;  // the last text, so that nothing is printed twice
};

// A bar for work on many bytes: "reading scan.nrrd: 45 % of 2048 MiB (310 MiB/s)". What was done before the first call of Show does not
// count for the rate. Ctrl-C stops the work.
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
