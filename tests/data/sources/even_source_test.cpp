// Rectilinear grids on even voxels, held against the function that interpolates between their own.
#include "data/sources/even_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/data/sources/memory_source.h"
#include "tests/data/sources/opened_source.h"

namespace slabstream {
namespace {

using testing::Contains;

constexpr Index3 kSize = {9, 7, 12};

// The same source, with other coordinates.
class Rectilinear : public DescribedSource {
 public:
  using DescribedSource::DescribedSource;
  std::shared_ptr<VolumeSource> Around(std::shared_ptr<VolumeSource> source, SourceInfo info) const override {
    return std::make_shared<Rectilinear>(std::move(source), std::move(info));
  }
};

template <class T>
std::shared_ptr<VolumeSource> SourceOf(ScalarType type, const UnevenAxes& uneven, const ValueMapping& mapping,
                                       const std::function<double(const Vec3&)>& value) {
  auto volume = std::make_shared<Volume>();
  Vec3 first;
  for (const Axis axis : kAxes) {
    const std::vector<double>& centres = uneven[std::size_t(Number(axis))].centres;
    first[axis] = centres.empty() ? 0 : centres.front();
  }
  volume->description = {{.size = kSize, .orientation = {.world = World::kScene, .origin = first}}, type, mapping};
  volume->block = MakeVoxelBlock({{0, 0, 0}, kSize}, type);
  for (std::int32_t z = 0; z < kSize.z; ++z) {
    for (std::int32_t y = 0; y < kSize.y; ++y) {
      for (std::int32_t x = 0; x < kSize.x; ++x) {
        Vec3 at = {double(x), double(y), double(z)};
        for (const Axis axis : kAxes) {
          const std::vector<double>& centres = uneven[std::size_t(Number(axis))].centres;
          if (!centres.empty()) at[axis] = centres[std::size_t(at[axis])];
        }
        volume->block.samples<T>()[volume->block.Offset({x, y, z})] = T((value(at) - mapping.offset) / mapping.scale);
      }
    }
  }
  const auto plain = MakeMemorySource(volume, {});
  SourceInfo info = plain->info();
  info.uneven = uneven;
  return std::make_shared<Rectilinear>(plain, std::move(info));
}

UnevenAxis RandomAxis(std::int32_t count, ValuesAt at, std::mt19937& random) {
  std::vector<double> coordinates = {std::uniform_real_distribution(-100.0, 100.0)(random)};
  const int more = at == ValuesAt::kCells ? count : count - 1;
  for (int i = 0; i < more; ++i) coordinates.push_back(coordinates.back() + std::exp(std::uniform_real_distribution(-2.0, 1.5)(random)));
  const Result<UnevenAxis> axis = UnevenAxisOf("axis", coordinates, at);
  CHECK(axis.ok()) << axis.status().message();
  return *axis;
}

double Value(const Vec3& at) {
  return 3 + 0.5 * at.x - 0.25 * at.y + 2 * at.z + 0.01 * at.x * at.y - 0.02 * at.y * at.z + 0.001 * at.x * at.y * at.z;
}

TEST(EvenSourceTest, TrilinearFunctionsOfTheWorldStayAsTheyAre) {
  const unsigned seed = 61;
  std::mt19937 random(seed);
  for (int round = 0; round < 40; ++round) {
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", round " << round);
    UnevenAxes uneven;
    for (const Axis axis : kAxes) {
      if (random() % 3 != 0) uneven[std::size_t(Number(axis))] = RandomAxis(kSize[axis], ValuesAt(random() % 2), random);
    }
    const auto even = Opened(MakeEven("m", SourceOf<float>(ScalarType::kFloat32, uneven, {}, Value), random() % 2 == 0 ? 0 : 40));
    const VolumeGeometry& geometry = even->info().finest().geometry;
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
      box.begin[axis] = std::uniform_int_distribution(0, geometry.size[axis] - 1)(random);
      box.end[axis] = std::min(box.begin[axis] + 20, geometry.size[axis]);
    }
    const AlignedVector<std::byte> bytes = ReadBoxApart(*even, 0, box, 3);
    const auto* sample = reinterpret_cast<const float*>(bytes.data());
    for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
        for (std::int32_t x = box.begin.x; x < box.end.x; ++x) {
          Vec3 at = geometry.ToWorld(ToVec3(Index3{x, y, z}));
          for (const Axis axis : kAxes) {
            const std::vector<double>& centres = uneven[std::size_t(Number(axis))].centres;
            if (!centres.empty()) at[axis] = std::clamp(at[axis], centres.front(), centres.back());
          }
          ASSERT_NEAR(*sample++, Value(at), 1e-5 * (100 + std::abs(Value(at)))) << x << ' ' << y << ' ' << z;
        }
      }
    }
  }
}

