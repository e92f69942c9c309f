#include "common/memory/pooled_vector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <random>
#include <thread>

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
