#include "common/memory/pooled_vector.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <numeric>
#include <random>
#include <thread>

#include "common/memory/aligned_buffer.h"

namespace slabstream {
namespace {

TEST(PooledVector, HoldsWhatAVectorHolds) {
  const unsigned seed = 1;
  std::mt19937 random(seed);
  std::vector<PooledVector<int>> vectors(20);
  std::vector<std::vector<int>> expected(20);
  for (int step = 0; step < 2000; ++step) {
    const std::size_t at = random() % 20, size = random() % 2 == 0 ? random() % 100 : random() % 300000;
    const int value = int(random() % 1000);
    vectors[at] = PooledVector<int>(size, value);
    expected[at].assign(size, value);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(vectors[at].data()) % 64, 0U);
    const std::size_t other = random() % 20;
    ASSERT_TRUE(std::ranges::equal(vectors[other], expected[other])) << "seed " << seed << " step " << step;
  }
}

// Volumes of one size come and go while smaller things that came between them stay: their memory is not held.
TEST(AlignedVector, LargeOnesGoBackToTheSystem) {
  const auto resident = [] {
    std::ifstream statm("/proc/self/statm");
    std::int64_t all = 0, pages = 0;
    statm >> all >> pages;
    return pages * ::sysconf(_SC_PAGESIZE);
  };
  constexpr std::size_t kBytes = std::size_t{16} << 20;
  const std::int64_t before = resident();
  std::vector<AlignedVector<std::byte>> stay;
  for (int round = 0; round < 20; ++round) {
    const AlignedVector<std::byte> volume(kBytes, std::byte{1});
    EXPECT_TRUE(kWatched || reinterpret_cast<std::uintptr_t>(volume.data()) % kHugePage == 0);
    stay.emplace_back(100'000, std::byte{2});
  }
  EXPECT_TRUE(kWatched || resident() - before < std::int64_t(2 * kBytes)) << (resident() - before);
}

TEST(MappedMemory, ReadsAsZeroAndHoldsWhatIsWrittenAtBothEnds) {
  for (const std::size_t bytes : {std::size_t{1}, kHugePage - 1, 2 * kHugePage - 1, 2 * kHugePage, 5 * kHugePage + 4097}) {
    auto* const block = static_cast<char*>(MapMemory(bytes));
    EXPECT_EQ(block[0] | block[bytes - 1], 0) << bytes;
    block[0] = block[bytes - 1] = 'x';
    EXPECT_EQ(block[bytes - 1], 'x');
    UnmapMemory(block, bytes);
  }
}

TEST(PooledVector, ResizeKeepsElementsAndWritesNoOther) {
  PooledVector<int> vector(3, 7);
  vector.reserve(10);
  std::fill_n(vector.data() + 3, 7, 9);
  vector.resize(5);
  EXPECT_EQ(vector[2], 7);
  EXPECT_EQ(vector[4], 9);
  vector.resize(7, 1);
  EXPECT_EQ(vector[6], 1);
}

#ifndef __SANITIZE_ADDRESS__
TEST(PooledVector, UsesMemoryAgain) {
  const int* first = nullptr;
  {
    const PooledVector<int> image(1000000);
    first = image.data();
  }
  const PooledVector<int> next(1000100);  // a little larger
  EXPECT_EQ(next.data(), first);
  const PooledVector<int> other(1000100);
  EXPECT_NE(other.data(), first);
}
#endif

TEST(PooledVector, ComesAndGoesOnAnyThread) {
  std::vector<std::thread> threads;
  for (unsigned seed = 0; seed < 4; ++seed) {
    threads.emplace_back([seed] {
      std::mt19937 random(seed);
      for (int step = 0; step < 200; ++step) {
        PooledVector<unsigned> vector(100000 + random() % 100000, seed);
        EXPECT_EQ(std::accumulate(vector.begin(), vector.end(), std::size_t{0}), seed * vector.size());
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace slabstream
