// AlignedVector<T>: std::vector whose storage begins at a 64-byte boundary, so that kernels may use whole-register loads. Large ones go
// back to the system when they are freed (mapped_memory.h).
#pragma once

#include <cstddef>
#include <vector>

#include "common/memory/mapped_memory.h"

namespace slabstream {

template <class T>
struct AlignedAllocator {
  using value_type = T;
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) {}  // NOLINT(google-explicit-constructor): rebinding
  T* allocate(std::size_t count) { return static_cast<T*>(TakeMemory(count * sizeof(T))); }
  void deallocate(T* data, std::size_t count) { FreeMemory(data, count * sizeof(T)); }
  friend bool operator==(const AlignedAllocator&, const AlignedAllocator&) { return true; }
};

template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace slabstream
