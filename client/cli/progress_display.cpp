#include "client/cli/progress_display.h"

#include <fmt/format.h>

namespace slabstream {

ProgressDisplay::ProgressDisplay(bool wanted, int frame_count, const std::string& label)
    : bar_(wanted, frame_count), label_(label.empty() ? "" : label + ": "), frame_count_(frame_count) {}

void ProgressDisplay::Show(int frame, const FrameProgress& progress) {
  const double part = progress.group_count == 0 ? 0 : double(progress.groups_done) / progress.group_count;
  bar_.Show(frames_done_ + part, fmt::format("{}frame {} of {}: {}", label_, frame + 1, frame_count_, Describe(progress)));
}

void ProgressDisplay::FrameDone(int frame) {
  ++frames_done_;
  bar_.Show(frames_done_, fmt::format("{}frame {} of {}: done", label_, frame + 1, frame_count_));
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
