// The fields of a binary header, at fixed offsets and in the file's byte order.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <span>

namespace slabstream {

class BinaryHeader {
 public:
  // `bytes` must outlive this. `swapped`: the file's byte order is not this machine's.
  BinaryHeader(std::span<const std::byte> bytes, bool swapped) : bytes_(bytes), swapped_(swapped) {}

  // The field of type T, which lies inside the header.
  template <class T>
  T At(std::size_t offset) const {
    std::array<std::byte, sizeof(T)> field{};
    std::ranges::copy(bytes_.subspan(offset, sizeof(T)), field.begin());
    if (swapped_) std::ranges::reverse(field);
    return std::bit_cast<T>(field);
  }

 private:
  std::span<const std::byte> bytes_;
  bool swapped_;
};

}  // namespace slabstream
