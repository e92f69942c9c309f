// LargeArray<T>: an array for large data; T needs neither constructor nor destructor. It is a memory mapping of its own, which goes back to
// the system when it is freed. It asks for huge pages: taking 4 KiB at a time costs more than what is computed into them. Memory that is
// never written is never taken, and reads as 0.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>

namespace slabstream {

struct UnmapArray {
  std::size_t bytes = 0;
  template <class T>
  void operator()(T* data) const {
    ::munmap(data, bytes);
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
  void* data = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (data == MAP_FAILED) throw std::bad_alloc();
  (void)::madvise(data, bytes, MADV_HUGEPAGE);  // without huge pages nothing changes
  return LargeArray<T>(static_cast<T*>(data), UnmapArray{bytes});
}

}  // namespace slabstream
