// Boxes of a picture of several levels: each lies in zones of one level, and none is too large.
#include "common/planning/level_partition.h"
#include "common/volume/indices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "tests/support/random.h"

namespace slabstream {
namespace {

LevelMap RandomMap(Random& random, const Index3& size) {
  LevelMap map{.levels = {0, 1, 2}};
  for (const Axis axis : kAxes) {
    map.side[axis] = random.Integer(1, size[axis]);
    map.counts[axis] = (size[axis] - 1) / map.side[axis] + 1;
  }
  constexpr std::array<std::uint8_t, 4> kLevels = {0, 1, 2, LevelMap::kOutside};
  const std::size_t kinds = random.Integer<std::size_t>(1, 4);
  for (std::size_t zone = 0; zone < CountIn(map.counts); ++zone)
    map.of_zone.push_back(kLevels.at(random.Integer<std::size_t>(0, kinds - 1)));
  return map;
}

TEST(LevelPartition, BoxesTileTheVolumeAndKeepToZonesOfOneLevelUnlessThereAreVeryMany) {
  Random random(71);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 200; ++round) {
    const Index3 size = {random.Integer(1, 60), random.Integer(1, 60), random.Integer(1, 60)};
    const LevelMap map = RandomMap(random, size);
    LevelPartitionRequest request{
        .map = &map,
        .size = size,
        .least_boxes = random.Integer(1, 30),
        .most_bytes = random.Integer(1, 20'000),
        .bytes_of = [](const LevelBox& at) { return std::max<std::int64_t>(at.box.voxel_count() >> (3 * at.level), 1); },
        .blocks_of = [&](std::uint8_t level) { return level == 0 ? Index3{} : Uniform(4 << level); }};
    const auto [partition, levels] = DivideByLevels(request);  // checks that boxes tile the bounds
    ASSERT_EQ(partition.bounds(), (Box{{0, 0, 0}, size}));
    ASSERT_EQ(levels.size(), partition.boxes().size());
    int shown = 0, mixed = 0;
    for (std::size_t i = 0; i < levels.size(); ++i) {
      const Box& box = partition.boxes()[i];
      std::set<std::uint8_t> met;
      for (const Index3& zone : IndicesIn(map.counts)) {
        if (!Intersection(map.BoxOf(zone, size), box).empty()) met.insert(map.Of(zone));
      }
      // Of very many small parts some boxes hold several levels, and have the finest of them.
      ASSERT_EQ(*met.begin(), levels[i]);
      mixed += met.size() > 1 ? 1 : 0;
      if (levels[i] == LevelMap::kOutside) continue;
      ++shown;
      ASSERT_LE(request.bytes_of({box, levels[i]}), request.most_bytes);
    }
    EXPECT_TRUE(mixed == 0 || levels.size() >= 768);
    const bool any = std::ranges::any_of(map.of_zone, [](std::uint8_t level) { return level != LevelMap::kOutside; });
    EXPECT_GE(shown, any ? 1 : 0);
    const auto again = DivideByLevels(request);
    EXPECT_EQ(again.partition, partition);
    EXPECT_EQ(again.levels, levels);
    // Each place has one level, for however many workers with however much memory.
    request.least_boxes = 1;
    request.most_bytes = 1 << 20;
    const auto other = DivideByLevels(request);
    for (std::size_t i = 0; i < levels.size(); ++i) {
      for (std::size_t j = 0; j < other.levels.size(); ++j) {
        if (Intersection(partition.boxes()[i], other.partition.boxes()[j]).empty()) continue;
        ASSERT_EQ(levels[i], other.levels[j]);
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
