// LruMap<Key, Value>: values by key, each of some weight (bytes, or 1 to count them). DropBeyond drops the least recently used ones until
// the rest weighs at most so much. One thread at a time uses a map.
//
// Keys with an order are looked up in a tree. Others, which have == alone, are compared one by one: for a few dozen.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <functional>
#include <iterator>
#include <list>
#include <map>
#include <type_traits>
#include <utility>

namespace slabstream {

template <class Key, class Value>
class LruMap {
 public:
  struct Entry {
    Key key;
    Value value;
    std::uint64_t weight;
  };
  using Entries = std::list<Entry>;

  LruMap() = default;
  LruMap(LruMap&&) noexcept = default;
  LruMap& operator=(LruMap&&) noexcept = default;

  // Null: there is none. A found value is then the one that was used last. Its place stays until it is dropped.
  Value* Find(const Key& key) {
    const auto found = Locate(key);
    if (found == entries_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, found);
    return &found->value;
  }

  // In place of the key's value, if it has one. It is then the one that was used last.
  Value& Put(Key key, Value value, std::uint64_t weight = 1) {
    Entries put;
    put.push_front({std::move(key), std::move(value), weight});
    Drop(put.front().key);
    if constexpr (kOrdered) places_.emplace(put.front().key, put.begin());
    entries_.splice(entries_.begin(), put);  // throws nothing, like what follows
    weight_ += weight;
    return entries_.front().value;
  }

  // These return what they drop, for callers that destroy it elsewhere.
  Entries Drop(const Key& key) {
    Entries dropped;
    if (const auto found = Locate(key); found != entries_.end()) Move(found, dropped);
    return dropped;
  }
  // Until the rest weighs at most `most_weight`. The value that was used last stays, whatever its weight.
  Entries DropBeyond(std::uint64_t most_weight) {
    Entries dropped;
    while (weight_ > most_weight && entries_.size() > 1) Move(std::prev(entries_.end()), dropped);
    return dropped;
  }
  // Those whose keys lie in [low, high].
  Entries DropBetween(const Key& low, const Key& high) requires std::totally_ordered<Key> {
    Entries dropped;
    for (auto place = places_.lower_bound(low); place != places_.end() && !(high < place->first.get());) Move((place++)->second, dropped);
    return dropped;
  }
  // Those of which which(entry) is true.
  template <class Which>
  Entries DropIf(Which&& which) {
    Entries dropped;
    for (auto entry = entries_.begin(); entry != entries_.end();) {
      const auto each = entry++;
      if (which(std::as_const(*each))) Move(each, dropped);
    }
    return dropped;
  }
  void Clear() { *this = {}; }

  const Entries& entries() const { return entries_; }  // the last used one first
  std::uint64_t weight() const { return weight_; }     // of all

 private:
  static constexpr bool kOrdered = std::totally_ordered<Key>;
  using Place = typename Entries::iterator;
  struct NoPlaces {};
  // The keys are those of the entries.
  using Places = std::conditional_t<kOrdered, std::map<std::reference_wrapper<const Key>, Place, std::less<Key>>, NoPlaces>;

  Place Locate(const Key& key) {
    if constexpr (kOrdered) {
      const auto found = places_.find(key);
      return found == places_.end() ? entries_.end() : found->second;
    } else {
      return std::ranges::find(entries_, key, &Entry::key);
    }
  }

  void Move(Place entry, Entries& dropped) {
    weight_ -= entry->weight;
    if constexpr (kOrdered) places_.erase(entry->key);
    dropped.splice(dropped.end(), entries_, entry);
  }

  Entries entries_;
  [[no_unique_address]] Places places_;
  std::uint64_t weight_ = 0;
};

}  // namespace slabstream
