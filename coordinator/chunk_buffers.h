// ChunkBuffers: memory for the samples of chunks, used again once the receiver of a chunk has released it. New memory for each chunk would
// be new pages each time, which cost more than writing the samples.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "common/wire/voxel_messages.h"

namespace slabstream {

class ChunkBuffers {
 public:
  using Memory = std::array<std::byte, kChunkBytes>;
  using Buffer = std::shared_ptr<Memory>;  // may be released by any thread, and outlive this object

  Buffer Take() {
    std::unique_ptr<Memory> memory;
    {
      const std::lock_guard lock(free_->mutex);
      if (!free_->memory.empty()) {
        memory = std::move(free_->memory.back());
        free_->memory.pop_back();
      }
    }
    if (memory == nullptr) memory = std::make_unique_for_overwrite<Memory>();
    return {memory.release(), [free = free_](Memory* returned) {
              std::unique_ptr<Memory> owned(returned);
              const std::lock_guard lock(free->mutex);
              if (free->memory.size() < kMostKept) free->memory.push_back(std::move(owned));
            }};
  }

 private:
  static constexpr std::size_t kMostKept = 4;
  struct Free {
    std::mutex mutex;
    std::vector<std::unique_ptr<Memory>> memory;
  };
  std::shared_ptr<Free> free_ = std::make_shared<Free>();
};

}  // namespace slabstream
