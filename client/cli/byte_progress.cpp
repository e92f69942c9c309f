#include "client/cli/byte_progress.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/volume/memory_budget.h"

namespace slabstream {

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
