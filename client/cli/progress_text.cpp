#include "client/cli/progress_text.h"

#include <fmt/format.h>

#include <filesystem>

#include "common/base/printable.h"
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

}  // namespace slabstream
