// Plotfiles of AMReX, as it writes them: where cells lie, what is interpolated, and what is wrong with a file.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <string>
#include <vector>

#include "data/open/open_source.h"
#include "tests/data/mosaic/amrex_files.h"
#include "tests/data/sources/opened_source.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

constexpr Index3 kDomain = {-8, 0, 4};  // the domain's first cell at the coarsest level
constexpr Index3 kCoarse = {16, 8, 8};
const Vec3 kCorner = {1, 2, 3};

// The values are those of their place in the world.
double FieldAt(const Vec3& place) { return place.x - 3 * place.y + 0.25 * place.z; }

// Two levels, of which the finer one has two boxes.
const AmrexSpec kTwoLevels = {
    .first = kDomain,
    .size = kCoarse,
    .corner = kCorner,
    .spacing = 0.25,
    .levels = {{1, {{{0, 0, 0}, {16, 8, 4}}, {{0, 0, 4}, {16, 8, 8}}}}, {2, {{{4, 4, 4}, {12, 8, 12}}, {{12, 4, 8}, {20, 8, 12}}}}}};

class AmrexTest : public testing::Test {
 protected:
  void Write(const AmrexSpec& spec = kTwoLevels) const { WritePlotfile(directory_ / "plt", spec, FieldAt); }
  Result<std::shared_ptr<VolumeSource>> Open(const std::string& array = "v") const {
    return OpenSource(directory_ / "plt", {.array = array}, context_);
  }

  const TemporaryDirectory directory_;
  const SourceContext context_ = TestReadContext();
};

TEST_F(AmrexTest, ALinearFieldIsThatOfItsPlaceAtEachLevel) {
  std::vector<AmrexSpec> specs(3, kTwoLevels);
  specs[1].big_endian = specs[1].apart = true;
  specs[2].type = SampleType::kFloat32;
  specs[2].ghosts = 2;
  for (const AmrexSpec& spec : specs) {
    Write(spec);
    for (const std::string array : {"v", "w"}) {
      const std::shared_ptr<VolumeSource> source = Opened(Open(array));
      ASSERT_EQ(source->info().levels.size(), 2U);
      ASSERT_EQ(source->info().levels[0].refined->size(), 2U);
      EXPECT_EQ(source->info().levels[0].block, Uniform(4)) << "all boxes begin and end at multiples of it";
      for (const int level : {0, 1}) {
        const VolumeGeometry& geometry = source->info().levels[std::size_t(level)].description.geometry;
        EXPECT_EQ(geometry.size, Uniform(2 - level) * kCoarse);
        EXPECT_EQ(geometry.ToWorld({-0.5, -0.5, -0.5}), kCorner);
        const Box inner = {Uniform(1), geometry.size - Uniform(1)};  // beyond the coarse cells' centres values are constant
        const AlignedVector<std::byte> bytes = ReadBox(*source, level, inner);
        const auto* const values = reinterpret_cast<const float*>(bytes.data());
        for (std::size_t i = 0; i < std::size_t(inner.voxel_count()); ++i) {
          const Index3 size = inner.size(), v = inner.begin + Index3{int(i) % size.x, int(i) / size.x % size.y, int(i) / size.x / size.y};
          ASSERT_NEAR(values[i], (array == "v" ? 1 : -1) * FieldAt(geometry.ToWorld(ToVec3(v))), 1e-5);
        }
      }
    }
  }
}

Box RandomBoxIn(const Box& whole, Random& random) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.begin[axis] = random.Integer(whole.begin[axis], whole.end[axis] - 1);
    box.end[axis] = random.Integer(box.begin[axis] + 1, whole.end[axis]);
  }
  return box;
}

// Disjoint boxes in those of the coarser level, each perhaps as large as one.
std::vector<Box> RandomBoxes(const std::vector<Box>& coarser, int ratio, Random& random) {
  std::vector<Box> boxes;
  for (int attempt = random.Integer(1, 12); attempt > 0; --attempt) {
    const Box& parent = coarser[random.Integer<std::size_t>(0, coarser.size() - 1)];
    Box box = RandomBoxIn(parent, random);
    box = {Uniform(ratio) * box.begin, Uniform(ratio) * box.end};
    if (std::ranges::all_of(boxes, [&](const Box& other) { return Intersection(box, other).empty(); })) boxes.push_back(box);
  }
  return boxes;
}

