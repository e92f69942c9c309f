#include "common/memory/pooled_vector.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <fstream>
#include <mutex>
#include <unordered_map>

#include "common/memory/large_buffers.h"
#include "common/memory/mapped_memory.h"

namespace slabstream {
namespace {

constexpr std::size_t kLeastKept = std::size_t{1} << 17;                    // bytes: smaller blocks come from the heap, and go back to it
constexpr std::size_t kUsuallyKept = std::size_t{96} << 20;                 // bytes
constexpr std::size_t kMostOwnKept = kWatched ? 0 : std::size_t{32} << 20;  // bytes

// Images of neighbouring views differ in size; rounding lets them reuse each other's blocks. Pages never written take no memory.
std::size_t BlockBytes(std::size_t bytes) { return std::bit_ceil(bytes); }

class Pool {
 public:
  explicit Pool(std::size_t most_kept) : most_kept_(most_kept) {}

  void* Take(std::size_t bytes) {
    {
      const std::lock_guard lock(mutex_);
      const auto kept = std::ranges::find(blocks_.rbegin(), blocks_.rend(), bytes, &Block::bytes);  // the last one may be in a cache
      if (kept != blocks_.rend()) {
        void* const data = kept->data;
        blocks_.erase(std::next(kept).base());
        bytes_ -= bytes;
        return data;
      }
      if (arena_ != nullptr) {
        if (void* const data = arena_->Take(bytes)) return data;
      }
    }
    return TakeMemory(bytes, kLeastKept);
  }

  void GiveBack(void* data, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    const auto pinned = pins_.find(data);
    if (pinned != pins_.end()) {
      pinned->second.given_back = bytes;
    } else {
      Keep(data, bytes);
    }
  }

  Status Share() {
    const std::lock_guard lock(mutex_);
    if (arena_ != nullptr) return Status::Ok();
    Result<std::unique_ptr<SharedArena>> arena = SharedArena::Create();
    if (!arena.ok()) return arena.status();
    for (const Block& kept : std::exchange(blocks_, {})) FreeMemory(kept.data, kept.bytes, kLeastKept);
    bytes_ = 0;
    arena_ = *std::move(arena);
    return Status::Ok();
  }

  void KeepMore(std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    most_kept_ = std::max(most_kept_, bytes);
  }

  void Release() {
    const std::lock_guard lock(mutex_);
    for (const Block& kept : std::exchange(blocks_, {})) Free(kept.data, kept.bytes);
    bytes_ = 0;
  }

  std::optional<ArenaName> arena() {
    const std::lock_guard lock(mutex_);
    return arena_ == nullptr ? std::nullopt : std::optional(arena_->name());
  }

  // The block's name, if it has one.
  std::optional<BlockName> Pin(const void* data) {
    const std::lock_guard lock(mutex_);
    ++pins_[data].count;
    if (arena_ == nullptr || !arena_->Contains(data)) return std::nullopt;
    return arena_->NameOf(data);
  }

  void Unpin(const void* data) {
    const std::lock_guard lock(mutex_);
    const auto pinned = pins_.find(data);
    if (--pinned->second.count > 0) return;
    const std::size_t bytes = pinned->second.given_back;
    pins_.erase(pinned);
    if (bytes > 0) Keep(const_cast<void*>(data), bytes);
  }

 private:
  struct Block {
    void* data;
    std::size_t bytes;
  };
  struct Pinned {
    int count = 0;
    std::size_t given_back = 0;  // bytes; 0: it is in use
  };

  void Keep(void* data, std::size_t bytes) {
    if (bytes > most_kept_) return Free(data, bytes);
    while (bytes_ + bytes > most_kept_) {  // those unused for longest
      Free(blocks_.front().data, blocks_.front().bytes);
      bytes_ -= blocks_.front().bytes;
      blocks_.erase(blocks_.begin());
    }
    if (arena_ != nullptr && arena_->Contains(data)) arena_->Renew(data);
    blocks_.push_back({data, bytes});
    bytes_ += bytes;
  }

  void Free(void* data, std::size_t bytes) {
    if (arena_ != nullptr && arena_->Contains(data)) {
      arena_->GiveBack(data);
    } else {
      FreeMemory(data, bytes, kLeastKept);
    }
  }

  std::mutex mutex_;  // guards what follows
  std::size_t most_kept_;
  std::vector<Block> blocks_;  // last given back comes last; a few hundred at most
  std::size_t bytes_ = 0;
  std::unique_ptr<SharedArena> arena_;
  std::unordered_map<const void*, Pinned> pins_;
};

// Never destroyed: blocks are given back until the very end of the program.
Pool& BlocksOf(BlockPool pool) {
  static Pool& shared = *new Pool(kWatched ? 0 : kUsuallyKept);
  static Pool& own = *new Pool(kMostOwnKept);
  return pool == BlockPool::kShared ? shared : own;
}
Pool& SharedBlocks() { return BlocksOf(BlockPool::kShared); }

std::atomic<std::int64_t> shared_in_use = 0;  // bytes

}  // namespace

void* TakeBlock(BlockPool pool, std::size_t bytes) {
  void* const block = bytes < kLeastKept ? TakeMemory(bytes, kLeastKept) : BlocksOf(pool).Take(BlockBytes(bytes));
  if (pool == BlockPool::kShared) shared_in_use += std::int64_t(bytes);
  return block;
}

void GiveBackBlock(BlockPool pool, void* block, std::size_t bytes) {
  if (pool == BlockPool::kShared) shared_in_use -= std::int64_t(bytes);
  if (bytes < kLeastKept) {
    FreeMemory(block, bytes, kLeastKept);
  } else {
    BlocksOf(pool).GiveBack(block, BlockBytes(bytes));
  }
}

void KeepBlocks(std::size_t bytes) {
  if (!kWatched) SharedBlocks().KeepMore(bytes);
}

// The second number of /proc/self/statm is in pages.
std::uint64_t ResidentBytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t addresses = 0, resident = 0;
  return statm >> addresses >> resident ? resident * std::uint64_t(::sysconf(_SC_PAGESIZE)) : 0;
}

void ReleaseFreeMemory() {
  for (const BlockPool pool : {BlockPool::kShared, BlockPool::kOwn}) BlocksOf(pool).Release();
  (void)::malloc_trim(0);
}

std::int64_t SpareForImages(std::uint64_t most) {
  if (ResidentBytes() > most) ReleaseFreeMemory();
  return std::int64_t(most) + shared_in_use - std::int64_t(ResidentBytes());
}

Status ShareBlocks() { return SharedBlocks().Share(); }
std::optional<ArenaName> SharedBlocksArena() { return SharedBlocks().arena(); }

std::optional<BlockPin> BlockPin::Pin(const void* block, std::size_t bytes) {
  if (block == nullptr || bytes < kLeastKept) return std::nullopt;
  return BlockPin(block, SharedBlocks().Pin(block));
}

BlockPin::~BlockPin() {
  if (block_ != nullptr) SharedBlocks().Unpin(block_);
}

}  // namespace slabstream
