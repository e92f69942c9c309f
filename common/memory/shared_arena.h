// Memory of this process that other processes of the same host may read. It has no name in any file system: it goes with the last process
// that has it open.
//
//   1. The owner makes a SharedArena, takes blocks from it, and tells others its ArenaName and the BlockName of what they may read.
//   2. A reader maps the arena by its name (MappedArena::Open, through /proc/<pid>/fd) and reads the block's bytes.
//   3. The owner may reuse a block at any time, even while a slow reader still reads it. So the reader calls Holds(block) after reading: if
//      that is false, what it read may be anything.
// Each use of a block has its own generation number, in a table at the arena's beginning that only the owner writes.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/memory/sealed_memory.h"

namespace slabstream {

struct ArenaName {
  std::uint64_t id = 0;  // random; 0: none
  std::uint32_t pid = 0, file_descriptor = 0;
  friend bool operator==(const ArenaName&, const ArenaName&) = default;
};

// One use of one block.
struct BlockName {
  std::uint64_t offset = 0;  // where its first byte lies in the arena, a multiple of kBlockAlignment
  std::uint64_t generation = 0;
  std::uint32_t slot = 0;  // its place in the generation table, below kArenaSlots
  friend bool operator==(const BlockName&, const BlockName&) = default;
};

inline constexpr std::size_t kBlockAlignment = 4096;               // bytes: a page
inline constexpr std::uint32_t kArenaSlots = 8190;                 // blocks at a time
inline constexpr std::size_t kArenaBytes = std::size_t{64} << 30;  // addresses of an arena; memory is taken when it is written

struct ArenaHeader {
  std::uint64_t magic;
  std::uint64_t id;
  std::atomic<std::uint64_t> generations[kArenaSlots];  // the generations of the blocks in use; 0: the slot is free
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free && sizeof(ArenaHeader) == 16 * kBlockAlignment);

// For one thread at a time.
class SharedArena {
 public:
  // Unavailable: the system has no such memory to give.
  static Result<std::unique_ptr<SharedArena>> Create();
  SharedArena(const SharedArena&) = delete;
  SharedArena& operator=(const SharedArena&) = delete;

  ArenaName name() const { return name_; }

  // A block of at least `bytes` bytes, > 0, of any content; null: there is no room.
  void* Take(std::size_t bytes);
  // Gives its memory back to the system.
  void GiveBack(void* block);
  // Gives the block, which stays taken, a new name. Holds is false for the old one before anything more is written.
  void Renew(void* block);

  bool Contains(const void* address) const { return address >= base_ && address < base_ + kArenaBytes; }
  BlockName NameOf(const void* block) const;  // a block that is taken

 private:
  SharedArena(SealedMemory memory, std::uint64_t id);
  ArenaHeader& header() { return *reinterpret_cast<ArenaHeader*>(base_); }

  struct Block {
    std::size_t bytes = 0;
    std::uint32_t slot = 0;
    std::uint64_t generation = 0;
  };
  const SealedMemory memory_;
  std::byte* const base_ = memory_.data();
  const ArenaName name_;
  std::uint64_t last_generation_;
  std::map<std::size_t, std::size_t> free_;  // offset -> bytes, no two adjacent
  std::map<const void*, Block> taken_;
  std::vector<std::uint32_t> free_slots_;
};

// Another process' arena, or this one's own, mapped for reading. Any thread.
class MappedArena {
 public:
  // NotFound: there is no such arena. Unavailable: it may not be opened. InvalidArgument: there is something else, or another
  // arena. Never opens, reads or waits for anything else.
  static Result<std::shared_ptr<const MappedArena>> Open(const ArenaName& name);
  MappedArena(const MappedArena&) = delete;
  MappedArena& operator=(const MappedArena&) = delete;

  // The first of `bytes` bytes of a block; null if the arena cannot hold such a block. Any name may be given.
  const std::byte* Find(const BlockName& block, std::uint64_t bytes) const;
  // True if all bytes read from the block before the call are what its owner wrote into it.
  bool Holds(const BlockName& block) const;

 private:
  explicit MappedArena(SealedMemory memory) : memory_(std::move(memory)) {}
  const SealedMemory memory_;
  const std::byte* const base_ = memory_.data();
};

}  // namespace slabstream