TEST(EvenSourceTest, VoxelsFillTheAxisAndNoneIsLongerThanTheShortestDistance) {
  UnevenAxes uneven;
  uneven[2] = *UnevenAxisOf("z", {0, 1, 3, 6, 10, 15, 21, 28, 36, 45, 55, 66, 78}, ValuesAt::kCells);
  const auto source = SourceOf<float>(ScalarType::kFloat32, uneven, {}, Value);
  const auto even = Opened(MakeEven("m", source, 0));
  const VolumeGeometry& geometry = even->info().finest().geometry;
  EXPECT_EQ(geometry.size, (Index3{9, 7, 52}));
  EXPECT_EQ(geometry.spacing, (Vec3{1, 1, 1.5}));
  EXPECT_EQ(geometry.ToWorld({0, 0, -0.5}).z, 0);
  EXPECT_EQ(geometry.ToWorld({0, 0, 51.5}).z, 78);
  EXPECT_TRUE(even->info().uneven[2].centres.empty());
  EXPECT_THAT(even->info().notes, Contains("the 12 voxels along z, 1.5 to 11.5 apart, are resampled linearly to 52 even ones 1.5 apart"));
  EXPECT_THAT(Opened(MakeEven("m", source, 13))->info().notes, Contains(HasSubstr("13 even ones 6 apart; 5 of the distances are shorter")));
  ExpectRefusal(MakeEven("m", source, 11), "m: resample is 11, must be at least 12, the voxels along z");
  uneven[2] = *UnevenAxisOf("z", {0, 1e-9, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}, ValuesAt::kPoints);
  ExpectRefusal(MakeEven("m", SourceOf<float>(ScalarType::kFloat32, uneven, {}, Value), 0),
                "m: resample=even needs 1.15e+10 voxels along z, limit 65535; resample=VOXELS, of 12 or more, takes longer ones");
  const auto plain = SourceOf<float>(ScalarType::kFloat32, {}, {}, Value);
  EXPECT_EQ(Opened(MakeEven("m", plain, 0)), plain);
}

TEST(EvenSourceTest, MappedWholeNumbersBecomeFloatsOfTheSameMapping) {
  UnevenAxes uneven;
  uneven[0] = *UnevenAxisOf("x", {0, 2, 3, 4, 5, 6, 7, 8, 9}, ValuesAt::kPoints);
  const ValueMapping mapping = {0.5, -100};
  const auto even =
      Opened(MakeEven("m", SourceOf<std::uint16_t>(ScalarType::kUint16, uneven, mapping, [](const Vec3& at) { return at.x; }), 21));
  EXPECT_EQ(even->info().finest().type, ScalarType::kFloat32);
  const Result<std::vector<float>> samples = SamplesOf<float>(*even);
  ASSERT_TRUE(samples.ok());
  for (const int x : {2, 3, 7, 19}) {  // half a distance each, from -1 on
    EXPECT_EQ(mapping.FromStored(double((*samples)[std::size_t(x)])), 0.5 * x - 0.75);
  }
}

// As on land, in the ocean. What is between voxels of which one has no value has none, and no others.
TEST(EvenSourceTest, ValuesThatAreNotThereStayWhereTheyAre) {
  const double none = std::nan("");
  UnevenAxes uneven;
  uneven[2] = *UnevenAxisOf("z", {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12}, ValuesAt::kPoints);
  const auto source =
      SourceOf<float>(ScalarType::kFloat32, uneven, {}, [&](const Vec3& at) { return at.x == 4 || at.z == 12 ? none : at.z; });
  const auto even = Opened(MakeEven("m", source, 27));  // half a distance each, from -0.5 to 13
  const VolumeGeometry& geometry = even->info().finest().geometry;
  const Result<std::vector<float>> samples = SamplesOf<float>(*even);
  ASSERT_TRUE(samples.ok());
  for (std::size_t i = 0; i < samples->size(); ++i) {
    const auto x = std::int32_t(i) % kSize.x, z = std::int32_t(i) / (kSize.x * kSize.y);
    EXPECT_EQ(std::isnan((*samples)[i]), x == 4 || geometry.ToWorld({0, 0, double(z)}).z > 10) << x << ' ' << z;
  }
}

TEST(UnevenAxisTest, RisesOrFalls) {
  EXPECT_EQ(UnevenAxisOf("z", {9, 5, 4}, ValuesAt::kPoints)->Reversed().centres, (std::vector<double>{4, 5, 9}));
  EXPECT_EQ(UnevenAxisOf("z", {9, 5, 4}, ValuesAt::kPoints)->Reversed().begin, 3.5);
  EXPECT_EQ(UnevenAxisOf("z", {9, 5, 4}, ValuesAt::kCells)->end, 4);
  const auto why_not = [](const std::vector<double>& coordinates, ValuesAt at = ValuesAt::kPoints) {
    return UnevenAxisOf("f: z", coordinates, at).status().message();
  };
  EXPECT_EQ(why_not({0, 2, 2, 3}), "f: z: number 2 is 2, must be finite and above number 1, which is 2");
  EXPECT_EQ(why_not({3, 2, 2.5, 0}), "f: z: number 2 is 2.5, must be finite and below number 1, which is 2");
  EXPECT_EQ(why_not({0, 1, INFINITY}), "f: z: number 2 is inf, must be finite and above number 1, which is 1");
  EXPECT_THAT(why_not({NAN, 1, 2}), HasSubstr("must be finite"));
  EXPECT_EQ(why_not({0, 1}, ValuesAt::kCells), "f: z: has 2 numbers, must have at least 3");
}

}  // namespace
}  // namespace slabstream
