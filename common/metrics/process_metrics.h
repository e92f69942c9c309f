// What every process tells of itself, from /proc.
#pragma once

#include <cstdint>

#include "common/metrics/exposition.h"

namespace slabstream {

// `memory_limit`: bytes that the process may take (--memory); 0: there is none. What the system does not tell is left out.
void AddProcess(Exposition& out, std::uint64_t memory_limit);

}  // namespace slabstream
