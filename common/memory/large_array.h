// LargeArray<T>: an array for large data; T needs neither constructor nor destructor. It is a mapping of its own (mapped_memory.h): memory
// that is never written is never taken, and reads as 0.
#pragma once

#include <cstddef>
#include <memory>
#include <type_traits>

#include "common/memory/mapped_memory.h"

namespace slabstream {

struct UnmapArray {
  std::size_t bytes = 0;
  template <class T>
  void operator()(T* data) const {
    UnmapMemory(data, bytes);
  }
};

template <class T>
using LargeArray = std::unique_ptr<T[], UnmapArray>;

// Throws std::bad_alloc. No elements: null.
template <class T>
LargeArray<T> MakeLargeArray(std::size_t count) {
  static_assert(std::is_trivially_default_constructible_v<T> && std::is_trivially_destructible_v<T>);
  if (count == 0) return {};
  const std::size_t bytes = count * sizeof(T);
  return LargeArray<T>(static_cast<T*>(MapMemory(bytes)), UnmapArray{bytes});
}

}  // namespace slabstream
