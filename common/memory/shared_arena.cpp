#include "common/memory/shared_arena.h"

#include <sys/mman.h>
#include <unistd.h>

#include <iterator>
#include <random>

#include "common/base/check.h"

namespace slabstream {
namespace {

constexpr std::uint64_t kMagic = 0x534c41424152454eULL;  // "SLABAREN"

std::uint64_t RandomNumber() {
  std::random_device device;
  const std::uint64_t number = (std::uint64_t{device()} << 32) | device();
  return number == 0 ? 1 : number;
}

std::size_t RoundedUp(std::size_t bytes) { return (bytes + kBlockAlignment - 1) / kBlockAlignment * kBlockAlignment; }

}  // namespace

// ---------------------------------------------------------------- the owner

Result<std::unique_ptr<SharedArena>> SharedArena::Create() {
  Result<SealedMemory> memory = SealedMemory::Create(kArenaBytes);
  if (!memory.ok()) return memory.status();
  return std::unique_ptr<SharedArena>(new SharedArena(*std::move(memory), RandomNumber()));
}

SharedArena::SharedArena(SealedMemory memory, std::uint64_t id)
    : memory_(std::move(memory)), name_{id, std::uint32_t(::getpid()), memory_.file_descriptor()}, last_generation_(RandomNumber()) {
  header().magic = kMagic;
  header().id = id;
  free_[sizeof(ArenaHeader)] = kArenaBytes - sizeof(ArenaHeader);
  for (std::uint32_t slot = kArenaSlots; slot-- > 0;) free_slots_.push_back(slot);
}

void* SharedArena::Take(std::size_t bytes) {
  if (bytes > kArenaBytes || free_slots_.empty()) return nullptr;
  const std::size_t wanted = RoundedUp(bytes);
  for (auto room = free_.begin(); room != free_.end(); ++room) {
    const auto [offset, size] = *room;
    if (size < wanted) continue;
    free_.erase(room);
    if (size > wanted) free_[offset + wanted] = size - wanted;
    void* const block = base_ + offset;
    taken_[block] = {wanted, free_slots_.back(), 0};
    free_slots_.pop_back();
    Renew(block);
    return block;
  }
  return nullptr;
}

void SharedArena::Renew(void* block) {
  Block& taken = taken_.at(block);
  if (++last_generation_ == 0) ++last_generation_;
  taken.generation = last_generation_;
  header().generations[taken.slot].store(taken.generation, std::memory_order_relaxed);
  // Readers see the new generation before anything written to the block from now on, even by stores that bypass the caches.
  std::atomic_thread_fence(std::memory_order_seq_cst);
}

void SharedArena::GiveBack(void* block) {
  const auto taken = taken_.find(block);
  CHECK(taken != taken_.end()) << "a block that was not taken from here";
  header().generations[taken->second.slot].store(0, std::memory_order_relaxed);
  std::atomic_thread_fence(std::memory_order_seq_cst);
  free_slots_.push_back(taken->second.slot);
  std::size_t offset = std::size_t(static_cast<std::byte*>(block) - base_), bytes = taken->second.bytes;
  taken_.erase(taken);
  (void)::madvise(block, bytes, MADV_REMOVE);  // if that fails the memory is merely kept
  // Join it with free neighbours.
  const auto after = free_.find(offset + bytes);
  if (after != free_.end()) {
    bytes += after->second;
    free_.erase(after);
  }
  const auto next = free_.lower_bound(offset);
  if (next != free_.begin() && std::prev(next)->first + std::prev(next)->second == offset) {
    std::prev(next)->second += bytes;
  } else {
    free_[offset] = bytes;
  }
}

BlockName SharedArena::NameOf(const void* block) const {
  const auto taken = taken_.find(block);
  CHECK(taken != taken_.end()) << "a block that was not taken from here";
  return {std::uint64_t(static_cast<const std::byte*>(block) - base_), taken->second.generation, taken->second.slot};
}

// ---------------------------------------------------------------- a reader

Result<std::shared_ptr<const MappedArena>> MappedArena::Open(const ArenaName& name) {
  Result<SealedMemory> memory = SealedMemory::Open(name.pid, name.file_descriptor, kArenaBytes, kArenaBytes);
  if (!memory.ok()) return memory.status();
  const auto* header = reinterpret_cast<const ArenaHeader*>(memory->data());
  if (header->magic != kMagic || header->id != name.id) {
    return Status::InvalidArgument("shared memory: " + PlaceOfMemory(name.pid, name.file_descriptor) + " is another one");
  }
  return std::shared_ptr<const MappedArena>(new MappedArena(*std::move(memory)));
}

const std::byte* MappedArena::Find(const BlockName& block, std::uint64_t bytes) const {
  const bool fits = block.slot < kArenaSlots && block.offset >= sizeof(ArenaHeader) && block.offset % kBlockAlignment == 0 &&
                    block.offset <= kArenaBytes && bytes <= kArenaBytes - block.offset;
  return fits ? base_ + block.offset : nullptr;
}

bool MappedArena::Holds(const BlockName& block) const {
  std::atomic_thread_fence(std::memory_order_acquire);
  return block.generation != 0 && block.slot < kArenaSlots &&
         reinterpret_cast<const ArenaHeader*>(base_)->generations[block.slot].load(std::memory_order_relaxed) == block.generation;
}

}  // namespace slabstream
