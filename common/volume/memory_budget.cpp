#include "common/volume/memory_budget.h"

#include <fmt/format.h>

#include <atomic>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>

#include "common/memory/large_buffers.h"
#include "common/text/parse_number.h"

namespace slabstream {
namespace {

constexpr std::int64_t kUnlimited = std::numeric_limits<std::int64_t>::max();

constexpr std::int64_t kMebi = 1 << 20;

// First number of a file such as a control group's memory.max; kUnlimited if there is none ("max", no such file).
std::int64_t NumberIn(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::int64_t value = 0;
  return file >> value ? value : kUnlimited;
}

// Of /proc/meminfo.
std::int64_t SystemBytes(std::string_view wanted) {
  std::ifstream meminfo("/proc/meminfo");
  std::string key, unit;
  std::int64_t kibibytes = 0;
  while (meminfo >> key >> kibibytes) {
    if (key == wanted) return kibibytes * 1024;
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

std::atomic<std::int64_t> own_limit = kUnlimited;

std::int64_t OwnAvailableBytes() {
  const std::int64_t limit = own_limit;
  return limit == kUnlimited ? kUnlimited : std::max<std::int64_t>(0, limit - std::int64_t(ResidentBytes()));
}

}  // namespace

void LimitMemory(std::uint64_t bytes) { own_limit = std::int64_t(bytes); }

std::int64_t AvailableMemoryBytes() { return std::min({SystemBytes("MemAvailable:"), ControlGroupAvailableBytes(), OwnAvailableBytes()}); }

Status CheckFitsMemory(std::int64_t bytes, std::string_view what) {
  std::int64_t available = AvailableMemoryBytes();
  if (bytes <= available) return Status::Ok();
  ReleaseFreeMemory();
  available = AvailableMemoryBytes();
  if (bytes <= available) return Status::Ok();
  return Status::ResourceExhausted(
      fmt::format("{} needs {} MiB of memory, but only {} MiB are available", what, bytes / kMebi, available / kMebi));
}

std::string MemoryText(std::uint64_t bytes) { return fmt::format("{} MiB", (bytes + kMebi - 1) / kMebi); }

Result<std::uint64_t> ParseMemoryLimit(const std::string& option, const std::string& text) {
  constexpr std::string_view kUnits[] = {"M", "G", "T"};
  const auto checked = [&](std::uint64_t bytes) -> Result<std::uint64_t> {
    if (bytes >= kLeastMemoryBytes && bytes <= kMostMemoryBytes) return bytes;
    return Status::InvalidArgument(
        fmt::format("{} {} is out of range [{}M, {}T]", option, text, kLeastMemoryBytes >> 20, kMostMemoryBytes >> 40));
  };
  if (text.starts_with("1/")) {
    const std::optional<std::uint64_t> parts = ParseNumber<std::uint64_t>(std::string_view(text).substr(2));
    if (parts && *parts > 0) return checked(MachineMemoryBytes() / *parts);
  }
  const std::string_view short_text = text.ends_with("iB") ? std::string_view(text).substr(0, text.size() - 2) : text;
  for (std::size_t i = 0; i < std::size(kUnits); ++i) {
    if (!short_text.ends_with(kUnits[i])) continue;
    const std::optional<std::uint64_t> count = ParseNumber<std::uint64_t>(short_text.substr(0, short_text.size() - 1));
    if (!count) break;
    const int shift = 20 + 10 * int(i);
    return checked(*count <= kMostMemoryBytes >> shift ? *count << shift : UINT64_MAX);
  }
  return Status::InvalidArgument(
      fmt::format("{} '{}' is not a size such as 512M or 4G, nor a part of the machine such as 1/4", option, text));
}

// Lines "0::/path" of version 2, "7:memory:/path" of version 1. In a container the path may not exist below the mount: then the mount
// itself is the container's group.
std::int64_t ControlGroupLimit(const std::string& memberships, const std::filesystem::path& mounted) {
  std::int64_t least = kUnlimited;
  std::istringstream lines(memberships);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = fmt::format(",{},", line.substr(first + 1, second - first - 1));
    const bool second_version = controllers == ",,";
    if (!second_version && controllers.find(",memory,") == std::string::npos) continue;
    const std::filesystem::path root = second_version ? mounted : mounted / "memory";
    for (std::filesystem::path group = line.substr(second + 1); !group.empty(); group = group.parent_path()) {
      least = std::min(least, NumberIn(root / group.relative_path() / (second_version ? "memory.max" : "memory.limit_in_bytes")));
      if (group == group.parent_path()) break;
    }
  }
  return least;
}

std::uint64_t MachineMemoryBytes() {
  std::ostringstream memberships;
  memberships << std::ifstream("/proc/self/cgroup").rdbuf();
  return std::uint64_t(std::min(SystemBytes("MemTotal:"), ControlGroupLimit(memberships.str(), "/sys/fs/cgroup")));
}

Result<MemoryShares> ShareMemory(std::uint64_t bytes, int workers) {
  const MemoryShares shares{.coordinator = bytes / 3, .worker = (bytes - bytes / 3) / std::uint64_t(workers)};
  if (std::min(shares.coordinator, shares.worker) >= kLeastMemoryBytes) return shares;
  const std::uint64_t least = std::uint64_t(std::max(workers, 2)) * kLeastMemoryBytes * 3 / 2;
  return Status::InvalidArgument(fmt::format("memory {} is too little for a coordinator and {} workers, which need {}", MemoryText(bytes),
                                             workers, MemoryText(least)));
}

std::uint64_t DefaultServiceMemory() { return MachineMemoryBytes() / 4 * 3; }

MemoryShares DefaultMemory() {
  const std::uint64_t machine = MachineMemoryBytes();
  return {.coordinator = std::max(machine / 4, kLeastMemoryBytes), .worker = std::max(machine / 2, kLeastMemoryBytes)};
}

}  // namespace slabstream
