// Voxels kept brick by brick are the same voxels.
#include "common/volume/bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <numeric>
#include <vector>

#include "common/volume/box_assembly.h"
#include "tests/support/random_box.h"
#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

// About half of the bricks hold one value, 0 or another one; the others anything.
Volume PatchyVolume(Random& random, const Index3& size, ScalarType type) {
  Volume volume = RandomVolume(random, size, type);
  const BrickGrid grid(volume.block.box);
  std::vector<int> values(grid.size());
  for (int& value : values) value = random.Chance(0.5) ? -1 : random.Integer(0, 2);
  VisitScalarType(type, [&]<class T>(const T*) {
    T* sample = volume.block.samples<T>();
    for (Index3 v; v.z < size.z; ++v.z) {
      for (v.y = 0; v.y < size.y; ++v.y) {
        for (v.x = 0; v.x < size.x; ++v.x, ++sample) {
          if (const int value = values[grid.Number({v.x / kBrick, v.y / kBrick, v.z / kBrick})]; value >= 0) *sample = T(value);
        }
      }
    }
  });
  return volume;
}

VoxelBlock Cut(const VoxelBlock& block, const Box& box) {
  VoxelBlock part = MakeVoxelBlock(box, block.type);
  const std::size_t sample = BytesPerSample(block.type);
  for (Index3 v = box.begin; v.z < box.end.z; ++v.z) {
    for (v.y = box.begin.y; v.y < box.end.y; ++v.y) {
      std::memcpy(&part.bytes[sample * std::size_t(part.Offset(v))], &block.bytes[sample * std::size_t(block.Offset(v))],
                  sample * std::size_t(box.size().x));
    }
  }
  return part;
}

TEST(Bricks, TileTheBox) {
  const BrickGrid grid({{3, 20, 16}, {50, 33, 17}});
  EXPECT_EQ(grid.counts, (Index3{4, 2, 1}));
  std::int64_t voxels = 0;
  for (Index3 brick = grid.first; brick.y < grid.first.y + grid.counts.y; ++brick.y) {
    for (brick.x = grid.first.x; brick.x < grid.first.x + grid.counts.x; ++brick.x) {
      const Box box = grid.BoxOf(brick);
      EXPECT_TRUE(grid.box.Contains(box));
      EXPECT_LT(grid.Number(brick), grid.size());
      voxels += box.voxel_count();
    }
  }
  EXPECT_EQ(voxels, grid.box.voxel_count());
  EXPECT_EQ(BrickGrid(Box{}).size(), 0U);
}

TEST(BrickedVoxels, WhatWasWrittenInPiecesIsRead) {
  Random random(41);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 60; ++round) {
    const ScalarType type = kTypes[round % 3];
    const std::size_t sample = BytesPerSample(type);
    const Volume volume = PatchyVolume(random, {random.Integer(1, 70), random.Integer(1, 40), random.Integer(1, 40)}, type);
    const VoxelBlock slab = Cut(volume.block, RandomBox(random, volume.block.box));
    BrickedVoxels bricks(slab.box, type);

    // Pieces in any order, some of them twice.
    const std::size_t piece = sample * std::size_t(random.Integer(1, 3000));
    std::vector<std::size_t> begins;
    for (std::size_t begin = 0; begin < slab.bytes.size(); begin += piece) begins.push_back(begin);
    for (std::size_t i = begins.size(); i > 1; --i) std::swap(begins[i - 1], begins[random.Integer(std::size_t{0}, i - 1)]);
    begins.push_back(begins.front());
    for (std::size_t begin : begins) {
      bricks.Write(slab.box, begin, std::span(slab.bytes).subspan(begin, std::min(piece, slab.bytes.size() - begin)));
    }

    const Box part = RandomBox(random, slab.box);
    const VoxelBlock expected = Cut(slab, part);
    const std::size_t skipped = sample * std::size_t(random.Integer(std::int64_t{0}, part.voxel_count() - 1));
    std::vector<std::byte> read(expected.bytes.size() - skipped);
    for (const VoxelBricks& voxels : {VoxelBricks(bricks), VoxelBricks(slab)}) {
      std::ranges::fill(read, std::byte{0});
      voxels.Read(part, skipped, read);
      ASSERT_EQ(std::memcmp(read.data(), expected.bytes.data() + skipped, read.size()), 0) << "round " << round;
    }
  }
}

TEST(BrickedVoxels, WhatWasWrittenBoxByBoxIsRead) {
  Random random(43);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 60; ++round) {
    const ScalarType type = kTypes[round % 3];
    const Volume volume = PatchyVolume(random, {random.Integer(1, 70), random.Integer(1, 40), random.Integer(1, 40)}, type);
    const VoxelBlock slab = Cut(volume.block, RandomBox(random, volume.block.box));
    std::vector<Box> boxes = Difference(slab.box, RandomBox(random, slab.box));
    const std::vector<Box> rest = Assemble(slab.box, boxes).missing;
    boxes.insert(boxes.end(), rest.begin(), rest.end());
    BrickedVoxels bricks(slab.box, type);
    for (const Box& box : boxes) bricks.Write(box, 0, Cut(slab, box).bytes);
    std::vector<std::byte> read(slab.bytes.size());
    VoxelBricks(bricks).Read(slab.box, 0, read);
    ASSERT_EQ(std::memcmp(read.data(), slab.bytes.data(), read.size()), 0) << "round " << round;
  }
}

