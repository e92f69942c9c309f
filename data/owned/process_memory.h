// Samples in the memory of another process of this host, or of this one, copied by the kernel: whatever has become of that memory or that
// process, the copy fails and nothing else does.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/status.h"
#include "data/sources/copy_samples.h"

namespace slabstream {

// Unavailable: the process has ended, has no such memory, or the system does not let this process read it.
Status ReadProcessMemory(std::uint32_t pid, std::uint64_t address, std::span<std::byte> out);

// CopySamples from address `first` of a process; steps are at least 1. Errors of ReadProcessMemory.
Status CopyProcessSamples(std::uint32_t pid, SampleType type, std::uint64_t first, const std::array<std::int64_t, 3>& steps,
                          const Index3& count, const BoxRoom& to);

// Lets other processes of this user read this one's memory where the system asks for the process' consent.
void LetProcessesReadMemory();

}  // namespace slabstream
