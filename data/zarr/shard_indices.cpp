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
    const auto found = entries_.find(shard);
    if (found == entries_.end()) {
      std::vector<Done>& waiting = waiting_[shard];
      waiting.push_back(std::move(done));
      return waiting.size() == 1;
    }
    used_.splice(used_.begin(), used_, found->second.used);
    known = found->second.index;
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
      if (const auto old = entries_.find(shard); old != entries_.end()) Remove(old);
      used_.push_front(shard);
      const std::uint64_t bytes = kEntryBytes + 2 * shard.size() + (*index == nullptr ? 0 : (*index)->bytes());
      entries_[shard] = {*index, bytes, used_.begin()};
      bytes_ += bytes;
      while (bytes_ > most_bytes_ && !used_.empty()) Remove(entries_.find(used_.back()));
    }
  }
  for (const Done& done : waiting) done(index);
}

void ShardIndices::Forget(const std::string& shard) {
  const std::lock_guard lock(mutex_);
  if (const auto found = entries_.find(shard); found != entries_.end()) Remove(found);
}

void ShardIndices::Remove(std::unordered_map<std::string, Entry>::iterator entry) {
  bytes_ -= entry->second.bytes;
  used_.erase(entry->second.used);
  entries_.erase(entry);
}

std::uint64_t ShardIndices::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace slabstream::zarr
