#include "data/zarr/shard_indices.h"

#include <cstring>
#include <limits>

namespace slabstream::zarr {
namespace {

constexpr std::uint64_t kEntryBytes = 256;  // of an entry beside its index and its name, roughly

}  // namespace

std::optional<ByteRange> ShardIndex::Find(std::uint64_t chunk) const {
  constexpr std::uint64_t kMissing = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t begin = 0, bytes = 0;
  const std::byte* const pair = numbers_.span().data() + chunk * (sizeof begin + sizeof bytes);
  std::memcpy(&begin, pair, sizeof begin);
  std::memcpy(&bytes, pair + sizeof begin, sizeof bytes);
  return begin == kMissing && bytes == kMissing ? std::nullopt : std::optional(ByteRange{.begin = begin, .bytes = bytes});
}

bool ShardIndices::Ask(const std::string& shard, Done done) {
  Index known;
  {
    const std::lock_guard lock(mutex_);
    const Index* const found = known_.Find(shard);
    if (found == nullptr) {
      std::vector<Done>& waiting = waiting_[shard];
      waiting.push_back(std::move(done));
      return waiting.size() == 1;
    }
    known = *found;
  }
  done(std::move(known));
  return false;
}

void ShardIndices::Put(const std::string& shard, const Result<Index>& index) {
  std::vector<Done> waiting;
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = waiting_.find(shard); found != waiting_.end()) {
      waiting = std::move(found->second);
      waiting_.erase(found);
    }
    if (index.ok()) {
      known_.Put(shard, *index, kEntryBytes + shard.size() + (*index == nullptr ? 0 : (*index)->bytes()));
      known_.DropBeyond(most_bytes_);
      if (known_.weight() > most_bytes_) known_.Drop(shard);
    }
  }
  for (const Done& done : waiting) done(index);
}

void ShardIndices::Forget(const std::string& shard) {
  const std::lock_guard lock(mutex_);
  known_.Drop(shard);
}

std::uint64_t ShardIndices::bytes() const {
  const std::lock_guard lock(mutex_);
  return known_.weight();
}

}  // namespace slabstream::zarr
