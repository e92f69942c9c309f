// How this process keeps its memory: buffers of a frame are reused for the next one; memory used to load a volume goes back to the system.
#pragma once

#include <malloc.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <thread>

namespace slabstream {

// glibc raises its threshold for mapping a buffer, up to 32 MiB, each time one is freed. Buffers of changing sizes, freed by other threads
// than made them, then leave holes in several heaps. With a fixed threshold, messages that carry pictures of up to 1100 x 1100 pixels find
// memory in a heap, instead of having it mapped, cleared and unmapped for each frame, and nothing larger leaves a hole. A heap (64 MiB at
// most) keeps the free memory at its end, so strips of pictures that arrive one after the other use the memory of the last frame's strips.
// There are as many heaps as cores, not glibc's eight a core: small chunks of stored voxels are read, decoded and freed by different
// threads, and what lies free in one heap is of no use to the others. Called once, first thing in main. Images have blocks of their own:
// pooled_vector.h.
inline void KeepFrameBuffers() {
  constexpr int kFrameBytes = 20 << 20, kHeapBytes = 64 << 20;
  mallopt(M_MMAP_THRESHOLD, kFrameBytes);
  mallopt(M_TRIM_THRESHOLD, kHeapBytes);
  mallopt(M_ARENA_MAX, std::max(2, int(std::thread::hardware_concurrency())));
}

// From now on, keeps up to so many bytes of the blocks of images (pooled_vector.h) that were given back; never fewer than before. A frame
// of 8 million pixels takes some hundred MiB of images at each worker, and to take them anew from the system costs more than to render
// them. Any thread.
void KeepBlocks(std::size_t bytes);

// What the process holds in RAM, with what it reads of other processes' memory and of files. 0: the system does not tell. Any thread.
std::uint64_t ResidentBytes();
// Gives what is kept for reuse back to the system: blocks, and free memory of the heaps. Takes some milliseconds. Any thread.
void ReleaseFreeMemory();
// What the process may take for images until it holds `most`, those that it has included. If it holds more, it calls ReleaseFreeMemory
// first. Any thread.
std::int64_t SpareForImages(std::uint64_t most);

}  // namespace slabstream
