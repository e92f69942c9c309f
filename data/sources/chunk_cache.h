// ChunkCache: decoded chunks of all sources of a process that may be needed again, within a budget of bytes; the one that was unused for
// longest goes first. Any thread.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>

#include "common/base/lru_map.h"
#include "common/memory/bytes.h"

namespace slabstream {

class ChunkCache {
 public:
  explicit ChunkCache(std::uint64_t most_bytes) : most_bytes_(most_bytes) {}
  ChunkCache(const ChunkCache&) = delete;
  ChunkCache& operator=(const ChunkCache&) = delete;

  using Owner = std::uint64_t;  // an array that is open
  Owner NewOwner();
  void Forget(Owner owner);  // drops all its chunks

  std::optional<Bytes> Find(Owner owner, std::uint64_t chunk);
  void Keep(Owner owner, std::uint64_t chunk, const Bytes& elements);  // unless it is larger than the whole budget

  std::uint64_t bytes() const;  // bytes that it holds

 private:
  using Key = std::pair<Owner, std::uint64_t>;
  const std::uint64_t most_bytes_;
  mutable std::mutex mutex_;  // guards what follows
  Owner last_owner_ = 0;
  LruMap<Key, Bytes> chunks_;
};

}  // namespace slabstream
