// AlignedVector<T>: std::vector whose storage begins at a 64-byte boundary, so that kernels may use whole-register loads. Large ones ask
// for huge pages: taking a volume's memory 4 KiB at a time costs as much as reading the volume.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <new>
#include <vector>

namespace slabstream {

inline constexpr std::size_t kBufferAlignment = 64;                                          // bytes: one AVX-512 register, one cache line
inline constexpr std::size_t kHugePage = std::size_t{2} << 20, kHugeBuffer = 8 * kHugePage;  // bytes

template <class T>
struct AlignedAllocator {
  using value_type = T;
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) {}  // NOLINT(google-explicit-constructor): rebinding
  T* allocate(std::size_t count) {
    const std::size_t bytes = count * sizeof(T);
    void* const data = ::operator new(bytes, Alignment(bytes));
    if (bytes >= kHugeBuffer) (void)::madvise(data, bytes, MADV_HUGEPAGE);  // without huge pages nothing changes
    return static_cast<T*>(data);
  }
  void deallocate(T* data, std::size_t count) { ::operator delete(data, Alignment(count * sizeof(T))); }
  friend bool operator==(const AlignedAllocator&, const AlignedAllocator&) { return true; }

 private:
  static std::align_val_t Alignment(std::size_t bytes) { return std::align_val_t(bytes >= kHugeBuffer ? kHugePage : kBufferAlignment); }
};

template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace slabstream
