#include "data/isosurface/make_isosurface.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "common/parallel/task_arena.h"
#include "tests/data/isosurface/surface.h"
#include "tests/data/sources/memory_source.h"
#include "tests/support/random_volume.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

class MakeIsosurfaceTest : public testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_.path() + "/" + name; }
  std::size_t FileCount() const {
    return std::size_t(std::ranges::distance(std::filesystem::directory_iterator(folder_.path()), std::filesystem::directory_iterator()));
  }
  SurfacePart Make(VolumeSource& source, const IsosurfaceOptions& options) const {
    const Result<MeshCounts> made = MakeIsosurface(source, options, Path("a.ply"));
    EXPECT_TRUE(made.ok()) << made.status().message();
    return made.ok() ? ReadPly(ReadFile(Path("a.ply"))) : SurfacePart();
  }

  const TemporaryDirectory folder_{"/tmp"};
};

// Says that its slices come in an order.
class StreamSource : public DescribedSource {
 public:
  StreamSource(const std::shared_ptr<VolumeSource>& source, const SliceOrder& order)
      : DescribedSource(source, With(source->info(), order)) {}

 private:
  static SourceInfo With(SourceInfo info, const SliceOrder& order) {
    info.slices = order;
    return info;
  }
};

TEST_F(MakeIsosurfaceTest, PiecesAndTheOrderOfSlicesDoNotMatter) {
  // Wide enough for two columns along x and along y, with several blocks each.
  const auto volume = std::make_shared<Volume>(MakeTestVolume(
      {4200, 70, 7}, ScalarType::kFloat32, [](const Index3& v) { return std::sin(0.11 * v.x) + std::sin(0.23 * v.y) + 0.4 * v.z; }));
  const std::shared_ptr<VolumeSource> source = MakeMemorySource(volume, {});
  SurfaceMaker maker(volume->description, 1.1, false);
  const Result<SurfacePart> whole = maker.Add(volume->block, maker.domain());
  ASSERT_TRUE(whole.ok());
  const auto expected = Sorted(*whole);
  EXPECT_EQ(Sorted(Make(*source, {.isovalue = 1.1})), expected);
  for (const SliceOrder& order : {SliceOrder{Axis::kZ, false}, SliceOrder{Axis::kZ, true}, SliceOrder{Axis::kX, false}}) {
    StreamSource stream(source, order);
    EXPECT_EQ(Sorted(Make(stream, {.isovalue = 1.1})), expected);
  }
  int calls = 0;
  const auto stop_at_once = [&](std::uint64_t, std::uint64_t) { return calls++ < 0; };
  EXPECT_EQ(MakeIsosurface(*source, {.isovalue = 1.1, .progress = stop_at_once}, Path("b.ply")).status().code(), StatusCode::kCancelled);
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(FileCount(), 1U);
}

// Whoever makes the last part joins them, whatever the order. Two columns along x, and blocks that parts cut.
TEST_F(MakeIsosurfaceTest, PartsAreTogetherTheSurface) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  const auto volume = std::make_shared<Volume>(MakeTestVolume({4200, 6, 81}, ScalarType::kUint8, [&](const Index3& v) {
    return (v.x / 90 + v.y / 7 + v.z / 15) % 3 + (random.Chance(0.002) ? 1 : 0);
  }));
  const std::shared_ptr<VolumeSource> values = MakeMemorySource(volume, {}), labels = MakeMemorySource(volume, {.labels = true});
  for (const int parts : {2, 5}) {
    for (const bool label : {false, true}) {
      IsosurfaceOptions options{.caps = random.Chance(0.5)};
      if (label) options.label = 2;
      if (!label) options.isovalue = 1.5;
      VolumeSource& source = label ? *labels : *values;
      const SurfacePart expected = Make(source, options);
      std::filesystem::remove(Path("a.ply"));
      std::vector<int> order;
      for (int part = 1; part <= parts; ++part) order.push_back(part);
      for (std::size_t i = 1; i < order.size(); ++i) std::swap(order[i], order[random.Integer<std::size_t>(0, i)]);
      for (std::size_t i = 0; i < order.size(); ++i) {
        options.share = {order[i], parts};
        const Result<MeshCounts> made = MakeIsosurface(source, options, Path("a.ply"));
        ASSERT_TRUE(made.ok()) << made.status().message();
        std::vector<int> missing(order.begin() + std::ptrdiff_t(i) + 1, order.end());
        std::ranges::sort(missing);
        EXPECT_EQ(made->missing_parts, missing);
        EXPECT_EQ(made->whole, missing.empty());
      }
      const SurfacePart joined = ReadPly(ReadFile(Path("a.ply")));
      EXPECT_EQ(Sorted(joined), Sorted(expected));
      EXPECT_EQ(joined.vertices.size(), expected.vertices.size());
      EXPECT_EQ(FileCount(), 1U);
    }
  }
}