// The domain, cut at random.
std::vector<Box> RandomTiles(const Index3& size, Random& random) {
  std::vector<Box> tiles = {{{0, 0, 0}, size}};
  for (int cuts = random.Integer(0, 6); cuts > 0; --cuts) {
    Box& tile = tiles[random.Integer<std::size_t>(0, tiles.size() - 1)];
    const int axis = random.Integer(0, 2);
    if (tile.size()[axis] < 2) continue;
    Box upper = tile;
    upper.begin[axis] = tile.end[axis] = random.Integer(tile.begin[axis] + 1, tile.end[axis] - 1);
    tiles.push_back(upper);
  }
  return tiles;
}

TEST_F(AmrexTest, ALinearFieldIsExactWhateverIsRefined) {
  Random random(2017);
  SCOPED_TRACE(random.trace());
  const auto real = [&] { return random.Real(-3, 3); };
  for (int round = 0; round < 60; ++round) {
    SCOPED_TRACE(round);
    AmrexSpec spec = {.first = {random.Integer(-20, 20), random.Integer(-20, 20), random.Integer(-20, 20)},
                      .size = {random.Integer(3, 12), random.Integer(3, 12), random.Integer(3, 12)},
                      .corner = {real(), real(), real()},
                      .spacing = random.Real(0.1, 2),
                      .ghosts = random.Integer(0, 1)};
    spec.levels.push_back({1, RandomTiles(spec.size, random)});
    for (int level = random.Integer(1, 3), factor = 1; level > 0; --level) {
      const int ratio = random.Chance(0.3) && factor < 4 ? 4 : 2;
      factor *= ratio;
      spec.levels.push_back({factor, RandomBoxes(spec.levels.back().boxes, ratio, random)});
    }
    const Vec3 slope = {real(), real(), real()};
    const double offset = real();
    const auto field = [&](const Vec3& place) { return offset + Dot(slope, place); };
    WritePlotfile(directory_ / "plt", spec, field);
    const std::shared_ptr<VolumeSource> source = Opened(Open());
    ASSERT_EQ(source->info().levels.size(), spec.levels.size());
    for (std::size_t level = 0; level < spec.levels.size(); ++level) {
      const VolumeGeometry& geometry = source->info().levels[level].description.geometry;
      const int factor = spec.levels[spec.levels.size() - 1 - level].factor;
      ASSERT_EQ(geometry.size, Uniform(factor) * spec.size);
      // Beyond the centres of cells values are constant, at each level that is interpolated.
      const Box inner = {Uniform(factor), geometry.size - Uniform(factor)};
      for (const Box& wanted : {inner, RandomBoxIn(inner, random)}) {
        const AlignedVector<std::byte> bytes = ReadBox(*source, int(level), wanted);
        const auto* value = reinterpret_cast<const float*>(bytes.data());
        for (std::int32_t z = wanted.begin.z; z < wanted.end.z; ++z) {
          for (std::int32_t y = wanted.begin.y; y < wanted.end.y; ++y) {
            for (std::int32_t x = wanted.begin.x; x < wanted.end.x; ++x) {
              ASSERT_NEAR(*value++, field(geometry.ToWorld(ToVec3({x, y, z}))), 1e-4)
                  << "level " << level << " at " << x << ", " << y << ", " << z;
            }
          }
        }
      }
    }
  }
}

