// PooledVector<T>: std::vector for images and other large buffers of numbers that come and go with each frame. Its storage begins at a
// 64-byte boundary and is used again: memory that is new from the system costs a page fault every 4 KiB, more than rendering what is
// written to it. New elements are left as they are unless a value is given: resize(n) alone does not write.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace slabstream {

// Blocks of at least `bytes` bytes at 64-byte boundaries. Large ones that were given back are kept for the next one who wants as much, up
// to 96 MiB for the process. Any thread.
void* TakeBlock(std::size_t bytes);
void GiveBackBlock(void* block, std::size_t bytes);  // `bytes` as taken

template <class T>
struct PooledAllocator {
  static_assert(std::is_trivially_destructible_v<T>);
  using value_type = T;
  PooledAllocator() = default;
  template <class U>
  PooledAllocator(const PooledAllocator<U>&) {}  // NOLINT(google-explicit-constructor): rebinding
  T* allocate(std::size_t count) { return static_cast<T*>(TakeBlock(count * sizeof(T))); }
  void deallocate(T* data, std::size_t count) { GiveBackBlock(data, count * sizeof(T)); }
  template <class U>
  void construct(U* element) {
    ::new (static_cast<void*>(element)) U;
  }
  template <class U, class... Args>
  void construct(U* element, Args&&... args) {
    std::construct_at(element, std::forward<Args>(args)...);
  }
  friend bool operator==(const PooledAllocator&, const PooledAllocator&) { return true; }
};

template <class T>
using PooledVector = std::vector<T, PooledAllocator<T>>;

}  // namespace slabstream
