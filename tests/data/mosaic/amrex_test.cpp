// Plotfiles of AMReX, as it writes them: where cells lie, what is interpolated, and what is wrong with a file.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <string>
#include <vector>

#include "data/open/open_source.h"
#include "tests/data/sources/opened_source.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

constexpr Index3 kDomain = {-8, 0, 4};  // the domain's first cell at the coarsest level
constexpr Index3 kCoarse = {16, 8, 8};
const Vec3 kCorner = {1, 2, 3};

struct Kind {
  SampleType type = SampleType::kFloat64;
  bool big_endian = false;
  int ghosts = 0;
  bool apart = false;  // each box lies in a file of its own, the last one in the first file
};

// The values are those of their place in the world.
double FieldAt(const Vec3& place) { return place.x - 3 * place.y + 0.25 * place.z; }

class AmrexTest : public testing::Test {
 protected:
  // Two levels, of which the finer one has two boxes. The variable "v" is that of FieldAt, "w" its negative.
  void Write(const Kind& kind = {}) const {
    const std::string real = kind.type == SampleType::kFloat64 ? "8, (64 11 52 0 1 12 0 1023)" : "8, (32 8 23 0 1 9 0 127)";
    const auto bytes = int(BytesPerSample(kind.type));
    std::string order;
    for (int i = 0; i < bytes; ++i) order += fmt::format("{}{}", i == 0 ? "" : " ", kind.big_endian ? i + 1 : bytes - i);
    std::string header = "HyperCLaw-V1.1\n2\nv\nw\n3\n0.5\n1\n1 2 3 \n5 4 5 \n2 \n", sides, grids;
    for (const int factor : {1, 2}) {
      const Index3 first = Uniform(factor) * kDomain, size = Uniform(factor) * kCoarse;
      header += fmt::format("{} ", TextOf({first, first + size}));
      sides += fmt::format("{0} {0} {0} \n", 0.25 / factor);
      const std::vector<Box> boxes = factor == 1 ? std::vector<Box>{{{0, 0, 0}, {16, 8, 4}}, {{0, 0, 4}, {16, 8, 8}}}
                                                 : std::vector<Box>{{{4, 4, 4}, {12, 8, 12}}, {{12, 4, 8}, {20, 8, 12}}};
      grids += fmt::format("{} {} 0.5\n7\n", factor - 1, boxes.size());
      std::string of_level = fmt::format("1\n1\n2\n{}\n({} 0\n", kind.ghosts, boxes.size()), places;
      std::vector<std::string> files(boxes.size());
      for (const Box& box : boxes) {
        grids += "0 1\n0 1\n0 1\n";  // corners, which the boxes tell
        of_level += TextOf({box.begin + first, box.end + first}) + "\n";
        const std::size_t file = kind.apart ? std::size_t(&boxes.back() - &box) : 0;
        std::string& data = files[file];
        places += fmt::format("FabOnDisk: Cell_D_0000{} {}\n", file, data.size());
        const Box stored = {box.begin - Uniform(kind.ghosts), box.end + Uniform(kind.ghosts)};
        data += fmt::format("FAB (({}),({}, ({}))){} 2\n", real, bytes, order, TextOf({stored.begin + first, stored.end + first}));
        std::vector<double> values;
        for (const double sign : {1.0, -1.0}) {
          for (std::int32_t z = stored.begin.z; z < stored.end.z; ++z) {
            for (std::int32_t y = stored.begin.y; y < stored.end.y; ++y) {
              for (std::int32_t x = stored.begin.x; x < stored.end.x; ++x) {
                values.push_back(sign * FieldAt(kCorner + (0.25 / factor) * Vec3{x + 0.5, y + 0.5, z + 0.5}));
              }
            }
          }
        }
        data += EncodeSamples(kind.type, values, kind.big_endian);
      }
      const std::string folder = fmt::format("plt/Level_{}/", factor - 1);
      WriteFile(directory_ / (folder + "Cell_H"), of_level + fmt::format(")\n{}\n", boxes.size()) + places + "\n2,2\n0,0,\n0,0,\n");
      for (std::size_t file = 0; file < files.size(); ++file)
        WriteFile(directory_ / fmt::format("{}Cell_D_0000{}", folder, file), files[file]);
      grids += fmt::format("Level_{}/Cell\n", factor - 1);
    }
    WriteFile(directory_ / "plt/Header", header + "\n7 7 \n" + sides + "0\n0\n" + grids);
  }
  // Both ends included.
  static std::string TextOf(const Box& box) {
    const Index3 low = box.begin, high = box.end - Uniform(1);
    return fmt::format("(({},{},{}) ({},{},{}) (0,0,0))", low.x, low.y, low.z, high.x, high.y, high.z);
  }
  Result<std::shared_ptr<VolumeSource>> Open(const std::string& array = "v") const {
    return OpenSource(directory_ / "plt", {.array = array}, context_);
  }

  const TemporaryDirectory directory_;
  const SourceContext context_ = TestReadContext();
};

TEST_F(AmrexTest, ALinearFieldIsThatOfItsPlaceAtEachLevel) {
  for (const Kind& kind : {Kind{}, Kind{.big_endian = true, .apart = true}, Kind{.type = SampleType::kFloat32, .ghosts = 2}}) {
    Write(kind);
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
