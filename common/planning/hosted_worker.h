// HostedWorker: what the choice of an open policy needs to know about a worker.
#pragma once

#include <cstdint>

namespace slabstream {

struct HostedWorker {
  std::uint64_t memory_scope = 0;  // workers of the same scope share a host and read each other's memory (SharedMemoryScope); 0: unknown
  bool lends_memory = true;        // workers of its scope read its images in place; otherwise it sends them in messages
  std::uint32_t threads = 1;       // render threads
  std::uint32_t pid = 0;           // process id: the workers of one process share their threads to make pictures; 0: unknown
  std::uint64_t memory_bytes = 0;  // limit of its memory; 0: it has stated none
  friend bool operator==(const HostedWorker&, const HostedWorker&) = default;
};

}  // namespace slabstream
