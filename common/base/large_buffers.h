// How this process' memory is kept: what a frame needs is there again for the next one, what loading a volume needed goes back to the
// system.
#pragma once

#include <malloc.h>

namespace slabstream {

// glibc raises its threshold for mapping a buffer each time that one is freed, up to 32 MiB; buffers of changing sizes, freed by other
// threads than made them, then leave holes in several heaps. With a fixed one, messages that carry pictures of up to 1100 x 1100 pixels
// find memory in a heap instead of having it mapped, cleared and unmapped for each frame, and nothing larger leaves a hole. A heap (64 MiB
// at most) keeps what is free at its end: strips of pictures that come one after the other are received where the last frame's were. Called
// once, first thing in main. Images have blocks of their own: pooled_vector.h.
inline void KeepFrameBuffers() {
  constexpr int kFrameBytes = 20 << 20, kHeapBytes = 64 << 20;
  mallopt(M_MMAP_THRESHOLD, kFrameBytes);
  mallopt(M_TRIM_THRESHOLD, kHeapBytes);
}

}  // namespace slabstream
