// ShardIndices: where the chunks of shards lie. Each index is read once, however many chunks are asked for at a time; the last ones that
// were used are kept. Any thread.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/base/lru_map.h"
#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "data/stores/store.h"

namespace slabstream::zarr {

class ShardIndex {
 public:
  // Pairs of numbers of 64 bits in this machine's byte order, one for each chunk.
  explicit ShardIndex(Bytes numbers) : numbers_(std::move(numbers)) {}

  // nullopt: the chunk is not there.
  std::optional<ByteRange> Find(std::uint64_t chunk) const;
  std::uint64_t bytes() const { return numbers_.size(); }

 private:
  Bytes numbers_;
};

class ShardIndices {
 public:
  using Index = std::shared_ptr<const ShardIndex>;  // null: there is no such shard
  using Done = std::function<void(Result<Index>)>;

  explicit ShardIndices(std::uint64_t most_bytes) : most_bytes_(most_bytes) {}

  // Calls `done` exactly once: now if the index is known, else by the call of Put that brings it. True: nobody is reading it yet, so the
  // caller must, and call Put.
  bool Ask(const std::string& shard, Done done);
  // Tells everybody who asked. Failures are not kept.
  void Put(const std::string& shard, const Result<Index>& index);
  // So that it is read anew: it was wrong.
  void Forget(const std::string& shard);

  std::uint64_t bytes() const;  // bytes that are kept

 private:
  const std::uint64_t most_bytes_;
  mutable std::mutex mutex_;  // guards what follows
  std::unordered_map<std::string, std::vector<Done>> waiting_;
  LruMap<std::string, Index> known_;  // by shard
};

}  // namespace slabstream::zarr