TEST(BrickedVoxels, AreThoseOfABlockThroughEitherView) {
  Random random(42);
  SCOPED_TRACE(random.trace());
  for (ScalarType type : kTypes) {
    const Volume volume = PatchyVolume(random, {51, 40, 37}, type);
    const VoxelBlock block = Cut(volume.block, {{5, 0, 9}, {51, 38, 37}});
    const BrickedVoxels bricked(block);
    // The same samples within a larger array.
    const Index3 whole = volume.block.box.size();
    const VoxelBricks apart(block.box, type,
                            volume.block.bytes.data() + std::size_t(volume.block.Offset(block.box.begin)) * BytesPerSample(type), whole.x,
                            std::ptrdiff_t{whole.x} * whole.y);
    const BrickGrid& grid = bricked.grid();
    VisitScalarType(type, [&]<class T>(const T*) {
      for (Index3 v = block.box.begin; v.z < block.box.end.z; ++v.z) {
        for (v.y = block.box.begin.y; v.y < block.box.end.y; ++v.y) {
          for (v.x = block.box.begin.x; v.x < block.box.end.x; ++v.x) {
            const Index3 brick = {v.x / kBrick, v.y / kBrick, v.z / kBrick};
            const std::int32_t x = v.x - grid.BoxOf(brick).begin.x;
            const T expected = block.samples<T>()[block.Offset(v)];
            ASSERT_EQ(VoxelBricks(block).View<T>(brick).Row(v.y, v.z)[x], expected);
            ASSERT_EQ(VoxelBricks(bricked).View<T>(brick).Row(v.y, v.z)[x], expected);
            ASSERT_EQ(apart.View<T>(brick).Row(v.y, v.z)[x], expected);
          }
        }
      }
    });
  }
}

TEST(BrickedVoxels, KeepOneRowOfABrickWhoseSamplesAreEqual) {
  const auto memory_of = [](auto value) {
    return BrickedVoxels(MakeTestVolume({160, 160, 160}, ScalarType::kUint16, value).block).bytes();
  };
  EXPECT_LT(memory_of([](const Index3&) { return 7; }), std::size_t{160 * 160 * 160 * 2} / 50);
  // Every brick has a voxel of its own.
  EXPECT_GE(memory_of([](const Index3& v) { return v.x % 16 == 5 && v.y % 16 == 6 && v.z % 16 == 15; }), std::size_t{160 * 160 * 160 * 2});
}

TEST(BrickedVoxels, KeepTheBitsOfWhatIsNotANumber) {
  const float nan = std::bit_cast<float>(0x7FC12345U), other_nan = std::bit_cast<float>(0xFFC00001U);
  Volume volume = MakeTestVolume({40, 16, 16}, ScalarType::kFloat32, [&](const Index3& v) { return v.x < 16 ? nan : -0.0F; });
  volume.block.samples<float>()[35] = other_nan;
  std::vector<std::byte> read(volume.block.bytes.size());
  const BrickedVoxels bricks(volume.block);
  VoxelBricks(bricks).Read(volume.block.box, 0, read);
  EXPECT_EQ(std::memcmp(read.data(), volume.block.bytes.data(), read.size()), 0);
}

// A part has its own bricks, cut off by its box, of voxels that stay where they are.
TEST(VoxelBricks, APartIsTheSameVoxelsInPlace) {
  Random random(17);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 40; ++i) {
    const Index3 size = {random.Integer(1, 70), random.Integer(1, 50), random.Integer(1, 40)};
    const Volume volume = PatchyVolume(random, size, ScalarType(random.Integer(1, 3)));
    const BrickedVoxels bricked(volume.block);
    const Box box = RandomBox(random, volume.block.box);
    if (box.empty()) continue;
    const VoxelBlock expected = Cut(volume.block, box);
    for (const VoxelBricks& whole : {VoxelBricks(volume.block), VoxelBricks(bricked)}) {
      const VoxelBricks part = whole.Part(box);
      EXPECT_EQ(part.box(), box);
      VoxelBlock read = MakeVoxelBlock(box, part.type());
      part.Read(box, 0, read.bytes);
      EXPECT_EQ(read.bytes, expected.bytes);
      EXPECT_EQ(part.Block().box, box);
      EXPECT_EQ(part.Block().bytes, expected.bytes);
      VisitScalarType(part.type(), [&]<class T>(const T*) {
        for (std::size_t number = 0; number < part.grid().size(); ++number) {
          const Index3 brick = part.grid().first + PlaceIn(part.grid().counts, number);
          const Box of_brick = part.grid().BoxOf(brick);
          const BrickView<T> view = part.View<T>(brick);
          ASSERT_EQ(view.begin, of_brick.begin);
          for (std::int32_t z = of_brick.begin.z; z < of_brick.end.z; ++z) {
            for (std::int32_t y = of_brick.begin.y; y < of_brick.end.y; ++y) {
              const T* const row = expected.samples<T>() + expected.Offset({of_brick.begin.x, y, z});
              ASSERT_EQ(std::memcmp(view.Row(y, z), row, std::size_t(of_brick.size().x) * sizeof(T)), 0);
            }
          }
        }
      });
    }
  }
}

}  // namespace
}  // namespace slabstream
