#include "common/volume/memory_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

namespace slabstream {
namespace {

constexpr std::int64_t kUnlimited = std::numeric_limits<std::int64_t>::max();

// First number of a file such as a control group's memory.max; kUnlimited if there is none ("max", no such file).
std::int64_t NumberIn(const char* path) {
  std::ifstream file(path);
  std::int64_t value = 0;
  return file >> value ? value : kUnlimited;
}

std::int64_t SystemAvailableBytes() {
  std::ifstream meminfo("/proc/meminfo");
  std::string key, unit;
  std::int64_t kibibytes = 0;
  while (meminfo >> key >> kibibytes) {
    if (key == "MemAvailable:") return kibibytes * 1024;
    std::getline(meminfo, unit);
  }
  return kUnlimited;
}

std::int64_t ControlGroupAvailableBytes() {
  const std::int64_t limit = NumberIn("/sys/fs/cgroup/memory.max");
  const std::int64_t used = NumberIn("/sys/fs/cgroup/memory.current");
  if (limit == kUnlimited || used == kUnlimited) return kUnlimited;
  return std::max<std::int64_t>(0, limit - used);
}

}  // namespace

std::int64_t AvailableMemoryBytes() { return std::min(SystemAvailableBytes(), ControlGroupAvailableBytes()); }

Status CheckFitsMemory(std::int64_t bytes, std::string_view what) {
  const std::int64_t available = AvailableMemoryBytes();
  if (bytes <= available) return Status::Ok();
  constexpr std::int64_t kMebi = 1 << 20;
  return Status::ResourceExhausted(
      fmt::format("{} needs {} MiB of memory, but only {} MiB are available", what, bytes / kMebi, available / kMebi));
}

}  // namespace slabstream
