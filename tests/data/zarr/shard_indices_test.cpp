// Indices of shards are kept within their bytes, and failures are not.
#include "data/zarr/shard_indices.h"

#include <gtest/gtest.h>

namespace slabstream {
namespace {

using zarr::ShardIndex;
using zarr::ShardIndices;

ShardIndices::Index IndexOfBytes(std::size_t bytes) { return std::make_shared<const ShardIndex>(Bytes(std::vector<std::byte>(bytes))); }

TEST(ShardIndicesTest, KeepsTheLastUsedOnesWithinItsBytes) {
  constexpr std::uint64_t kMost = 10'000;
  ShardIndices indices(kMost);
  int told = 0;
  const auto done = [&](const Result<ShardIndices::Index>& index) { told += index.ok() ? 1 : 0; };
  constexpr int kShards = 50;
  for (int i = 0; i < kShards; ++i) {
    const std::string shard = "c/" + std::to_string(i);
    EXPECT_TRUE(indices.Ask(shard, done));
    EXPECT_FALSE(indices.Ask(shard, done)) << "it is being read already";
    indices.Put(shard, IndexOfBytes(1024));
    EXPECT_LE(indices.bytes(), kMost);
    EXPECT_FALSE(indices.Ask("c/0", done)) << "it was used again and again";
  }
  EXPECT_EQ(told, 3 * kShards);
  EXPECT_FALSE(indices.Ask("c/49", done));
  EXPECT_TRUE(indices.Ask("c/1", done)) << "it had to go";
  indices.Put("c/1", IndexOfBytes(2 * kMost));
  EXPECT_LE(indices.bytes(), kMost);
}

TEST(ShardIndicesTest, TellsFailuresAndForgetsThem) {
  ShardIndices indices(1000);
  Status told;
  const auto done = [&](const Result<ShardIndices::Index>& index) { told = index.status(); };
  EXPECT_TRUE(indices.Ask("shard", done));
  indices.Put("shard", Status::DataLoss("damaged"));
  EXPECT_EQ(told, Status::DataLoss("damaged"));
  EXPECT_TRUE(indices.Ask("shard", done));
  indices.Put("shard", ShardIndices::Index());
  EXPECT_TRUE(told.ok());
  EXPECT_FALSE(indices.Ask("shard", done));
  indices.Forget("shard");
  EXPECT_TRUE(indices.Ask("shard", done));
}

}  // namespace
}  // namespace slabstream
