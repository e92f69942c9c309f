#include "common/memory/shared_arena.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <set>
#include <string>

#include "common/memory/pooled_vector.h"
#include "common/memory/sealed_memory.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

std::unique_ptr<SharedArena> NewArena() { return *SharedArena::Create(); }

TEST(SharedArena, BlocksAreReadUnderTheirNames) {
  const auto arena = NewArena();
  const auto mapped = MappedArena::Open(arena->name());
  ASSERT_TRUE(mapped.ok()) << mapped.status().message();
  void* const first = arena->Take(10000);
  void* const second = arena->Take(1);
  std::memset(first, 3, 10000);
  std::memset(second, 4, 1);
  const BlockName name = arena->NameOf(first), other = arena->NameOf(second);
  EXPECT_NE(name, other);
  ASSERT_NE((*mapped)->Find(name, 10000), nullptr);
  EXPECT_EQ(int((*mapped)->Find(name, 10000)[9999]), 3);
  EXPECT_EQ(int((*mapped)->Find(other, 1)[0]), 4);
  EXPECT_TRUE((*mapped)->Holds(name));

  arena->Renew(first);
  EXPECT_FALSE((*mapped)->Holds(name)) << "used again";
  EXPECT_TRUE((*mapped)->Holds(arena->NameOf(first)));
  arena->GiveBack(second);
  EXPECT_FALSE((*mapped)->Holds(other)) << "given back";
}

TEST(SharedArena, BlocksDoNotOverlapAndRoomIsUsedAgain) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  const auto arena = NewArena();
  std::map<std::byte*, std::size_t> blocks;
  std::set<std::uint64_t> generations;
  for (int step = 0; step < 3000; ++step) {
    if (blocks.size() < 30 || random.Chance(0.5)) {
      const auto bytes = random.Integer<std::size_t>(1, 300000);
      auto* const block = static_cast<std::byte*>(arena->Take(bytes));
      ASSERT_NE(block, nullptr);
      const auto after = blocks.lower_bound(block);
      ASSERT_TRUE(after == blocks.end() || block + bytes <= after->first);
      ASSERT_TRUE(after == blocks.begin() || std::prev(after)->first + std::prev(after)->second <= block);
      blocks[block] = bytes;
      EXPECT_TRUE(generations.insert(arena->NameOf(block).generation).second);
    } else {
      const auto gone = std::next(blocks.begin(), random.Integer<std::ptrdiff_t>(0, std::ptrdiff_t(blocks.size()) - 1));
      arena->GiveBack(gone->first);
      blocks.erase(gone);
    }
  }
  for (const auto& [block, bytes] : blocks) arena->GiveBack(block);
  void* const all = arena->Take(kArenaBytes - sizeof(ArenaHeader));
  EXPECT_NE(all, nullptr) << "what was given back is one piece again";
  EXPECT_EQ(arena->Take(1), nullptr) << "full";
}

TEST(SharedArena, RunsOutOfSlotsInOrder) {
  const auto arena = NewArena();
  for (std::uint32_t i = 0; i < kArenaSlots; ++i) ASSERT_NE(arena->Take(1), nullptr);
  EXPECT_EQ(arena->Take(1), nullptr);
}

