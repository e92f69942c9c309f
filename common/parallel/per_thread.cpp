#include "common/parallel/per_thread.h"

#include <tbb/enumerable_thread_specific.h>

namespace slabstream {

struct ThreadSlots::Slots {
  tbb::enumerable_thread_specific<void*> each = nullptr;
};

ThreadSlots::ThreadSlots() : slots_(std::make_unique<Slots>()) {}
ThreadSlots::~ThreadSlots() = default;

void*& ThreadSlots::Mine() { return slots_->each.local(); }

}  // namespace slabstream
