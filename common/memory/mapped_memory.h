// Blocks of memory that begin where kernels want them to. Large ones are mappings of their own, which go back to the system when they are
// freed. The heap of glibc 2.36 cannot use an aligned block's place for the next block of that size: a process whose volumes came and went
// held twice what was in use. Any thread.
#pragma once

#include <cstddef>

namespace slabstream {

inline constexpr std::size_t kBufferAlignment = 64;               // bytes: one AVX-512 register, one cache line
inline constexpr std::size_t kHugePage = std::size_t{2} << 20;    // bytes
inline constexpr std::size_t kLargeBlock = std::size_t{1} << 20;  // bytes

// Whether a sanitizer watches the heap. All blocks come from it then, and none is kept, so that it sees who uses one after it was freed.
#ifdef __SANITIZE_ADDRESS__
inline constexpr bool kWatched = true;
#else
inline constexpr bool kWatched = false;
#endif

// A mapping of its own, of at least one byte. It reads as 0, and takes no memory where it is never written. A mapping of a huge page or
// more begins at a huge page and asks for them: to take a volume's memory 4 KiB at a time costs as much as to read the volume. Throws
// std::bad_alloc.
void* MapMemory(std::size_t bytes);
void UnmapMemory(void* block, std::size_t bytes);  // both as taken

// A block at a boundary of kBufferAlignment: from the heap if it has less than `mapped_from` bytes or is kWatched; else a
// mapping. Throws std::bad_alloc.
void* TakeMemory(std::size_t bytes, std::size_t mapped_from = kLargeBlock);
// The same, of kLargeBlock. It reads as 0.
void* TakeZeros(std::size_t bytes);
void FreeMemory(void* block, std::size_t bytes, std::size_t mapped_from = kLargeBlock);  // all three as taken

}  // namespace slabstream
