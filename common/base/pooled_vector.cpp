#include "common/base/pooled_vector.h"

#include <algorithm>
#include <bit>
#include <mutex>

#include "common/base/aligned_buffer.h"

namespace slabstream {
namespace {

constexpr std::size_t kLeastKept = std::size_t{1} << 17;  // bytes: smaller blocks come from the heap, and go back to it
#ifdef __SANITIZE_ADDRESS__
constexpr std::size_t kMostKept = 0;  // so that the use of a block that was given back is seen
#else
constexpr std::size_t kMostKept = std::size_t{96} << 20;  // bytes in all
#endif

void* Allocate(std::size_t bytes) { return ::operator new(bytes, std::align_val_t(kBufferAlignment)); }
void Free(void* block) { ::operator delete(block, std::align_val_t(kBufferAlignment)); }

// Images of neighbouring views differ in size: one's block is to fit the other. What is never written of a block takes no memory.
std::size_t RoundedUp(std::size_t bytes) { return std::bit_ceil(bytes); }

class Pool {
 public:
  void* Take(std::size_t bytes) {
    {
      const std::lock_guard lock(mutex_);
      const auto kept = std::ranges::find(blocks_.rbegin(), blocks_.rend(), bytes, &Block::bytes);  // the last one is in a cache
      if (kept != blocks_.rend()) {
        void* const data = kept->data;
        blocks_.erase(std::next(kept).base());
        bytes_ -= bytes;
        return data;
      }
    }
    return Allocate(bytes);
  }

  void GiveBack(void* data, std::size_t bytes) {
    if (bytes > kMostKept) return Free(data);
    const std::lock_guard lock(mutex_);
    while (bytes_ + bytes > kMostKept) {  // the ones that were not wanted for longest
      Free(blocks_.front().data);
      bytes_ -= blocks_.front().bytes;
      blocks_.erase(blocks_.begin());
    }
    blocks_.push_back({data, bytes});
    bytes_ += bytes;
  }

 private:
  struct Block {
    void* data;
    std::size_t bytes;
  };
  std::mutex mutex_;
  std::vector<Block> blocks_;  // given back last comes last; a few hundred at most
  std::size_t bytes_ = 0;
};

// Never destroyed: blocks are given back until the very end of the program.
Pool& TheBlocks() {
  static Pool& pool = *new Pool;
  return pool;
}

}  // namespace

void* TakeBlock(std::size_t bytes) { return bytes < kLeastKept ? Allocate(bytes) : TheBlocks().Take(RoundedUp(bytes)); }

void GiveBackBlock(void* block, std::size_t bytes) {
  if (bytes < kLeastKept) {
    Free(block);
  } else {
    TheBlocks().GiveBack(block, RoundedUp(bytes));
  }
}

}  // namespace slabstream
