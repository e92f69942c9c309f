// A volume of several sources, held against the same voxels in one.
#include "data/mosaic/mosaic_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <set>

#include "data/mosaic/box_tree.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

constexpr Index3 kSize = {23, 17, 29};

float ValueAt(const Index3& v) { return float(v.x + 100 * v.y + 10'000 * v.z); }

SourceInfo InfoOf(const Index3& size) {
  SourceInfo info;
  info.levels = {{{{size}, ScalarType::kFloat32, {}}, Min(size, {5, 4, 2})}};
  info.exact = {SampleType::kFloat32, {}};
  return info;
}

using ValueFunction = std::function<float(const Index3& voxel)>;

// The voxels of a box of the volume of such values.
class BoxOfValues : public VolumeSource {
 public:
  BoxOfValues(const Box& box, ValueFunction value, std::shared_ptr<std::atomic<int>> open)
      : box_(box), value_(std::move(value)), info_(InfoOf(box.size())), open_(std::move(open)) {
    ++*open_;
  }
  ~BoxOfValues() override { --*open_; }

  const SourceInfo& info() const override { return info_; }
  Counts counts() const override { return {.stored_bytes = read_}; }
  void Read(int /*level*/, const Box& box, const BoxRoom& out, std::stop_token /*stop*/, ReadDone done) override {
    for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
        for (std::int32_t x = box.begin.x; x < box.end.x; ++x) {
          const std::int64_t at = (z - box.begin.z) * out.slice + (y - box.begin.y) * out.row + x - box.begin.x;
          reinterpret_cast<float*>(out.first)[at] = value_(Index3{x, y, z} + box_.begin);
        }
      }
    }
    read_ += std::uint64_t(box.voxel_count());
    done(Status::Ok());
  }

 private:
  const Box box_;
  const ValueFunction value_;
  const SourceInfo info_;
  const std::shared_ptr<std::atomic<int>> open_;
  std::atomic<std::uint64_t> read_ = 0;
};

class Mosaic : public testing::Test {
 protected:
  Result<std::shared_ptr<VolumeSource>> SourceOf(const Box& box, const ValueFunction& value) const {
    return std::shared_ptr<VolumeSource>(std::make_shared<BoxOfValues>(box, value, open_));
  }
  MosaicPart PartOf(const Box& box) {
    return {"part", box, [this, box] { return SourceOf(box, ValueAt); }};
  }
  static Index3 At(const Box& box, std::size_t number) {
    const Index3 size = box.size();
    const auto n = std::int32_t(number);
    return box.begin + Index3{n % size.x, n / size.x % size.y, n / size.x / size.y};
  }
  static std::int32_t Between(std::int32_t least, std::int32_t most, std::mt19937& random) {
    return std::uniform_int_distribution(least, most)(random);
  }
  static Box RandomBox(const Index3& size, std::mt19937& random) {
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
      box.begin[axis] = Between(0, size[axis] - 1, random);
      box.end[axis] = Between(box.begin[axis] + 1, size[axis], random);
    }
    return box;
  }
  // Slabs along random axes, which share up to two layers with their neighbours.
  std::vector<Box> RandomParts(int count, std::mt19937& random) const {
    std::vector<Box> parts = {{{0, 0, 0}, kSize}};
    while (int(parts.size()) < count) {
      const auto cut = std::size_t(Between(0, int(parts.size()) - 1, random));
      const int axis = Between(0, 2, random);
      Box& low = parts[cut];
      if (low.size()[axis] < 2) continue;
      Box high = low;
      high.begin[axis] = Between(low.begin[axis] + 1, low.end[axis] - 1, random);
      low.end[axis] = std::min(high.begin[axis] + Between(0, 2, random), low.end[axis]);
      parts.push_back(high);
    }
    std::ranges::shuffle(parts, random);
    return parts;
  }
  static void ExpectValues(VolumeSource& source, const Box& box) {
    std::vector<float> read(std::size_t(box.voxel_count()), -1);
    ASSERT_TRUE(source.ReadNow(0, box, std::as_writable_bytes(std::span(read))).ok());
    for (std::size_t i = 0; i < read.size(); ++i) {
      ASSERT_EQ(read[i], ValueAt(At(box, i)));
    }
  }

  std::shared_ptr<std::atomic<int>> open_ = std::make_shared<std::atomic<int>>(0);  // sources
};

