// UnwrittenVector<T>: std::vector for bytes that are written right after memory is taken for them, such as a chunk that is read and
// decoded. New elements are uninitialised unless a value is given. Its storage begins at a 64-byte boundary and comes from the heap.
#pragma once

#include <cstddef>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/base/aligned_buffer.h"

namespace slabstream {

template <class T>
struct UnwrittenAllocator {
  static_assert(std::is_trivially_destructible_v<T>);
  using value_type = T;
  UnwrittenAllocator() = default;
  template <class U>
  UnwrittenAllocator(const UnwrittenAllocator<U>&) {}  // NOLINT(google-explicit-constructor): rebinding
  T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), std::align_val_t(kBufferAlignment))); }
  void deallocate(T* data, std::size_t) { ::operator delete(data, std::align_val_t(kBufferAlignment)); }
  template <class U>
  void construct(U* element) {
    ::new (static_cast<void*>(element)) U;
  }
  template <class U, class... Arguments>
  void construct(U* element, Arguments&&... arguments) {
    ::new (static_cast<void*>(element)) U(std::forward<Arguments>(arguments)...);
  }
  friend bool operator==(const UnwrittenAllocator&, const UnwrittenAllocator&) { return true; }
};

template <class T>
using UnwrittenVector = std::vector<T, UnwrittenAllocator<T>>;

}  // namespace slabstream
