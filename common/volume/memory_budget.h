// How much memory a volume may take: asked before anything is allocated, so that an absurd header or flag ends in one line and not in the
// kernel's out-of-memory killer.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/base/status.h"

namespace slabstream {

// Bytes that this process can still take without swapping: the system's available memory, or less if its control group allows less.
// The largest int64 if neither can be read.
std::int64_t AvailableMemoryBytes();

// ResourceExhausted naming `what`, the bytes needed and the bytes there are.
Status CheckFitsMemory(std::int64_t bytes, std::string_view what);

}  // namespace slabstream