TEST_F(AmrexTest, WhatIsWrongIsSaidInOneLine) {
  Write();
  EXPECT_THAT(Open("").status().message(), HasSubstr("v, w"));
  EXPECT_THAT(Open("u").status().message(), HasSubstr("v, w"));
  const auto with = [&](const std::string& file, const std::string& from, const std::string& to) {
    Write();
    std::string text = ReadFile(directory_ / ("plt/" + file));
    WriteFile(directory_ / ("plt/" + file), text.replace(text.find(from), from.size(), to));
    Result<std::shared_ptr<VolumeSource>> source = Open();
    if (!source.ok()) return source.status().message();
    std::vector<float> room(CountIn(Uniform(2) * kCoarse));
    return (*source)->ReadNow(0, {{0, 0, 0}, Uniform(2) * kCoarse}, std::as_writable_bytes(std::span(room))).message();
  };
  EXPECT_THAT(with("Header", "\n3\n", "\n2\n"), HasSubstr("Header: has 2 axes, must have 3"));
  EXPECT_THAT(with("Header", "\n0.5\n1\n", "\n0.5\n99\n"), HasSubstr("has 100 levels, must have 1 to 16"));
  EXPECT_THAT(with("Header", "Level_1/Cell", "Level_7/Cell"), HasSubstr("Level_7/Cell_H"));
  EXPECT_THAT(with("Level_1/Cell_H", "(2 0", "(0 0"), HasSubstr("has 0 boxes, must have 1 to 262144"));
  EXPECT_THAT(with("Level_1/Cell_H", "((-12,", "((-99,"), HasSubstr("box 0 is none, or not in the domain"));
  EXPECT_THAT(with("Level_1/Cell_H", "(0,0,0))", "(1,0,0))"), HasSubstr("box 0 has values of nodes or faces"));
  EXPECT_THAT(with("Level_1/Cell_H", "FabOnDisk: Cell_D_00000 0", "FabOnDisk: Cell_D_00000 1"), HasSubstr("begins no box: FAB is missing"));
  EXPECT_THAT(with("Level_1/Cell_D_00000", "(64 11", "(64 12"), testing::IsEmpty()) << "the parts of a number are not looked at";
  EXPECT_THAT(with("Level_1/Cell_D_00000", ")) 2\n", ")) 0\n"), HasSubstr("are 0 variables"));
  EXPECT_THAT(with("Level_1/Cell_D_00000", "((-12,", "((-11,"), HasSubstr("lies another box than Cell_H says"));
  EXPECT_THAT(with("Level_1/Cell_D_00000", "FAB ((8, (64 11 52 0 1 12 0 1023)),(8, (8 7 6 5 4 3 2 1))",
                   "FAB ((8, (64 11 52 0 1 12 0 1023)),(4, (4 3 2 1))"),
              HasSubstr("values are of float32, must be of float64"));
  EXPECT_THAT(with("Level_0/Cell_H", "((-8,0,4) (7,7,7)", "((-8,0,4) (7,6,7)"), HasSubstr("plt: its parts hold 960 of the 1024 voxels"));
  ASSERT_EQ(::mkfifo((directory_ / "plt/Level_1/pipe").c_str(), 0600), 0);
  EXPECT_THAT(with("Level_1/Cell_H", "FabOnDisk: Cell_D_00000", "FabOnDisk: pipe"), HasSubstr("pipe: not a file that can be read"));
  ASSERT_EQ(::mkfifo((directory_ / "plt/Level_1/pipe_H").c_str(), 0600), 0);
  EXPECT_THAT(with("Header", "Level_1/Cell", "Level_1/pipe"), HasSubstr("pipe_H: not a file that can be read"));
  Write();
  const std::string data = ReadFile(directory_ / "plt/Level_1/Cell_D_00000");
  EXPECT_THAT(with("Level_1/Cell_D_00000", data.substr(data.size() - 1500), ""), HasSubstr("truncated"));
}

// Each mutation ends in a picture or an error, and takes no memory that the files do not have.
TEST_F(AmrexTest, AlteredFilesEndInAnError) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 400; ++round) {
    Write();
    const std::string file = directory_ / ("plt/" + std::vector<std::string>{"Header", "Level_0/Cell_H", "Level_1/Cell_H",
                                                                             "Level_1/Cell_D_00000"}[std::size_t(round % 4)]);
    std::string text = ReadFile(file);
    for (int i = 0; i < 3; ++i) {
      const auto at = std::size_t(random.Integer(0, int(std::min<std::size_t>(text.size(), 200)) - 1));
      text[at] = "0123456789-( )\n,9"[std::size_t(random.Integer(0, 15))];
    }
    WriteFile(file, text);
    const Result<std::shared_ptr<VolumeSource>> source = Open();
    if (!source.ok()) continue;
    const Index3 size = (*source)->info().finest().geometry.size;
    const Box box = {{0, 0, 0}, Min(size, Uniform(32))};
    std::vector<float> room(std::size_t(box.voxel_count()));
    (void)(*source)->ReadNow(0, box, std::as_writable_bytes(std::span(room)));
  }
}

}  // namespace
}  // namespace slabstream
