#include "client/cli/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>

#include "common/base/printable.h"
#include "common/volume/memory_budget.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

std::string Describe(const FrameProgress& progress, const std::string& source) {
  switch (progress.phase) {
    case FramePhase::kQueued: return fmt::format("queued, {} before it", progress.queue_position);
    case FramePhase::kLoading: return Describe(ReadShare{int(progress.read_percent), progress.read_rate}, source);
    case FramePhase::kRunning: break;
  }
  std::string text = fmt::format("{} of {} groups, {} worker{}", progress.groups_done, progress.group_count, progress.workers,
                                 progress.workers == 1 ? "" : "s");
  if (progress.attempt > 1) text += fmt::format(", attempt {}", progress.attempt);
  return text;
}

std::string Describe(const ReadShare& read, const std::string& source) {
  const Result<SourceText> text = ParseSourceText(source);
  const std::string name = std::filesystem::path(text.ok() ? text->path : source).filename().string();
  const std::string reading = "reading " + (name.empty() ? "the volume" : Printable(name));
  return read.percent == 0 ? reading : fmt::format("{}: {} % ({} MiB/s)", reading, read.percent, read.bytes_per_second >> 20);
}

ProgressBar::ProgressBar(bool wanted, double total) : wanted_(wanted), terminal_(::isatty(STDERR_FILENO) == 1), total_(total) {}

void ProgressBar::Clear() {
  if (terminal_ && !last_.empty()) std::cerr << "\r\033[K" << std::flush;
  last_.clear();
}

void ProgressBar::Show(double done, const std::string& text) {
  if (!wanted_ || text == last_) return;
  last_ = text;
  if (!terminal_) {
    std::cerr << text << std::endl;
    return;
  }
  constexpr int kWidth = 30;  // characters
  const int filled = std::clamp(int(std::lround(kWidth * done / total_)), 0, kWidth);
  std::cerr << fmt::format("\r\033[K[{:=<{}}{:.<{}}] {}", "", filled, "", kWidth - filled, text) << std::flush;
}

void ByteProgress::Show(std::uint64_t done, std::uint64_t all) {
  if (guard_.interrupted()) stop_.request_stop();
  if (!done_before_) done_before_ = done;
  const int percent = int(100 * done / all);
  if (std::exchange(percent_, percent) == percent) return;
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  const auto rate = std::uint64_t(double(done - *done_before_) / std::max(seconds, 1e-9));
  bar_.Show(0.01 * percent, fmt::format("{}: {} % of {} ({} MiB/s)", what_, percent, MemoryText(all), rate >> 20));
}

}  // namespace slabstream
