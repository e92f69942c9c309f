// PooledVector<T>: std::vector for images and other large buffers of numbers that come and go with each frame. Its storage begins at a
// 64-byte boundary and is reused: new memory from the system costs a page fault every 4 KiB, more than rendering what is written to it. New
// elements are uninitialised unless a value is given: resize(n) alone does not write.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/memory/shared_arena.h"

namespace slabstream {

// Where blocks come from. Of each pool, blocks that were given back are kept for reuse: up to 96 MiB, or what KeepBlocks says
// (large_buffers.h), of those that other processes may come to read (ShareBlocks), such as images; up to 32 MiB of the process' own.
enum class BlockPool { kShared, kOwn };

// Blocks of at least `bytes` bytes at 64-byte boundaries. Large blocks are memory mappings of their own, so they leave no holes in a heap.
// Any thread.
void* TakeBlock(BlockPool pool, std::size_t bytes);
void GiveBackBlock(BlockPool pool, void* block, std::size_t bytes);  // `bytes` as taken

// From now on, takes large blocks from a SharedArena of the process. Unavailable: there is none; blocks stay private. Again: no change.
Status ShareBlocks();
std::optional<ArenaName> SharedBlocksArena();  // none: not shared

// Keeps the contents of a block, even after it was given back: the block is reused only when its last pin is gone.
class BlockPin {
 public:
  // `block` and `bytes` as taken, null allowed. None: the block is so small that it goes back to the heap at once.
  static std::optional<BlockPin> Pin(const void* block, std::size_t bytes);
  BlockPin(BlockPin&& other) noexcept : block_(std::exchange(other.block_, nullptr)), name_(other.name_) {}
  BlockPin& operator=(BlockPin&& other) noexcept {
    std::swap(block_, other.block_);
    std::swap(name_, other.name_);
    return *this;
  }
  ~BlockPin();
  const std::optional<BlockName>& name() const { return name_; }  // none: no other process can read it

 private:
  BlockPin(const void* block, std::optional<BlockName> name) : block_(block), name_(name) {}
  const void* block_;
  std::optional<BlockName> name_;
};

template <class T, BlockPool kPool>
struct PooledAllocator {
  static_assert(std::is_trivially_destructible_v<T>);
  using value_type = T;
  PooledAllocator() = default;
  template <class U>
  struct rebind {
    using other = PooledAllocator<U, kPool>;
  };
  template <class U>
  PooledAllocator(const PooledAllocator<U, kPool>&) {}  // NOLINT(google-explicit-constructor): rebinding
  T* allocate(std::size_t count) { return static_cast<T*>(TakeBlock(kPool, count * sizeof(T))); }
  void deallocate(T* data, std::size_t count) { GiveBackBlock(kPool, data, count * sizeof(T)); }
  template <class U>
  void construct(U* element) {
    ::new (static_cast<void*>(element)) U;
  }
  template <class U, class... Args>
  void construct(U* element, Args&&... args) {
    std::construct_at(element, std::forward<Args>(args)...);
  }
  friend bool operator==(const PooledAllocator&, const PooledAllocator&) { return true; }
};

template <class T>
using PooledVector = std::vector<T, PooledAllocator<T, BlockPool::kShared>>;

// The same with blocks of the process' own, for bytes that are written right after memory is taken for them, such as a chunk that is read
// and decoded: chunks come and go on several threads, and their holes in the heap once took as much memory again.
template <class T>
using UnwrittenVector = std::vector<T, PooledAllocator<T, BlockPool::kOwn>>;

template <class T>
std::optional<BlockPin> PinOf(const PooledVector<T>& vector) {
  return BlockPin::Pin(vector.data(), vector.capacity() * sizeof(T));
}

}  // namespace slabstream
