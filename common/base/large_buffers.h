// How this process' memory is kept: what a frame needs is there again for the next one, what loading a volume needed goes back to the
// system.
#pragma once

#include <malloc.h>

namespace slabstream {

// glibc raises its threshold for mapping a buffer each time that one is freed, up to 32 MiB; buffers of changing sizes, freed by other
// threads than made them, then leave holes in several heaps. With a fixed one, messages that carry pictures of up to 700 x 700 pixels find
// memory in a heap instead of having it mapped, cleared and unmapped for each frame, and nothing larger leaves a hole. Called once, first
// thing in main. Images have blocks of their own: pooled_vector.h.
inline void KeepFrameBuffers() {
  constexpr int kFrameBytes = 8 << 20;
  mallopt(M_MMAP_THRESHOLD, kFrameBytes);
  mallopt(M_TRIM_THRESHOLD, kFrameBytes);
}

}  // namespace slabstream
