// Numbered: the different ones of many keys, numbered in the order in which they came first.
#pragma once

#include <xxhash.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace slabstream {

template <std::size_t kWords>
class Numbered {
 public:
  using Key = std::array<std::uint32_t, kWords>;

  std::uint32_t NumberOf(const Key& key) {
    if (2 * keys_.size() >= slots_.size()) Grow();
    std::uint32_t& slot = SlotOf(key);
    if (slot == kFree) {
      slot = std::uint32_t(keys_.size());
      keys_.push_back(key);
    }
    return slot;
  }
  const std::vector<Key>& keys() const { return keys_; }

 private:
  static constexpr std::uint32_t kFree = UINT32_MAX;

  // The key's, or the free one for it.
  std::uint32_t& SlotOf(const Key& key) {
    std::size_t at = XXH3_64bits_withSeed(key.data(), sizeof key, seed_) & (slots_.size() - 1);
    while (slots_[at] != kFree && keys_[slots_[at]] != key) at = (at + 1) & (slots_.size() - 1);
    return slots_[at];
  }

  void Grow() {
    slots_.assign(slots_.empty() ? 1024 : 2 * slots_.size(), kFree);
    for (std::uint32_t number = 0; number < keys_.size(); ++number) SlotOf(keys_[number]) = number;
  }

  const std::uint64_t seed_ = std::random_device()();  // so that no file can be made whose keys meet
  std::vector<Key> keys_;
  std::vector<std::uint32_t> slots_;  // numbers of keys, at most half of them taken
};

}  // namespace slabstream
