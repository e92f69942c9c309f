// How much memory a volume may take: asked before anything is allocated, so that an absurd header or flag ends in one line and not in the
// kernel's out-of-memory killer. And how much a process of the service may take in all (--memory): shares of the machine.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace slabstream {

// Bytes that this process can still take without swapping: the system's available memory, or less if its control group or its own limit
// allows less. The largest int64 if none can be read.
std::int64_t AvailableMemoryBytes();

// This process' own limit: of what it holds in memory at a time. Without a call there is none. Any thread.
void LimitMemory(std::uint64_t bytes);

// ResourceExhausted naming `what`, the bytes needed and the bytes there are.
Status CheckFitsMemory(std::int64_t bytes, std::string_view what);

// "512 MiB", rounded up to whole MiB.
std::string MemoryText(std::uint64_t bytes);

// What the machine has for this process: its memory, or less if a control group that the process is in, or one above, allows less. The
// largest int64 if neither can be read.
std::uint64_t MachineMemoryBytes();

// The least limit of the control groups of a process, in either version: `memberships` is the text of its /proc/PID/cgroup, `mounted` the
// folder in which control groups are mounted. The largest int64: none limits it.
std::int64_t ControlGroupLimit(const std::string& memberships, const std::filesystem::path& mounted);

// What a process of the service takes before it does anything, with its threads and the blocks that it keeps for reuse (KeepBlocks,
// common/memory/large_buffers.h): a sixteenth of its limit, at least half of kIdleMemoryBytes.
inline constexpr std::uint64_t kIdleMemoryBytes = std::uint64_t{192} << 20;
inline constexpr std::uint64_t KeptBytes(std::uint64_t limit) { return std::max(kIdleMemoryBytes / 2, limit / 16); }
inline constexpr std::uint64_t IdleMemoryBytes(std::uint64_t limit) { return kIdleMemoryBytes / 2 + KeptBytes(limit); }
// The part of a process's limit for chunks that it reads and decodes, if it does.
inline constexpr std::uint64_t SourceBytes(std::uint64_t limit) { return limit > kIdleMemoryBytes ? (limit - kIdleMemoryBytes) / 4 : 0; }
// Limits of a process that may be stated.
inline constexpr std::uint64_t kLeastMemoryBytes = std::uint64_t{256} << 20, kMostMemoryBytes = std::uint64_t{1} << 50;

// A limit of a process: a whole number with one of the units M, G, T, or MiB, GiB, TiB, which mean the same: powers of 1024 bytes. Or a
// part of what the machine has, as 1/4. InvalidArgument, naming `option`: the text is no such number, or it is out of [kLeastMemoryBytes,
// kMostMemoryBytes].
Result<std::uint64_t> ParseMemoryLimit(const std::string& option, const std::string& text);

// The limits of the processes of a service on one machine.
struct MemoryShares {
  std::uint64_t coordinator = 0, worker = 0;  // bytes of each
};
// A third for the coordinator, the rest for `workers` >= 1 workers in equal parts. InvalidArgument: less than kLeastMemoryBytes for one.
Result<MemoryShares> ShareMemory(std::uint64_t bytes, int workers);

// The part of a coordinator's limit for the voxels of datasets. 0: there is no limit.
inline constexpr std::uint64_t DatasetShare(std::uint64_t limit) { return limit == 0 ? UINT64_MAX : limit / 4 * 3; }

// Without --memory a service takes three quarters of its machine. A coordinator or a worker that is started by itself takes what
// ShareMemory would give it beside one of the other kind, but at least kLeastMemoryBytes.
std::uint64_t DefaultServiceMemory();
MemoryShares DefaultMemory();

}  // namespace slabstream
