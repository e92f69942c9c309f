// AlignedVector<T>: std::vector whose storage begins at a 64-byte boundary, so that kernels may use whole-register loads. Large ones go
// back to the system when they are freed (mapped_memory.h). New storage reads as 0, so elements without a value are not written: filling
// a volume with zeros took longer than reading its voxels. If a vector shrinks and grows again, these elements keep their old values.
#pragma once

#include <cstddef>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/memory/mapped_memory.h"

namespace slabstream {

template <class T>
struct AlignedAllocator {
  using value_type = T;
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) {}  // NOLINT(google-explicit-constructor): rebinding
  T* allocate(std::size_t count) { return static_cast<T*>(TakeZeros(count * sizeof(T))); }
  void deallocate(T* data, std::size_t count) { FreeMemory(data, count * sizeof(T)); }
  template <class U>
  void construct(U* element) {
    if constexpr (!std::is_trivially_default_constructible_v<U>) std::construct_at(element);
  }
  template <class U, class... Args>
  void construct(U* element, Args&&... args) {
    std::construct_at(element, std::forward<Args>(args)...);
  }
  friend bool operator==(const AlignedAllocator&, const AlignedAllocator&) { return true; }
};

template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace slabstream
