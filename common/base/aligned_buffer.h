// AlignedVector<T>: std::vector whose storage begins at a 64-byte boundary, so that kernels may use whole-register loads.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace slabstream {

inline constexpr std::size_t kBufferAlignment = 64;  // bytes: one AVX-512 register, one cache line

template <class T>
struct AlignedAllocator {
  using value_type = T;
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) {}  // NOLINT(google-explicit-constructor): rebinding
  T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), std::align_val_t(kBufferAlignment))); }
  void deallocate(T* data, std::size_t) { ::operator delete(data, std::align_val_t(kBufferAlignment)); }
  friend bool operator==(const AlignedAllocator&, const AlignedAllocator&) { return true; }
};

template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace slabstream
