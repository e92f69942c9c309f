// UnwrittenVector<T>: std::vector for bytes that are written right after memory is taken for them, such as a chunk that is read and
// decoded. New elements are uninitialised unless a value is given. Its storage begins at a 64-byte boundary and is reused: chunks come and
// go on several threads, and their holes in the heap once took as much memory again.
#pragma once

#include <cstddef>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/base/pooled_vector.h"

namespace slabstream {

template <class T>
struct UnwrittenAllocator {
  static_assert(std::is_trivially_destructible_v<T>);
  using value_type = T;
  UnwrittenAllocator() = default;
  template <class U>
  UnwrittenAllocator(const UnwrittenAllocator<U>&) {}  // NOLINT(google-explicit-constructor): rebinding
  T* allocate(std::size_t count) { return static_cast<T*>(TakeOwnBlock(count * sizeof(T))); }
  void deallocate(T* data, std::size_t count) { GiveBackOwnBlock(data, count * sizeof(T)); }
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
