#include "data/sources/chunk_cache.h"

#include <limits>

namespace slabstream {

ChunkCache::Owner ChunkCache::NewOwner() {
  const std::lock_guard lock(mutex_);
  return ++last_owner_;
}

void ChunkCache::Forget(Owner owner) {
  LruMap<Key, Bytes>::Entries dropped;  // destroyed without the lock
  const std::lock_guard lock(mutex_);
  dropped = chunks_.DropBetween({owner, 0}, {owner, std::numeric_limits<std::uint64_t>::max()});
}

std::optional<Bytes> ChunkCache::Find(Owner owner, std::uint64_t chunk) {
  const std::lock_guard lock(mutex_);
  const Bytes* const found = chunks_.Find({owner, chunk});
  return found == nullptr ? std::nullopt : std::optional(*found);
}

void ChunkCache::Keep(Owner owner, std::uint64_t chunk, const Bytes& elements) {
  if (elements.size() > most_bytes_) return;
  LruMap<Key, Bytes>::Entries dropped;
  const std::lock_guard lock(mutex_);
  if (chunks_.Find({owner, chunk}) != nullptr) return;
  chunks_.Put({owner, chunk}, elements, elements.size());
  dropped = chunks_.DropBeyond(most_bytes_);
}

std::uint64_t ChunkCache::bytes() const {
  const std::lock_guard lock(mutex_);
  return chunks_.weight();
}

}  // namespace slabstream
