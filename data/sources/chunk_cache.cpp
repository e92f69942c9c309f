#include "data/sources/chunk_cache.h"

#include <limits>

namespace slabstream {

ChunkCache::Owner ChunkCache::NewOwner() {
  const std::lock_guard lock(mutex_);
  return ++last_owner_;
}

void ChunkCache::Forget(Owner owner) {
  std::list<Entry> dropped;  // destroyed without the lock
  const std::lock_guard lock(mutex_);
  const auto begin = places_.lower_bound({owner, 0});
  const auto end = places_.upper_bound({owner, std::numeric_limits<std::uint64_t>::max()});
  for (auto place = begin; place != end; ++place) {
    bytes_ -= place->second->elements.size();
    dropped.splice(dropped.end(), entries_, place->second);
  }
  places_.erase(begin, end);
}

std::optional<Bytes> ChunkCache::Find(Owner owner, std::uint64_t chunk) {
  const std::lock_guard lock(mutex_);
  const auto place = places_.find({owner, chunk});
  if (place == places_.end()) return std::nullopt;
  entries_.splice(entries_.begin(), entries_, place->second);
  return place->second->elements;
}

void ChunkCache::Keep(Owner owner, std::uint64_t chunk, const Bytes& elements) {
  if (elements.size() > most_bytes_) return;
  std::list<Entry> dropped;
  const std::lock_guard lock(mutex_);
  const auto [place, added] = places_.try_emplace({owner, chunk});
  if (!added) return;
  try {
    entries_.push_front({place->first, elements});
  } catch (...) {
    places_.erase(place);
    throw;
  }
  place->second = entries_.begin();
  bytes_ += elements.size();
  while (bytes_ > most_bytes_) {
    bytes_ -= entries_.back().elements.size();
    places_.erase(entries_.back().key);
    dropped.splice(dropped.end(), entries_, std::prev(entries_.end()));
  }
}

std::uint64_t ChunkCache::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace slabstream
