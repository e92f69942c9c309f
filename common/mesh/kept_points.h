// Some points of a mesh: those of a part of it.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/mesh/cells.h"

namespace slabstream {

// They are numbered anew in their order.
class KeptPoints {
 public:
  explicit KeptPoints(std::size_t points) : words_((points + 63) / 64) {}

  void Keep(PointNumber point) { words_[point / 64].kept |= std::uint64_t{1} << point % 64; }
  // After the last call of Keep. How many there are.
  std::size_t Count() {
    std::size_t count = 0;
    for (Word& word : words_) {
      word.before = PointNumber(count);
      count += std::size_t(std::popcount(word.kept));
    }
    return count;
  }
  // After Count.
  PointNumber NumberOf(PointNumber point) const {
    const Word& word = words_[point / 64];
    return word.before + PointNumber(std::popcount(word.kept & ((std::uint64_t{1} << point % 64) - 1)));
  }
  // The same of all points of tetrahedra, which are kept.
  void Renumber(std::span<Tetrahedron> tetrahedra) const {
    for (Tetrahedron& t : tetrahedra) std::ranges::transform(t, t.begin(), [&](PointNumber point) { return NumberOf(point); });
  }
  // Calls function(old number) in their order.
  template <class Function>
  void Visit(Function&& function) const {
    for (std::size_t i = 0; i < words_.size(); ++i) {
      for (std::uint64_t kept = words_[i].kept; kept != 0; kept &= kept - 1) function(i * 64 + std::size_t(std::countr_zero(kept)));
    }
  }

 private:
  struct Word {  // of 64 points
    std::uint64_t kept = 0;
    PointNumber before = 0;  // kept in the words in front
  };
  std::vector<Word> words_;
};

// Numbers the points of these tetrahedra of a mesh with so many points anew. Their old numbers, ascending.
inline std::vector<PointNumber> NumberAnew(std::span<Tetrahedron> tetrahedra, std::size_t points) {
  KeptPoints kept(points);
  for (const Tetrahedron& t : tetrahedra) {
    for (const PointNumber point : t) kept.Keep(point);
  }
  std::vector<PointNumber> numbers;
  numbers.reserve(kept.Count());
  kept.Visit([&](std::size_t point) { numbers.push_back(PointNumber(point)); });
  kept.Renumber(tetrahedra);
  return numbers;
}

}  // namespace slabstream