TEST_F(Mosaic, IsTheVolumeOfItsParts) {
  const unsigned seed = 61;
  std::mt19937 random(seed);
  for (const int count : {1, 2, 7, 40, 300}) {
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << count << " parts");
    open_ = std::make_shared<std::atomic<int>>(0);
    std::vector<MosaicPart> parts;
    for (const Box& box : RandomParts(count, random)) parts.push_back(PartOf(box));
    const auto mosaic = MakeMosaic("m", InfoOf(kSize), {parts});
    ASSERT_TRUE(mosaic.ok()) << mosaic.status().message();
    EXPECT_EQ(*open_, 1) << "a part is opened by who needs it";
    std::int64_t voxels = 0;
    for (int i = 0; i < 20; ++i) {
      const Box box = RandomBox(kSize, random);
      ExpectValues(**mosaic, box);
      voxels += box.voxel_count();
    }
    EXPECT_EQ((*mosaic)->counts().stored_bytes, std::uint64_t(voxels)) << "no voxel is read twice, and closed parts count";
    EXPECT_LE(*open_, 64);
  }
}

// Boxes may overlap, repeat and be empty.
TEST_F(Mosaic, ATreeFindsTheBoxesThatMeetOne) {
  const unsigned seed = 63;
  std::mt19937 random(seed);
  for (const int count : {0, 1, 8, 9, 500}) {
    auto boxes = std::make_shared<std::vector<Box>>();
    for (int i = 0; i < count; ++i) boxes->push_back(i % 7 == 6 ? boxes->front() : RandomBox(i % 5 == 4 ? kSize : Uniform(9), random));
    if (count > 8) boxes->back() = {};
    const BoxTree tree(boxes);
    for (int i = 0; i < 50; ++i) {
      const Box box = RandomBox(kSize, random);
      std::vector<std::uint32_t> met;
      for (std::size_t n = 0; n < boxes->size(); ++n) {
        if (!Intersection((*boxes)[n], box).empty()) met.push_back(std::uint32_t(n));
      }
      ASSERT_EQ(tree.Meeting(box), met) << "seed " << seed << ", " << count << " boxes";
    }
  }
}

TEST_F(Mosaic, OpensTheFirstPartAndThoseOfABox) {
  const auto mosaic = MakeMosaic("m", InfoOf(kSize), {{PartOf({{0, 0, 0}, {10, 17, 29}}), PartOf({{10, 0, 0}, kSize})}});
  ASSERT_TRUE(mosaic.ok());
  EXPECT_EQ(*open_, 1);
  ExpectValues(**mosaic, {{0, 0, 0}, {10, 17, 29}});
  EXPECT_EQ(*open_, 1);
  ExpectValues(**mosaic, {{9, 0, 0}, {12, 5, 5}});
  EXPECT_EQ(*open_, 2);
}

TEST_F(Mosaic, BlocksAreThoseOfPartsWhereTheseBeginAtThem) {
  const auto mosaic =
      MakeMosaic("m", InfoOf(kSize), {{PartOf({{0, 0, 0}, {10, 17, 29}}), PartOf({{10, 0, 0}, {23, 17, 7}}), PartOf({{10, 0, 7}, kSize})}});
  ASSERT_TRUE(mosaic.ok());
  EXPECT_EQ((*mosaic)->info().levels.front().block, (Index3{5, 4, 1}));
}