TEST(MappedArena, OpensNothingElse) {
  const auto arena = NewArena();
  const ArenaName name = arena->name();
  const auto code = [](const ArenaName& wrong) { return MappedArena::Open(wrong).status().code(); };
  EXPECT_EQ(code({name.id + 1, name.pid, name.file_descriptor}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({name.id, name.pid, 1 << 20}), StatusCode::kNotFound);
  EXPECT_EQ(code({name.id, 0, name.file_descriptor}), StatusCode::kNotFound);
  EXPECT_EQ(code({name.id, 0xffffffffU, 0xffffffffU}), StatusCode::kNotFound);

  int pipe[2];
  ASSERT_EQ(::pipe(pipe), 0);
  EXPECT_EQ(code({name.id, name.pid, std::uint32_t(pipe[0])}), StatusCode::kInvalidArgument);
  ::close(pipe[0]);
  ::close(pipe[1]);
  // As large as an arena, but it may shrink.
  const int unsealed = ::memfd_create("unsealed", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  ASSERT_EQ(::ftruncate(unsealed, off_t(kArenaBytes)), 0);
  EXPECT_EQ(code({name.id, name.pid, std::uint32_t(unsealed)}), StatusCode::kInvalidArgument);
  ::close(unsealed);
  // The arena itself, as whoever maps it has it open for a moment.
  const int reader = ::open(PlaceOfMemory(name.pid, name.file_descriptor).c_str(), O_RDONLY | O_CLOEXEC);
  EXPECT_EQ(code({name.id, name.pid, std::uint32_t(reader)}), StatusCode::kInvalidArgument);
  ::close(reader);
  // Sealed and as large, but of huge pages: without any left, whoever reads it ends.
  if (const int huge = ::memfd_create("huge", MFD_CLOEXEC | MFD_ALLOW_SEALING | MFD_HUGETLB); huge >= 0) {
    if (::ftruncate(huge, off_t(kArenaBytes)) == 0 && ::fcntl(huge, F_ADD_SEALS, F_SEAL_SHRINK) == 0) {
      EXPECT_EQ(code({name.id, name.pid, std::uint32_t(huge)}), StatusCode::kInvalidArgument);
    }
    ::close(huge);
  }
}

TEST(MappedArena, FindsNoBlockThatLeavesTheArena) {
  const auto arena = NewArena();
  const auto mapped = *MappedArena::Open(arena->name());
  const BlockName good = arena->NameOf(arena->Take(1));
  const auto find = [&](std::uint64_t offset, std::uint32_t slot, std::uint64_t bytes) {
    return mapped->Find({offset, good.generation, slot}, bytes);
  };
  EXPECT_NE(find(good.offset, good.slot, 1), nullptr);
  EXPECT_EQ(find(0, good.slot, 1), nullptr) << "the table";
  EXPECT_EQ(find(good.offset + 1, good.slot, 1), nullptr);
  EXPECT_EQ(find(good.offset, kArenaSlots, 1), nullptr);
  EXPECT_EQ(find(good.offset, good.slot, kArenaBytes), nullptr);
  EXPECT_EQ(find(good.offset, good.slot, ~std::uint64_t{0}), nullptr);
  EXPECT_EQ(find(kArenaBytes, good.slot, 1), nullptr);
  EXPECT_EQ(find(~std::uint64_t{0} - 4095, good.slot, 8192), nullptr);
  EXPECT_FALSE(mapped->Holds({good.offset, 0, good.slot}));
  EXPECT_FALSE(mapped->Holds({good.offset, good.generation, kArenaSlots}));
}

// A reader keeps what it has mapped when the owner is killed.
TEST(MappedArena, OutlivesItsOwner) {
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  struct Message {
    ArenaName arena;
    BlockName block;
  } message;
  const pid_t child = ::fork();
  if (child == 0) {
    auto arena = SharedArena::Create();
    void* const block = (*arena)->Take(100000);
    std::memset(block, 7, 100000);
    const Message mine = {(*arena)->name(), (*arena)->NameOf(block)};
    if (::write(ready[1], &mine, sizeof(mine)) != sizeof(mine)) ::_exit(1);
    ::pause();
    ::_exit(0);
  }
  ASSERT_EQ(::read(ready[0], &message, sizeof(message)), ssize_t(sizeof(message)));
  const auto mapped = MappedArena::Open(message.arena);
  ASSERT_TRUE(mapped.ok()) << mapped.status().message();
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  const std::byte* const bytes = (*mapped)->Find(message.block, 100000);
  for (int i = 0; i < 100000; ++i) ASSERT_EQ(int(bytes[i]), 7);
  EXPECT_TRUE((*mapped)->Holds(message.block));
  EXPECT_EQ(MappedArena::Open(message.arena).status().code(), StatusCode::kNotFound);
  ::close(ready[0]);
  ::close(ready[1]);
}

TEST(BlockPin, KeepsWhatABlockHeldUntilTheLastPinIsGone) {
  ASSERT_TRUE(ShareBlocks().ok());
  ASSERT_TRUE(ShareBlocks().ok());
  const auto mapped = *MappedArena::Open(*SharedBlocksArena());
  const int* address = nullptr;
  std::optional<BlockPin> pin, second;
  {
    const PooledVector<int> image(1000000, 5);
    address = image.data();
    pin = PinOf(image);
    second = PinOf(image);
    ASSERT_TRUE(pin && second);
    EXPECT_EQ(pin->name(), second->name());
  }
  {
    const PooledVector<int> next(1000000, 6);
    EXPECT_NE(next.data(), address);
    pin.reset();
    const PooledVector<int> another(1000000, 6);
    EXPECT_NE(another.data(), address);
    const auto* numbers = reinterpret_cast<const int*>(mapped->Find(*second->name(), 4000000));
    EXPECT_EQ(numbers[999999], 5);
    EXPECT_TRUE(mapped->Holds(*second->name()));
  }
  const BlockName name = *second->name();
  second.reset();
  EXPECT_FALSE(mapped->Holds(name));
  const PooledVector<int> small(10);
  EXPECT_FALSE(PinOf(small).has_value());
  EXPECT_FALSE(PinOf(PooledVector<int>()).has_value());
}

}  // namespace
}  // namespace slabstream
