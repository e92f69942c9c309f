// The cores of this machine, and how workers share them if nobody says it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <thread>

#include "client/cli/options.h"

namespace slabstream {

inline int CoreCount() { return std::max(1, int(std::thread::hardware_concurrency())); }

// With less memory for each, workers read small boxes of large volumes, which are mostly halo.
inline constexpr std::uint64_t kMemoryOfAWorker = std::uint64_t{1} << 30;
// Workers that share `memory` bytes (0: no limit) without being short of it: at most `most`, at least 1.
inline int WorkersWithin(std::uint64_t memory, int most) {
  return memory == 0 ? most : int(std::clamp(memory / kMemoryOfAWorker, std::uint64_t{1}, std::uint64_t(most)));
}

// The threads of one worker draw one image together, while images of several workers must be combined. A task of splatting is 64 rows, so a
// picture of 1024 rows keeps this many threads busy.
inline constexpr int kThreadsOfAWorker = 8;
// Workers for the pictures of one user.
inline int WorkersForOneUser() { return (CoreCount() + kThreadsOfAWorker - 1) / kThreadsOfAWorker; }

// Threads for each of `workers`, so that together they use all cores; at least 1.
inline int CoreShare(int workers) { return std::max(1, CoreCount() / workers); }

// Render threads of each worker of --local.
inline int LocalThreads(const ConnectionOptions& connection) {
  return connection.local_threads > 0 ? connection.local_threads : CoreShare(connection.local_workers);
}

}  // namespace slabstream