// Patches of three levels over a coarse grid: a linear field is exact at each of them, wherever patches lie.
TEST_F(Mosaic, WhatLiesInNoPatchIsInterpolatedBetweenCoarserVoxels) {
  const unsigned seed = 62;
  std::mt19937 random(seed);
  SourceInfo info = InfoOf({48, 40, 56});
  info.levels.clear();
  for (const int step : {1, 2, 8}) {
    VolumeDescription level{{Index3{48, 40, 56} / Uniform(step), double(step) * Vec3{0.5, 0.5, 2}}, ScalarType::kFloat32, {}};
    level.geometry.orientation.origin = Vec3{10, 20, 30} + double(step) * Vec3{0.25, 0.25, 1};
    info.levels.push_back({level, Uniform(1)});
  }
  const auto part = [&](std::size_t level, const Box& box) {
    const VolumeGeometry geometry = info.levels[level].description.geometry;
    const auto value = [geometry](const Index3& v) { return float(Dot(geometry.ToWorld(ToVec3(v)), {1, -3, 0.25})); };
    return MosaicPart{"part", box, [this, box, value] { return SourceOf(box, value); }};
  };
  std::vector<std::vector<MosaicPart>> levels(3);
  levels[2].push_back(part(2, {{0, 0, 0}, {6, 5, 7}}));
  for (const std::size_t level : {0U, 1U}) {
    for (int i = 0; i < 6; ++i) levels[level].push_back(part(level, RandomBox(info.levels[level].description.geometry.size, random)));
  }
  const auto mosaic = MakeMosaic("m", info, levels);
  ASSERT_TRUE(mosaic.ok()) << mosaic.status().message();
  for (const std::size_t level : {0U, 1U, 2U}) {
    const VolumeGeometry& geometry = info.levels[level].description.geometry;
    for (int i = 0; i < 20; ++i) {
      const Box box = RandomBox(geometry.size, random);
      std::vector<float> read(std::size_t(box.voxel_count()));
      ASSERT_TRUE((*mosaic)->ReadNow(int(level), box, std::as_writable_bytes(std::span(read))).ok());
      for (std::size_t n = 0; n < read.size(); ++n) {
        const Index3 voxel = At(box, n);
        // Beyond the outermost centres of the coarsest level values are constant, and reach from there as far as a voxel of the next one.
        const VolumeGeometry& coarsest = info.levels[2].description.geometry;
        const Vec3 place = geometry.ToWorld(ToVec3(voxel)), beside = info.levels[1].description.geometry.spacing;
        const Vec3 first = coarsest.ToWorld({}) + beside, last = coarsest.ToWorld(ToVec3(coarsest.size - Uniform(1))) - beside;
        if (place.x < first.x || place.y < first.y || place.z < first.z || place.x > last.x || place.y > last.y || place.z > last.z)
          continue;
        ASSERT_NEAR(read[n], Dot(place, {1, -3, 0.25}), 1e-4) << "seed " << seed << ", level " << level;
      }
    }
  }
}

TEST_F(Mosaic, WhatIsMissingOrDoesNotFitIsSaid) {
  EXPECT_THAT(MakeMosaic("m", InfoOf(kSize), {{PartOf({{0, 0, 0}, {23, 17, 28}}), PartOf({{1, 0, 27}, kSize})}}).status().message(),
              HasSubstr("m: its parts hold 11322 of the 11339 voxels between them"));
  const auto read = [&](const MosaicPart& second) {
    const auto mosaic = MakeMosaic("m", InfoOf(kSize), {{PartOf({{0, 0, 0}, {10, 17, 29}}), second}});
    EXPECT_TRUE(mosaic.ok());
    std::vector<float> room(CountIn(kSize));
    return (*mosaic)->ReadNow(0, {{0, 0, 0}, kSize}, std::as_writable_bytes(std::span(room))).message();
  };
  MosaicPart part = PartOf({{10, 0, 0}, {23, 17, 28}});
  part.box = {{10, 0, 0}, kSize};
  EXPECT_THAT(read(part), HasSubstr("m: part has 13 x 17 x 28 voxels, must have 13 x 17 x 29"));
  part.open = [] { return Result<std::shared_ptr<VolumeSource>>(Status::NotFound("part.vti: No such file or directory")); };
  EXPECT_THAT(read(part), HasSubstr("part.vti: No such file"));
}

}  // namespace
}  // namespace slabstream