TEST_F(MakeIsosurfaceTest, PartsOfAnotherSurfaceOrCutOffAreMissing) {
  const std::shared_ptr<VolumeSource> source =
      MakeMemorySource(std::make_shared<Volume>(MakeTestVolume({9, 9, 64}, ScalarType::kUint8, [](const Index3& v) { return v.x; })), {});
  const auto make = [&](int part, double isovalue) {
    return MakeIsosurface(*source, {.isovalue = isovalue, .share = {part, 3}}, Path("a.ply")).value().missing_parts;
  };
  EXPECT_EQ(make(1, 3.5), std::vector<int>({2, 3}));
  EXPECT_EQ(make(2, 4.5), std::vector<int>({1, 3}));
  EXPECT_EQ(make(3, 3.5), std::vector<int>({2}));
  std::filesystem::resize_file(Path("a.ply.part1of3"), std::filesystem::file_size(Path("a.ply.part1of3")) - 1);
  EXPECT_EQ(make(2, 3.5), std::vector<int>({1}));
  std::ofstream(Path("a.ply.joining")) << "left by a command that was killed";
  EXPECT_EQ(make(1, 3.5), std::vector<int>());
  EXPECT_EQ(FileCount(), 1U);
  const IsosurfaceOptions too_many{.isovalue = 3.5, .share = {1, 5}};
  EXPECT_THAT(MakeIsosurface(*source, too_many, Path("b.ply")).status().message(), HasSubstr("--part 1/5: the level has 64 slices"));
  for (const int part : {1, 2}) {
    const Result<MeshCounts> none = MakeIsosurface(*source, {.isovalue = 99, .share = {part, 2}}, Path("b.ply"));
    EXPECT_EQ(none.ok(), part == 1) << "the parts together have no surface";
    EXPECT_THAT(none.status().message(), HasSubstr(part == 1 ? "" : "no surface; values are 0 to 8"));
  }
  EXPECT_EQ(FileCount(), 1U);
}

// A part whose triangles name vertices that are not there.
TEST_F(MakeIsosurfaceTest, ADamagedPartIsNamed) {
  const std::shared_ptr<VolumeSource> source =
      MakeMemorySource(std::make_shared<Volume>(MakeTestVolume({9, 9, 64}, ScalarType::kUint8, [](const Index3& v) { return v.x; })), {});
  const auto make = [&](int part) { return MakeIsosurface(*source, {.isovalue = 3.5, .share = {part, 2}}, Path("a.ply")); };
  ASSERT_TRUE(make(2).ok());
  std::string bytes = ReadFile(Path("a.ply.part2of2"));
  const std::string whole = bytes;
  for (const std::uint8_t high : {0x7f, 0xbf}) {
    bytes[bytes.size() - 1] = char(high);  // of the last number of the last triangle: the last part has no last slice
    std::ofstream(Path("a.ply.part2of2"), std::ios::binary) << bytes;
    EXPECT_EQ(make(1).status().message(), fmt::format("'{}' is damaged: remove it and make this part again", Path("a.ply.part2of2")));
  }
  std::ofstream(Path("a.ply.part2of2"), std::ios::binary) << whole;
  EXPECT_TRUE(make(1).value().whole);
}

TEST_F(MakeIsosurfaceTest, ThreadsDoNotChangeAByte) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  const std::shared_ptr<VolumeSource> source =
      MakeMemorySource(std::make_shared<Volume>(RandomVolume(random, {70, 40, 33}, ScalarType::kUint16)), {});
  std::string first;
  for (const int threads : {1, 2, 5}) {
    TaskArena arena(threads);
    arena.Run([&] { Make(*source, {.isovalue = 30000, .caps = true}); });
    const std::string bytes = ReadFile(Path("a.ply"));
    if (first.empty()) first = bytes;
    EXPECT_EQ(bytes, first);
  }
}

