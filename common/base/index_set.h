// IndexSet: a set of numbers below a limit, one bit each. Its elements are found in ascending order.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

namespace slabstream {

class IndexSet {
 public:
  explicit IndexSet(std::uint32_t limit = 0) : words_((limit + 63) / 64) {}

  void Insert(std::uint32_t index) { words_[index / 64] |= Bit(index); }
  void Erase(std::uint32_t index) { words_[index / 64] &= ~Bit(index); }
  // The least element in [begin, end); `end` if there is none. `end` is at most the limit.
  std::uint32_t Find(std::uint32_t begin, std::uint32_t end) const {
    if (begin >= end) return end;
    std::uint32_t word = begin / 64;
    std::uint64_t bits = words_[word] & ~(Bit(begin) - 1);
    while (bits == 0) {
      if (++word * 64 >= end) return end;
      bits = words_[word];
    }
    return std::min(word * 64 + std::uint32_t(std::countr_zero(bits)), end);
  }

 private:
  static constexpr std::uint64_t Bit(std::uint32_t index) { return std::uint64_t{1} << (index % 64); }

  std::vector<std::uint64_t> words_;
};

}  // namespace slabstream
