#include "data/sources/chunk_cache.h"

#include <gtest/gtest.h>

#include <vector>

namespace slabstream {
namespace {

Bytes Elements(std::size_t count, std::uint8_t value) { return Bytes(std::vector<std::byte>(count, std::byte{value})); }

TEST(ChunkCacheTest, DropsTheChunkThatWasUnusedForLongest) {
  ChunkCache cache(100);
  const ChunkCache::Owner owner = cache.NewOwner();
  cache.Keep(owner, 1, Elements(40, 1));
  cache.Keep(owner, 2, Elements(40, 2));
  EXPECT_TRUE(cache.Find(owner, 1).has_value());
  cache.Keep(owner, 3, Elements(40, 3));
  EXPECT_FALSE(cache.Find(owner, 2).has_value());
  EXPECT_EQ(cache.Find(owner, 1)->span()[0], std::byte{1});
  EXPECT_EQ(cache.Find(owner, 3)->span()[0], std::byte{3});
  EXPECT_EQ(cache.bytes(), 80U);
}

TEST(ChunkCacheTest, KeepsNothingLargerThanItsBudget) {
  ChunkCache cache(100);
  const ChunkCache::Owner owner = cache.NewOwner();
  cache.Keep(owner, 1, Elements(100, 1));
  cache.Keep(owner, 2, Elements(101, 2));
  EXPECT_TRUE(cache.Find(owner, 1).has_value());
  EXPECT_FALSE(cache.Find(owner, 2).has_value());
}

TEST(ChunkCacheTest, ForgetsTheChunksOfOneOwner) {
  ChunkCache cache(100);
  const ChunkCache::Owner one = cache.NewOwner(), other = cache.NewOwner();
  cache.Keep(one, 1, Elements(10, 1));
  cache.Keep(one, 2, Elements(10, 2));
  cache.Keep(other, 1, Elements(10, 3));
  cache.Keep(other, 1, Elements(10, 4));  // is there already
  cache.Forget(one);
  EXPECT_FALSE(cache.Find(one, 1).has_value());
  EXPECT_EQ(cache.Find(other, 1)->span()[0], std::byte{3});
  EXPECT_EQ(cache.bytes(), 10U);
}

}  // namespace
}  // namespace slabstream