TEST_F(MakeIsosurfaceTest, ALabelHasASmoothSurface) {
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint64}) {
    const std::uint64_t label = type == ScalarType::kUint64 ? (std::uint64_t{1} << 60) + 1 : 7;
    constexpr double kRadius = 12;
    const Vec3 centre = {20, 20.3, 20.1};
    const auto volume = std::make_shared<Volume>(MakeTestVolume(
        {42, 41, 40}, type, [&](const Index3& v) -> std::uint64_t { return Length(ToVec3(v) - centre) < kRadius ? label : label - 1; }));
    const std::shared_ptr<VolumeSource> source = MakeMemorySource(volume, {.labels = true});
    const SurfacePart ball = Make(*source, {.label = label});
    EXPECT_EQ(CountEdges(ball).open, 0);
    EXPECT_EQ(EulerCharacteristic(ball), 2);
    EXPECT_NEAR(Measure(ball).volume, 4.0 / 3 * std::numbers::pi * kRadius * kRadius * kRadius, 150);
    EXPECT_NEAR(Measure(ball).area, 4 * std::numbers::pi * kRadius * kRadius, 90);  // the faces of voxels have half as much more
    // The other label lies around it, and reaches the border.
    EXPECT_GT(CountEdges(Make(*source, {.label = label - 1, .caps = true})).edges, CountEdges(ball).edges);
    const Result<MeshCounts> none = MakeIsosurface(*source, {.label = 5}, Path("b.ply"));
    EXPECT_EQ(none.status().message(), "--label 5: no surface; no voxel has it, or it is too thin");
  }
}

TEST_F(MakeIsosurfaceTest, NothingIsLeftBehindWithoutASurface) {
  auto volume = MakeTestVolume({20, 20, 20}, ScalarType::kUint8, [](const Index3& v) { return v.x + 3; });
  volume.description.mapping = {2, -10};
  const std::shared_ptr<VolumeSource> source = MakeMemorySource(std::make_shared<Volume>(volume), {});
  const Result<MeshCounts> none = MakeIsosurface(*source, {.isovalue = 99}, Path("a.ply"));
  EXPECT_EQ(none.status(), Status::InvalidArgument("--isovalue 99: no surface; values are -4 to 34"));
  for (const int last : {0, 1}) {
    int calls = 0;
    const auto progress = [&](std::uint64_t, std::uint64_t) { return calls++ < last; };
    const Result<MeshCounts> stopped = MakeIsosurface(*source, {.isovalue = 9, .progress = progress}, Path("a.ply"));
    EXPECT_EQ(stopped.status().code(), StatusCode::kCancelled);
  }
  EXPECT_EQ(FileCount(), 0U);
}

TEST_F(MakeIsosurfaceTest, FormatsHaveTheSameSurface) {
  auto volume = MakeTestVolume({9, 9, 9}, ScalarType::kFloat32, [](const Index3& v) { return -Length(ToVec3(v) - Vec3{4, 4, 4}); });
  volume.description.geometry.orientation.world = World::kPatient;
  const std::shared_ptr<VolumeSource> source = MakeMemorySource(std::make_shared<Volume>(volume), {});
  const SurfacePart ply = Make(*source, {.isovalue = -3});
  EXPECT_THAT(ReadFile(Path("a.ply")), HasSubstr("comment world: patient, RAS: x to the right, y to anterior, z to superior; unit: mm\n"));

  ASSERT_TRUE(MakeIsosurface(*source, {.isovalue = -3}, Path("a.stl")).ok());
  const std::string stl = ReadFile(Path("a.stl"));
  ASSERT_EQ(stl.size(), 84 + 50 * ply.triangles.size());
  std::uint32_t count = 0;
  std::memcpy(&count, &stl[80], 4);
  EXPECT_EQ(count, ply.triangles.size());
  for (std::size_t i = 0; i < ply.triangles.size(); ++i) {
    std::array<std::array<float, 3>, 4> read;  // the normal, and the corners
    std::memcpy(read.data(), &stl[84 + 50 * i], sizeof read);
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const SurfaceVertex& vertex = ply.vertices[std::size_t(ply.triangles[i].at(corner))];
      EXPECT_EQ(read.at(corner + 1), vertex.position);
      EXPECT_GT(Dot(Point(read[0]), Point(vertex.normal)), 0.5);
    }
  }
}

}  // namespace
}  // namespace slabstream
