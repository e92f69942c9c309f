#include "data/sources/chunk_cache.h"

#include <gtest/gtest.h>

#include <vector>

namespace slabstream {
namespace {

class ChunkCacheTest : public testing::Test {
 protected:
  // A chunk whose elements all have the value `value`.
  void Keep(ChunkCache::Owner owner, std::uint64_t chunk, std::size_t bytes, std::uint8_t value) {
    cache_.Keep(owner, chunk, Bytes(std::vector<std::byte>(bytes, std::byte{value})));
  }
  bool Has(ChunkCache::Owner owner, std::uint64_t chunk) { return cache_.Find(owner, chunk).has_value(); }

  ChunkCache cache_{100};
  const ChunkCache::Owner one_ = cache_.NewOwner(), other_ = cache_.NewOwner();
};

TEST_F(ChunkCacheTest, DropsTheChunkThatWasUnusedForLongest) {
  Keep(one_, 1, 40, 1);
  Keep(one_, 2, 40, 2);
  EXPECT_TRUE(Has(one_, 1));
  Keep(one_, 3, 40, 3);
  EXPECT_FALSE(Has(one_, 2));
  EXPECT_EQ(cache_.Find(one_, 1)->span()[0], std::byte{1});
  EXPECT_EQ(cache_.Find(one_, 3)->span()[0], std::byte{3});
  EXPECT_EQ(cache_.bytes(), 80U);
}

TEST_F(ChunkCacheTest, KeepsNothingLargerThanItsBudget) {
  Keep(one_, 1, 100, 1);
  Keep(one_, 2, 101, 2);
  EXPECT_TRUE(Has(one_, 1));
  EXPECT_FALSE(Has(one_, 2));
}

TEST_F(ChunkCacheTest, ForgetsTheChunksOfOneOwner) {
  Keep(one_, 1, 10, 1);
  Keep(one_, 2, 10, 2);
  Keep(other_, 1, 10, 3);
  Keep(other_, 1, 10, 4);  // is there already
  cache_.Forget(one_);
  EXPECT_FALSE(Has(one_, 1));
  EXPECT_EQ(cache_.Find(other_, 1)->span()[0], std::byte{3});
  EXPECT_EQ(cache_.bytes(), 10U);
}

}  // namespace
}  // namespace slabstream
