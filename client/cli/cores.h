// The cores of this machine, and the default number of threads of a worker.
#pragma once

#include <algorithm>
#include <thread>

#include "client/cli/options.h"

namespace slabstream {

inline int CoreCount() { return std::max(1, int(std::thread::hardware_concurrency())); }

// Threads for each of `workers`, so that together they use all cores; at least 1.
inline int CoreShare(int workers) { return std::max(1, CoreCount() / workers); }

// Render threads of each worker of --local.
inline int LocalThreads(const ConnectionOptions& connection) {
  return connection.local_threads > 0 ? connection.local_threads : CoreShare(connection.local_workers);
}

}  // namespace slabstream
