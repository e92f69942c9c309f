// Files of FLASH, held against a field of the places of their cells.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "common/volume/indices.h"
#include "data/open/open_source.h"
#include "tests/data/hdf5/hdf5_files.h"
#include "tests/data/sources/opened_source.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

constexpr Index3 kCells = {4, 6, 4};                 // of a block
const Vec3 kLow = {-1, 2, 10}, kSide = {2, 3, 1.5};  // of the first block

double FieldAt(const Vec3& place) { return place.x - 3 * place.y + 0.25 * place.z; }

// What a file says of its blocks.
struct Blocks {
  std::vector<std::int64_t> levels;
  std::vector<double> corners;  // from and to along x, y and z
  std::vector<double> values;
};

class FlashTest : public testing::Test {
 protected:
  static void Add(Blocks& blocks, int level, const Vec3& low, const Vec3& side) {
    blocks.levels.push_back(level);
    for (int axis = 0; axis < 3; ++axis) blocks.corners.insert(blocks.corners.end(), {low[axis], low[axis] + side[axis]});
    for (int z = 0; z < kCells.z; ++z) {
      for (int y = 0; y < kCells.y; ++y) {
        for (int x = 0; x < kCells.x; ++x)
          blocks.values.push_back(FieldAt(low + side * (Vec3{x + 0.5, y + 0.5, z + 0.5} / ToVec3(kCells))));
      }
    }
  }
  // Two blocks along x, of which the first has eight finer ones, and one of these eight more.
  static Blocks Tree() {
    Blocks blocks;
    const auto add_children = [&](int level, const Vec3& low, const Vec3& side) {
      for (int child = 0; child < 8; ++child) {
        Add(blocks, level, low + 0.5 * side * Vec3{double(child & 1), double(child >> 1 & 1), double(child >> 2)}, 0.5 * side);
      }
    };
    Add(blocks, 1, kLow, kSide);
    add_children(2, kLow, kSide);
    add_children(3, kLow + 0.5 * kSide, 0.5 * kSide);
    Add(blocks, 1, kLow + Vec3{kSide.x, 0, 0}, kSide);
    return blocks;
  }
  Result<std::shared_ptr<VolumeSource>> Write(const Blocks& blocks, const std::string& variable = "dens", hsize_t chunk = 0) {
    const hsize_t count = blocks.levels.size();
    Hdf5Writer file(path_);
    file.Write("/refine level", {.size = {count}, .type = SampleType::kInt64}, blocks.levels.data());
    file.Write("/node type", {.size = {count}, .type = SampleType::kInt64}, blocks.levels.data());
    file.Doubles("/bounding box", {count, 3, 2}, blocks.corners);
    Hdf5Writer::Layout layout{.size = {count, hsize_t(kCells.z), hsize_t(kCells.y), hsize_t(kCells.x)}, .type = SampleType::kFloat64};
    if (chunk > 0) layout.chunk = {chunk, 1, 3, 4};
    file.Write("/dens", layout, blocks.values.data());
    file.Write("/pres", layout, blocks.values.data());
    return OpenLater(variable);
  }
  Result<std::shared_ptr<VolumeSource>> OpenLater(const std::string& variable) const {
    return OpenSource(path_, {.dataset = variable}, context_);
  }

  const TemporaryDirectory directory_;
  const std::string path_ = directory_ / "run_hdf5_plt_cnt_0000";
  const SourceContext context_ = TestReadContext();
};

TEST_F(FlashTest, ALinearFieldIsThatOfItsPlace) {
  for (const hsize_t chunk : {0, 3}) {
    { [[maybe_unused]] const auto closed = Write(Tree(), "dens", chunk); }
    for (const std::string variable : {"dens", "pres"}) {
      const std::shared_ptr<VolumeSource> source = Opened(OpenLater(variable));
      ASSERT_EQ(source->info().levels.size(), 3U);
      EXPECT_EQ(source->info().finest().geometry.size, (Index3{4 * 8, 4 * 6, 4 * 4}));
      EXPECT_EQ(source->info().levels[0].refined->size(), 8U);
      // In the outermost cells, which may be coarse, values are constant.
      const VolumeGeometry& geometry = source->info().finest().geometry;
      EXPECT_NEAR(Length(geometry.ToWorld({-0.5, -0.5, -0.5}) - kLow), 0, 1e-12);
      const Box inner = {Uniform(4), geometry.size - Uniform(4)};
      const AlignedVector<std::byte> bytes = ReadBox(*source, 0, inner);
      std::size_t i = 0;
      for (const Index3& voxel : IndicesIn(inner)) {
        ASSERT_NEAR(reinterpret_cast<const float*>(bytes.data())[i++], FieldAt(geometry.ToWorld(ToVec3(voxel))), 1e-5);
      }
    }
  }
}

TEST_F(FlashTest, WhatIsWrongIsSaidInOneLine) {
  { [[maybe_unused]] const auto closed = Write(Tree()); }
  ExpectRefusal(OpenLater(""), "choose one by its name (--array): dens, pres");
  ExpectRefusal(OpenLater("temp"), "has no array 'temp'; it has dens, pres");
  const auto refused = [&](const std::function<void(Blocks&)>& change, const std::string& why) {
    Blocks blocks = Tree();
    change(blocks);
    { [[maybe_unused]] const auto closed = Write(blocks); }
    ExpectRefusal(OpenLater("dens"), why);
  };
  refused([](Blocks& blocks) { blocks.corners[6] += 0.05, blocks.corners[7] += 0.05; },
          "block 1 does not lie on cells of its level along x");
  refused([](Blocks& blocks) { blocks.corners[7] += 1; }, "does not lie on cells of its level");
  refused([](Blocks& blocks) { blocks.corners[0] = blocks.corners[1]; }, "does not lie on cells of its level");
  refused([](Blocks& blocks) { blocks.corners[3] = INFINITY; }, "has a bounding box that is not finite");
  refused([](Blocks& blocks) { blocks.levels.back() = 2; }, "level");
  refused([](Blocks& blocks) { blocks.corners.resize(12), blocks.levels.resize(2), blocks.values.resize(2 * 96), blocks.levels[0] = 2; },
          "level");
  refused(
      [](Blocks& blocks) {
        for (std::size_t i = 0; i < 2; ++i) blocks.corners[blocks.corners.size() - 6 + i] += 4;
      },
      "its parts hold");
}

}  // namespace
}  // namespace slabstream
