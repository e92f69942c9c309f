// Limits of this process, for the message about memory or threads that it did not get.
#pragma once

#include <string>

namespace slabstream {

enum class Scarce { kMemory, kThreads };

// "; this process may have 200000 KiB of data (ulimit -d)": the limits that somebody has set and that may be the reason. Empty: none is
// set.
std::string LimitsOf(Scarce what);

}  // namespace slabstream
