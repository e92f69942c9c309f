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
constexpr std::size_t kMostKept = std::size_t{1} << 26;  // bytes in all
#endif

void* Allocate(std::size_t bytes) { return ::operator new(bytes, std::align_val_t(kBufferAlignment)); }
void Free(void* block) { ::operator delete(block, std::align_val_t(kBufferAlignment)); }

// In front of a block that may be kept: how much it holds, which may be more than was asked for.
struct alignas(kBufferAlignment) Header {
  std::size_t bytes = 0;
};
Header* HeaderOf(void* block) { return static_cast<Header*>(block) - 1; }

// Images of neighbouring views differ a little in size: blocks are an eighth of a power of two apart, so that one fits the other.
std::size_t RoundedUp(std::size_t bytes) {
  const std::size_t step = std::bit_floor(bytes) / 8;
  return (bytes + step - 1) / step * step;
}

class Pool {
 public:
  // The smallest block that is large enough, but for ones of twice the size; of several the last one, which is in a cache.
  void* Take(std::size_t bytes) {
    {
      const std::lock_guard lock(mutex_);
      auto best = blocks_.end();
      for (auto block = blocks_.begin(); block != blocks_.end(); ++block) {
        const std::size_t held = (*block)->bytes;
        if (held >= bytes && held < 2 * bytes && (best == blocks_.end() || held <= (*best)->bytes)) best = block;
      }
      if (best != blocks_.end()) {
        Header* const header = *best;
        blocks_.erase(best);
        bytes_ -= header->bytes;
        return header + 1;
      }
    }
    bytes = RoundedUp(bytes);
    return new (Allocate(sizeof(Header) + bytes)) Header{bytes} + 1;
  }

  void GiveBack(void* block) {
    Header* const header = HeaderOf(block);
    if (header->bytes > kMostKept) return Free(header);
    const std::lock_guard lock(mutex_);
    while (bytes_ + header->bytes > kMostKept) {  // the ones that were not wanted for longest
      bytes_ -= blocks_.front()->bytes;
      Free(blocks_.front());
      blocks_.erase(blocks_.begin());
    }
    blocks_.push_back(header);
    bytes_ += header->bytes;
  }

 private:
  std::mutex mutex_;
  std::vector<Header*> blocks_;  // given back last comes last; a few hundred at most
  std::size_t bytes_ = 0;
};

// Never destroyed: blocks are given back until the very end of the program.
Pool& TheBlocks() {
  static Pool& pool = *new Pool;
  return pool;
}

}  // namespace

void* TakeBlock(std::size_t bytes) { return bytes < kLeastKept ? Allocate(bytes) : TheBlocks().Take(bytes); }

void GiveBackBlock(void* block, std::size_t bytes) {
  if (bytes < kLeastKept) {
    Free(block);
  } else {
    TheBlocks().GiveBack(block);
  }
}

}  // namespace slabstream
