#include "client/cli/progress_display.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>

namespace slabstream {

ProgressDisplay::ProgressDisplay(bool wanted, int frame_count, const std::string& label)
    : wanted_(wanted), terminal_(::isatty(STDERR_FILENO) == 1), label_(label.empty() ? "" : label + ": "), frame_count_(frame_count) {}

ProgressDisplay::~ProgressDisplay() {
  if (terminal_ && !last_.empty()) std::cerr << "\r\033[K" << std::flush;
}

void ProgressDisplay::Show(int frame, const FrameProgress& progress) {
  const double part = progress.group_count == 0 ? 0 : double(progress.groups_done) / progress.group_count;
  Draw(frames_done_ + part, fmt::format("{}frame {} of {}: {}", label_, frame + 1, frame_count_, Describe(progress)));
}

void ProgressDisplay::FrameDone(int frame) {
  ++frames_done_;
  Draw(frames_done_, fmt::format("{}frame {} of {}: done", label_, frame + 1, frame_count_));
}

void ProgressDisplay::Draw(double done, const std::string& text) {
  if (!wanted_ || text == last_) return;
  last_ = text;
  if (!terminal_) {
    std::cerr << text << std::endl;
    return;
  }
  constexpr int kWidth = 30;  // characters
  const int filled = std::clamp(int(std::lround(kWidth * done / frame_count_)), 0, kWidth);
  std::cerr << fmt::format("\r\033[K[{:=<{}}{:.<{}}] {}", "", filled, "", kWidth - filled, text) << std::flush;
}

std::string Describe(const FrameProgress& progress) {
  switch (progress.phase) {
    case FramePhase::kQueued: return fmt::format("queued, {} before it", progress.queue_position);
    case FramePhase::kLoading: return "loading the volume";
    case FramePhase::kRunning: break;
  }
  std::string text = fmt::format("{} of {} groups, {} workers", progress.groups_done, progress.group_count, progress.workers);
  if (progress.attempt > 1) text += fmt::format(", attempt {}", progress.attempt);
  return text;
}

}  // namespace slabstream
